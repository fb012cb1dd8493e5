"""The constraint rows of `Closure` for laws, at the price of a few calls of the engine: J from its own arrays, dJ/dt v by its own
recursion.

    connect, and the offset of a weld     efc_J, as it is
    rotation of a weld                    the axes of all rates that move one of the two bodies alone (cdof)
    tendon                                efc_J; a spatial one has b = (|d'|^2 - d_length'^2) / length + e b_12 (see `Closure`)

b_12 is the relative acceleration of the two sites for qacc = 0, by mj_rnePostConstraint. Signs are those of efc_J: first minus second
site. The rows are compared with those of `Closure` when they are made, and are not used where they differ.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.engines.mujoco.closure import Closure
from mechlab.mechanism.geometry import Array

SITE = int(mujoco.mjtObj.mjOBJ_SITE)
SAME = 1e-9
"""Largest difference from the rows of `Closure`, relative to their size: rounding is 1e-14."""


class EngineRows:
    """Rows of all equality constraints of a dense model, in the order of the engine."""

    def __init__(self, model: mujoco.MjModel, closure: Closure) -> None:
        self.model = model
        self._kept_acceleration = np.zeros(model.nv)
        self._pairs: list[tuple[int, int, slice, slice | None]] = []
        self._distances: list[tuple[int, int, int, int]] = []
        self._turning: list[int] = []
        moved_alone: list[Array] = []
        self._order: list[int] = []
        self._signs: list[float] = []
        at = 0
        for k in range(model.neq):
            rows = closure.slices[k]
            count = rows.stop - rows.start
            self._order += range(rows.start, rows.stop)
            tendon = model.eq_type[k] == mujoco.mjtEq.mjEQ_TENDON
            self._signs += [1.0 if tendon else -1.0] * count
            if not tendon:
                one, two = int(model.eq_obj1id[k]), int(model.eq_obj2id[k])
                turns = slice(at + 3, at + 6) if count == 6 else None
                if turns is not None:
                    self._turning += range(at + 3, at + 6)
                    moved_alone.append(_moving(model, one) - _moving(model, two))
                self._pairs.append((one, two, slice(at, at + 3), turns))
            elif (ends := closure.ends_of_distance(k)) is not None:
                self._distances.append((at, int(model.eq_obj1id[k]), *ends))
            at += count
        self.count = at
        self._alone = np.array(moved_alone).reshape(-1, model.nv, 1)
        self._ends = np.zeros((2, 6))
        self._speeds = np.zeros((2, 6))

    def agree(self, data: mujoco.MjData, closure: Closure) -> bool:
        """Whether they are those of `closure` at an evaluated state."""
        mine, other = self.rows(data), closure.rows(data)
        if mine is None:
            return False
        signs = np.array(self._signs)
        wanted = signs[:, None] * other[0][self._order], signs * other[1][self._order]
        size = [max(1.0, float(np.abs(b).max(initial=0.0))) for b in wanted]
        return all(np.abs(a - b).max(initial=0.0) <= SAME * n for a, b, n in zip(mine, wanted, size, strict=True))

    def rows(self, data: mujoco.MjData) -> tuple[Array, Array] | None:
        """(rows, engine nv) J and (rows,) b; None where the engine has dropped a row. See `Closure.rows` for what must be evaluated."""
        nv, count = self.model.nv, self.count
        if data.ne != count:
            return None
        jacobian = data.efc_J[: count * nv].reshape(count, nv).copy()
        if self._turning:
            jacobian[self._turning] = (self._alone * data.cdof[:, :3]).transpose(0, 2, 1).reshape(-1, nv)
        bias = np.zeros(count)
        if self._pairs or self._distances:
            self._accelerations(data, bias)
        return jacobian, bias

    def _accelerations(self, data: mujoco.MjData, bias: Array) -> None:
        model, (one, two) = self.model, self._ends
        acceleration = mujoco.mj_objectAcceleration
        # the accelerations of an evaluated state may still be read
        kept, qacc = self._kept_acceleration, data.qacc
        kept[:] = qacc
        qacc[:] = 0.0
        mujoco.mj_rnePostConstraint(model, data)
        qacc[:] = kept
        for a, b, shift, turn in self._pairs:
            acceleration(model, data, SITE, a, one, 0)
            acceleration(model, data, SITE, b, two, 0)
            relative = one - two
            bias[shift] = relative[3:]
            if turn is not None:
                bias[turn] = relative[:3]
        for row, tendon, a, b in self._distances:
            acceleration(model, data, SITE, a, one, 0)
            acceleration(model, data, SITE, b, two, 0)
            mujoco.mj_objectVelocity(model, data, SITE, a, self._speeds[0], 0)
            mujoco.mj_objectVelocity(model, data, SITE, b, self._speeds[1], 0)
            change = two[3:] - one[3:]
            speed = self._speeds[1, 3:] - self._speeds[0, 3:]
            between = data.site_xpos[b] - data.site_xpos[a]
            length, along = float(data.ten_length[tendon]), float(data.ten_velocity[tendon])
            bias[row] = (float(speed.dot(speed)) - along * along + float(between.dot(change))) / length


def _moving(model: mujoco.MjModel, site: int) -> Array:
    """(nv,) 1 for the rates that move the body of a site."""
    out = np.zeros(model.nv)
    body = int(model.site_bodyid[site])
    while body:
        out[model.body_dofadr[body] : model.body_dofadr[body] + model.body_dofnum[body]] = 1.0
        body = int(model.body_parentid[body])
    return out
