"""Named quantities of a mechanism as rows over a MuJoCo model's rates: values, gradients, dJ/dt v, from the engine's own kinematics."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import mujoco
import numpy as np

from mechlab.engines.mujoco.model import MujocoMap
from mechlab.errors import unknown
from mechlab.mechanism.geometry import Array, rotation_log

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
        self._plain: tuple[Array, Array] | None = None
        if not self._sites:
            stacked = np.array(list(self._rows.values())).reshape(-1, self.model.nv)
            zeros = np.array([m.zero(n) for n in self.names])
            over_qpos = np.zeros((len(stacked), self.model.nq))
            over_qpos[:, map_.qpos[m.q_columns]] = stacked[:, map_.dof]
            self._plain, self._over_qpos = (stacked, zeros), over_qpos

    def _jacobian(self, data: mujoco.MjData, site: int) -> tuple[Array, Array]:
        linear, angular = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
        mujoco.mj_jacSite(self.model, data, linear, angular, site)
        return linear, angular

    def jacobian(self, data: mujoco.MjData) -> Array:
        """(rows, engine nv) gradients."""
        if self._plain is not None:
            return self._plain[0]
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

    def missing(self, data: mujoco.MjData, wanted: Sequence[Any]) -> Array:
        """(rows,) present minus wanted, in the order of the names; of rotations the rotation vector from wanted to present, in world
        axes."""
        if self._plain is not None:
            return np.asarray(self._over_qpos @ data.qpos + (self._plain[1] - wanted))
        out = [np.zeros(0)]
        for value, target in zip(self.now(data).values(), wanted, strict=True):
            if np.ndim(value) == 2:
                out.append(rotation_log(np.asarray(value) @ np.asarray(target).T))
            else:
                out.append(np.array([float(value) - float(target)]))
        return np.concatenate(out)
