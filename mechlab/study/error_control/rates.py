"""The fastest rate of a mechanism as it stands: what bounds the steps of an explicit method."""

from __future__ import annotations

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.initial import initial_state
from mechlab.experiment.scene import Scene
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import passive_force
from mechlab.study.error_control.conservative import scalars

LARGEST = 24
"""Mechanisms with more rates are not linearised: it would cost more than it saves."""


def fastest_rate(mechanism: Mechanism, scene: Scene) -> float:
    """Largest |eigenvalue| [1/s] of the motion at the start of a scene, linearised: a = A q + B v on the constraints, by
    central differences of the passive forces (springs and dampers; weight and laws are slow). 0 when unknown."""
    m = mechanism
    springs = any(s.stiffness or s.damping for s in m.springs)
    if m.nv > LARGEST or any(j.nv != 1 for j in m.joints):
        return 0.0
    if not springs and not any(x.stiffness or x.damping for x in scalars(m)):
        return 0.0
    try:
        q, v = initial_state(m, scene)
    except MechlabError:
        return 0.0
    tree = TreeKinematics(m, q)
    rows = ConstraintSet(m).jacobian(tree)
    free = _null(rows, m.nv)
    mass = free.T @ tree.mass_matrix() @ free
    size = 1e-7

    def force(q: Array, v: Array) -> Array:
        return np.asarray(free.T @ passive_force(tree.set(q, v)))

    stiff = np.column_stack([(force(q + size * d, v) - force(q - size * d, v)) / (2.0 * size) for d in free.T])
    damp = np.column_stack([(force(q, v + d) - force(q, v - d)) / 2.0 for d in free.T])
    n = free.shape[1]
    system = np.zeros((2 * n, 2 * n))
    system[:n, n:] = np.eye(n)
    system[n:] = np.linalg.lstsq(mass, np.hstack([stiff, damp]), rcond=1e-12)[0]
    return float(np.max(np.abs(np.linalg.eigvals(system)), initial=0.0))


def _null(rows: Array, nv: int) -> Array:
    """(nv, k) basis of what the rows leave free."""
    if not len(rows):
        return np.eye(nv)
    _, sizes, vectors = np.linalg.svd(rows)
    return np.asarray(vectors[int(np.sum(sizes > 1e-9 * sizes[0])) :].T)
