"""Steps of large models with MuJoCo's sparse Jacobian, where it is shown to be right.

The files say jacobian="dense", because the sparse factorization of MuJoCo 4.0.0 returns wrong accelerations for some models (its
issue 3767). Dense steps cost the cube of the number of rates. The fault lies in the pattern of the matrix; as long as equalities
are the only constraints that pattern does not change in a run, so that a comparison at a few states decides about all of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np

from mechlab.mechanism.geometry import Array

LARGE = 60
"""Rates up to which dense steps are as fast; MuJoCo's own choice ("auto") draws the line there, too."""
AGREE = 1e-9
"""Relative difference of accelerations below which sparse and dense are the same: rounding is 1e-12, the fault above 1e-3."""
STATES = 3
"""Random states beside the one at hand at which accelerations are compared."""


def sparse_is_right(model: mujoco.MjModel, data: mujoco.MjData) -> bool:
    """Whether steps of a model may use the sparse Jacobian: it is large, equalities are its only constraints, and accelerations
    agree with dense ones at the state of `data` and at random states near it. `data` and the options of the model stay as they are.
    """
    if model.nv <= LARGE or not only_equalities(model) or _has_curves(model):
        return False
    rng = np.random.default_rng(17)
    trial = mujoco.MjData(model)
    shift = np.zeros(model.nv)
    for _ in range(STATES + 1):
        trial.qpos[:], trial.qvel[:] = data.qpos, data.qvel + 10.0 * shift
        mujoco.mj_integratePos(model, trial.qpos, shift, 1.0)
        dense = _acceleration(model, trial, mujoco.mjtJacobian.mjJAC_DENSE)
        sparse = _acceleration(model, trial, mujoco.mjtJacobian.mjJAC_SPARSE)
        if not np.max(np.abs(sparse - dense)) <= AGREE * max(1.0, float(np.max(np.abs(dense)))):
            return False
        shift = 0.1 * rng.standard_normal(model.nv)
    return True


@contextmanager
def sparse_steps(model: mujoco.MjModel, wanted: bool = True) -> Iterator[None]:
    """In this block the model has the sparse Jacobian, if wanted."""
    before = model.opt.jacobian
    if wanted:
        model.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    try:
        yield
    finally:
        model.opt.jacobian = before


def _acceleration(model: mujoco.MjModel, data: mujoco.MjData, kind: mujoco.mjtJacobian) -> Array:
    before = model.opt.jacobian
    model.opt.jacobian = kind
    data.qacc_warmstart[:] = 0.0
    try:
        mujoco.mj_forward(model, data)
    finally:
        model.opt.jacobian = before
    return data.qacc.copy()


def _has_curves(model: mujoco.MjModel) -> bool:
    """Whether the dense rows of curves are written in the middle of a step (`mechlab.engines.mujoco.curve_rows`)."""
    no_islands = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_ISLAND
    return bool(no_islands and np.any(model.eq_type == mujoco.mjtEq.mjEQ_JOINT))


def only_equalities(model: mujoco.MjModel) -> bool:
    """Whether no limit, no dry friction and no contact can ever become a row beside those of the equalities."""
    limited = np.any(model.jnt_limited) or np.any(model.tendon_limited)
    friction = np.any(model.dof_frictionloss) or np.any(model.tendon_frictionloss)
    touching = model.npair > 0 or (np.any(model.geom_contype) and np.any(model.geom_conaffinity))
    return not (limited or friction or touching or model.nflex)
