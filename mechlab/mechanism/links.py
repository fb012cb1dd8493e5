"""Links with their mass and their looks: the straight bar, and the plate through any number of pins."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.geometry import Array, Placement, cross, frame_along
from mechlab.mechanism.given import Number, point, si
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.parts import Color, Joint, Shape, X, Z, shape
from mechlab.mechanism.plate import plate_area, plate_inertia

PIN: Color = (0.28, 0.31, 0.36, 1.0)
BLUE: Color = (0.25, 0.45, 0.75, 1.0)
MOST_PINS = 12
"""Most pins of a plate, that of its joint included."""
DENSITY = 2700.0
"""Density of a plate [kg/m3] for which neither mass nor density is given: aluminium."""


def uniform_bar(
    name: str, joint: Joint, length: float, mass: float | None, width: float | None, color: Color, layer: float
) -> tuple[Inertia, tuple[Shape, ...]]:
    """Inertia and shapes of the bar along its local x, from its joint to `length` [m]; see `Builder.bar`."""
    w = 0.08 * length if width is None else width
    m = length if mass is None else mass
    axis = np.array(joint.axis) if joint.kind == "revolute" and abs(joint.axis[0]) < 0.5 else np.array(Z)
    facing = np.column_stack([np.array(X), cross(axis, X), axis])
    place = Placement.of(facing, layer * axis)
    looks = shape("link", place, color, name, length=length, width=w, thickness=0.4 * w, bore=0.18 * w)
    ends = (layer * axis, layer * axis + np.array([length, 0.0, 0.0]))
    rod = Inertia.rod(m, (0.0, 0.0, 0.0), (length, 0.0, 0.0), w / 4)
    return rod, (looks, *_pins(facing, ends, w))


def _pins(facing: Array, ends: Sequence[Array], width: float) -> list[Shape]:
    return [
        shape("cylinder", Placement.of(facing, p), PIN, f"pin_{k}", radius=0.18 * width, length=0.9 * width)
        for k, p in enumerate(ends)
    ]


def plate(
    name: str,
    joint: Joint,
    points: Sequence[Sequence[Number]],
    mass: float | None,
    density: float | None,
    width: float | None,
    thickness: float | None,
    color: Color,
    layer: float,
) -> tuple[Inertia, tuple[Shape, ...]]:
    """Inertia and shapes of the plate through the origin and `points` of the body; see `Builder.plate`."""
    what = f"plate {name!r}"
    axis = np.array(joint.axis) if joint.kind == "revolute" else np.array(Z)
    facing = np.eye(3) if tuple(axis) == Z else frame_along(axis)
    places = _in_plane(points, facing, what)
    span = max(float(np.linalg.norm(a - b)) for a, b in combinations(places, 2))
    w = 0.12 * span if width is None else width
    t = 0.4 * w if thickness is None else thickness
    bore = 0.18 * w
    for a, b in combinations(range(len(places)), 2):
        if np.linalg.norm(places[a] - places[b]) <= 2.0 * bore:
            raise MechlabError(
                f"{what}: its points {a} and {b} are closer than the bores at them ({2.0 * bore:.3g} m wide); point 0 is "
                "the joint at the origin. Give each point once, or a smaller width."
            )
    volume = plate_area(places, 0.5 * w).area * t
    m = volume * (DENSITY if density is None else density) if mass is None else mass
    solid = plate_inertia(places, 0.5 * w, t, m).at((0.0, 0.0, 0.0), facing)
    sizes = {f"{c}_{k}": float(v) for k, p in enumerate(places, 1) for c, v in zip("xy", p, strict=True)}
    looks = shape(
        "plate_link", Placement.of(facing, layer * axis), color, name,
        points=len(places), width=w, thickness=t, bore=bore, **sizes,
    )  # fmt: skip
    ends = [facing @ np.array([*p, 0.0]) + layer * axis for p in places]
    return solid, (looks, *_pins(facing, ends, w))


def _in_plane(points: Sequence[Sequence[Number]], facing: Array, what: str) -> Array:
    """(n, 2) places of the pins in the plane of a plate, that of the joint at the origin first."""
    if isinstance(points, str) or not isinstance(points, Sequence | np.ndarray) or not 1 <= len(points) < MOST_PINS:
        raise MechlabError(
            f"{what}: expected 1 to {MOST_PINS - 1} points (x, y) or (x, y, z) besides the joint at the origin, got {points!r}."
        )
    found = [np.zeros(2)]
    for k, given in enumerate(points, 1):
        which = f"{what}: point {k}"
        if not isinstance(given, str) and len(given) == 2:
            found.append(np.array([si(v, which, "m") for v in given]))
            continue
        local = facing.T @ np.array(point(given, which))
        if abs(local[2]) > 1e-9 * float(np.linalg.norm(local)):
            raise MechlabError(
                f"{which} lies {local[2]:.3g} m off the plane through the joint at right angles to its axis: "
                "a plate is flat. Give (x, y) in that plane."
            )
        found.append(local[:2])
    return np.array(found)
