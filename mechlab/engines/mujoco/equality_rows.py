"""The equality rows of any MuJoCo model by themselves: residual, Jacobian, names; and a push along what they leave free."""

from __future__ import annotations

import copy

import mujoco
import numpy as np

from mechlab.engines.mujoco.model import constraint_jacobian
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import null_space

PUSH = 1e-3
"""Twice the energy of a push, over weight x size of the model."""
_LETTERS = {mujoco.mjtEq.mjEQ_CONNECT: "xyz", mujoco.mjtEq.mjEQ_WELD: ("x", "y", "z", "rx", "ry", "rz")}
_KINDS = {
    mujoco.mjtEq.mjEQ_CONNECT: "connect", mujoco.mjtEq.mjEQ_WELD: "weld", mujoco.mjtEq.mjEQ_JOINT: "joint equality",
    mujoco.mjtEq.mjEQ_TENDON: "tendon equality",
}  # fmt: skip

Start = tuple[Array, Array, Array]
"""qpos, qvel, ctrl."""


def equality_name(model: mujoco.MjModel, k: int) -> str:
    """The name of an equality, or what it joins where the file gives it none."""
    name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_EQUALITY, k)
    if name:
        return str(name)
    kind = _KINDS.get(mujoco.mjtEq(model.eq_type[k]), "equality")
    object_kind = mujoco.mjtObj(model.eq_objtype[k])
    if model.eq_type[k] == mujoco.mjtEq.mjEQ_JOINT:
        object_kind = mujoco.mjtObj.mjOBJ_JOINT
    elif model.eq_type[k] == mujoco.mjtEq.mjEQ_TENDON:
        object_kind = mujoco.mjtObj.mjOBJ_TENDON
    ends = [int(model.eq_obj1id[k]), int(model.eq_obj2id[k])]
    said = [mujoco.mj_id2name(model, object_kind, e) or f"number {e}" for e in ends if e >= 0]
    return f"{kind} {'-'.join(said)}"


class EqualityRows:
    """Equality rows of a model alone: residual and Jacobian at any qpos; contacts, limits and friction are left out."""

    def __init__(self, model: mujoco.MjModel, qpos: Array) -> None:
        self.model = copy.copy(model)
        bit = mujoco.mjtDisableBit
        self.model.opt.disableflags |= bit.mjDSBL_CONTACT | bit.mjDSBL_LIMIT | bit.mjDSBL_FRICTIONLOSS
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.data = mujoco.MjData(self.model)
        self.start = np.array(qpos)
        self.groups: list[int] = []

    def at(self, qpos: Array) -> tuple[Array, Array]:
        """(rows,) residual and (rows, nv) Jacobian."""
        d = self.data
        d.qpos[:] = qpos
        mujoco.mj_fwdPosition(self.model, d)
        keep = d.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        return np.array(d.efc_pos[keep]), constraint_jacobian(self.model, d)[keep]

    def names(self) -> tuple[str, ...]:
        """Row names at the pose last evaluated; `groups` then numbers those that share an equality and a unit."""
        d, out = self.data, list[str]()
        self.groups = []
        ids = d.efc_id[d.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
        for k in dict.fromkeys(int(i) for i in ids):
            letters = _LETTERS.get(mujoco.mjtEq(self.model.eq_type[k]), "")
            count = int(np.sum(ids == k))
            name = equality_name(self.model, k)
            self.groups += [2 * k + (i > 2) for i in range(count)]
            out += [f"{name}.{letters[i] if i < len(letters) else i}" if count > 1 else name for i in range(count)]
        return tuple(out)

    def moved(self, qpos: Array, v: Array) -> Array:
        """qpos after the step v (nv,)."""
        out = np.array(qpos)
        mujoco.mj_integratePos(self.model, out, v, 1.0)
        return out

    def closed(self, qpos: Array) -> Array | None:
        """The pose that Gauss-Newton on the rows ends in, or None where they stay open."""
        for _ in range(30):
            gap, jacobian = self.at(qpos)
            if not np.all(np.isfinite(gap)):
                return None
            if np.max(np.abs(gap), initial=0.0) < 1e-11:
                return qpos
            step = np.asarray(np.linalg.lstsq(jacobian, gap, rcond=1e-9)[0], dtype=np.float64)
            qpos = self.moved(qpos, -step)
        return qpos if np.max(np.abs(self.at(qpos)[0]), initial=0.0) < 1e-9 else None


def free_push(model: mujoco.MjModel, qpos: Array, size: float) -> Array:
    """(nv,) rates along all motions that the equality rows allow, of twice the energy PUSH x weight x size; zero where
    nothing can move. size [m]: that of the model."""
    rows = EqualityRows(model, qpos)
    _, jacobian = rows.at(qpos)
    basis = null_space(jacobian)
    if not basis.shape[1]:
        return np.zeros(model.nv)
    weight = float(np.linalg.norm(model.opt.gravity)) or 9.81
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(rows.model, rows.data, mass)
    v = basis @ np.random.default_rng(1).standard_normal(basis.shape[1])
    total = float(model.body_mass.sum())
    return np.asarray(v * np.sqrt(PUSH * total * weight * size / max(float(v @ mass @ v), 1e-300)))
