"""States between the steps of a smooth motion: the quintic through positions, rates and accelerations, the cubic through rates and
accelerations, closed again.

Steps may be longer than the distance of the outputs. The error of the quintic falls with the sixth power of the step, that of the
cubic with the fourth; it is seen by leaving out every second node, and BETWEEN of that change is counted.
"""

from __future__ import annotations

from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.clock import spent_on
from mechlab.engines.protocol import available, engine
from mechlab.experiment.laws import applied_force
from mechlab.experiment.laws.compiled import CompiledLaws
from mechlab.experiment.scene import Scene
from mechlab.experiment.tree_plant import TreePlant
from mechlab.lab.accuracy.measure import largest
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.batch_dynamics import WIDE, BatchDynamics
from mechlab.mechanism.free_directions import free_directions
from mechlab.mechanism.geometry import Array, quaternion_products
from mechlab.mechanism.kinematics import unit_quaternions
from mechlab.mechanism.many_poses import moved
from mechlab.mechanism.many_states import ManyStates
from mechlab.mechanism.parts import Joint, Shaft
from mechlab.mechanism.small_systems import solve_positive
from mechlab.mechanism.state_rows import state_rows

BETWEEN = 0.125
"""Error of interpolation between the states, over its change when every second state is left out."""
SOFTENED = 1e-9
"""Share of the largest element of J J^T added to its diagonal: redundant rows leave it regular."""
CLOSINGS, SETTLED = 4, 1e-6
"""Most steps of closing, and the gap [m, rad] from which a step, whose error is of second order, is the last: the Jacobian of that pose
serves the rates too."""
OF_VALUES_AND_RATES = frozenset(
    {"constant", "harmonic", "servo", "viscous", "viscous_between", "motor", "dc_motor", "table"}
)
"""Kinds of laws that ask a plant for nothing else."""


@dataclass(frozen=True)
class DenseStates:
    """q (n, nq), v (n, nv) at n times; near_q, near_v: moved by what interpolation and closing may have changed: BETWEEN of the
    change when every second node is left out, and all that closing them has moved. a (n, nv), forces (n,) of joints and shafts: the
    accelerations and what laws act with, quintic splines through those at the nodes."""

    q: Array
    v: Array
    near_q: Array
    near_v: Array
    a: Array
    forces: dict[str, Array]


def law_forces(m: Mechanism, scene: Scene, t: Array, q: Array, v: Array) -> dict[str, Array]:
    """Joint or shaft -> (n,) force of the laws at states q (n, nq), v (n, nv) at times t (n,)."""
    if not scene.laws:
        return {}
    if all(law.kind == "constant" for law in scene.laws):
        always = applied_force(m, scene.laws, 0.0, TreePlant(m))[1]
        return {name: np.full(len(t), x) for name, x in always.items()}
    laws = CompiledLaws(m, scene.laws)
    if not laws.at_once:
        return _one_by_one(m, laws, t, q, v)[0]
    dynamics, made = _dynamics(m), []
    for b in dynamics.blocks(len(t)):
        made.append(laws.many(t[b], q[b], v[b], partial(dynamics.equations, q[b], v[b]))[0])
    forces = np.concatenate(made)
    return dict(zip(laws.targets, _completed(m, laws, t, q, v, forces, forces).T, strict=True))


def driven(m: Mechanism, scene: Scene, t: Array, q: Array, v: Array) -> tuple[dict[str, Array], Array]:
    """`law_forces`, and (n, nv) accelerations under them: rigid dynamics, without dry friction."""
    laws, dynamics = CompiledLaws(m, scene.laws), _dynamics(m)
    named: dict[str, Array] = {}
    pushes: Array | None = None
    if not laws.at_once:
        named, pushes = _one_by_one(m, laws, t, q, v)
    found, forces = [], []
    for b in dynamics.blocks(len(t)):
        at = dynamics.equations(q[b], v[b])
        if pushes is not None:
            found.append(at.accelerations(pushes[b]))
            continue
        now, push = laws.many(t[b], q[b], v[b], lambda at=at: at)  # type: ignore[misc]
        forces.append(_completed(m, laws, t[b], q[b], v[b], now, push))
        found.append(at.accelerations(push))
    if pushes is None:
        named = dict(zip(laws.targets, np.concatenate(forces).T, strict=True))
    return named, np.concatenate(found)


