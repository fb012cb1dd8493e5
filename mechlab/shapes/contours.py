"""Plates with a computed contour in the xy plane, axes along z: Geneva wheel and its driver, disc cam, oval wheel."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic.cams import LAWS, rise_and_fall, roller_contour
from mechlab.shapes.build import SMALL, Kind, angle, count, extrude, gap, length, require
from mechlab.shapes.polygon import circle
from mechlab.shapes.solid import Mesh, merge

ARC = 12
"""Corners of an arc."""
WALL = 1.2
"""Wall between slot and locking arc of a Geneva wheel, in radii of the pin."""


def _plate(outline: np.ndarray, thickness: float, bore: float) -> Mesh:
    return extrude(outline, [circle(bore, SMALL)] if bore else [], -0.5 * thickness, 0.5 * thickness)


def _arc(center: complex, radius: float, start: float, end: float, count: int = ARC) -> list[complex]:
    return [center + radius * complex(math.cos(t), math.sin(t)) for t in np.linspace(start, end, count + 1)]


def _points(z: list[complex]) -> np.ndarray:
    """(n, 2) points, without those that coincide with the one before."""
    size = max(map(abs, z))
    kept = [b for a, b in zip([z[-1], *z[:-1]], z, strict=True) if abs(a - b) > 1e-9 * size]
    return np.array([[p.real, p.imag] for p in kept])


def _lock(slots: int, center: float, pin: float) -> tuple[float, float, float]:
    """Radii of the crank, of the wheel and of the locking disc."""
    crank, wheel = center * math.sin(math.pi / slots), center * math.cos(math.pi / slots)
    lock = crank - (1.0 + WALL) * pin
    require(lock > pin, "geneva: the pin is too thick for the crank; make it thinner.")
    return crank, wheel, lock


def geneva_wheel(slots: int, center: float, pin: float, thickness: float, bore: float) -> Mesh:
    """A wheel with radial slots, the first towards +x, and a hollow between two slots that the locking disc of the driver fills."""
    require(slots >= 3, f"geneva_wheel: at least 3 slots, got {slots}.")
    crank, wheel, lock = _lock(slots, center, pin)
    depth = center - crank
    require(depth - pin > bore, "geneva_wheel: the slots reach the bore; make it smaller.")
    mouth = math.asin(pin / wheel)
    # the locking disc cuts the rim of the wheel at this angle from the middle between two slots
    cut = math.acos((wheel**2 + center**2 - lock**2) / (2.0 * wheel * center))
    require(mouth + cut < math.pi / slots, "geneva_wheel: no rim is left beside the slots; make the pin thinner.")
    z: list[complex] = []
    for k in range(slots):
        turn = complex(math.cos(2 * math.pi * k / slots), math.sin(2 * math.pi * k / slots))
        slot = [complex(wheel * math.cos(mouth), -pin), *_arc(complex(depth, 0.0), pin, 1.5 * math.pi, 0.5 * math.pi)]
        half = math.pi / slots
        rim = _arc(0j, wheel, mouth, half - cut, 4)
        middle = complex(math.cos(half), math.sin(half))
        width = math.asin(wheel * math.sin(cut) / lock)
        hollow = [middle * p for p in _arc(complex(center, 0.0), lock, math.pi + width, math.pi - width)]
        z += [turn * p for p in [*slot, *rim, *hollow, *(middle**2 * p.conjugate() for p in reversed(rim))]]
    return _plate(_points(z), thickness, bore)


def geneva_driver(slots: int, center: float, pin: float, thickness: float, bore: float) -> Mesh:
    """The driver of a `geneva_wheel`, its pin towards +x: an arm below the wheel, the pin, and the locking disc in the plane of the wheel,
    cut free where the wheel passes."""
    crank, wheel, lock = _lock(slots, center, pin)
    free = wheel + 0.5 * pin
    cut = math.acos((lock**2 + center**2 - free**2) / (2.0 * lock * center))
    width = math.asin(min(1.0, lock * math.sin(cut) / free))
    disc = [*_arc(0j, lock, cut, 2.0 * math.pi - cut, 4 * ARC), *_arc(complex(center, 0.0), free, math.pi + width, math.pi - width)]
    arm = [*_arc(0j, 0.6 * lock, 0.5 * math.pi, 1.5 * math.pi), *_arc(complex(crank, 0.0), 1.6 * pin, -0.5 * math.pi, 0.5 * math.pi)]
    t = 0.5 * thickness
    low = extrude(_points(arm), [circle(bore, SMALL)] if bore else [], -3.2 * t, -1.2 * t)
    near = max(p.real for p in disc if abs(p.imag) < 1e-12 * center)
    holes = [circle(bore, SMALL)] if 0.0 < 1.2 * bore < near else []
    peg = extrude(circle(0.9 * pin, SMALL, (crank, 0.0)), [], -1.6 * t, t)
    return merge([low, extrude(_points(disc), holes, -1.4 * t, t), peg])  # they overlap in the arm


def disc_cam(
    base: float, lift: float, rise: float, top: float, fall: float, law: int, roller: float, thickness: float, bore: float, points: int
) -> Mesh:
    """A disc cam for a roller that stands on +y, with the laws of `mechlab.analytic.cams`, by their number in LAWS."""
    require(law < len(LAWS), f"disc_cam: law is a number from 0 to {len(LAWS) - 1}, got {law}.")
    require(bore < base, "disc_cam: the bore must be smaller than the base circle.")
    turn = 2.0 * math.pi * np.arange(points) / points
    s, slope, _ = rise_and_fall(LAWS[law], turn, lift, rise, top, fall)
    outline = roller_contour(turn, s, slope, base, roller)[::-1]
    around = np.unwrap(np.arctan2(outline[:, 1], outline[:, 0]))
    require(bool(np.all(np.diff(around) > 0.0)), "disc_cam: it is undercut: take a larger base circle, a smaller roller or a longer rise.")
    return _plate(outline, thickness, bore)


def oval(major: float, eccentricity: float, thickness: float, bore: float, points: int) -> Mesh:
    """An elliptic plate about one focus, the far end towards +x; major: half of its long axis."""
    require(eccentricity < 1.0, f"oval: the eccentricity must be below 1, got {eccentricity:g}.")
    require(bore < major * (1.0 - eccentricity), "oval: the bore does not fit between the focus and the near end.")
    t = 2.0 * math.pi * np.arange(points) / points
    outline = np.column_stack([major * (np.cos(t) + eccentricity), major * math.sqrt(1.0 - eccentricity**2) * np.sin(t)])
    return _plate(outline, thickness, bore)


_SLOTTED = (
    count("slots", "number of slots", low=3),
    length("center", "distance of the axes of driver and wheel"),
    length("pin", "radius of the pin"),
    length("thickness", "thickness along z"),
    gap("bore", "radius of the bore"),
)
KINDS = (
    Kind("geneva_wheel", "Geneva wheel in xy, its first slot towards +x", geneva_wheel, _SLOTTED),
    Kind("geneva_driver", "driver of a Geneva wheel, its pin towards +x", geneva_driver, _SLOTTED, solid=False),
    Kind(
        "disc_cam", "disc cam in xy for a roller on +y, at the beginning of its rise", disc_cam,
        (
            length("base", "radius of the base circle"),
            gap("lift", "lift"),
            angle("rise", "turn of the rise", 2.0),
            angle("top", "turn of the dwell at the top"),
            angle("fall", "turn of the fall", 2.0),
            count("law", f"number of the law of motion: {', '.join(f'{k} {n}' for k, n in enumerate(LAWS))}", 0),
            length("roller", "radius of the roller"),
            length("thickness", "thickness along z"),
            gap("bore", "radius of the bore"),
            count("points", "corners of its contour", 180, low=12),
        ),
    ),
    Kind(
        "oval", "elliptic plate in xy about one focus, the far end towards +x", oval,
        (
            length("major", "half of the long axis"),
            gap("eccentricity", "distance of the foci over the long axis"),
            length("thickness", "thickness along z"),
            gap("bore", "radius of the bore"),
            count("points", "corners of its contour", 120, low=12),
        ),
    ),
)  # fmt: skip
