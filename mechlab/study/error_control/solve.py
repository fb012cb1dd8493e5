"""A scene solved to a stated error: the method and its sharpness are chosen, the error is estimated and checked."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.initial import initial_state
from mechlab.experiment.scene import Scene
from mechlab.mechanism.structure import structure
from mechlab.study.design import Design
from mechlab.study.error_control.batch import BatchTree
from mechlab.study.error_control.by_energy import by_energy
from mechlab.study.error_control.by_hinge import by_hinge
from mechlab.study.error_control.by_ladders import by_ladders
from mechlab.study.error_control.check_method import Checker
from mechlab.study.error_control.conservative import OneJoint, potential, why_not
from mechlab.study.error_control.judged import Asked
from mechlab.study.error_control.measure import Measure
from mechlab.study.error_control.meter import Meter
from mechlab.study.error_control.result import Result
from mechlab.study.error_control.rows import BatchRows
from mechlab.study.error_control.rules import RULES
from mechlab.study.error_control.verdict import LOW
from mechlab.study.methods import Problem


def solve_to(design: Design, scene: Scene | str | None, max_error: float, outputs: int = 100) -> Result:
    """The scene of a design at `outputs` + 1 even times with an error of at most `max_error` [m or rad].

    Raises MechlabError for an error that is not positive, NoSolution when no method gets to the end at all.
    """
    if not (math.isfinite(max_error) and max_error > 0.0):
        raise MechlabError(f"max_error: expected a number > 0, got {max_error!r}.")
    lived = design
    if not isinstance(scene, Scene):
        lived = design.for_scene(scene)
        scene = lived.scene(scene)
    problem = Problem(lived, scene, outputs)
    m = problem.mechanism
    tree = BatchTree(m) if all(j.nv == 1 for j in m.joints) else None
    measure = Measure(problem, tree)
    why = why_not(m, scene)
    freedoms = structure(m).freedoms if m.loops or m.relations else m.nv
    if freedoms != 1:
        why = f"{freedoms} degrees of freedom"
    if not why and tree is not None:
        meter = Meter()
        try:
            found = _as_a_whole(problem, measure, max_error, tree, meter)
        except NoSolution as cause:
            why = str(cause)
        else:
            if found.reached or found.estimate < RULES.floor:
                return found
            other = by_ladders(
                problem, measure, max_error, freedoms, f"{found.method} stays at {found.estimate:.2g}", meter
            )
            best = other if other.reached or other.estimate < found.estimate else found
            return replace(best, cpu_s=other.cpu_s)
    return by_ladders(problem, measure, max_error, freedoms, why, Meter())


def _as_a_whole(problem: Problem, measure: Measure, max_error: float, tree: BatchTree, meter: Meter) -> Result:
    """One freedom under forces of position alone: in closed form, else by its energy. Raises NoSolution where neither does."""
    with meter.building():
        q0, v0 = initial_state(problem.mechanism, problem.scene)
        energies, rows = potential(tree, problem.scene), BatchRows(tree)
        t = np.linspace(0.0, problem.scene.duration, problem.outputs + 1)
        checker = Checker(problem, "one_freedom", 0.0, max_error < LOW)
        asked = Asked(problem, measure, max_error, t, q0, v0, checker, meter)
    if isinstance(energies, OneJoint) and not rows.count:
        try:
            return by_hinge(asked, energies)
        except NoSolution:
            pass  # other forces, or a motion without a period
    return by_energy(asked, tree, rows, energies)
