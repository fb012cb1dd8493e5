"""MuJoCo as a witness for questions: assembly by Newton's method on its own kinematics and constraint rows, then rates and
accelerations from its own Jacobians. The numpy kinematics of the Mechanism take no part in the numbers.

What is given and asked (joints, shafts, coordinates of frames) becomes rows over the engine's rates by name (`targets`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.motions import KeptMotions
from mechlab.engines.mujoco.closure import Closure, equality_jacobian
from mechlab.engines.mujoco.model import MujocoMap, to_mujoco
from mechlab.engines.mujoco.targets import Targets
from mechlab.errors import MechlabError, NoSolution
from mechlab.mechanism.assembly import same_mode
from mechlab.mechanism.geometry import Array, axis_rotation, rotation_log
from mechlab.mechanism.kept import LastKept
from mechlab.mechanism.many_rows import NewtonSteps, held_rows
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly, Status, follow, newton
from mechlab.mechanism.structure import generic


class MujocoCloser:
    """The closure equations of a mechanism with given targets, in the engine's coordinates qpos, connectors included; keeps model,
    data and what depends on the names for many solutions. Implements `mechlab.mechanism.warm_start.PoseEquations`."""

    def __init__(self, mechanism: Mechanism, names: Iterable[str]) -> None:
        self.mechanism = mechanism
        self.model, self.data = to_mujoco(mechanism)
        self.map = MujocoMap(mechanism, self.model)
        self.targets = Targets(self.map, names, rates=False)
        self.names = self.targets.names

    def start(self, q: Array) -> Array:
        """(engine nq,) the engine's coordinates of a pose q (nq,)."""
        return self.map.engine_coordinates(q)

    def coordinates(self, x: Array) -> Array:
        """(nq,) of the mechanism."""
        return self.map.coordinates(x)

    def place(self, x: Array) -> None:
        """Move to the engine's coordinates and evaluate positions and constraint rows."""
        self.data.qpos[:] = x
        self.map.curves.place(x)
        mujoco.mj_fwdPosition(self.model, self.data)

    def evaluate(self, q: Array, targets: Sequence[Any]) -> tuple[Array, Array]:
        """(m,) residual of the equality rows, then of the targets, and (m, engine nv) Jacobian at the engine's coordinates q."""
        self.place(q)
        data, count = self.data, int(self.data.ne)  # the engine's equality rows stand first
        residual = np.concatenate([data.efc_pos[:count], self.targets.missing(data, targets)])
        rows = data.efc_J[: count * self.model.nv].reshape(count, self.model.nv)
        return residual, np.concatenate([rows, self.targets.jacobian(data)])

    def residual(self, q: Array, targets: Sequence[Any]) -> Array:
        """(m,) the residual of `evaluate`."""
        return self.evaluate(q, targets)[0]

    def step(self, q: Array, dv: Array) -> Array:
        """The engine's coordinates moved by dv (engine nv,)."""
        out = q.copy()
        mujoco.mj_integratePos(self.model, out, dv, 1.0)
        return out

    @cached_property
    def newton_steps(self) -> NewtonSteps:
        """The steps of these equations, from the rows at a generic pose."""
        x = self.start(generic(self.mechanism)[0])
        self.place(x)
        now = list(self.targets.now(self.data).values())
        held = np.zeros((len(rows := held_rows(self.mechanism, self.names)), self.model.nv))
        held[:, self.map.dof] = rows
        rows = self.evaluate(x, now)[1]
        return NewtonSteps(rows, held, int(self.data.ne))


def kept_closer(mechanism: Mechanism, names: tuple[str, ...]) -> MujocoCloser:
    """A MujocoCloser for these names; the last few of each thread are kept, by identity of the mechanism."""
    return _KEPT.get(MujocoCloser, mechanism, names)


_KEPT = LastKept()
Given = Mapping[str, float | Array]


