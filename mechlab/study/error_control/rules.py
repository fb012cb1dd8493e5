"""The one rule set of error control, as data. Nothing here knows a mechanism."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Rules:
    """What all problems are held to.

    safety: an estimate counts this many times; work [s]: counted, of all probing together; nodes: of a cell of the method "energy",
    first and last; rungs: of a ladder, at least, before the order that it shows is believed; failures: of a ladder
    at its coarse end, before it is given up; floor [m or rad]: below it the error of "energy" is rounding, which steps do not
    cure; tolerances: of a ladder that is controlled by them; sharpest: of a
    ladder that starts near its target; rounding: units in the last place by which the energy is shifted
    to see what double precision allows; check_share: of the work done so far that the check method may add; check_steps: its
    steps in an output interval, fewest and most; check_tolerances: of a check method that has no steps;
    check_own: share of the size of the motion up to which its own error lets
    it say anything; contradiction: how many times the errors stated by both methods their difference may be.
    """

    safety: float = 2.0
    work: float = 4.5
    nodes: tuple[int, int] = (6, 192)
    rungs: int = 3
    failures: int = 6
    floor: float = 1e-8
    tolerances: tuple[float, ...] = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
    sharpest: float = 1e-13
    rounding: float = 4.0
    check_share: float = 0.1
    check_steps: tuple[int, int] = (4, 4000)
    check_tolerances: tuple[float, float] = (1e-5, 1e-7)
    check_own: float = 1e-3
    contradiction: float = 10.0


RULES = Rules()


@dataclass(frozen=True)
class LadderRule:
    """A method as error control may use it. engine, integrator, constraints as of `mechlab.study.methods.Method`; order:
    of its error in the step; control: "step" or "tolerance"; stable: largest step times the fastest rate of the mechanism
    (0: no limit); extrapolated: whether the steps of the ladder are combined (Richardson); leaves: (c, p) of the error
    c x tolerance^p that a run leaves as a rule, so that the ladder starts near its target (c = 0: it starts at the
    coarsest); evaluations: expected in an output interval under a tolerance, until a run has told."""

    name: str
    engine: str
    integrator: str
    constraints: str
    control: str
    order: float
    stable: float = 0.0
    extrapolated: bool = False
    leaves: tuple[float, float] = (0.0, 1.0)
    evaluations: float = 1.0


LSODA_LEAVES = (12.0, 0.89)
"""Measured on a stiff governor over 10 s: 3 x tolerance^0.89 from 1e-5 to 1e-12; a run is believed at half of its target, and
as much again is left for other problems."""

LADDERS: tuple[LadderRule, ...] = (
    LadderRule("MuJoCo RK4", "mujoco", "RK4", "hard", "step", 4.0, 2.2),
    LadderRule("MuJoCo discrete, extrapolated", "mujoco", "discrete", "hard", "step", 1.0, 0.0, True),
    LadderRule("Pinocchio RK4", "pinocchio", "RK4", "soft", "step", 4.0, 2.2),
    LadderRule(
        "LSODA on MuJoCo's tree", "mujoco", "LSODA", "exact", "tolerance", 5.0, leaves=LSODA_LEAVES, evaluations=25.0
    ),
    LadderRule(
        "LSODA on Pinocchio's tree",
        "pinocchio",
        "LSODA",
        "exact",
        "tolerance",
        5.0,
        leaves=LSODA_LEAVES,
        evaluations=25.0,
    ),
    LadderRule("one freedom DOP853", "one_freedom", "DOP853", "exact", "tolerance", 8.0, evaluations=8.0),
    LadderRule("hybrid DOP853", "hybrid", "DOP853", "exact", "tolerance", 8.0, evaluations=7.0),
)
"""The methods; what each is expected to cost a problem is known from its price. "energy" comes before all of them where it
applies."""

LOOPS_ORDER = 2.0
"""Of MuJoCo with loops or gears: their softness goes with the square of the step."""
EXTRAPOLATED = 3.0
"""Largest order that the errors of extrapolated runs are believed to fall with: it rises from rung to rung."""
