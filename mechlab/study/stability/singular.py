"""Map "singularity": timestep against the distance to a singular position, made by the length of one link of each loop.

A mechanism whose drive turns fully is brought near its change point: the length at which it stops turning is found by
bisection, and the map keeps ever less away from it. A mechanism whose own motion passes a singular position (a parallelogram)
is made ever less perfect.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.scene import Scene
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.structure import rank, structure
from mechlab.study.closed_path import ClosedPath, choose_path
from mechlab.study.methods import Problem
from mechlab.study.stability.data import Axis
from mechlab.study.stability.measure import sharp_method
from mechlab.study.stability.plan import Case, Plan, steps_of, usual_methods
from mechlab.study.stability.vary import link_length, shift_loops

DISTANCES = (1e-4, 1e-3, 1e-2, 1e-1)
"""Of the length that is changed."""
TRIED = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6)
CLOSE = 1e-5
DIVISIONS = (3, 5, 8, 13, 21, 34, 55, 89, 144)
LONGEST = 10.0
HALF_WAY = 0.6
"""Of a turn: the crank passes the line of its ground link once on either side."""
SINGULAR = 2e-2
SAMPLES = 200


@dataclass(frozen=True)
class ChangePoint:
    """`shift` [m] of the loops at which the mechanism becomes singular, how that is known, and whether its drive turns
    fully on the near side."""

    shift: float
    text: str
    turns: bool


def plan_singular(case: Case) -> Plan | str:
    """The map, or why there is none."""
    m = case.mechanism
    if not m.loops:
        return "it has no loops: a tree has no singular position"
    if structure(m).freedoms != 1:
        return f"it has {structure(m).freedoms} degrees of freedom; a change point is looked for along one"
    length = link_length(m)
    if length == 0.0:
        return "its loops end at the joints of their bodies: no length can be changed"
    prefer = tuple({**case.scene.initial, **case.scene.initial_rates})
    found: ChangePoint | str = change_point(m, prefer, length) or _on_the_way(case)
    if isinstance(found, str):
        return found
    duration = min(case.scene.duration, LONGEST) * (HALF_WAY if found.turns else 1.0)
    case = replace(case.free, scene=_first_rate(case.free.scene))
    point, side = found, -1.0 if found.shift >= 0 else 1.0

    def problem(y: float) -> Problem:
        return case.problem(shift_loops(m, point.shift + side * y), None, duration)

    values = tuple(length * x for x in DISTANCES)
    return Plan(
        "singularity", "timestep and distance to a singular position",
        Axis("distance to the change point", "m", values, found.text), problem, usual_methods(case),
        steps_of(duration, DIVISIONS), remark=case.remark,
    )  # fmt: skip


def _first_rate(scene: Scene) -> Scene:
    """With one freedom one rate says all; more of them would contradict another length."""
    return replace(scene, initial_rates=dict(list(scene.initial_rates.items())[:1]))


@lru_cache(maxsize=16)
def change_point(mechanism: Mechanism, prefer: tuple[str, ...], length: float) -> ChangePoint | None:
    """The nearest change of length at which the drive no longer turns fully; None for a mechanism that does not turn."""

    try:
        path, turn = choose_path(mechanism, None, prefer)
    except MechlabError:
        return None
    if turn is None:
        return None

    def turns(shift: float) -> bool:
        try:
            return ClosedPath(shift_loops(mechanism, shift), path.coordinate).full_turn() is not None
        except MechlabError:
            return False

    for x in TRIED:
        for sign in (1.0, -1.0):
            far = sign * x * length
            if sign * x > -0.9 and not turns(far):
                near = 0.0
                while abs(far - near) > CLOSE * length:
                    middle = 0.5 * (far + near)
                    near, far = (middle, far) if turns(middle) else (near, middle)
                way = "longer" if far > 0 else "shorter"
                text = f"the link that closes each loop {way} by up to {abs(near):.6g} m: there its drive stops turning"
                return ChangePoint(near, text, True)
    return None


def _on_the_way(case: Case) -> ChangePoint | str:
    """The motion of the scene passes a singular position: the smallest singular value of the rows nearly vanishes."""
    m = case.mechanism
    problem = Problem(case.design, case.scene, SAMPLES)
    try:
        run = sharp_method(problem).run(problem, 1e-8)
    except MechlabError as error:
        return f"no change point was found: {error}"
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    full = structure(m).rank
    least = min(_smallest(constraints.jacobian(tree.set(q)), full) for q in run.q)
    if least > SINGULAR:
        return f"no change of length that was tried stops its drive, and its motion keeps away from singular positions ({least:.2g})"
    return ChangePoint(
        0.0, "links that close the loops shorter by this; as given its motion passes a singular position", False
    )


def _smallest(jacobian: np.ndarray, full: int) -> float:
    """The `full`-th singular value relative to the first; rank of the rows falls where it vanishes."""
    values = np.linalg.svd(jacobian, compute_uv=False)
    return float(values[full - 1] / values[0]) if rank(jacobian) >= full else 0.0
