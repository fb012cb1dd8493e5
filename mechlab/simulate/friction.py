"""The rows of dry friction of a MuJoCo run, sample by sample: which of them only creep."""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.experiment.friction import friction_finding
from mechlab.experiment.health import Finding
from mechlab.simulate.model import MujocoMap

_KINDS = (int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF), int(mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON))
INSIDE = 1.0 - 1e-6
"""A force below this part of its bound is not at it."""


class FrictionWatch:
    """Sees every sample (after mj_forward): the rates of what has dry friction, and whether its force is below its bound: then the
    load could not break it away."""

    def __init__(self, map_: MujocoMap) -> None:
        model, m = map_.model, map_.mechanism
        joints = {int(map_.dof[s.start + k]): name for name, s in m.v_slice.items() for k in range(s.stop - s.start)}
        tendons = {k: name for name, k in map_.tendons.items()} if model.ntendon else {}
        self._rows = [(_KINDS[0], k, joints[k]) for k in np.flatnonzero(model.dof_frictionloss).tolist() if k in joints]
        self._rows += [
            (_KINDS[1], k, tendons[k]) for k in np.flatnonzero(model.tendon_frictionloss).tolist() if k in tendons
        ]
        self.names = tuple(name for *_, name in self._rows)
        self._rates: list[list[float]] = []
        self._standing: list[list[bool]] = []

    def take(self, data: mujoco.MjData) -> None:
        """One sample."""
        if not self._rows:
            return
        rates, standing = [], []
        for kind, k, _ in self._rows:
            found = np.flatnonzero((data.efc_type == kind) & (data.efc_id == k))
            rates.append(float(data.efc_vel[found[0]]) if len(found) else 0.0)
            standing.append(all(abs(data.efc_force[i]) < INSIDE * data.efc_frictionloss[i] for i in found))
        self._rates.append(rates)
        self._standing.append(standing)

    def finding(self, t: list[float], tolerance: float, timestep: float) -> Finding | None:
        """The finding "friction" of the run; None without dry friction."""
        how = f"is of first order in the step ({timestep:g} s) whatever the integrator, and creeps instead of sticking"
        return friction_finding(
            self.names, np.array(t), np.array(self._rates), np.array(self._standing, dtype=bool), tolerance, how
        )
