"""Masses that MuJoCo cannot hold: it works with no number below mjMINVAL = 1e-15 where it divides, moments of inertia among
them, so that a small light part becomes a heavier one without a word."""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.experiment.health import Finding
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.simulate.model import MujocoMap

LIMIT = 1e-6


def floor_finding(map_: MujocoMap, q: Array) -> Finding | None:
    """Finding "engine_masses" (an error) where the engine's mass matrix at q (nq,) is not that of the mechanism; None where
    it is, within LIMIT of sqrt(M_ii M_jj), or where connectors that the mechanism lacks carry a part of the masses."""
    if len(map_.other_dof):
        return None
    data = mujoco.MjData(map_.model)
    data.qpos[:] = map_.engine_coordinates(q)
    mujoco.mj_fwdPosition(map_.model, data)
    own = TreeKinematics(map_.mechanism, q).mass_matrix()
    scale = np.sqrt(np.abs(np.diag(own)))
    off = np.abs(map_.mass_matrix(data) - own) / np.where(np.outer(scale, scale) > 0.0, np.outer(scale, scale), 1.0)
    worst = float(np.max(off, initial=0.0))
    if worst <= LIMIT:
        return None
    text = (
        f"MuJoCo's mass matrix is off by {worst:.2g} of its size: a moment of inertia below {mujoco.mjMINVAL:g} kg m2 is too "
        "small for this engine; do not trust this run. Take --engine pinocchio, or other units of length and mass"
    )
    return Finding("engine_masses", worst, LIMIT, "of its size", "error", text)
