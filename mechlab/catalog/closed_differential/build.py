"""The closed differential in three fidelities: minimal, parts (one planet a stage), full (all planets)."""

from __future__ import annotations

from functools import lru_cache

from mechlab.catalog.closed_differential import looks
from mechlab.catalog.closed_differential.parameters import Parameters
from mechlab.errors import MechlabError, unknown
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute

MESHES = ("mesh_12", "mesh_23", "mesh_45", "mesh_56")
"""Names of the meshes, each followed by _ and the number of the planet."""


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """minimal: two coordinates, no rows; all dependent parts are shafts. parts: one planet a stage. full: all planets.

    H1, H2, block_14, block_36 and the absolute turns planet_2_spin, planet_5_spin are joints or shafts of every fidelity.
    One drive, the input H1. No gravity: the axis stands upright.
    Raises MechlabError for `minimal` when both carriers turn as one.
    """
    b = Builder("closed_differential", gravity=(0.0, 0.0, 0.0), summary="closed gear differential, two freedoms")
    if fidelity == "minimal":
        _minimal(b, p)
    elif fidelity in ("parts", "full"):
        _gears(b, p, 1 if fidelity == "parts" else p.planets)
    else:
        raise unknown("closed_differential: fidelity", fidelity, ("minimal", "parts", "full"))
    return b.drive("H1").build()


def _disc(inertia: float, mass: float) -> Inertia:
    """A flat part with the given moment about z."""
    return Inertia.axial(mass, inertia, 0.5 * inertia)


def _carrier(p: Parameters, stage: int, carried: int) -> Inertia:
    """A carrier; planets beyond the `carried` ones that are bodies ride along as point masses."""
    bare, mass = (p.J_H1, p.m2) if stage == 1 else (p.J_H2, p.m5)
    radius, riding = p.radii[stage - 1], p.planets - carried
    return _disc(bare + riding * mass * radius**2, bare / radius**2 + riding * mass)


def _minimal(b: Builder, p: Parameters) -> None:
    """H2 is nested in H1, so that every shaft lies on one path: w = w_H1 + (coefficient) x (w_H2 - w_H1). The planets of a
    stage are one shaft, not drawn: a page shows the full train along any run."""
    if not p.train.regular:
        raise MechlabError(
            f"closed_differential: teeth {p.teeth}: both carriers turn as one (z1/z3 = z4/z6), their speeds do not fix "
            "the blocks. Change the teeth, or take the fidelity 'parts'."
        )
    a, c = p.train.exact_shares
    w1, w3 = -(1 - a) / (a - c), a / (a - c)  # coefficients of w_H2 - w_H1; that of w_H1 is 1
    (z1, z2, z3, z4, z5, z6), far = p.teeth, "H2_on_H1"
    b.body("H1", revolute("H1"), inertia=_carrier(p, 1, 0), shapes=looks.carrier(p, 1))
    b.body("H2", revolute(far), parent="H1", inertia=_carrier(p, 2, 0), shapes=looks.carrier(p, 2))
    b.shaft("H2", {"H1": 1, far: 1})
    b.shaft("block_14", {"H1": 1, far: w1}, inertia=p.J14, shapes=looks.block_14(p))
    b.shaft("block_36", {"H1": 1, far: w3}, inertia=p.J36, shapes=looks.block_36(p))
    spins = (z3 * w3 - z1 * w1) / (2 * z2), (z6 * w3 - z4 * w1) / (2 * z5)
    b.shaft("planet_2_spin", {"H1": 1, far: spins[0]}, inertia=p.planets * p.J2)
    b.shaft("planet_5_spin", {"H1": 1, far: spins[1]}, inertia=p.planets * p.J5)


def _gears(b: Builder, p: Parameters, planets: int) -> None:
    (z1, z2, z3, z4, z5, z6), r1 = p.teeth, p.radii[0]
    b.body("block_14", revolute("block_14"), inertia=_disc(p.J14, p.J14 / r1**2), shapes=looks.block_14(p))
    b.body("block_36", revolute("block_36"), inertia=_disc(p.J36, p.J36 / r1**2), shapes=looks.block_36(p))
    for stage, (sun, planet, ring) in ((1, (z1, z2, z3)), (2, (z4, z5, z6))):
        carrier, kind = f"H{stage}", looks.planet_name(stage)
        mass, spin = (p.m2, p.J2) if stage == 1 else (p.m5, p.J5)
        spin *= p.planets if planets == 1 else 1
        b.body(carrier, revolute(carrier), inertia=_carrier(p, stage, planets), shapes=looks.carrier(p, stage))
        for k in range(planets):
            name = f"{kind}_{k + 1}"
            b.body(name, revolute(name), parent=carrier, at=looks.planet_axis(p, stage, k), inertia=_disc(spin, mass),
                   shapes=looks.planet(p, stage, k))  # fmt: skip
            inner, outer = MESHES[2 * stage - 2 : 2 * stage]
            b.gears(f"{inner}_{k + 1}", "block_14", name, (sun, planet), carrier=carrier)
            b.gears(f"{outer}_{k + 1}", "block_36", name, (ring, planet), carrier=carrier, kind="internal")
        b.shaft(f"{kind}_spin", {carrier: 1, f"{kind}_1": 1})
