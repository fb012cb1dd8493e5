"""What the closed differential looks like: toothed gears in phase, two blocks, two carriers, along the axis z."""

from __future__ import annotations

import math

from mechlab.catalog.closed_differential.parameters import Parameters
from mechlab.kit.palette import BLUE, BRASS, GREEN, RED, STEEL
from mechlab.mechanism import Placement, shape
from mechlab.mechanism.geometry import Vector, axis_rotation
from mechlab.mechanism.parts import Color, Shape
from mechlab.shapes import external_phase, internal_phase

WIDTH, GAP = 8.0, 9.0
"""Face width and clear distance of the two gear planes, in modules."""


def planet_name(stage: int) -> str:
    """Planets of stage 1 are wheels 2, of stage 2 wheels 5."""
    return "planet_2" if stage == 1 else "planet_5"


def _teeth(p: Parameters, stage: int) -> tuple[int, int, int]:
    z1, z2, z3, z4, z5, z6 = p.teeth
    return (z1, z2, z3) if stage == 1 else (z4, z5, z6)


def _plane(p: Parameters, stage: int) -> float:
    return 0.0 if stage == 1 else (WIDTH + GAP) * p.module


def azimuth(p: Parameters, stage: int, k: int) -> float:
    """Direction of planet k on its carrier: the possible one nearest to equal spacing, so that teeth always fit."""
    sun, _, ring = _teeth(p, stage)
    return 2.0 * math.pi * round(k * (sun + ring) / p.planets) / (sun + ring)


def planet_axis(p: Parameters, stage: int, k: int) -> Vector:
    """Centre of planet k in the frame of its carrier [m]."""
    radius, turn = p.radii[stage - 1], azimuth(p, stage, k)
    return radius * math.cos(turn), radius * math.sin(turn), _plane(p, stage)


def _phase(p: Parameters, stage: int, k: int) -> float:
    sun, planet_teeth, _ = _teeth(p, stage)
    return external_phase(sun, 0.0, planet_teeth, azimuth(p, stage, k))


def _bore(p: Parameters, teeth: int, wanted: float) -> float:
    """A bore that leaves the teeth a body."""
    return min(wanted, 0.3 * p.module * teeth)


def _shaft_radius(p: Parameters) -> float:
    return 0.2 * p.module * min(p.teeth[0], p.teeth[3])


def planet(p: Parameters, stage: int, k: int) -> tuple[Shape, ...]:
    """A planet in the frame of its own axis."""
    z = _teeth(p, stage)[1]
    return (
        shape("spur_gear", color=STEEL, name=planet_name(stage), teeth=z, module=p.module, width=WIDTH * p.module,
              bore=_bore(p, z, 0.09 * p.module * z), phase=_phase(p, stage, k), holes=5 if z >= 30 else 0),
    )  # fmt: skip


def block_14(p: Parameters) -> tuple[Shape, ...]:
    """Suns 1 and 4 on one shaft, which stands out beyond both."""
    m, bore = p.module, _shaft_radius(p)
    suns = [
        shape("spur_gear", Placement((0.0, 0.0, _plane(p, s))), BRASS, name, teeth=_teeth(p, s)[0], module=m,
              width=WIDTH * m, bore=bore, phase=0.0, holes=6 if _teeth(p, s)[0] >= 40 else 0)
        for s, name in ((1, "sun_1"), (2, "sun_4"))
    ]  # fmt: skip
    middle = Placement((0.0, 0.0, 0.5 * _plane(p, 2)))
    return (*suns, shape("cylinder", middle, BRASS, "shaft", radius=bore, length=_plane(p, 2) + 18.0 * m))


def _ring_phase(p: Parameters, stage: int) -> float:
    _, z, ring = _teeth(p, stage)
    return internal_phase(z, _phase(p, stage, 0), ring, 0.0)


