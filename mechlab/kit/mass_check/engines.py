"""Masses, poses, mass matrix and forces of a mechanism at a moving state, from the models of numpy, Pinocchio and
MuJoCo."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from mechlab.kit.witness import room
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import passive_force
from mechlab.mechanism.structure import rank


class Share(NamedTuple):
    """A moving mass [kg], its centre (3,) [m], inertia tensor about the centre [kg m2], momentum [kg m/s], and angular
    momentum `spin` about the centre [kg m2/s]; world axes."""

    mass: float
    centre: Array
    tensor: Array
    momentum: Array
    spin: Array


class Reading(NamedTuple):
    """Quantities of a state by one implementation: masses, points of frames, poses of bodies, mass matrix; forces
    h(q, 0) (`still`), h(q, v) (`ahead`), h(q, -v) (`back`); rows: see `_rows`."""

    shares: list[Share]
    points: Array
    poses: dict[str, tuple[Array, Array]]
    matrix: Array
    still: Array
    ahead: Array
    back: Array
    rows: tuple[float, float, int]


def _moving(m: Mechanism) -> list[Any]:
    """Bodies that can move: those with a joint between them and the ground."""
    moves = {"ground": False}
    for b in m.bodies:
        moves[b.name] = bool(b.joints) or moves[b.parent]
    return [b for b in m.bodies if moves[b.name]]


def _places(m: Mechanism, state_of: Any) -> tuple[Array, dict[str, tuple[Array, Array]]]:
    poses = {b.name: state_of.pose(b.name) for b in m.bodies} | {"ground": (np.eye(3), np.zeros(3))}
    points = [poses[f.body][1] + poses[f.body][0] @ f.placement.translation for f in m.frames]
    return np.array(points).reshape(-1, 3), poses


def by_numpy(m: Mechanism, q: Array, v: Array) -> Reading:
    """The quantities by the numpy tree of the Mechanism."""
    tree, rows = TreeKinematics(m, q, v), ConstraintSet(m)
    shares = []
    for b in _moving(m):
        rotation, origin = tree.pose(b.name)
        centre = origin + rotation @ np.array(b.inertia.com)
        tensor, twist = rotation @ b.inertia.matrix() @ rotation.T, tree.velocity(b.name, centre)
        shares.append(Share(b.inertia.mass, centre, tensor, b.inertia.mass * twist[:3], tensor @ twist[3:]))
    jacobian, residual, matrix = rows.jacobian(tree), rows.residual(tree), tree.mass_matrix()
    places = _places(m, tree)
    force = [tree.set(q, s * v).bias_force() - passive_force(tree) for s in (0.0, 1.0, -1.0)]
    return Reading(shares, *places, matrix, force[0], force[1], force[2], _rows(m.nv, jacobian, residual, v))


def by_pinocchio(m: Mechanism, q: Array, v: Array) -> Reading:
    """The quantities by Pinocchio, with the composite inertia and momentum of the whole tree as one mass."""
    solve = room("pinocchio")
    import pinocchio as pin

    kin, plant = solve.PinKinematics(m, q, v), solve.PinPlant(m, q, v)
    data = kin.pin.create_data()
    pin.ccrba(kin.model, data, kin.pin.to_pin(q), v)
    pin.centerOfMass(kin.model, data, kin.pin.to_pin(q))
    share = Share(data.Ig.mass, data.com[0], data.Ig.inertia, data.hg.linear, data.hg.angular)
    rows, force = ConstraintSet(m), [np.array(plant.set(q, s * v).bias()) for s in (0.0, 1.0, -1.0)]
    places, closed = _places(m, kin), _rows(m.nv, rows.jacobian(kin), rows.residual(kin), v)
    return Reading([share], *places, plant.mass_matrix(), force[0], force[1], force[2], closed)


def by_mujoco(m: Mechanism, q: Array, v: Array) -> Reading:
    """The quantities by MuJoCo, from its bodies with their inertial frames; connectors of loops are such bodies."""
    simulate = room("mujoco")
    import mujoco

    from mechlab.engines.mujoco.model import equality_jacobian, passive

    model, data = simulate.to_mujoco(m)
    passive(model)
    view = simulate.MujocoMap(m, model)
    plant = simulate.MujocoPlant(m, model, data, view)
    force = []
    for s in (0.0, -1.0, 1.0):
        data.qpos[:] = view.engine_coordinates(q)
        data.qvel[:] = view.engine_rates(data.qpos, s * v)
        mujoco.mj_forward(model, data)
        force.append(plant.bias())
    shares, twist = [], np.zeros(6)
    for k in range(1, model.nbody):  # connectors, which hold a share of a body's mass, are among them
        if model.body_weldid[k]:
            turned = data.ximat[k].reshape(3, 3)
            tensor = turned @ np.diag(model.body_inertia[k]) @ turned.T
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, k, twist, 0)
            mass, centre = float(model.body_mass[k]), data.xipos[k].copy()
            shares.append(Share(mass, centre, tensor, mass * twist[3:], tensor @ twist[:3]))
    points = np.array([data.site_xpos[view.site(f.name)] for f in m.frames]).reshape(-1, 3)
    poses = {b.name: (data.xmat[view.body(b.name)].reshape(3, 3), data.xpos[view.body(b.name)]) for b in m.bodies}
    equal = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    closed = _rows(model.nv, equality_jacobian(model, data), data.efc_pos[equal], data.qvel)
    return Reading(shares, points, poses, plant.mass_matrix(), force[0], force[2], force[1], closed)


def _rows(nv: int, jacobian: Array, residual: Array, v: Array) -> tuple[float, float, int]:
    """Largest residual of loops and relations, largest rate of a residual, and degrees of freedom."""
    opening, rate = (float(np.max(np.abs(x), initial=0.0)) for x in (residual, jacobian @ v))
    return opening, rate, nv - rank(jacobian)
