"""Map "sticking": timestep against dry friction; what sticks must not creep."""

from __future__ import annotations

from mechlab.study.methods import Problem
from mechlab.study.stability.data import Axis
from mechlab.study.stability.plan import Case, Plan, steps_of
from mechlab.study.stability.vary import rough_parts, scale_friction

FACTORS = (0.01, 0.1, 0.3, 1.0, 3.0, 10.0)
LONGEST = 0.3


def plan_sticking(case: Case) -> Plan | str:
    """The map, or why there is none."""
    m = case.mechanism
    rough = rough_parts(m)
    if not rough:
        return "it has no dry friction"
    duration = min(case.scene.duration, LONGEST)

    def problem(y: float) -> Problem:
        return case.problem(scale_friction(m, y), None, duration)

    names = [f"MuJoCo {i}, hard" for i in ("implicitfast", "discrete", "RK4")]
    methods = case.methods(
        "MuJoCo RK4, defaults", *names, "Pinocchio RK4, friction by sign", "Pinocchio RK4, friction by tanh"
    )
    text = "dry friction of " + ", ".join(f"{n} ({f:.3g} N m or N)" for n, f in rough.items()) + " times this"
    return Plan(
        "sticking", "timestep and dry friction", Axis("friction / as given", "", FACTORS, text, 1.0), problem,
        methods, steps_of(duration),
    )  # fmt: skip
