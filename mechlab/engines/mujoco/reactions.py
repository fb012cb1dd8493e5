"""Reactions by MuJoCo: of loops and relations during a run, and what a given motion needs (inverse dynamics).

MuJoCo: M a + h = tau + J^T f with J the gradient of its residual. A relation's residual is its tendon length, so f is the
multiplier of the Mechanism's row: with the first coefficient 1 the torque on that joint. A connect or weld measures site 1
minus site 2, so the force on body b is -f. A loop with a connector is read where the joint stands: the force that the host
passes to the connector, which together with the body it is welded to is the other side of the loop.

Inverse dynamics: accelerations and reactions of hard constraints (`ExactDynamics`) are linear in the drive force, so two
evaluations fix it. The reactions are then put in the place of the engine's own constraint forces, and mj_rnePostConstraint
finds what passes through each joint.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.mujoco.closure import ExactDynamics
from mechlab.engines.mujoco.model import MujocoMap, passive, to_mujoco
from mechlab.engines.state import MotionForces
from mechlab.errors import MechlabError, NoSolution
from mechlab.formats.mjcf.write_loops import axis_name, axis_site_names, connector_name, site_names
from mechlab.mechanism.geometry import Array, cross
from mechlab.mechanism.model import Mechanism
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
        self.units: dict[str, str] = {f"{x.name}_load": "N" if x.coefficients[0][0] in m.slides else "N m" for x in m.relations}
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
        # MuJoCo leaves out a connect whose rows are all zero (a point that no joint moves): it carries nothing
        rows = [r if r.size else np.zeros(3) for r in rows]
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


@dataclass(frozen=True)
class MujocoInverse:
    """drive_force [N m or N]; loops: force (3,) on body b of each spherical loop; joints: force and moment (6,) on each
    body from its parent, about the origin of its last joint, world axes; accelerations (nv,)."""

    drive_force: float
    loops: dict[str, Array]
    joints: dict[str, Array]
    accelerations: Array


class InverseDynamicsSolver:
    """Inverse dynamics of one mechanism with one freedom, for many states. Loops must be spherical.

    Raises MechlabError for a mechanism with loops of other kinds: MuJoCo closes those through bodies of its own.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        other = [x.name for x in mechanism.loops if x.kind != "spherical"]
        if other:
            raise MechlabError(
                f"{mechanism.name}: reactions by MuJoCo are read for spherical loops; {', '.join(other)} are of other "
                "kinds. Use pinocchio."
            )
        self.mechanism = mechanism
        self.model, self.data = to_mujoco(mechanism)
        passive(self.model)
        self.map = MujocoMap(mechanism, self.model)
        self.exact = ExactDynamics(self.model)

    def solve(
        self, q: ArrayLike, v: ArrayLike, drive: str, acceleration: float, load: ArrayLike | None = None
    ) -> MujocoInverse:
        """Drive force and reactions of the state q (nq,), v (nv,) in which `drive` has the acceleration; `load` (nv,)
        generalised forces of loads. Raises NoSolution when the drive cannot make the motion (a limit position)."""
        data, row = self.data, np.zeros(self.model.nv)
        row[self.map.dof] = self.mechanism.row(drive)
        extra = np.zeros(self.model.nv)
        if load is not None:
            extra[self.map.dof] = np.asarray(load, dtype=float)
        data.qpos[:] = self.map.engine_coordinates(np.asarray(q, dtype=float))
        data.qvel[:] = self.map.engine_rates(data.qpos, np.asarray(v, dtype=float))
        got = []
        for force in (0.0, 1.0):
            data.qfrc_applied[:] = extra + force * row
            mujoco.mj_forward(self.model, data)
            a, reaction = self.exact.solve(data)
            got.append((row @ a, a, reaction))
        gain = got[1][0] - got[0][0]
        if not abs(gain) > 1e-12 * max(1.0, float(np.abs(got[1][1]).max())):
            raise NoSolution(f"{self.mechanism.name}: {drive} cannot drive the mechanism in this pose.")
        f = (acceleration - got[0][0]) / gain
        a = got[0][1] + f * (got[1][1] - got[0][1])
        reaction = got[0][2] + f * (got[1][2] - got[0][2])
        return MujocoInverse(
            float(f), self._loops(reaction), self._joints(a, reaction, extra, f * row), self.map.rates(a)
        )

    def _loops(self, reaction: Array) -> dict[str, Array]:
        """Rows of the closure are site 2 minus site 1, and site 2 stands in body b."""
        slices = self.exact.closure.slices
        return {x.name: reaction[slices[self.map.equalities[x.name][0]]] for x in self.mechanism.loops}

    def _joints(self, a: Array, reaction: Array, extra: Array, drive: Array) -> dict[str, Array]:
        """Wrenches through the joints by mj_rnePostConstraint, with the loop forces as external forces on the bodies:
        the engine's own sum over equality rows leaves out tendons and would repeat the soft forces."""
        model, data = self.model, self.data
        data.qacc[:] = a
        data.efc_force[:] = 0.0
        data.xfrc_applied[:] = 0.0
        for loop in self.mechanism.loops:
            force = reaction[self.exact.closure.slices[self.map.equalities[loop.name][0]]]
            for name, side, sign in zip((loop.body_a, loop.body_b), site_names(loop.name), (-1.0, 1.0), strict=True):
                held = self.map.body(name)
                arm = data.site_xpos[self.map.site(side)] - data.xipos[held]
                data.xfrc_applied[held] += np.concatenate([sign * force, cross(arm, sign * force)])
        mujoco.mj_rnePostConstraint(model, data)
        data.xfrc_applied[:] = 0.0
        out: dict[str, Array] = {}
        for body in self.mechanism.bodies:
            if not body.joints:
                continue
            number = self.map.body(body.name)
            here, centre = data.xpos[number], data.subtree_com[model.body_rootid[number]]
            moment, force = data.cfrc_int[number][:3], data.cfrc_int[number][3:]
            out[body.joints[-1].name] = np.concatenate([force, moment + cross(centre - here, force)])
        return out


def motion_forces(
    mechanism: Mechanism, q: Array, v: Array, drive: str, acceleration: float, load: Array
) -> MotionForces:
    """`InverseDynamicsSolver` at states q (n, nq), v (n, nv): the last joint of every body; reactions of relations are
    not read. Raises MechlabError unless all loops are spherical, which transmit no moment."""
    m, solver = mechanism, InverseDynamicsSolver(mechanism)
    found = [solver.solve(q[k], v[k], drive, acceleration, load) for k in range(len(q))]
    loops = {x.name: np.array([np.concatenate([f.loops[x.name], np.zeros(3)]) for f in found]) for x in m.loops}
    joints = {b.joints[-1].name: np.array([f.joints[b.joints[-1].name] for f in found]) for b in m.bodies if b.joints}
    return MotionForces(np.array([f.drive_force for f in found]), loops, joints, {})
