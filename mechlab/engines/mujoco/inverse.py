"""Inverse dynamics by MuJoCo: the drive force of a given motion, and what loops and joints transmit in it.

Accelerations and reactions of hard constraints (`ExactDynamics`) are linear in the drive force, so two evaluations fix
it. The reactions are then laid into the engine's own constraint forces, and mj_rnePostConstraint finds what passes
through each joint.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.mujoco.model import MujocoMap, passive, to_mujoco
from mechlab.engines.mujoco.plant import ExactDynamics
from mechlab.errors import MechlabError, NoSolution
from mechlab.formats.mjcf.write_loops import site_names
from mechlab.mechanism.geometry import Array, cross
from mechlab.mechanism.model import Mechanism


@dataclass(frozen=True)
class MujocoInverse:
    """drive_force [N m or N]; loops: force (3,) on body b of each spherical loop; joints: force and moment (6,) on each
    body from its parent, about the origin of its last joint, world axes; accelerations (nv,)."""

    drive_force: float
    loops: dict[str, Array]
    joints: dict[str, Array]
    accelerations: Array


class InverseDynamics:
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