def assemble(mechanism: Mechanism, given: Given, start: ArrayLike | None = None, steps: int = 10) -> Assembly:
    """Coordinates that close all loops and have the given values.

    given: joints and shafts (physical values), FRAME_x, FRAME_y, FRAME_z [m], FRAME_rotation (3, 3). Newton on the
    engine's own constraint residuals and Jacobian (efc_pos, efc_J) and the gradients of what is given, followed along a path in at
    least `steps` steps from the pose `start` (default: the reference), whose assembly mode is kept. steps = 1: Newton
    from the start, and a status that says so if that met another mode.
    The engine's soft constraints do not matter here: the residual is brought to rounding level. With fewer quantities
    than freedoms the others move as little as they must. Raises MechlabError for an unknown name.
    """
    m = mechanism
    closer = kept_closer(m, tuple(given))
    q0 = m.reference() if start is None else np.asarray(start, dtype=float)
    if q0.shape != (m.nq,):
        raise MechlabError(f"{m.name}: the start has shape {q0.shape}, expected ({m.nq},).")
    end = [_checked(m, name, value) for name, value in given.items()]
    first = closer.start(q0)
    closer.place(first)
    begin = list(closer.targets.now(closer.data).values())

    def evaluate(qpos: Array, s: float) -> tuple[Array, Array]:
        return closer.evaluate(qpos, [_between(a, b, s) for a, b in zip(begin, end, strict=True)])

    if steps > 1:
        found = follow(evaluate, closer.step, first, steps=steps)
    else:
        found = newton(lambda x: evaluate(x, 1.0), closer.step, first)
    found = replace(found, q=closer.coordinates(found.q))
    scalars = [name for name in given if name in m.scalar_names]
    if found.closed and len(scalars) == len(given) and not same_mode(m, q0, found.q, scalars):
        return replace(found, status=Status.WRONG_MODE)
    return found


class MujocoState:
    """A mechanism on MuJoCo at one state, in the engine's coordinates and rates, connectors included; keeps model and data.
    Implements `mechlab.engines.motions.KeptState`."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.model, self.data = to_mujoco(mechanism)
        self.map = MujocoMap(mechanism, self.model)
        self.closure = Closure(self.model)
        self._targets: dict[tuple[str, ...], Targets] = {}

    def start(self, q: Array) -> Array:
        """(engine nq,) the engine's coordinates of a pose q (nq,)."""
        return self.map.engine_coordinates(q)

    def place(self, x: Array) -> None:
        """Move to the engine's coordinates at rest."""
        self.move(x, np.zeros(self.model.nv))

    def move(self, x: Array, u: Array) -> None:
        """Move to the engine's coordinates and rates."""
        self.data.qpos[:], self.data.qvel[:] = x, u
        self.map.curves.place(x)
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)

    def at(self, q: ArrayLike, v: ArrayLike | None) -> MujocoState:
        """Moved to coordinates q (nq,) and rates v (nv,) of the mechanism. Raises MechlabError for a wrong shape."""
        m = self.mechanism
        q, v = np.asarray(q, dtype=float), np.zeros(m.nv) if v is None else np.asarray(v, dtype=float)
        if q.shape != (m.nq,) or v.shape != (m.nv,):
            raise MechlabError(f"{m.name}: shapes {q.shape}, {v.shape} of q, v; expected ({m.nq},), ({m.nv},).")
        x = self.start(q)
        self.move(x, self.map.engine_rates(x, v))
        return self

    def targets(self, names: Sequence[str]) -> Targets:
        """Rows and biases of the names."""
        key = tuple(names)
        if key not in self._targets:
            self._targets[key] = Targets(self.map, key, rates=True)
        return self._targets[key]

    def rate_rows(self, names: Sequence[str]) -> Array:
        """(m, engine nv) rows of the engine's equalities, then of the names."""
        return np.concatenate([equality_jacobian(self.model, self.data), self.targets(names).jacobian(self.data)])

    def accel_rows(self, names: Sequence[str]) -> tuple[Array, Array]:
        """(m, engine nv) rows and (m,) dJ/dt v, exact, from mj_jacDot (see `Closure`)."""
        jacobian, bias = self.closure.rows(self.data)
        targets = self.targets(names)
        return np.concatenate([jacobian, targets.jacobian(self.data)]), np.concatenate([bias, targets.bias(self.data)])

    def frame(self, name: str) -> tuple[Array, Array, Array, Array]:
        """Pose, velocity, Jacobian and dJ/dt v of a Frame."""
        model, data, site = self.model, self.data, self.map.site(name)
        body = int(model.site_bodyid[site])
        jacobian, change = np.zeros((6, model.nv)), np.zeros((6, model.nv))
        mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], site)
        mujoco.mj_jacDot(model, data, change[:3], change[3:], data.site_xpos[site], body)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = data.site_xmat[site].reshape(3, 3), data.site_xpos[site]
        return pose, jacobian @ data.qvel, jacobian, change @ data.qvel

    def rates(self, u: Array) -> Array:
        """(..., nv) of the mechanism."""
        return self.map.rates(u)


