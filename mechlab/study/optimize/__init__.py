"""The best parameters for a goal: kept optimisers (scipy) over any quantity that mechlab can compute; fronts of two goals."""

from mechlab.study.optimize.problem import Constraint, Goal, Problem, Variable, read_constraints, read_goal
from mechlab.study.optimize.result import Optimum
from mechlab.study.optimize.tasks import TASKS, Task
from mechlab.study.optimize.work import optimize

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
