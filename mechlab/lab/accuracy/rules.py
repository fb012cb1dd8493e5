"""The rules of error control as data, the same for all mechanisms."""

from __future__ import annotations

from mechlab.lab.methods import METHODS, Method, Problem
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class ControlRules:
    """The numbers that hold for all problems.

    safety: factor on every estimate. work [s]: most counted work of all trials together: always, more for each second of the
    scene, and at most.
    nodes: number of nodes of a cell of the energy quadrature at first, and at most.
    runs: number of runs of a method before their observed order is used. failures: most failed runs of a method.
    tolerances: those that a method is refined by; sharpest: the smallest for a method that starts near its target.
    floor [m or rad]: below it the error of the energy quadrature is rounding, which steps do not reduce.
    rounding: units in the last place by which energy or start are moved to see what double precision allows.
    check_share: share of the work so far that the check may add; check_steps: its fewest and most steps in an output
    interval; check_tolerances: those of a check method without steps; check_own: the check ends where its own error
    exceeds this share of the size of the motion; contradiction: largest difference of two methods over their errors.
    """

    safety: float = 2.0
    work: tuple[float, float, float] = (3.0, 1.5, 30.0)
    nodes: tuple[int, int] = (6, 192)
    runs: int = 3
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


RULES = ControlRules()


def default_budget(duration: float) -> float:
    """Most counted work [s] of the error control of a scene of this duration [s], where no budget is given."""
    always, more, most = RULES.work
    return min(always + more * duration, most)


@dataclass(frozen=True)
class MethodRule:
    """How error control uses a method. engine, integrator, constraints: as in `mechlab.lab.methods.Method`.

    control: what is refined, "step" or "tolerance". order: power of the step with which the error falls; with_rows: the power that is
    relied on and the one that is expected where there are loops or relations (None: `order`). stable: largest step
    times the fastest rate of the mechanism (0: no limit). extrapolated: whether the runs are combined (Richardson).
    error_left: (c, p) of the usual error c tolerance^p of a run, which sets the first tolerance (c = 0: the coarsest).
    evaluations: expected number in an output interval under a tolerance, before the first run.
    least: the smallest error [m or rad] that it is tried for, and only where steps are short for other reasons than that error:
    rates that are fast for the outputs, or kinks (0: always).
    """

    name: str
    engine: str
    integrator: str
    constraints: str
    control: str
    order: float
    stable: float = 0.0
    extrapolated: bool = False
    error_left: tuple[float, float] = (0.0, 1.0)
    evaluations: float = 1.0
    least: float = 0.0
    with_rows: tuple[float, float] | None = None

    def method(self, problem: Problem) -> Method | None:
        """The method of the registry that this rule selects for a problem; None where there is none. Without loops and
        relations MuJoCo has no rows to harden: then its default method is selected."""
        rows = problem.mechanism.is_closed
        kind = "default" if self.engine == "mujoco" and self.control == "step" and not rows else self.constraints
        wanted = (self.engine, self.integrator, kind, self.control)
        return next((m for m in METHODS if (m.engine, m.integrator, m.constraints, m.control) == wanted), None)


LSODA_ERROR = (12.0, 0.89)
"""Measured on a stiff governor over 10 s: 3 tolerance^0.89 from 1e-5 to 1e-12. Times 2, because a run must stay below half of
its target, and times 2 for other problems."""

SOFT_ROWS, STABILIZED = (1.0, 2.0), (1.0, 4.0)
"""MuJoCo's softness goes with the square of the step, and so do positions in general; near singular positions, and in rates, the errors
fall more slowly. Baumgarte's gains go with 1/h^2 and meet the stages of RK4, whose poses are open by h^2: a small part of its errors
falls with the square of the step too, and where it meets the rest, two runs agree by chance."""

METHOD_RULES: tuple[MethodRule, ...] = (
    MethodRule("MuJoCo RK4", "mujoco", "RK4", "hard", "step", 4.0, 2.2, with_rows=SOFT_ROWS),
    MethodRule("MuJoCo discrete, extrapolated", "mujoco", "discrete", "hard", "step", 1.0, 0.0, True),
    MethodRule("MuJoCo implicitfast", "mujoco", "implicitfast", "hard", "step", 1.0, 1.1, least=1e-4, with_rows=SOFT_ROWS),
    MethodRule("Pinocchio RK4", "pinocchio", "RK4", "soft", "step", 4.0, 2.2, with_rows=STABILIZED),
    MethodRule(
        "LSODA on MuJoCo's tree", "mujoco", "LSODA", "exact", "tolerance", 5.0, error_left=LSODA_ERROR, evaluations=25.0
    ),
    MethodRule(
        "LSODA on Pinocchio's tree",
        "pinocchio",
        "LSODA",
        "exact",
        "tolerance",
        5.0,
        error_left=LSODA_ERROR,
        evaluations=25.0,
    ),
    MethodRule("one freedom DOP853", "one_freedom", "DOP853", "exact", "tolerance", 8.0, evaluations=8.0),
    MethodRule("hybrid DOP853", "hybrid", "DOP853", "exact", "tolerance", 8.0, evaluations=4.0),
)
"""The methods; their prices (`mechlab.experiment.prices`) say what each is expected to cost. Where the energy quadrature applies
it comes before all of them."""

RELIED = 3.0
"""Largest order that is relied on: where the steps only just resolve a short event, the changes of three runs may fall by the theory's
order and the errors by less (Schatz's linkage). The order of extrapolated runs rises from run to run, and counts no more."""
EPSILON = 2.2e-16
"""Unit in the last place of a double, relative."""
