"""MuJoCo as a witness for questions: assembly by Newton's method on its own kinematics and constraint rows, then rates and
accelerations from its own Jacobians. The numpy kinematics of the Mechanism take no part in the numbers.

What is given and asked (joints, shafts, coordinates of frames) becomes rows over the engine's rates by name: `Targets`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.mujoco.closure import Closure, equality_jacobian, equality_rows
from mechlab.engines.mujoco.model import MujocoMap, to_mujoco
from mechlab.errors import MechlabError, NoSolution, unknown
from mechlab.mechanism.assembly import same_mode
from mechlab.mechanism.geometry import Array, axis_rotation, rotation_log
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly, Status, follow, newton

LINEAR = {"x": 0, "y": 1, "z": 2}
ANGULAR = {"wx": 0, "wy": 1, "wz": 2}


class Targets:
    """Rows of named quantities: their values, gradients and dJ/dt v at the state that `data` was evaluated at.

    Names: a joint or shaft (physical value); FRAME_x, FRAME_y, FRAME_z, the position of a frame [m]; for rates and
    accelerations also FRAME_wx, FRAME_wy, FRAME_wz, its angular velocity; for positions also FRAME_rotation, its (3, 3)
    orientation: three rows. All in world axes. Raises MechlabError that lists the names.
    """

    def __init__(self, map_: MujocoMap, names: Iterable[str], rates: bool) -> None:
        self.map, self.model = map_, map_.model
        self.names = tuple(names)
        m = map_.mechanism
        self._rows: dict[str, Array] = {}
        self._sites: dict[str, tuple[int, str]] = {}
        frames = {f.name for f in m.frames}
        suffixes = (*LINEAR, *ANGULAR) if rates else (*LINEAR, "rotation")
        known = {*m.scalar_names, *(f"{f}_{s}" for f in frames for s in suffixes)}
        for name in self.names:
            frame, _, suffix = name.rpartition("_")
            if name in m.scalar_names:
                row = np.zeros(self.model.nv)
                row[map_.dof] = m.row(name)
                self._rows[name] = row
            elif frame in frames and suffix in suffixes:
                self._sites[name] = (map_.site(frame), suffix)
            else:
                raise unknown(f"{m.name}: quantity", name, known)

    def _jacobian(self, data: mujoco.MjData, site: int) -> tuple[Array, Array]:
        linear, angular = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
        mujoco.mj_jacSite(self.model, data, linear, angular, site)
        return linear, angular

    def jacobian(self, data: mujoco.MjData) -> Array:
        """(rows, engine nv) gradients."""
        blocks = [np.zeros((0, self.model.nv))]
        for name in self.names:
            if name in self._rows:
                blocks.append(self._rows[name][None, :])
                continue
            site, suffix = self._sites[name]
            linear, angular = self._jacobian(data, site)
            if suffix == "rotation":
                blocks.append(angular)
            else:
                k = LINEAR.get(suffix)
                blocks.append(linear[[k]] if k is not None else angular[[ANGULAR[suffix]]])
        return np.concatenate(blocks)

    def bias(self, data: mujoco.MjData) -> Array:
        """(rows,) dJ/dt v; rotations have none."""
        out = []
        for name in self.names:
            if name in self._rows:
                out.append(0.0)
                continue
            site, suffix = self._sites[name]
            linear, angular = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
            body = int(self.model.site_bodyid[site])
            mujoco.mj_jacDot(self.model, data, linear, angular, data.site_xpos[site], body)
            k = LINEAR.get(suffix)
            row = linear[k] if k is not None else angular[ANGULAR[suffix]]
            out.append(float(row @ data.qvel))
        return np.array(out)

    def now(self, data: mujoco.MjData) -> dict[str, float | Array]:
        """Present values: numbers, and (3, 3) matrices for rotations."""
        out: dict[str, float | Array] = {}
        q = self.map.coordinates(data.qpos)
        for name in self.names:
            if name in self._rows:
                out[name] = float(self.map.mechanism.value(name, q))
            else:
                site, suffix = self._sites[name]
                if suffix == "rotation":
                    out[name] = data.site_xmat[site].reshape(3, 3).copy()
                else:
                    out[name] = float(data.site_xpos[site, LINEAR[suffix]])
        return out

    def missing(self, data: mujoco.MjData, wanted: dict[str, float | Array]) -> Array:
        """(rows,) present minus wanted; of rotations the rotation vector from wanted to present, in world axes."""
        out = [np.zeros(0)]
        for name, value in self.now(data).items():
            if np.ndim(value) == 2:
                out.append(rotation_log(np.asarray(value) @ np.asarray(wanted[name]).T))
            else:
                out.append(np.array([float(value) - float(wanted[name])]))
        return np.concatenate(out)


Given = Mapping[str, float | Array]


def assemble(mechanism: Mechanism, given: Given, start: ArrayLike | None = None, steps: int = 10) -> Assembly:
    """Coordinates q (nq,) that close all loops and relations and have the `given` quantities, by MuJoCo.

    given: joints and shafts (physical values), FRAME_x FRAME_y FRAME_z [m], FRAME_rotation (3, 3). Newton on the
    engine's residual and Jacobian (efc_pos, efc_J) and the gradients of what is given, followed along a path in at
    least `steps` steps from the pose `start` (default: the reference), whose assembly mode is kept. steps = 1: Newton
    from the start, and a status that says so if that met another mode.
    The engine's soft constraints do not matter here: the residual is brought to rounding level. With fewer quantities
    than freedoms the others move as little as they must. Raises MechlabError for an unknown name.
    """
    m = mechanism
    model, data = to_mujoco(m)
    map_ = MujocoMap(m, model)
    targets = Targets(map_, given, rates=False)
    q0 = m.reference() if start is None else np.asarray(start, dtype=float)
    if q0.shape != (m.nq,):
        raise MechlabError(f"{m.name}: the start has shape {q0.shape}, expected ({m.nq},).")
    end = {name: _checked(m, name, value) for name, value in given.items()}
    first = map_.engine_coordinates(q0)
    data.qpos[:] = first
    mujoco.mj_fwdPosition(model, data)
    begin = targets.now(data)

    def evaluate(qpos: Array, s: float) -> tuple[Array, Array]:
        data.qpos[:] = qpos
        mujoco.mj_fwdPosition(model, data)
        residual, jacobian = equality_rows(model, data)
        wanted = {name: _between(begin[name], end[name], s) for name in end}
        missing = targets.missing(data, wanted)
        return np.concatenate([residual, missing]), np.vstack([jacobian, targets.jacobian(data)])

    def step(qpos: Array, dv: Array) -> Array:
        out = qpos.copy()
        mujoco.mj_integratePos(model, out, dv, 1.0)
        return out

    if steps > 1:
        found = follow(evaluate, step, first, steps=steps)
    else:
        found = newton(lambda x: evaluate(x, 1.0), step, first)
    found = replace(found, q=map_.coordinates(found.q))
    scalars = [name for name in given if name in m.scalar_names]
    if found.closed and len(scalars) == len(given) and not same_mode(m, q0, found.q, scalars):
        return replace(found, status=Status.WRONG_MODE)
    return found


def rates(mechanism: Mechanism, q: ArrayLike, given: Mapping[str, float]) -> Array:
    """(nv,) rates that keep all constraints at the pose q (nq,) and have the `given` ones, from MuJoCo's Jacobians.

    given: rates of joints and shafts, FRAME_x FRAME_y FRAME_z [m/s], FRAME_wx FRAME_wy FRAME_wz [rad/s]; the smallest
    when they do not fix the motion. Raises NoSolution when they contradict the constraints (as at a singular pose).
    """
    model, data, map_ = _at(mechanism, q, None)
    targets = Targets(map_, given, rates=True)
    matrix = np.vstack([equality_jacobian(model, data), targets.jacobian(data)])
    wanted = np.concatenate([np.zeros(len(matrix) - len(given)), [float(x) for x in given.values()]])
    return map_.rates(_solved(mechanism, matrix, wanted, "rates", tuple(given)))


def accelerations_of(mechanism: Mechanism, q: ArrayLike, v: ArrayLike, given: Mapping[str, float]) -> Array:
    """(nv,) accelerations that keep all constraints at the pose q (nq,) and rates v (nv,) and have the `given` ones.

    given: as of `rates`, second derivatives. dJ/dt v is exact, from mj_jacDot (see `Closure`). Raises NoSolution when
    the given ones contradict the constraints.
    """
    model, data, map_ = _at(mechanism, q, v)
    targets = Targets(map_, given, rates=True)
    jacobian, bias = Closure(model).rows(data)
    matrix = np.vstack([jacobian, targets.jacobian(data)])
    wanted = np.concatenate([-bias, [float(x) for x in given.values()] - targets.bias(data)])
    return map_.rates(_solved(mechanism, matrix, wanted, "accelerations", tuple(given)))


def frame_motion(
    mechanism: Mechanism, frame: str, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None
) -> tuple[Array, Array, Array]:
    """Pose (4, 4), velocity (6,) and acceleration (6,) of a Frame by MuJoCo: linear at its origin, then angular, in
    world axes. Rates and accelerations default to zero."""
    mechanism.frame(frame)
    model, data, map_ = _at(mechanism, q, v)
    targets = Targets(map_, [f"{frame}_{s}" for s in ("x", "y", "z", "wx", "wy", "wz")], rates=True)
    jacobian = targets.jacobian(data)
    site = map_.site(frame)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = data.site_xmat[site].reshape(3, 3), data.site_xpos[site]
    acceleration = targets.bias(data)
    if a is not None:
        acceleration = acceleration + jacobian[:, map_.dof] @ np.asarray(a, dtype=float)
    return pose, jacobian @ data.qvel, acceleration


def _at(m: Mechanism, q: ArrayLike, v: ArrayLike | None) -> tuple[mujoco.MjModel, mujoco.MjData, MujocoMap]:
    """A model evaluated at a pose and rates, connectors included."""
    q, v = np.asarray(q, dtype=float), np.zeros(m.nv) if v is None else np.asarray(v, dtype=float)
    if q.shape != (m.nq,) or v.shape != (m.nv,):
        raise MechlabError(f"{m.name}: shapes {q.shape}, {v.shape} of q, v; expected ({m.nq},), ({m.nv},).")
    model, data = to_mujoco(m)
    map_ = MujocoMap(m, model)
    data.qpos[:] = map_.engine_coordinates(q)
    data.qvel[:] = map_.engine_rates(data.qpos, v)
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    return model, data, map_


def _solved(m: Mechanism, matrix: Array, wanted: Array, what: str, names: tuple[str, ...]) -> Array:
    """Smallest solution of a consistent system; raises NoSolution when it is not consistent."""
    x = np.linalg.lstsq(matrix, wanted, rcond=1e-11)[0]
    missed = np.abs(matrix @ x - wanted)
    if missed.max(initial=0.0) > 1e-8 * max(1.0, float(np.abs(wanted).max(initial=0.0))):
        raise NoSolution(
            f"{m.name}: the {what} of {', '.join(names) or 'nothing'} contradict the constraints in this pose "
            f"(missed by {missed.max():.3g}): give as many as there are freedoms, away from singular poses."
        )
    return np.asarray(x)


def _checked(m: Mechanism, name: str, value: float | Array) -> float | Array:
    array = np.asarray(value, dtype=float)
    shape = (3, 3) if name.endswith("_rotation") and name not in m.scalar_names else ()
    if array.shape != shape or not np.all(np.isfinite(array)):
        raise MechlabError(
            f"{m.name}: {name}: expected {'a (3, 3) rotation' if shape else 'a finite number'}, got {value!r}."
        )
    if shape and not np.allclose(array @ array.T, np.eye(3), atol=1e-9, rtol=0.0):
        raise MechlabError(f"{m.name}: {name}: the matrix is no rotation: its rows are not orthonormal.")
    return array if shape else float(array)


def _between(begin: float | Array, end: float | Array, s: float) -> float | Array:
    """Value on the way from begin (s = 0) to end (s = 1), exact at the end; rotations turn about one axis."""
    if np.ndim(end) == 0:
        return float(end) if s == 1.0 else float(begin) + s * (float(end) - float(begin))
    turn = rotation_log(np.asarray(end) @ np.asarray(begin).T)
    angle = float(np.linalg.norm(turn))
    if s == 1.0 or angle < 1e-12:
        return end
    return np.asarray(axis_rotation(turn / angle, s * angle) @ begin)