def _completed(m: Mechanism, laws: CompiledLaws, t: Array, q: Array, v: Array, forces: Array, pushes: Array) -> Array:
    """The forces (n, targets), with those that are not known yet from the states one by one; pushes (n, nv) likewise, in place."""
    left = np.flatnonzero(~np.isfinite(forces).all(axis=1))
    if len(left):
        named, more = _one_by_one(m, laws, t[left], q[left], v[left])
        if pushes is not forces:
            pushes[left] = more
        forces[left] = np.stack(list(named.values()), axis=1)
    return forces


def _one_by_one(m: Mechanism, laws: CompiledLaws, t: Array, q: Array, v: Array) -> tuple[dict[str, Array], Array]:
    """`law_forces`, and (n, nv) generalized forces, by a call of the laws for each state."""
    # most laws see values and rates alone; those that ask for the dynamics get it ten times faster from Pinocchio
    simple = all(law.kind in OF_VALUES_AND_RATES for law in laws.laws)
    plant: Any = TreePlant(m) if simple or available("pinocchio") else engine("pinocchio").plant(m)
    made = []
    for k, x in enumerate(t.tolist()):
        laws.put(x, q[k], v[k])
        made.append(laws.forces(x, plant.set(q[k], v[k], x)))
    forces = np.zeros((len(t), len(laws.targets)))
    for row, (x, _) in zip(forces, made, strict=True):
        row[: len(x)] = x  # a law may have come to another joint later on
    return dict(zip(laws.targets, forces.T, strict=True)), np.array([x for _, x in made])


@lru_cache(maxsize=8)
def _dynamics(m: Mechanism) -> BatchDynamics:
    return BatchDynamics(m)


def dense_states(m: Mechanism, scene: Scene, nodes: Array, q: Array, v: Array, t: Array) -> DenseStates:
    """The motion q (k, nv), v (k, nv) at the nodes (k,), k odd, at times t (n,)."""
    with spent_on("imports"):
        from scipy.interpolate import make_interp_spline
    as_is, (q, v) = (q, v), closed_states(m, q, v)
    forces, a = driven(m, scene, nodes, q, v)
    every, second = (interpolated(m, nodes[::k], q[::k], v[::k], a[::k], t) for k in (1, 2))
    closed = closed_states(m, *every)
    near_q, near_v = (
        x + BETWEEN * (less - x) + (all_ - x) + between_nodes(nodes, raw - node, t)
        for x, less, all_, raw, node in zip(closed, second, every, as_is, (q, v), strict=True)
    )
    between = np.asarray(make_interp_spline(nodes, np.column_stack([a, *forces.values()]), k=5)(t))
    return DenseStates(*closed, near_q, near_v, between[:, : m.nv], dict(zip(forces, between[:, m.nv :].T, strict=True)))


