"""The series-planet gear in each fidelity."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache

from mechlab.catalog.planetary.looks import carrier_shapes, fixed_gear, gear, phases
from mechlab.catalog.planetary.parameters import Parameters
from mechlab.errors import unknown
from mechlab.kit.epicyclic import azimuth, disc, on_circle
from mechlab.kit.palette import BRASS, STEEL, TEAL
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, revolute


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """minimal: one coordinate, no rows. parts: one ray of planets, each mesh a row. full: all rays, redundant rows."""
    if fidelity not in ("minimal", "parts", "full"):
        raise unknown("planetary: fidelity", fidelity, ("minimal", "parts", "full"))
    b = Builder("planetary", gravity=(0.0, 0.0, 0.0), summary="planetary gear with series planets, all meshes external")
    z1, z2, z3, z4 = p.teeth
    sun = gear(p, z1, "sun", BRASS, 0.0)
    b.ground(fixed_gear(p))
    bodies = {"minimal": 0, "parts": 1, "full": p.planets}[fidelity]
    r2, r3 = p.radii
    orbit = (p.planets - bodies) * (p.mass_2 * r2**2 + p.mass_3 * r3**2)
    b.body("carrier", revolute("carrier"), inertia=disc(p.J_carrier + orbit, r3), shapes=carrier_shapes(p))
    if fidelity == "minimal":
        b.shaft("sun", {"carrier": p.ratio}, inertia=p.J_sun, shapes=(sun,))
    else:
        b.body("sun", revolute("sun"), inertia=disc(p.J_sun, 0.5 * p.module * z1), shapes=(sun,))
    for k in range(p.planets):
        a = azimuth(k, p.planets)
        two, three, _ = phases(p, k)
        looks = {
            2: gear(p, z2, "planet_2", STEEL, 0.0, phase=two, holes=5),
            3: gear(p, z3, "planet_3", TEAL, -4.5, phase=three, width=18 * p.module),
        }
        for n, r, moment, mass, relative in (
            (2, r2, p.J_planet_2, p.mass_2, -Fraction(z4, z2)), (3, r3, p.J_planet_3, p.mass_3, Fraction(z4, z3)),
        ):  # fmt: skip
            name, at = f"planet_{n}_{k + 1}", on_circle(r, a)
            if fidelity == "minimal":
                b.shaft(f"{name}_spin", {"carrier": 1 + relative}, inertia=moment)
                b.shaft(name, {"carrier": relative}, body="carrier", placement=Placement(at), shapes=(looks[n],))
            elif k < bodies:
                spin = moment * (p.planets if bodies == 1 else 1)
                inertia = Inertia.axial(mass, spin, 0.5 * spin)
                b.body(name, revolute(name), parent="carrier", at=at, inertia=inertia, shapes=(looks[n],))
        if fidelity != "minimal" and k < bodies:
            two_name, three_name = f"planet_2_{k + 1}", f"planet_3_{k + 1}"
            b.gears(f"sun_{two_name}", "sun", two_name, (z1, z2), carrier="carrier")
            b.gears(f"{two_name}_{three_name}", two_name, three_name, (z2, z3), carrier="carrier")
            b.relation(f"{three_name}_gear_4", **{three_name: 1, "carrier": -Fraction(z4, z3)})
    b.drive("sun", stiffness=50.0, damping=0.2)
    return b.build()
