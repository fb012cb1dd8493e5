"""What the parts of the Wolfrom train look like."""

from __future__ import annotations

from mechlab.catalog.wolfrom.meshing import planet_turn
from mechlab.catalog.wolfrom.parameters import Parameters
from mechlab.kit.epicyclic import azimuth, on_circle
from mechlab.kit.palette import BLUE, BRASS, GREEN, RED, STEEL
from mechlab.mechanism import Placement, shape
from mechlab.mechanism.geometry import axis_rotation
from mechlab.mechanism.parts import Shape
from mechlab.shapes import external_phase, internal_phase

WIDTH, GAP = 7.0, 2.0
"""Face width and the gap between the two planes of gears, in modules."""


def _planes(p: Parameters) -> tuple[float, float]:
    return 0.0, (WIDTH + GAP) * p.module


def _gear(p: Parameters, kind: str, color: tuple[float, float, float, float], name: str, k: int, teeth: int, phase: float,
          **size: float) -> Shape:  # fmt: skip
    module = p.module if k == 0 else p.second_module
    place = Placement((0.0, 0.0, _planes(p)[k]))
    return shape(kind, place, color, name, teeth=teeth, module=module, width=WIDTH * p.module, phase=phase, **size)


def sun_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Sun and its shaft."""
    m, z = p.module, p.teeth[0]
    shaft = shape("cylinder", Placement((0.0, 0.0, -14 * m)), BRASS, "shaft", radius=0.16 * m * z, length=24 * m)
    return _gear(p, "spur_gear", BRASS, "sun", 0, z, 0.0, bore=0.12 * m * z), shaft


def planet_shapes(p: Parameters, k: int) -> tuple[Shape, ...]:
    """The two gears of planet k."""
    sun, first, _, second, _ = p.all_teeth
    turn = planet_turn(p.all_teeth, p.planets, k)
    bore = 0.09 * p.module * first
    return (
        _gear(p, "spur_gear", STEEL, "planet_gear_1", 0, first, external_phase(sun, 0.0, first, 0.0) + turn, bore=bore, holes=5),
        _gear(p, "spur_gear", STEEL, "planet_gear_2", 1, second, turn, bore=bore, holes=5),
    )  # fmt: skip


def held_ring(p: Parameters) -> Shape:
    """The ring that is fixed to the ground."""
    sun, first, ring, _, _ = p.all_teeth
    phase = internal_phase(first, external_phase(sun, 0.0, first, 0.0), ring, 0.0)
    return _gear(p, "internal_gear", BLUE, "held_ring", 0, ring, phase)


def ring_shapes(p: Parameters) -> tuple[Shape, ...]:
    """The output ring."""
    _, _, _, second, ring = p.all_teeth
    return (_gear(p, "internal_gear", GREEN, "output_ring", 1, ring, internal_phase(second, 0.0, ring, 0.0)),)


def carrier_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Hub, arms and pins."""
    m = p.module
    low = -(WIDTH + 1.0) * m
    out = [
        shape(
            "disc",
            Placement((0.0, 0.0, low)),
            RED,
            "hub",
            radius=0.35 * p.orbit,
            thickness=4 * m,
            bore=0.2 * m * p.teeth[0],
        )
    ]
    length = (2.0 * WIDTH + GAP + 6.0) * m
    for k in range(p.planets):
        a = azimuth(k, p.planets)
        arm = Placement.of(axis_rotation((0, 0, 1.0), a), on_circle(0.3 * p.orbit, a, low))
        out.append(shape("link", arm, RED, f"arm_{k + 1}", length=0.7 * p.orbit, width=0.2 * p.orbit, thickness=4 * m,
                         bore=0.05 * p.orbit))  # fmt: skip
        pin = on_circle(p.orbit, a, low + 0.5 * length)
        out.append(shape("cylinder", Placement(pin), RED, f"pin_{k + 1}", radius=0.088 * m * p.teeth[1], length=length))
    return tuple(out)
