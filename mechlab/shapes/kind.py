"""What a kind of solid is: its parameters with units and defaults, and the function that builds it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from mechlab.errors import MechlabError, unknown
from mechlab.shapes.solid import Mesh


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
