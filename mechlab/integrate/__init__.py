"""Integrators of dy/dt = f(t, y): explicit Runge-Kutta methods as data, step-size control, dry friction with events."""

from typing import TYPE_CHECKING

from mechlab.on_demand import on_demand

if TYPE_CHECKING:
    from mechlab.integrate.adaptive import (
        ADAPTIVE,
        IntegrationStatus,
        LsodaStates,
        Trajectory,
        integrate_adaptive,
        integrate_lsoda,
    )
    from mechlab.integrate.collocation import integrate_collocated
    from mechlab.integrate.fixed import EULER, HEUN, RK4, RK38, TABLEAUX, FixedStepEnd, Tableau, integrate_fixed, step
    from mechlab.integrate.hybrid import (
        Ending,
        Event,
        HybridTrajectory,
        Modes,
        RoughProblem,
        integrate_hybrid,
        modes_at,
    )
    from mechlab.integrate.work import OutOfWork, count_work, work_done, work_limit

_HOMES = {
    "adaptive": ("ADAPTIVE", "IntegrationStatus", "LsodaStates", "Trajectory", "integrate_adaptive", "integrate_lsoda"),
    "collocation": ("integrate_collocated",),
    "fixed": ("EULER", "HEUN", "RK4", "RK38", "TABLEAUX", "FixedStepEnd", "Tableau", "integrate_fixed", "step"),
    "hybrid": ("Ending", "Event", "HybridTrajectory", "Modes", "RoughProblem", "integrate_hybrid", "modes_at"),
    "work": ("OutOfWork", "count_work", "work_done", "work_limit"),
}
__getattr__ = on_demand(__name__, _HOMES)

__all__ = [
    "ADAPTIVE", "EULER", "HEUN", "RK4", "RK38", "TABLEAUX", "Ending", "Event", "FixedStepEnd", "HybridTrajectory",
    "IntegrationStatus", "LsodaStates", "Modes", "OutOfWork", "RoughProblem", "Tableau", "Trajectory", "count_work",
    "integrate_adaptive", "integrate_collocated", "integrate_fixed", "integrate_hybrid", "integrate_lsoda", "modes_at", "step", "work_done",
    "work_limit",
]  # fmt: skip
