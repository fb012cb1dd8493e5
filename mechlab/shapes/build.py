"""Kinds of solids and how they are made: parameters with units and defaults, and a function that builds a mesh of them.

Solids are made by extruding an outline, turning a profile about z, or sweeping a section along a helix.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.shapes.polygon import circle
from mechlab.shapes.solid import Mesh, Shell


@dataclass(frozen=True)
class Times:
    """A default that is a multiple of another parameter."""

    factor: float
    of: str

    def __str__(self) -> str:
        return self.of if self.factor == 1.0 else f"{self.factor:g} {self.of}"


@dataclass(frozen=True)
class Parameter:
    """One size of a kind: `unit` is "m", "rad", "count" (a whole number), "module" or "pitch" (multiples of these).

    `default` None means that it must be given; `low` is the smallest value allowed, itself included when `closed`.
    """

    name: str
    unit: str
    text: str
    default: float | Times | None = None
    low: float = -math.inf
    closed: bool = True

    def checked(self, kind: str, value: float) -> float | int:
        """The value as int (counts) or float; raises MechlabError when it is not allowed."""
        if not math.isfinite(value):
            raise MechlabError(f"{kind}: {self.name} must be finite, got {value!r}.")
        if value < self.low or (value == self.low and not self.closed):
            unit = "" if self.unit == "count" else f" {self.unit}"
            sign = "at least" if self.closed else "greater than"
            raise MechlabError(f"{kind}: {self.name} must be {sign} {self.low:g}{unit}, got {value:g}.")
        if self.unit != "count":
            return value
        if value != round(value):
            raise MechlabError(f"{kind}: {self.name} must be a whole number, got {value:g}.")
        return round(value)


def length(name: str, text: str, default: float | Times | None = None) -> Parameter:
    """A length greater than zero."""
    return Parameter(name, "m", text, default, 0.0, closed=False)


def gap(name: str, text: str, default: float | Times | None = 0.0) -> Parameter:
    """A length that may be zero: nothing is cut or added then."""
    return Parameter(name, "m", text, default, 0.0)


def angle(name: str, text: str, default: float | None = 0.0) -> Parameter:
    """An angle [rad]."""
    return Parameter(name, "rad", text, default)


def count(name: str, text: str, default: float | None = None, low: int = 0) -> Parameter:
    """A whole number."""
    return Parameter(name, "count", text, default, low)


@dataclass(frozen=True)
class Kind:
    """A kind of solid. `solid` is True when the mesh is one body; otherwise several closed bodies overlap."""

    name: str
    text: str
    build: Callable[..., Mesh]
    parameters: tuple[Parameter, ...]
    solid: bool = True

    def sizes(self, given: Mapping[str, float]) -> dict[str, float | int]:
        """All parameters in their order: the given ones checked, the others by default.

        Raises MechlabError that names an unknown, missing or impossible parameter.
        """
        names = [p.name for p in self.parameters]
        for name in given:
            if name not in names:
                raise unknown(f"{self.name}: parameter", name, names)
        missing = [p.name for p in self.parameters if p.default is None and p.name not in given]
        if missing:
            raise MechlabError(f"{self.name}: missing {', '.join(missing)}. Parameters: {', '.join(names)}.")
        values: dict[str, float | int] = {}
        for p in sorted(self.parameters, key=lambda p: p.name not in given and isinstance(p.default, Times)):
            raw = given.get(p.name, p.default)
            raw = raw.factor * values[raw.of] if isinstance(raw, Times) else raw
            assert raw is not None  # missing parameters were refused above
            values[p.name] = p.checked(self.name, float(raw))
        return {name: values[name] for name in names}


SEGMENTS = 48  # of a large circle
SMALL = 24  # of a bore, a bolt hole, a thin rod


def require(condition: bool, message: str) -> None:
    """Raises MechlabError(message) unless the condition holds: how builders refuse sizes that make no solid."""
    if not condition:
        raise MechlabError(message)


def extrude(outer: ArrayLike, holes: Sequence[ArrayLike] = (), low: float = 0.0, high: float = 1.0) -> Mesh:
    """The prism over a counter-clockwise outline (n, 2), without its holes, from z = low to z = high [m]."""
    shell = Shell()
    bottom, top = shell.loop(outer, low), shell.loop(outer, high)
    shell.band(bottom, top)
    pairs = [(shell.loop(hole, low), shell.loop(hole, high)) for hole in holes]
    for lower, upper in pairs:
        shell.band(upper, lower)
    shell.cap(top, [upper for _, upper in pairs], up=True)
    shell.cap(bottom, [lower for lower, _ in pairs], up=False)
    return shell.mesh()


def revolve(profile: ArrayLike, segments: int = SEGMENTS) -> Mesh:
    """The solid that a profile of (radius, z) points sweeps about z; the profile runs upwards on the outside.

    A profile that starts and ends on the axis closes at poles; any other is closed from its last point to its first.
    """
    points = np.asarray(profile, dtype=float)
    shell = Shell()
    rings = [shell.loop([(0.0, 0.0)] if r == 0.0 else circle(r, segments), z) for r, z in points.tolist()]
    closed = points[0, 0] > 0.0
    for lower, upper in zip(rings, rings[1:] + rings[:1] if closed else rings[1:], strict=False):
        if len(lower) == 1:
            shell.fan(int(lower[0]), upper[::-1])
        elif len(upper) == 1:
            shell.fan(int(upper[0]), lower)
        else:
            shell.band(lower, upper)
    return shell.mesh()


def turned(radius: float, low: float, high: float, segments: int = SEGMENTS, chamfer: float = 0.0) -> Mesh:
    """A cylinder about z from `low` to `high`, its rims broken by `chamfer` [m]."""
    c = chamfer
    side = (
        [(radius, low), (radius, high)]
        if c <= 0.0
        else [(radius - c, low), (radius, low + c), (radius, high - c), (radius - c, high)]
    )
    return revolve([(0.0, low), *side, (0.0, high)], segments)


def hollow(outer: float, inner: float, low: float, high: float, segments: int = SEGMENTS) -> Mesh:
    """A tube about z from `low` to `high`."""
    require(inner < outer, f"tube: the inner radius {inner:g} m must be smaller than the outer radius {outer:g} m.")
    return revolve([(inner, low), (outer, low), (outer, high), (inner, high)], segments)


def arc(radius: float, z: float, start: float, stop: float, steps: int) -> list[tuple[float, float]]:
    """Profile points (radius cos t, z + radius sin t); a point at +-90 degrees lies exactly on the axis."""
    points = []
    for t in np.linspace(start, stop, steps + 1).tolist():
        on_axis = abs(abs(t) - 0.5 * math.pi) < 1e-12
        points.append((0.0 if on_axis else radius * math.cos(t), z + radius * math.sin(t)))
    return points


MOST_TURNS = 2000


def helix(section: ArrayLike, radius: float, low: float, pitch: float, turns: float, steps: int = 20) -> Mesh:
    """A right-handed helix of a closed section of (radial, axial) offsets, counter-clockwise, `steps` to the turn."""
    offsets = np.asarray(section, dtype=float)
    shell = Shell()
    require(turns <= MOST_TURNS, f"a helix of {turns:.3g} turns; at most {MOST_TURNS} are drawn.")
    count = max(2, round(turns * steps))
    rings: list[NDArray[np.int64]] = []
    for k in range(count + 1):
        t = 2.0 * math.pi * turns * k / count
        r, z = radius + offsets[:, 0], low + pitch * t / (2.0 * math.pi) + offsets[:, 1]
        rings.append(shell.loop(np.column_stack([r * math.cos(t), r * math.sin(t), z])))
    for here, there in zip(rings, rings[1:], strict=False):
        shell.band(there, here)
    n = len(offsets)
    fan = np.array([(0, i, i + 1) for i in range(1, n - 1)])
    shell.faces(rings[0][fan])
    shell.faces(rings[-1][fan][:, ::-1])
    return shell.mesh()
