"""The best parameters for a goal: kept optimisers (scipy) over any quantity that mechlab can compute; fronts of two goals."""

from mechlab.studies.optimize.problem import (
    TASKS,
    Constraint,
    Goal,
    Problem,
    Task,
    Variable,
    read_constraints,
    read_goal,
)
from mechlab.studies.optimize.result import Optimum
from mechlab.studies.optimize.work import optimize

__all__ = [
    "TASKS",
    "Constraint",
    "Goal",
    "Optimum",
    "Problem",
    "Task",
    "Variable",
    "optimize",
    "read_constraints",
    "read_goal",
]