_STATES, _MOTIONS = LastKept(), LastKept()


def kept_state(mechanism: Mechanism) -> MujocoState:
    """A MujocoState; the last few of each thread are kept, by identity of the mechanism."""
    return _STATES.get(MujocoState, mechanism)


def kept_motions(mechanism: Mechanism) -> KeptMotions:
    """Motions at many poses; the last few of each thread are kept."""
    return _MOTIONS.get(lambda m: KeptMotions(kept_state(m)), mechanism)


def rates(mechanism: Mechanism, q: ArrayLike, given: Mapping[str, float]) -> Array:
    """(nv,) rates that keep all constraints at the pose q (nq,) and have the `given` ones, from MuJoCo's Jacobians.

    given: rates of joints and shafts, FRAME_x FRAME_y FRAME_z [m/s], FRAME_wx FRAME_wy FRAME_wz [rad/s]; the smallest
    when they do not fix the motion. Raises NoSolution when they contradict the constraints (as at a singular pose).
    """
    state = kept_state(mechanism).at(q, None)
    matrix = state.rate_rows(tuple(given))
    wanted = np.concatenate([np.zeros(len(matrix) - len(given)), [float(x) for x in given.values()]])
    return state.rates(_solved(mechanism, matrix, wanted, "rates", tuple(given)))


def accelerations_of(mechanism: Mechanism, q: ArrayLike, v: ArrayLike, given: Mapping[str, float]) -> Array:
    """(nv,) accelerations that keep all constraints at the pose q (nq,) and rates v (nv,) and have the `given` ones.

    given: as of `rates`, second derivatives. dJ/dt v is exact, from mj_jacDot (see `Closure`). Raises NoSolution when
    the given ones contradict the constraints.
    """
    state = kept_state(mechanism).at(q, v)
    matrix, bias = state.accel_rows(tuple(given))
    wanted = np.concatenate([np.zeros(len(matrix) - len(given)), [float(x) for x in given.values()]]) - bias
    return state.rates(_solved(mechanism, matrix, wanted, "accelerations", tuple(given)))


def frame_motion(
    mechanism: Mechanism, frame: str, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None
) -> tuple[Array, Array, Array]:
    """Pose (4, 4), velocity (6,) and acceleration (6,) of a Frame by MuJoCo: linear at its origin, then angular, in
    world axes. Rates and accelerations default to zero."""
    mechanism.frame(frame)
    state = kept_state(mechanism).at(q, v)
    pose, velocity, jacobian, acceleration = state.frame(frame)
    if a is not None:
        acceleration = acceleration + jacobian[:, state.map.dof] @ np.asarray(a, dtype=float)
    return pose, velocity, acceleration


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
