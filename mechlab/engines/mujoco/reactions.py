"""Reactions of loops and relations from the engine's constraint forces, and the slip that its softness predicts.

MuJoCo: M a + h = tau + J^T f with J the gradient of its residual. A relation's residual is its tendon length, so f is
the multiplier of the Mechanism's row: with the first coefficient 1 the torque on that joint. A connect or weld measures
site 1 minus site 2, so the force on body b is -f.

A loop with a connector is read where the joint stands: the force that the host passes to the connector, which together
with the body it is welded to is the other side of the loop.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from mechlab.engines.mujoco.model import MujocoMap
from mechlab.engines.mujoco.plant import ExactDynamics
from mechlab.formats.mjcf.write_loops import axis_name, axis_site_names, connector_name, site_names
from mechlab.mechanism.geometry import Array, cross
from mechlab.mechanism.parts import LOOP_ROWS, Loop

FORCES, MOMENTS = ("fx", "fy", "fz"), ("mx", "my", "mz")


@dataclass(frozen=True)
class _Reader:
    loop: Loop
    equalities: tuple[int, ...]
    site_b: int
    connector: int = -1
    on_b: float = 1.0
    lever: tuple[int, int] | None = None


class Reactions:
    """Reads the reactions of all relations and loops at one evaluated state (after mj_forward) of a MjData.

    Channels: RELATION_load, conjugate to the relation's sum [N m, or N: its first joint slides]; LOOP_fx _fy _fz [N]
    and LOOP_mx _my _mz [N m] on body b at its end of the loop, world axes; no moments for spherical loops. LOOP_load
    [N] of a distance loop pushes its ends apart. A mechanism with a distance loop is read by `ExactDynamics`, which
    gives the loads of relations, distance loops and spherical loops. Rows that repeat others share their load equally:
    in an overconstrained mechanism this says how the engine shares it, no more.
    """

    def __init__(self, map_: MujocoMap) -> None:
        self.map, self.model = map_, map_.model
        m = map_.mechanism
        self.relations = tuple(x.name for x in m.relations)
        self.distances = tuple(x.name for x in m.loops if x.kind == "distance")
        kept = ("spherical",) if self.distances else tuple(k for k in LOOP_ROWS if k != "distance")
        self._loops = [self._reader(x) for x in m.loops if x.kind in kept]
        self._exact = ExactDynamics(self.model) if self.distances else None
        self._post = any(r.connector >= 0 for r in self._loops)
        kinds = {j.name: j.kind for j in m.joints}
        self.units: dict[str, str] = {
            f"{x.name}_load": "N" if kinds[x.coefficients[0][0]] == "prismatic" else "N m" for x in m.relations
        }
        self.units |= {f"{name}_load": "N" for name in self.distances}
        for reader in self._loops:
            self.units |= {f"{reader.loop.name}_{k}": "N" for k in FORCES}
            if reader.loop.kind != "spherical":
                self.units |= {f"{reader.loop.name}_{k}": "N m" for k in MOMENTS}
        self.names = tuple(self.units)

    def _reader(self, loop: Loop) -> _Reader:
        site_b = self.map.site(site_names(loop.name)[1])
        found = self.map.equalities[loop.name]
        connector = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, connector_name(loop.name))
        if connector >= 0:
            welded = (int(self.model.eq_obj1id[found[0]]), int(self.model.eq_obj2id[found[0]]))
            return _Reader(loop, found, site_b, connector, 1.0 if site_b in welded else -1.0)
        if loop.kind == "revolute":
            names = [mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_EQUALITY, k) for k in found]
            point, axis = found[names.index(loop.name)], found[names.index(axis_name(loop.name))]
            lever = (site_b, self.map.site(axis_site_names(loop.name)[1]))
            return _Reader(loop, (point, axis), site_b, lever=lever)
        return _Reader(loop, found, site_b)

    def read(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """(nv,) accelerations, and (channels,) reactions in the order of `names`."""
        if self._exact is not None:
            return self._read_exact(self._exact, data)
        if self._post:
            mujoco.mj_rnePostConstraint(self.model, data)
        ids, force = data.efc_id[: data.ne], data.efc_force
        out = [float(np.sum(force[: data.ne][ids == self.map.equalities[name][0]])) for name in self.relations]
        for reader in self._loops:
            f, moment = self._wrench(reader, data, ids, force)
            out += f.tolist()
            if reader.loop.kind != "spherical":
                out += moment.tolist()
        return self.map.rates(data.qacc), np.array(out)

    def _read_exact(self, exact: ExactDynamics, data: mujoco.MjData) -> tuple[Array, Array]:
        acceleration, reaction = exact.solve(data)
        slices = exact.closure.slices
        names = [*self.relations, *self.distances, *(r.loop.name for r in self._loops)]
        parts = [reaction[slices[self.map.equalities[name][0]]] for name in names]
        return self.map.rates(acceleration), np.concatenate(parts)

    def _wrench(self, reader: _Reader, data: mujoco.MjData, ids: Array, force: Array) -> tuple[Array, Array]:
        """Force on body b, and moment about its site of the loop."""
        here = data.site_xpos[reader.site_b]
        if reader.connector >= 0:
            body = reader.connector
            wrench = reader.on_b * data.cfrc_int[body]
            centre = data.subtree_com[self.model.body_rootid[body]]
            return wrench[3:], wrench[:3] + cross(centre - here, wrench[3:])
        rows = [-force[: data.ne][ids == k] for k in reader.equalities]
        if reader.lever is not None:
            arm = data.site_xpos[reader.lever[1]] - here
            return rows[0] + rows[1], cross(arm, rows[1])
        if len(rows[0]) == 6:
            # The residual of the rotation is torquescale x the vector part of a quaternion, in the axes of the sites.
            scale = 0.5 * self.model.eq_data[reader.equalities[0], 10]
            return rows[0][:3], scale * (data.site_xmat[reader.site_b].reshape(3, 3) @ rows[0][3:])
        return rows[0], np.zeros(3)

    def slip(self, data: mujoco.MjData) -> tuple[float, float, float]:
        """Largest |residual| of the relations, the largest one that softness alone predicts at standstill, and the work
        [J] that their soft rows have taken up, sum |r f|: half of it stored, half lost when a load comes on at once.

        A soft row obeys R f = -k d r when the row neither moves nor accelerates, with R = (1 - d) A / d and
        k = 1 / (d^2 tc^2 zeta^2): r = (1 - d) tc^2 zeta^2 A f, A the engine's diagonal estimate of J M^-1 J^T.
        """
        measured = predicted = taken = 0.0
        ids = data.efc_id[: data.ne]
        for name in self.relations:
            for k in np.flatnonzero(ids == self.map.equalities[name][0]):
                stiffness, impedance = data.efc_KBIP[k, 0], data.efc_KBIP[k, 2]
                measured = max(measured, abs(float(data.efc_pos[k])))
                predicted = max(predicted, abs(float(data.efc_R[k] * data.efc_force[k] / (stiffness * impedance))))
                taken += abs(float(data.efc_pos[k] * data.efc_force[k]))
        return measured, predicted, taken
