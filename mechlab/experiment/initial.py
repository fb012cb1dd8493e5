"""The state a scene starts from: given values and rates, and everything else from closure."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.scene import Scene
from mechlab.mechanism.assembly import Assembly, close
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism

PATH_STEPS = 10


def initial_state(mechanism: Mechanism, scene: Scene) -> tuple[Array, Array]:
    """Coordinates q (nq,) and rates v (nv,) at t = 0, on all constraints.

    `scene.initial` (physical values of joints or shafts) is approached from the reference pose by path continuation, so
    the assembly mode of the reference is kept. `scene.initial_rates` are met exactly, the other rates are the smallest
    ones that the constraints allow. Raises MechlabError for an unknown name, NoSolution when the pose does not close or
    the rates contradict the constraints, naming what stays open.
    """
    what = f"{mechanism.name}, scene {scene.name!r}"
    q = initial_pose(mechanism, scene.initial, what)
    return q, initial_rates(mechanism, q, scene.initial_rates, what)


def initial_pose(mechanism: Mechanism, values: Mapping[str, float], what: str) -> Array:
    """(nq,) closed coordinates that give the joints or shafts in `values` their physical values."""
    q = mechanism.reference()
    _finite(values, what, "initial value")
    if all(float(mechanism.value(name, q)) == x for name, x in values.items()):
        return q
    found = _closed(mechanism, tuple(values.items()))
    if found.closed:
        return found.q.copy()
    tree, constraints = TreeKinematics(mechanism, found.q), ConstraintSet(mechanism)
    open_ends = [
        f"{n} = {float(mechanism.value(n, found.q)):.6g} instead of {x:.6g}"
        for n, x in values.items()
        if abs(float(mechanism.value(n, found.q)) - x) > 1e-9
    ]
    residual = np.abs(constraints.residual(tree))
    if len(residual) and residual.max() > 1e-9:
        k = int(np.argmax(residual))
        open_ends.append(f"{constraints.rows[k]} open by {residual[k]:.3g}")
    raise NoSolution(
        f"{what}: the initial pose does not close ({found.status.value}): "
        f"{', '.join(open_ends) or 'another assembly mode'}. "
        "Give fewer initial values, or values nearer the reference pose."
    )


@lru_cache(maxsize=32)
def _closed(mechanism: Mechanism, values: tuple[tuple[str, float], ...]) -> Assembly:
    """The pose with these values; the last ones are kept, for studies that run one scene many times."""
    return close(mechanism, None, dict(values), steps=PATH_STEPS)


def initial_rates(mechanism: Mechanism, q: Array, rates: Mapping[str, float], what: str) -> Array:
    """(nv,) smallest rates with J v = 0 and the given rates of joints or shafts."""
    _finite(rates, what, "initial rate")
    names = list(rates)
    rows = np.array([mechanism.row(n) for n in names]).reshape(len(names), mechanism.nv)
    if not any(rates.values()):
        return np.zeros(mechanism.nv)
    constraints = ConstraintSet(mechanism)
    jacobian = constraints.jacobian(TreeKinematics(mechanism, q))
    matrix = np.vstack([jacobian, rows])
    wanted = np.concatenate([np.zeros(len(jacobian)), [float(rates[n]) for n in names]])
    v = np.linalg.lstsq(matrix, wanted, rcond=1e-11)[0]
    gap = np.abs(matrix @ v - wanted)
    if gap.max() > 1e-9 * max(1.0, float(np.abs(wanted).max())):
        k = int(np.argmax(gap))
        culprit = (list(constraints.rows) + names)[k]
        raise NoSolution(
            f"{what}: the initial rates {', '.join(names)} contradict the constraints "
            f"({culprit} is missed by {gap[k]:.3g}). Give as many rates as there are degrees of freedom."
        )
    return np.asarray(v)


def _finite(values: Mapping[str, float], what: str, kind: str) -> None:
    for name, x in values.items():
        if not np.isfinite(x):
            raise MechlabError(f"{what}: {kind} of {name!r}: expected a finite number, got {x!r}.")
