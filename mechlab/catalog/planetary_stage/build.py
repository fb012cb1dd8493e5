"""The planetary stage in each fidelity."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache

from mechlab.catalog.planetary_stage.looks import carrier_shapes, planet_shapes, ring_shapes, sun_shapes
from mechlab.catalog.planetary_stage.parameters import Parameters
from mechlab.errors import unknown
from mechlab.kit.epicyclic import azimuth, disc, on_circle
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, revolute


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """minimal: as many coordinates as freedoms, no rows. parts: one planet. full: all planets, redundant rows."""
    b = Builder("planetary_stage", gravity=(0.0, 0.0, 0.0), summary="simple planetary stage")
    if fidelity == "minimal":
        _minimal(b, p)
    elif fidelity in ("parts", "full"):
        _gears(b, p, 1 if fidelity == "parts" else p.planets)
    else:
        raise unknown("planetary_stage: fidelity", fidelity, ("minimal", "parts", "full"))
    b.drive("sun", stiffness=50.0, damping=0.2)
    if p.ring == "free":
        b.drive("carrier", stiffness=50.0, damping=0.2)
    return b.build()


def _carrier_inertia(p: Parameters, carried: int) -> Inertia:
    """Carrier; planets beyond the `carried` ones that are bodies ride along as point masses (their orbit)."""
    orbiting = (p.planets - carried) * p.planet_mass * p.orbit**2
    return disc(p.J_carrier + orbiting, p.orbit)


def _minimal(b: Builder, p: Parameters) -> None:
    sun, planet, ring = p.teeth
    shapes = carrier_shapes(p)
    b.body("carrier", revolute("carrier"), inertia=_carrier_inertia(p, 0), shapes=shapes)
    if p.ring == "held":
        b.shaft("sun", {"carrier": 1 + Fraction(ring, sun)}, inertia=p.J_sun, shapes=sun_shapes(p))
        spin: dict[str, object] = {"carrier": 1 - Fraction(ring, planet)}
        turn: dict[str, object] = {"carrier": -Fraction(ring, planet)}
        b.ground(*ring_shapes(p))
    else:
        b.body(
            "sun",
            revolute("sun_on_carrier"),
            parent="carrier",
            inertia=disc(p.J_sun, 0.5 * p.module * sun),
            shapes=sun_shapes(p),
        )
        b.shaft("sun", {"carrier": 1, "sun_on_carrier": 1})
        b.shaft("ring", {"carrier": 1, "sun_on_carrier": -Fraction(sun, ring)}, inertia=p.J_ring, shapes=ring_shapes(p))
        spin = {"carrier": 1, "sun_on_carrier": -Fraction(sun, planet)}
        turn = {"sun_on_carrier": -Fraction(sun, planet)}
    for k in range(p.planets):
        a = azimuth(k, p.planets)
        place = Placement(on_circle(p.orbit, a))
        b.shaft(f"planet_{k + 1}_spin", spin, inertia=p.J_planet)
        b.shaft(f"planet_{k + 1}", turn, body="carrier", placement=place, shapes=planet_shapes(p, k))


def _gears(b: Builder, p: Parameters, planets: int) -> None:
    sun, planet, ring = p.teeth
    b.body("sun", revolute("sun"), inertia=disc(p.J_sun, 0.5 * p.module * sun), shapes=sun_shapes(p))
    carrier = _carrier_inertia(p, planets)
    b.body("carrier", revolute("carrier"), inertia=carrier, shapes=carrier_shapes(p))
    if p.ring == "free":
        b.body("ring", revolute("ring"), inertia=disc(p.J_ring, 0.5 * p.module * ring), shapes=ring_shapes(p))
    else:
        b.ground(*ring_shapes(p))
    for k in range(planets):
        a, name = azimuth(k, p.planets), f"planet_{k + 1}"
        spin = p.J_planet * (p.planets if planets == 1 else 1)
        b.body(name, revolute(name), parent="carrier", at=on_circle(p.orbit, a),
               inertia=Inertia.axial(p.planet_mass, spin, 0.5 * spin), shapes=planet_shapes(p, k))  # fmt: skip
        b.gears(f"sun_{name}", "sun", name, (sun, planet), carrier="carrier")
        if p.ring == "free":
            b.gears(f"ring_{name}", "ring", name, (ring, planet), carrier="carrier", kind="internal")
        else:
            b.relation(f"ring_{name}", **{"carrier": 1, name: Fraction(planet, ring)})
