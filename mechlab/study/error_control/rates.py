"""The fastest rate of a mechanism as it stands: what bounds the steps of an explicit method."""

from __future__ import annotations

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.initial import initial_state
from mechlab.experiment.scene import Scene
from mechlab.mechanism import ConstraintSet, Joint, Mechanism, Shaft, Spring, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import spring_stretch
from mechlab.study.error_control.conservative import scalars

LARGEST = 24
"""Mechanisms with more rates are not linearised: it would cost more than it saves."""


def fastest_rate(mechanism: Mechanism, scene: Scene) -> float:
    """Largest |eigenvalue| [1/s] of the motion at the start of a scene, linearised on the constraints: M a = -C v - K q with
    C, K the sums of c g g^T and k g g^T over all springs and dampers, g the gradient of what they stretch by. What their
    tension adds, and weight and laws, are slow. 0 when unknown."""
    m = mechanism
    acting: list[Joint | Shaft | Spring] = [x for x in (*scalars(m), *m.springs) if x.stiffness or x.damping]
    if m.nv > LARGEST or not acting or any(j.nv != 1 for j in m.joints):
        return 0.0
    try:
        q, v = initial_state(m, scene)
    except MechlabError:
        return 0.0
    tree = TreeKinematics(m, q)
    free = _null(ConstraintSet(m).jacobian(tree), m.nv)
    stretch = np.array([_gradient(tree, x) for x in acting]) @ free
    mass = free.T @ tree.mass_matrix() @ free
    n = free.shape[1]
    system = np.zeros((2 * n, 2 * n))
    system[:n, n:] = np.eye(n)
    for columns, sizes in (
        (slice(0, n), [x.stiffness for x in acting]),
        (slice(n, None), [x.damping for x in acting]),
    ):
        system[n:, columns] = -np.linalg.lstsq(mass, (stretch.T * sizes) @ stretch, rcond=1e-12)[0]
    return float(np.max(np.abs(np.linalg.eigvals(system)), initial=0.0))


def _gradient(tree: TreeKinematics, x: Joint | Shaft | Spring) -> Array:
    """(nv,) of the stretch of a spring: of a joint or shaft, or of the distance between two points."""
    if not isinstance(x, Spring):
        return tree.mechanism.row(x.name)
    a, b, length, _ = spring_stretch(tree, x)
    if length == 0.0:
        return np.zeros(tree.mechanism.nv)
    return np.asarray((b - a) / length @ (tree.jacobian(x.body_b, b)[:3] - tree.jacobian(x.body_a, a)[:3]))


def _null(rows: Array, nv: int) -> Array:
    """(nv, k) basis of what the rows leave free."""
    if not len(rows):
        return np.eye(nv)
    _, sizes, vectors = np.linalg.svd(rows)
    return np.asarray(vectors[int(np.sum(sizes > 1e-9 * sizes[0])) :].T)
