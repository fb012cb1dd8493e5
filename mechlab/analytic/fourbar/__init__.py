"""Closed forms of the planar four-bar: motion, ranges, and its dynamics as one freedom."""

from mechlab.analytic.fourbar.dynamics import (
    NO_GRAVITY,
    FourbarForces,
    LinkMass,
    MovingFourbar,
    ReducedInertia,
    acceleration,
    energy_speed,
    generalised_inertia,
    pin_forces,
    potential_energy,
    rod_fourbar,
    slender_rod,
)
from mechlab.analytic.fourbar.kinematics import (
    CrankLimits,
    FourbarMotion,
    GrashofClass,
    crank_limits,
    grashof_class,
    solve,
)

__all__ = [
    "NO_GRAVITY",
    "CrankLimits",
    "FourbarForces",
    "FourbarMotion",
    "GrashofClass",
    "LinkMass",
    "MovingFourbar",
    "ReducedInertia",
    "acceleration",
    "crank_limits",
    "energy_speed",
    "generalised_inertia",
    "grashof_class",
    "pin_forces",
    "potential_energy",
    "rod_fourbar",
    "slender_rod",
    "solve",
]
