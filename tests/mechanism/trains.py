"""Trains of gears that the tests share: the closed differential of the specification, a bevel differential, oddities."""

import math
from fractions import Fraction

from mechlab.mechanism import Builder, Inertia, Mechanism, revolute

ROUND = (0.0, 0.0, 0.0)


def disc(moment: float, mass: float = 1.0) -> Inertia:
    return Inertia.axial(mass, moment, 0.5 * moment)


def closed_differential(planets: int = 3, damping: float = 0.0) -> Mechanism:
    """Carriers H1 and H2, blocks 14 (suns) and 36 (rings), planets 2 and 5: two freedoms. Inertias of the specification."""
    z1, z2, z3, z4, z5, z6 = 72, 18, 108, 18, 72, 162
    b = Builder("closed_differential", gravity=(0, 0, 0))
    for name, moment in (("H1", 0.02), ("H2", 0.02), ("block14", 0.03), ("block36", 0.15)):
        b.body(name, revolute(name, damping=damping), inertia=disc(moment))
    for k in range(planets):
        a = 2 * math.pi * k / planets
        at = (0.2 * math.cos(a), 0.2 * math.sin(a), 0.0)
        for carrier, planet, mass, moment in (("H1", "p2", 0.3, 2.4e-4), ("H2", "p5", 4.0, 0.0512)):
            share = 3 / planets
            b.body(
                f"{planet}_{k}",
                revolute(f"{planet}_{k}", damping=damping),
                parent=carrier,
                at=at,
                inertia=disc(moment * share, mass * share),
            )
        b.gears(f"m12_{k}", "block14", f"p2_{k}", (z1, z2), carrier="H1")
        b.gears(f"m32_{k}", "block36", f"p2_{k}", (z3, z2), carrier="H1", kind="internal")
        b.gears(f"m45_{k}", "block14", f"p5_{k}", (z4, z5), carrier="H2")
        b.gears(f"m65_{k}", "block36", f"p5_{k}", (z6, z5), carrier="H2", kind="internal")
    b.drive("H1").drive("H2")
    return b.build()


def bevel_differential(across: float = 0.5, lopsided: bool = False) -> Mechanism:
    """Side gears and cage about x, a bevel planet whose axis turns with the cage. `across`: moment across over along."""
    b = Builder("differential", gravity=(0, 0, 0))
    for name in ("left", "cage", "right"):
        b.body(name, revolute(name, "x"), inertia=Inertia.axial(1.0, 0.01, 0.005, (1, 0, 0)))
    inertia = Inertia.axial(0.4, 2e-3, across * 2e-3, (0, 1, 0), (0.0, 0.05, 0.0))
    if lopsided:
        inertia = inertia + Inertia.point(0.1, (0.02, 0.05, 0.0)) + Inertia.point(0.1, (-0.02, 0.05, 0.0))
    b.body("planet", revolute("planet", "y"), parent="cage", inertia=inertia)
    b.gears("l", "left", "planet", (30, 20), carrier="cage", kind="bevel")
    b.gears("r", "right", "planet", (30, 20), carrier="cage", kind="bevel", side=-1)
    return b.build()


def gearbox(mass_offset: float = 0.0, gravity: float = 0.0, weld: bool = False) -> Mechanism:
    """Three shafts side by side, 2:1 and 3:1, the last one turning about -z; one freedom."""
    b = Builder("gearbox", gravity=(0, -gravity, 0))
    b.body("a", revolute("a", armature=1e-3, damping=0.2, zero=0.5), inertia=disc(0.01))
    b.body(
        "b",
        revolute("b", stiffness=3.0, spring_rest=0.1),
        at=(0.3, 0, 0),
        inertia=Inertia(2.0, (mass_offset, 0, 0), (0.02, 0.02, 0.04, 0, 0, 0)),
    )
    b.body("c", revolute("c", "-z", friction=0.1), at=(0.7, 0, 0), inertia=disc(0.5))
    if weld:
        b.body("rotor", parent="c", at=(0.0, 0.0, 0.1), inertia=disc(0.25))
    b.gears("ab", "a", "b", (20, 40)).gears("bc", "b", "c", (20, 60))
    b.shaft("tacho", {"a": Fraction(7, 3)}, inertia=1e-4, damping=0.01)
    return b.build()
