"""The constraint rows of `Closure` for laws, at the price of a few calls of the engine: J from its own arrays, dJ/dt v by its own
recursion.

    connect, and the offset of a weld     efc_J, as it is
    rotation of a weld                    the axes of all rates that move one of the two bodies alone (cdof)
    joint                                 as in `Closure`
    tendon                                efc_J; a spatial one has b = (|d'|^2 - d_length'^2) / length + e b_12 (see `Closure`)

b_12 is the relative acceleration of the two sites for qacc = 0, by mj_rnePostConstraint. Signs are those of efc_J: first minus second
site. The rows are compared with those of `Closure` when they are made, and are not used where they differ. Equalities that the engine
drops, because no motion can violate them, have no rows.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.engines.mujoco.closure import Closure, joint_row
from mechlab.mechanism.geometry import Array

SITE = int(mujoco.mjtObj.mjOBJ_SITE)
SAME = 1e-9
"""Largest difference from the rows of `Closure`, relative to their size: rounding is 1e-14."""


class EngineRows:
    """Rows of the equality constraints of a dense model that the engine has at an evaluated state, in its order."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, closure: Closure) -> None:
        self.model = model
        self._kept = np.zeros(model.nv)
        self._sites: list[int] = []
        self._joints: list[tuple[int, int]] = []
        self._distances: list[tuple[int, int, int, int, int]] = []
        self._turning: list[tuple[slice, Array]] = []
        places: list[tuple[int, int]] = []  # row of b, and the number of the acceleration of the first site
        self._order: list[int] = []
        self._signs: list[float] = []
        at = 0
        self._equalities = data.efc_id[: data.ne].tobytes()
        for k in dict.fromkeys(data.efc_id[: data.ne].tolist()):
            rows = closure.slices[k]
            count = rows.stop - rows.start
            self._order += range(rows.start, rows.stop)
            joint = model.eq_type[k] == mujoco.mjtEq.mjEQ_JOINT
            tendon = joint or model.eq_type[k] == mujoco.mjtEq.mjEQ_TENDON
            self._signs += [1.0 if tendon else -1.0] * count
            if joint:
                self._joints.append((at, k))
            first, ends = 6 * len(self._sites), closure.ends_of_distance(k)
            if not tendon:
                one, two = int(model.eq_obj1id[k]), int(model.eq_obj2id[k])
                # the engine gives the angular acceleration first
                places += [(at + i, first + 3 + i) for i in range(3)]
                if count == 6:
                    places += [(at + 3 + i, first + i) for i in range(3)]
                    self._turning.append((slice(at + 3, at + 6), _moving(model, one) - _moving(model, two)))
                self._sites += [one, two]
            elif ends is not None:
                self._distances.append((at, int(model.eq_obj1id[k]), len(self._sites), *ends))
                self._sites += ends
            at += count
        self.count = at
        self._found = np.zeros((len(self._sites), 6))
        self._flat, self._calls = self._found.ravel(), list(zip(self._sites, self._found, strict=True))
        self._differences = np.zeros((at, self._found.size))  # first site minus second
        for row, number in places:
            self._differences[row, number], self._differences[row, number + 6] = 1.0, -1.0
        self._speeds = np.zeros((2, 6))

    def agree(self, data: mujoco.MjData, closure: Closure) -> bool:
        """Whether they are those of `closure` at an evaluated state."""
        mine, other = self.rows(data), closure.rows(data)
        dropped = np.setdiff1d(np.arange(len(other[0])), self._order)
        if mine is None or any(np.abs(x[dropped]).max(initial=0.0) > SAME for x in other):
            return False
        signs = np.array(self._signs)
        wanted = signs[:, None] * other[0][self._order], signs * other[1][self._order]
        size = [max(1.0, float(np.abs(b).max(initial=0.0))) for b in wanted]
        return all(np.abs(a - b).max(initial=0.0) <= SAME * n for a, b, n in zip(mine, wanted, size, strict=True))

    def rows(self, data: mujoco.MjData) -> tuple[Array, Array] | None:
        """(rows, engine nv) J and (rows,) b; None where the engine has other rows now. See `Closure.rows` for what must be evaluated."""
        nv, count = self.model.nv, self.count
        if data.ne != count or data.efc_id[:count].tobytes() != self._equalities:
            return None
        jacobian = data.efc_J[: count * nv].reshape(count, nv).copy()
        if self._turning:
            axes = data.cdof[:, :3].T
            for turn, moved_alone in self._turning:
                np.multiply(axes, moved_alone, jacobian[turn])
        bias = self._bias(data) if self._calls else np.zeros(count)
        for row, equality in self._joints:
            jacobian[row], bias[row] = joint_row(self.model, data, equality)
        return jacobian, bias

    def _bias(self, data: mujoco.MjData) -> Array:
        model, kept, qacc, acceleration = self.model, self._kept, data.qacc, mujoco.mj_objectAcceleration
        kept[:] = qacc  # those of an evaluated state may still be read
        qacc[:] = 0.0
        mujoco.mj_rnePostConstraint(model, data)
        qacc[:] = kept
        for site, out in self._calls:
            acceleration(model, data, SITE, site, out, 0)
        bias: Array = self._differences.dot(self._flat)
        for row, tendon, k, a, b in self._distances:
            one, two = self._speeds
            mujoco.mj_objectVelocity(model, data, SITE, a, one, 0)
            mujoco.mj_objectVelocity(model, data, SITE, b, two, 0)
            speed, between = one[3:] - two[3:], data.site_xpos[a] - data.site_xpos[b]
            change = self._found[k, 3:] - self._found[k + 1, 3:]
            length, along = float(data.ten_length[tendon]), float(data.ten_velocity[tendon])
            bias[row] = (float(speed.dot(speed)) - along * along + float(between.dot(change))) / length
        return bias


def _moving(model: mujoco.MjModel, site: int) -> Array:
    """(nv,) 1 for the rates that move the body of a site."""
    out = np.zeros(model.nv)
    body = int(model.site_bodyid[site])
    while body:
        out[model.body_dofadr[body] : model.body_dofadr[body] + model.body_dofnum[body]] = 1.0
        body = int(model.body_parentid[body])
    return out
