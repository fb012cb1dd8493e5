"""Map "stiffness": timestep against the stiffness of springs, dampers and servos, with the limits of theory."""

from __future__ import annotations

from mechlab.experiment.laws import OneSidedStop, Servo
from mechlab.mechanism import Mechanism
from mechlab.study.methods import Method, Problem
from mechlab.study.stability.data import Axis, Theory
from mechlab.study.stability.linear import Linear, formula, largest_step, linearise
from mechlab.study.stability.plan import DIVISIONS, OUTPUTS, Case, Plan, steps_of, tree_methods
from mechlab.study.stability.vary import scale_servos, scale_springs

FACTORS = (1e-2, 10**-1.5, 1e-1, 10**-0.5, 1.0, 10**0.5, 1e1, 10**1.5, 1e2)
FEW = (DIVISIONS[:7], FACTORS[::2])
"""With servos: laws are evaluated in Python, at every stage of every step."""


def stiff_parts(mechanism: Mechanism) -> dict[str, tuple[float, str]]:
    """Name -> stiffness and its unit of every spring, sprung joint and sprung shaft."""
    out = {s.name: (s.stiffness, "N/m") for s in mechanism.springs if s.stiffness}
    for j in mechanism.joints:
        if j.stiffness:
            out[j.name] = (j.stiffness, "N/m" if j.kind == "prismatic" else "N m/rad")
    return out | {s.name: (s.stiffness, "N m/rad") for s in mechanism.shafts if s.stiffness}


def plan_stiffness(case: Case) -> Plan | str:
    """The map, or why there is none: nothing in the scene is stiff."""
    m, scene = case.mechanism, case.scene
    springs = stiff_parts(m)
    servos = {w.on: w.stiffness for w in scene.laws if isinstance(w, Servo | OneSidedStop) and w.stiffness}
    if not springs and not servos:
        return "it has no springs, and the scene no servo: nothing that limits the timestep by its stiffness"
    methods = tree_methods(case)

    def problem(y: float) -> Problem:
        return case.problem(scale_springs(m, y), scale_servos(scene, y), duration)

    limits = [x for x in (largest_step(linearise(m, scene), w) for w in methods) if x < 1e3]
    if not limits:
        return "no explicit method among those asked for: springs do not limit their timestep"
    divisions, factors = FEW if servos else (DIVISIONS, FACTORS)
    top = min(max(limits), 4.0 * min(limits))  # what is treated implicitly may have a limit far away
    duration = OUTPUTS * (min(divisions) * max(divisions) * min(limits) * top) ** 0.5

    def theory(shown: tuple[Method, ...]) -> tuple[Theory, ...]:
        return spring_theory(factors, [_linear(problem(y)) for y in factors], shown)

    named = [f"{n} {k:.3g} {u}" for n, (k, u) in springs.items()] + [f"servo of {n} {k:.3g}" for n, k in servos.items()]
    text = f"stiffness of {', '.join(named[:3])}{', ...' if len(named) > 3 else ''}, times this; damping by its root"
    return Plan(
        "stiffness", "timestep and stiffness", Axis("stiffness / as given", "", factors, text, 1.0), problem, methods,
        steps_of(duration, divisions), theory=theory,
        remark="the limits of theory are those of the start pose" if m.loops else "",
    )  # fmt: skip


def _linear(problem: Problem) -> Linear:
    return linearise(problem.mechanism, problem.scene)


def spring_theory(values: tuple[float, ...], systems: list[Linear], methods: tuple[Method, ...]) -> tuple[Theory, ...]:
    """The largest stable step of every method at every value; methods with the same limits share one line."""
    lines: dict[tuple[tuple[float, ...], str], list[str]] = {}
    for m in methods:
        limits = tuple(largest_step(s, m) for s in systems)
        if all(x < float("inf") for x in limits):
            rounded = tuple(float(f"{x:.9g}") for x in limits)
            lines.setdefault((rounded, formula(systems[len(systems) // 2], m)), []).append(m.name)
    return tuple(
        Theory("largest stable timestep", text, limits, values, tuple(names)) for (limits, text), names in lines.items()
    )
