"""A scene solved to a stated error: the method and its sharpness are chosen, the error is estimated and checked."""

from __future__ import annotations

import math
from dataclasses import replace

from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.initial import initial_state
from mechlab.experiment.scene import Scene
from mechlab.mechanism.structure import structure
from mechlab.study.design import Design
from mechlab.study.error_control.batch import BatchTree
from mechlab.study.error_control.by_energy import ENERGY, by_energy
from mechlab.study.error_control.by_ladders import by_ladders
from mechlab.study.error_control.conservative import why_not
from mechlab.study.error_control.measure import Measure
from mechlab.study.error_control.meter import Meter
from mechlab.study.error_control.result import Result
from mechlab.study.error_control.rows import BatchRows
from mechlab.study.error_control.rules import RULES
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
        q0, v0 = initial_state(m, scene)
        rows = BatchRows(tree)
        meter = Meter()
        try:
            found = by_energy(problem, measure, max_error, tree, rows, q0, v0, meter)
        except NoSolution as cause:
            why = str(cause)
        else:
            if found.reached or found.estimate < RULES.floor:
                return found
            other = by_ladders(problem, measure, max_error, freedoms, f"{ENERGY} stays at {found.estimate:.2g}", meter)
            best = other if other.reached or other.estimate < found.estimate else found
            return replace(best, cpu_s=other.cpu_s)
    return by_ladders(problem, measure, max_error, freedoms, why, Meter())
