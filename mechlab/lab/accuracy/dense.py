"""States between the steps of a smooth motion: the quintic through positions, rates and accelerations, the cubic through rates and
accelerations, closed again.

Steps may be longer than the distance of the outputs. The error of the quintic falls with the sixth power of the step, that of the
cubic with the fourth; it is seen by leaving out every second node, and BETWEEN of that change is counted.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import BPoly

from mechlab.engines.protocol import available, engine
from mechlab.experiment.laws import applied_force
from mechlab.experiment.laws.compiled import CompiledLaws
from mechlab.experiment.scene import Scene
from mechlab.experiment.tree_plant import TreePlant
from mechlab.mechanism import Mechanism
from mechlab.mechanism.batch_dynamics import BatchDynamics
from mechlab.mechanism.batch_tree import BatchRows, BatchTree
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import Joint, Shaft

BETWEEN = 0.125
"""Error of interpolation between the states, over its change when every second state is left out."""
SOFTENED = 1e-9
"""Share of the largest element of J J^T added to its diagonal: redundant rows leave it regular."""
CLOSINGS = 3
OF_VALUES_AND_RATES = frozenset(
    {"constant", "harmonic", "servo", "viscous", "viscous_between", "motor", "dc_motor", "table"}
)
"""Kinds of laws that ask a plant for nothing else."""


@dataclass(frozen=True)
class DenseStates:
    """q (n, nq), v (n, nv) at n times; near_q, near_v: moved by what interpolation and closing may have changed: BETWEEN of the
    change when every second node is left out, and all that closing them has moved."""

    q: Array
    v: Array
    near_q: Array
    near_v: Array


def law_forces(m: Mechanism, scene: Scene, t: Array, q: Array, v: Array) -> tuple[Array, dict[str, Array]]:
    """Of the laws, at states q (n, nq), v (n, nv) at times t (n,): generalised forces (n, nv), and joint or shaft -> (n,) force."""
    if not scene.laws:
        return np.zeros_like(v), {}
    if all(law.kind == "constant" for law in scene.laws):
        always, by_name = applied_force(m, scene.laws, 0.0, TreePlant(m))
        return np.tile(always, (len(t), 1)), {name: np.full(len(t), x) for name, x in by_name.items()}
    # most laws see values and rates alone; those that ask for the dynamics get it ten times faster from Pinocchio
    simple = all(law.kind in OF_VALUES_AND_RATES for law in scene.laws)
    plant = TreePlant(m) if simple or available("pinocchio") else engine("pinocchio").plant(m)
    laws = CompiledLaws(m, scene.laws)
    made = []
    for k, x in enumerate(t.tolist()):
        laws.put(x, q[k], v[k])
        made.append(laws.forces(x, plant.set(q[k], v[k], x)))
    forces = np.zeros((len(t), len(laws.targets)))
    for row, (x, _) in zip(forces, made, strict=True):
        row[: len(x)] = x  # a law may have come to another joint later on
    return np.array([x for _, x in made]), dict(zip(laws.targets, forces.T, strict=True))


def accelerations(m: Mechanism, q: Array, v: Array, forces: Array) -> Array:
    """(n, nv) at states q (n, nq), v (n, nv): rigid dynamics under the forces (n, nv), without dry friction."""
    if all(j.nv == 1 for j in m.joints):
        return _dynamics(m).accelerations(q, v, forces)
    # of ball joints: Pinocchio is twenty times as fast as the numpy tree
    return engine("numpy" if available("pinocchio") else "pinocchio").accelerations(m, q, v, forces)


@lru_cache(maxsize=8)
def _dynamics(m: Mechanism) -> BatchDynamics:
    return BatchDynamics(m)


def dense_states(m: Mechanism, scene: Scene, nodes: Array, q: Array, v: Array, t: Array) -> DenseStates:
    """The motion q (k, nv), v (k, nv) at the nodes (k,), k odd, at times t (n,). For joints of one coordinate."""
    a = accelerations(m, q, v, law_forces(m, scene, nodes, q, v)[0])
    poses, rates = np.stack([q, v, a], axis=1), np.stack([v, a], axis=1)
    # not the slope of the quintic, in which the errors of two positions appear divided by the step
    every, second = ([BPoly.from_derivatives(nodes[::k], x[::k])(t) for x in (poses, rates)] for k in (1, 2))
    closed, fewer = _closed(m, *every), _closed(m, *second)
    near = (x + BETWEEN * (less - x) + (as_is - x) for x, less, as_is in zip(closed, fewer, every, strict=True))
    return DenseStates(*closed, *near)


def with_difference(dense: DenseStates, nodes: Array, dq: Array, dv: Array, t: Array) -> tuple[Array, Array]:
    """The dense states moved by differences dq, dv (k, nv) that are known at the nodes (k,): linear between them."""
    moved = [np.array([np.interp(t, nodes, x) for x in d.T]).T for d in (dq, dv)]
    return dense.q + moved[0], dense.v + moved[1]


def meets_range(m: Mechanism, q: Array) -> bool:
    """Whether a joint or shaft is at the end of its range, or beyond, at one of q (n, nq)."""
    items: list[Joint | Shaft] = [*m.joints, *m.shafts]
    for x in items:
        if x.range is None:
            continue
        values = m.value(x.name, q)
        if values.min() <= x.range[0] or values.max() >= x.range[1]:
            return True
    return False


def _closed(m: Mechanism, q: Array, v: Array) -> tuple[Array, Array]:
    """The nearest closed poses, and the nearest rates that keep them closed."""
    if not m.is_closed:
        return q, v
    rows = BatchRows(BatchTree(m))
    for _ in range(CLOSINGS):
        residual, jacobian = rows.evaluate(q)
        back = _shortest(jacobian)
        q = q - (back @ residual[..., None])[..., 0]
    jacobian = rows.evaluate(q)[1]
    return q, v - (_shortest(jacobian) @ (jacobian @ v[..., None]))[..., 0]


def _shortest(jacobian: Array) -> Array:
    """(n, nv, rows) matrices that take a residual to the shortest step that removes it."""
    across = np.swapaxes(jacobian, 1, 2)
    small = jacobian @ across
    soft = SOFTENED * np.max(np.abs(small), axis=(1, 2))[:, None, None] * np.eye(small.shape[1])
    return np.asarray(across @ np.linalg.inv(small + soft))
