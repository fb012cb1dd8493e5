"""Where a run of a model file starts: its first keyframe, else its reference pose; and the joints that start outside their range."""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.mechanism.geometry import Array

SINGLE = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
"""Kinds of joints with one coordinate."""
SLACK = 1e-3
"""Share of the range of a joint by which a start may lie beyond it."""


def reset(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Puts the first keyframe into the data, or the reference pose where there is none."""
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    else:
        mujoco.mj_resetData(model, data)


def start_pose(model: mujoco.MjModel) -> Array:
    """(nq,) coordinates at which a run starts: those of the first keyframe, else qpos0."""
    return np.array(model.key_qpos[0] if model.nkey else model.qpos0)


def start_data(model: mujoco.MjModel, qpos: Array | None = None) -> mujoco.MjData:
    """Data of the start of a run, not evaluated; with other coordinates (nq,) where they are given."""
    data = mujoco.MjData(model)
    reset(model, data)
    if qpos is not None:
        data.qpos[:] = qpos
    return data


def outside_ranges(model: mujoco.MjModel, qpos: Array) -> dict[int, float]:
    """Joint -> how far [rad or m] it lies beyond its range, for those that do by more than SLACK; inf where it is not finite."""
    out = {}
    for j in range(model.njnt):
        if model.jnt_limited[j] and int(model.jnt_type[j]) in SINGLE:
            value, (low, high) = float(qpos[model.jnt_qposadr[j]]), model.jnt_range[j].tolist()
            far = max(low - value, value - high) if np.isfinite(value) else np.inf
            if far > SLACK * (high - low):
                out[j] = far
    return out
