"""The Wolfrom train in each fidelity."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache

from mechlab.catalog.wolfrom.looks import carrier_shapes, held_ring, planet_shapes, ring_shapes, sun_shapes
from mechlab.catalog.wolfrom.parameters import Parameters
from mechlab.errors import unknown
from mechlab.kit.epicyclic import azimuth, disc, on_circle
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute
from mechlab.mechanism.reduction import Reduction, reduce


def build(p: Parameters, fidelity: str) -> Mechanism:
    """minimal: one coordinate (the carrier), all gears as shafts. parts: one planet stands for all. full: every planet."""
    if fidelity == "minimal":
        return reduction(p).mechanism
    if fidelity not in ("parts", "full"):
        raise unknown("wolfrom: fidelity", fidelity, ("minimal", "parts", "full"))
    return _gears(p, 1 if fidelity == "parts" else p.planets)


@lru_cache(maxsize=32)
def reduction(p: Parameters) -> Reduction:
    """The exact reduction of the full train."""
    return reduce(_gears(p, p.planets), ("carrier",))


@lru_cache(maxsize=32)
def _gears(p: Parameters, planets: int) -> Mechanism:
    b = Builder("wolfrom", gravity=(0.0, 0.0, 0.0), summary=f"Wolfrom train {p.ratio}:1")
    sun, first, ring, second, output = p.all_teeth
    m = p.module
    b.ground(held_ring(p))
    b.body("sun", revolute("sun"), inertia=disc(p.J_sun, 0.5 * m * sun), shapes=sun_shapes(p))
    orbiting = (p.planets - planets) * p.planet_mass * p.orbit**2
    b.body("carrier", revolute("carrier"), inertia=disc(p.J_carrier + orbiting, p.orbit), shapes=carrier_shapes(p))
    b.body("ring", revolute("ring"), inertia=disc(p.J_ring, 0.5 * m * ring), shapes=ring_shapes(p))
    for k in range(planets):
        a, name = azimuth(k, p.planets), f"planet_{k + 1}"
        spin = p.J_planet * (p.planets if planets == 1 else 1)
        b.body(name, revolute(name), parent="carrier", at=on_circle(p.orbit, a),
               inertia=Inertia.axial(p.planet_mass, spin, 0.5 * spin), shapes=planet_shapes(p, k))  # fmt: skip
        b.gears(f"sun_{name}", "sun", name, (sun, first), carrier="carrier")
        b.relation(f"held_ring_{name}", **{"carrier": 1, name: Fraction(first, ring)})
        b.gears(f"ring_{name}", "ring", name, (output, second), carrier="carrier", kind="internal")
    b.drive("sun", stiffness=5.0, damping=0.05)
    b.drive("ring", damping=1.0)
    return b.build()
