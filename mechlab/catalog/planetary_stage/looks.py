"""What the parts of the stage look like."""

from __future__ import annotations

from mechlab.catalog.planetary_stage.parameters import Parameters
from mechlab.kit.epicyclic import azimuth, on_circle
from mechlab.kit.palette import BLUE, BRASS, RED, STEEL
from mechlab.mechanism import Placement, shape
from mechlab.mechanism.geometry import axis_rotation
from mechlab.mechanism.parts import Shape
from mechlab.shapes import external_phase, internal_phase


def sun_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Sun and its shaft."""
    m, z = p.module, p.teeth[0]
    return (
        shape("spur_gear", color=BRASS, name="sun", teeth=z, module=m, width=8 * m, bore=0.12 * m * z, phase=0.0),
        shape("cylinder", Placement((0.0, 0.0, 8 * m)), BRASS, "shaft", radius=0.12 * m * z, length=24 * m),
    )


def planet_shapes(p: Parameters, k: int) -> tuple[Shape, ...]:
    """Planet k, in phase with the sun."""
    m, (sun, planet, _) = p.module, p.teeth
    return (
        shape("spur_gear", color=STEEL, name="planet", teeth=planet, module=m, width=8 * m, bore=0.09 * m * planet,
              phase=external_phase(sun, 0.0, planet, azimuth(k, p.planets)), holes=5),
    )  # fmt: skip


def ring_shapes(p: Parameters) -> tuple[Shape, ...]:
    """The ring, in phase with the planets."""
    m, (sun, planet, ring) = p.module, p.teeth
    phase = internal_phase(planet, external_phase(sun, 0.0, planet, 0.0), ring, 0.0)
    return (shape("internal_gear", color=BLUE, name="ring", teeth=ring, module=m, width=8 * m, phase=phase),)


def carrier_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Hub, arms and pins."""
    m = p.module
    out = [shape("disc", Placement((0.0, 0.0, -8 * m)), RED, "hub", radius=0.35 * p.orbit, thickness=4 * m)]
    for k in range(p.planets):
        a = azimuth(k, p.planets)
        arm = Placement.of(axis_rotation((0, 0, 1.0), a), (0.0, 0.0, -8 * m))
        out.append(
            shape(
                "link",
                arm,
                RED,
                f"arm_{k + 1}",
                length=p.orbit,
                width=0.2 * p.orbit,
                thickness=4 * m,
                bore=0.05 * p.orbit,
            )
        )
        pin = on_circle(p.orbit, a, -1.5 * m)
        out.append(shape("cylinder", Placement(pin), RED, f"pin_{k + 1}", radius=0.09 * m * p.teeth[1], length=14 * m))
    return tuple(out)