def block_36(p: Parameters) -> tuple[Shape, ...]:
    """Rings 3 and 6 joined by a drum between the gear planes, and a flange where the rings differ in size."""
    m = p.module
    rings, sizes = [], []
    for s, name in ((1, "ring_3"), (2, "ring_6")):
        z = _teeth(p, s)[2]
        sizes.append((0.5 * m * z + 1.25 * m, 0.5 * m * z + 4.25 * m))
        place = Placement((0.0, 0.0, _plane(p, s)))
        rings.append(
            shape("internal_gear", place, BLUE, name, teeth=z, module=m, width=WIDTH * m, phase=_ring_phase(p, s))
        )
    low, high = 0.5 * WIDTH * m, _plane(p, 2) - 0.5 * WIDTH * m
    inner, outer = min(s[0] for s in sizes), max(s[1] for s in sizes)
    wide = max(s[0] for s in sizes)
    flange = shape(
        "tube", Placement((0.0, 0.0, 0.5 * (low + high))), BLUE, "flange", outer=outer, inner=inner, length=1.5 * m
    )
    drums = [
        shape(
            "tube",
            Placement((0.0, 0.0, z)),
            BLUE,
            f"drum_{s + 1}",
            outer=sizes[s][1],
            inner=sizes[s][0],
            length=high - low,
        )
        for s, z in ((0, 0.5 * (low + high)), (1, 0.5 * (low + high)))
    ]
    return (*rings, *(drums[:1] if inner == wide else (*_halves(drums, low, high), flange)))


def _halves(drums: list[Shape], low: float, high: float) -> tuple[Shape, ...]:
    """Each drum from its own ring to the flange in the middle."""
    out = []
    for k, drum in enumerate(drums):
        sizes = dict(drum.size) | {"length": 0.5 * (high - low)}
        z = low + (0.25 + 0.5 * k) * (high - low)
        out.append(shape("tube", Placement((0.0, 0.0, z)), BLUE, drum.name, **sizes))
    return tuple(out)


def carrier(p: Parameters, stage: int) -> tuple[Shape, ...]:
    """A carrier on the outer side of its gear plane: hub, arms, pins through the planets, and a shaft."""
    m, (radius, side) = p.module, (p.radii[stage - 1], -1.0 if stage == 1 else 1.0)
    z = _plane(p, stage) + side * (0.5 * WIDTH + 3.5) * m
    color: Color = RED if stage == 1 else GREEN
    name, bore = f"H{stage}", 1.15 * _shaft_radius(p)
    pin = _bore(p, _teeth(p, stage)[1], 0.09 * m * _teeth(p, stage)[1])
    out = [
        shape(
            "disc",
            Placement((0.0, 0.0, z)),
            color,
            f"{name}_hub",
            radius=max(0.28 * radius, 1.6 * bore),
            thickness=4 * m,
            bore=bore,
        ),
        shape(
            "tube",
            Placement((0.0, 0.0, z + side * 6 * m)),
            color,
            f"{name}_shaft",
            outer=1.5 * bore,
            inner=bore,
            length=10 * m,
        ),
    ]
    for k in range(p.planets):
        turn = azimuth(p, stage, k)
        start = max(0.2 * radius, 1.35 * bore)
        place = Placement.of(axis_rotation((0, 0, 1.0), turn), (start * math.cos(turn), start * math.sin(turn), z))
        width = max(2.8 * pin, 0.14 * radius)
        out.append(
            shape(
                "link",
                place,
                color,
                f"{name}_arm_{k + 1}",
                length=radius - start,
                width=width,
                thickness=4 * m,
                bore=0.3 * pin,
            )
        )
        x, y, plane = planet_axis(p, stage, k)
        middle = 0.5 * (z + plane - side * (0.5 * WIDTH + 0.5) * m)
        length = abs(z - plane) + (0.5 * WIDTH + 2.5) * m
        out.append(
            shape("cylinder", Placement((x, y, middle)), color, f"{name}_pin_{k + 1}", radius=pin, length=length)
        )
    return tuple(out)