def interpolated(m: Mechanism, nodes: Array, q: Array, v: Array, a: Array, t: Array) -> tuple[Array, Array]:
    """q (n, nq), v (n, nv) at times t (n,) between nodes (k,): the quintics through q, v, a; of the rates the cubics through v, a, not
    the slope of the quintics, in which the errors of two positions appear divided by the step. Quaternions w are interpolated as
    four numbers with the rates 1/2 w o, 1/2 w b - 1/4 |o|^2 w, where o and b are the angular velocity and its rate."""
    if m.nq == m.nv:
        return quintic(nodes, q, v, a, t), cubic(nodes, v, a, t)
    dq, ddq = np.empty_like(q), np.empty_like(q)
    dq[:, m.q_columns], ddq[:, m.q_columns] = v, a
    for joint in m.joints:
        if joint.kind == "spherical":
            qs, vs = m.q_slice[joint.name], m.v_slice[joint.name]
            zero = np.zeros((len(q), 1))
            spin, bend = (np.hstack([zero, x[:, vs]]) for x in (v, a))
            dq[:, qs] = 0.5 * quaternion_products(q[:, qs], spin)
            ddq[:, qs] = 0.5 * quaternion_products(q[:, qs], bend) - 0.25 * np.sum(spin**2, axis=1, keepdims=True) * q[:, qs]
    return unit_quaternions(m, quintic(nodes, q, dq, ddq, t)), cubic(nodes, v, a, t)


def _cells(nodes: Array, t: Array) -> tuple[NDArray[np.intp], Array, Array]:
    """Number of the cell between nodes (k,) of each time (n,), its length (n, 1), and the place in it, 0 to 1 (n, 1)."""
    k = np.clip(np.searchsorted(nodes, t, side="right") - 1, 0, len(nodes) - 2)
    h = nodes[k + 1] - nodes[k]
    return k, h[:, None], ((t - nodes[k]) / h)[:, None]


def cubic(nodes: Array, x: Array, dx: Array, t: Array) -> Array:
    """(n, m) at times t (n,) of the cubics through values x (k, m) and slopes dx (k, m) at the nodes (k,)."""
    k, h, s = _cells(nodes, t)
    r = 1.0 - s
    near, far = x[k] * (1.0 + 2.0 * s) + h * s * dx[k], x[k + 1] * (1.0 + 2.0 * r) - h * r * dx[k + 1]
    return np.asarray(r * r * near + s * s * far)


def quintic(nodes: Array, x: Array, dx: Array, ddx: Array, t: Array) -> Array:
    """(n, m) at times t (n,) of the quintics through values, slopes and second derivatives (k, m) at the nodes (k,)."""
    k, h, s = _cells(nodes, t)
    r = 1.0 - s
    near = x[k] * (1.0 + s * (3.0 + 6.0 * s)) + h * s * (dx[k] * (1.0 + 3.0 * s) + 0.5 * h * s * ddx[k])
    k = k + 1
    far = x[k] * (1.0 + r * (3.0 + 6.0 * r)) - h * r * (dx[k] * (1.0 + 3.0 * r) - 0.5 * h * r * ddx[k])
    return np.asarray(r**3 * near + s**3 * far)


def between_nodes(nodes: Array, x: Array, t: Array) -> Array:
    """(n, m) at times t (n,) of what is known at the nodes, x (k, m): linear between them."""
    return np.array([np.interp(t, nodes, column) for column in x.T]).T


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


def closed_states(m: Mechanism, q: Array, v: Array) -> tuple[Array, Array]:
    """The nearest closed poses, and the nearest rates that keep them closed."""
    if not m.is_closed:
        return q, v
    rows = state_rows(m)
    for _ in range(CLOSINGS):
        states = ManyStates(m, q)
        residual, jacobian = rows.residual(states), rows.jacobian(states)
        back = _shortest(jacobian, np.stack([residual, (jacobian @ v[..., None])[..., 0]], axis=2))
        q = moved(m, q, -back[..., 0])
        if largest(residual) < SETTLED:
            break
    return q, v - back[..., 1]


def _shortest(jacobian: Array, apart: Array) -> Array:
    """(n, nv, k) the shortest steps that remove residuals (n, rows, k)."""
    at = free_directions(jacobian, apart) if jacobian.shape[2] >= WIDE else None
    if at is not None and at.served.all():
        return at.shortest()
    across = np.swapaxes(jacobian, 1, 2)
    small = jacobian @ across
    soft = SOFTENED * np.max(np.abs(small), axis=(1, 2))[:, None, None] * np.eye(small.shape[1])
    return np.asarray(across @ solve_positive(small + soft, apart))
