"""What the parts of the series-planet gear look like."""

from __future__ import annotations

import math

from mechlab.analytic import planetary_synthesis as closed_form
from mechlab.catalog.planetary.parameters import Parameters
from mechlab.kit.epicyclic import azimuth, on_circle
from mechlab.kit.palette import BLUE, RED
from mechlab.mechanism import Placement, shape
from mechlab.mechanism.geometry import axis_rotation
from mechlab.mechanism.parts import Shape
from mechlab.shapes import external_phase


def phases(p: Parameters, k: int) -> tuple[float, float, float]:
    """Phases of planet 2, planet 3 and gear 4 for ray k, the sun at phase 0: a tooth stands in a gap at every mesh."""
    z1, z2, z3, z4 = p.teeth
    a = azimuth(k, p.planets)
    two = external_phase(z1, 0.0, z2, a)
    three = external_phase(z2, two, z3, a)
    return two, three, external_phase(z3, three, z4, a + math.pi)


def gear(
    p: Parameters, z: int, name: str, color: tuple[float, float, float, float], lift: float, **more: float
) -> Shape:
    """A spur gear of z teeth, `lift` modules above the plane of the sun."""
    m = p.module
    sizes = {"width": 8 * m, "bore": 0.09 * m * z, "phase": 0.0} | more
    return shape("spur_gear", Placement((0.0, 0.0, lift * m)), color, name, teeth=z, module=m, **sizes)


def fixed_gear(p: Parameters) -> Shape:
    """Gear 4 in the second plane; it carries the whole profile shift of its mesh (the other two have none)."""
    z1, z2, z3, z4 = p.teeth
    aw = float(closed_form.working_angle(z1, z2, z3, z4))
    shift = (z3 + z4) * (closed_form.involute(aw) - closed_form.involute(closed_form.STANDARD))
    x = min(float(shift / (2.0 * math.tan(closed_form.STANDARD))), 1.0)
    return gear(p, z4, "gear_4", BLUE, -9.0, bore=0.3 * p.module * z4, phase=phases(p, 0)[2], profile_shift=x)


def carrier_shapes(p: Parameters) -> tuple[Shape, ...]:
    """Hub, arms and pins."""
    m, (r2, r3) = p.module, p.radii
    out = [shape("disc", Placement((0.0, 0.0, 8 * m)), RED, "hub", radius=0.3 * r2, thickness=4 * m)]
    for k in range(p.planets):
        a = azimuth(k, p.planets)
        arm = Placement.of(axis_rotation((0.0, 0.0, 1.0), a), (0.0, 0.0, 8 * m))
        out.append(shape("link", arm, RED, f"arm_{k + 1}", length=r3, width=0.16 * r2, thickness=3 * m, bore=0.03 * r2))
        for name, r, low in (("a", r2, -5.0), ("b", r3, -14.0)):
            pin = Placement(on_circle(r, a, 0.5 * (low + 9.0) * m))
            out.append(shape("cylinder", pin, RED, f"pin_{k + 1}{name}", radius=0.03 * r2, length=(9.0 - low) * m))
    return tuple(out)
