"""The equality rows of any MuJoCo model: residual and Jacobian at any qpos, names, and a push along the free motions;
the structure of the model (freedoms, redundant rows) by the rank of the rows at closed poses; names of its elements.
"""

from __future__ import annotations

import copy

import mujoco
import numpy as np

from mechlab.engines.mujoco.closure import equality_rows
from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.model_file.spins import local_freedoms
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.redundancy import Redundancy, repetitions
from mechlab.mechanism.structure import null_space

PUSH = 1e-3
"""v^T M v of a push with rates v, over weight x size of the model."""
_LETTERS = {mujoco.mjtEq.mjEQ_CONNECT: "xyz", mujoco.mjtEq.mjEQ_WELD: ("x", "y", "z", "rx", "ry", "rz")}
_KINDS = {
    mujoco.mjtEq.mjEQ_CONNECT: "connect", mujoco.mjtEq.mjEQ_WELD: "weld", mujoco.mjtEq.mjEQ_JOINT: "joint equality",
    mujoco.mjtEq.mjEQ_TENDON: "tendon equality",
}  # fmt: skip

Start = tuple[Array, Array, Array]
"""qpos, qvel, ctrl."""


def name_of(model: mujoco.MjModel, kind: str, k: int) -> str:
    """The name of element k of a kind ("JOINT", "TENDON"), or its number where it has none."""
    return mujoco.mj_id2name(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind}"), k) or f"{kind.lower()} number {k}"


def joint_of_dof(model: mujoco.MjModel, i: int) -> str:
    """The name of the joint to which degree of freedom i belongs."""
    return name_of(model, "JOINT", int(model.dof_jntid[i]))


def active(model: mujoco.MjModel) -> list[int]:
    """The equalities that act from the start."""
    if model.opt.disableflags & (mujoco.mjtDisableBit.mjDSBL_EQUALITY | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT):
        return []
    return [k for k in range(model.neq) if model.eq_active0[k]]


_LOOPS = (
    mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD, mujoco.mjtEq.mjEQ_JOINT, mujoco.mjtEq.mjEQ_TENDON,
)  # fmt: skip


def loops(model: mujoco.MjModel) -> list[int]:
    """The active equalities that close loops or couple joints: not those of flexible bodies, nor welds to a mocap body, which are
    meant to drag softly, nor what pins deformable bodies."""
    kinds = [int(kind) for kind in _LOOPS]
    return [k for k in active(model) if int(model.eq_type[k]) in kinds and not drags(model, k) and not _of_flex(model, k)]


def _of_flex(model: mujoco.MjModel, k: int) -> bool:
    """Whether an equality ties a point of a deformable body."""
    return bool(model.nflex) and bool(set(tied_bodies(model, k)) & {int(b) for b in model.flex_vertbodyid})


def drags(model: mujoco.MjModel, k: int) -> bool:
    """Whether an equality ties a body to a mocap body, which a program moves."""
    return any(model.body_mocapid[model.body_rootid[b]] >= 0 for b in tied_bodies(model, k))


def mocap_bodies(model: mujoco.MjModel) -> set[str]:
    """Names of the bodies that a program moves."""
    return {name_of(model, "BODY", b) for b in range(1, model.nbody) if model.body_mocapid[b] >= 0}


def tied_bodies(model: mujoco.MjModel, k: int) -> list[int]:
    """The bodies that a connect or weld ties; none for other equalities."""
    if int(model.eq_type[k]) not in (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)):
        return []
    ends = [int(e) for e in (model.eq_obj1id[k], model.eq_obj2id[k]) if e >= 0]
    return [int(model.site_bodyid[e]) for e in ends] if model.eq_objtype[k] == mujoco.mjtObj.mjOBJ_SITE else ends


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
    names = [mujoco.mj_id2name(model, object_kind, e) or f"number {e}" for e in ends if e >= 0]
    return f"{kind} {'-'.join(names)}"


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
        self.data.qpos[:] = qpos
        mujoco.mj_fwdPosition(self.model, self.data)
        return equality_rows(self.model, self.data)

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


def tendon_moments(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """(ntendon, nv) dense Jacobian of the tendon lengths."""
    out = np.zeros((model.ntendon, model.nv))
    for k in range(model.ntendon):
        start, count = int(model.ten_J_rowadr[k]), int(model.ten_J_rownnz[k])
        flat = np.asarray(data.ten_J).ravel()
        out[k, model.ten_J_colind[start : start + count]] = flat[start : start + count]
    return out


def started(model: mujoco.MjModel, start: Start) -> mujoco.MjData:
    """Fresh data at a start."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = start
    return data


def free_push(model: mujoco.MjModel, qpos: Array, size: float) -> Array:
    """(nv,) rates v along all motions that the equality rows allow, with v^T M v = PUSH x weight x size; zero where
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


POSES, SPREAD = 4, 0.1
MOST_ENTRIES = 40_000
"""Rows times coordinates above which only the start pose is examined: each further pose takes many least-squares problems."""
VOID, SMALL, NEARLY = 1e-12, 1e-8, 1e-3
"""Below VOID a row is zero. With the part that other rows span removed, a unit row below SMALL is rounding (it repeats
them), below NEARLY it is suspicious."""


@dataclass(frozen=True)
class EngineStructure:
    """nv coordinates; names of the equality rows; rank (largest of several poses) and rank in the reference pose; rows that
    repeat others; rows that nearly do: (row, length of the unit row without the part that others span); residuals
    (rows,) at the reference; spins: bodies that can move without anything else moving, and in how many ways; skipped: what was not
    examined, and why."""

    nv: int
    rows: tuple[str, ...]
    rank: int
    reference_rank: int
    redundant: tuple[Redundancy, ...]
    nearly: tuple[tuple[str, float], ...]
    gaps: Array
    spins: tuple[tuple[str, int], ...] = ()
    skipped: str = ""

    @property
    def freedoms(self) -> int:
        """Degrees of freedom, local ones included."""
        return self.nv - self.rank


def engine_structure(model: mujoco.MjModel, qpos: Array, size: float) -> EngineStructure:
    """The structure about the pose qpos; `size` [m] of the model limits the step of slides."""
    with engine():
        rows = EqualityRows(model, qpos)
        gaps, first = rows.at(rows.start)
        names = rows.names()
        large = first.size > MOST_ENTRIES
        poses = [rows.start, *(() if large else _elsewhere(rows, first, size))]
        found = [rows.at(pose)[1] for pose in poses]
    groups = rows.groups
    ranks = [len(_kept(j, groups)[0]) for j in found]
    best = found[int(np.argmax(ranks))]
    keep, nearly = _kept(best, groups)
    with engine():
        spins = () if large else tuple(local_freedoms(rows.model, rows.data, found[-1], size))
    skipped = f"the {len(names)} constraint rows beyond the start pose: {first.size} entries, above {MOST_ENTRIES}" if large else ""
    return EngineStructure(
        model.nv, names, max(ranks), ranks[0], () if large else repetitions(best, keep, names),
        tuple((names[i], x) for i, x in nearly), gaps, spins, skipped,
    )  # fmt: skip


def _elsewhere(rows: EqualityRows, jacobian: Array, size: float) -> list[Array]:
    """Closed poses around the start."""
    rng = np.random.default_rng(7)
    out: list[Array] = []
    basis = null_space(jacobian)
    if not len(jacobian) or not basis.shape[1]:
        return out
    sliding = (int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_FREE))
    slides = bool(np.any(np.isin(rows.model.jnt_type, sliding)))
    reach = SPREAD * (min(1.0, size) if slides else 1.0)
    for _ in range(POSES):
        v = basis @ rng.standard_normal(basis.shape[1])
        pose = rows.closed(rows.moved(rows.start, v * reach / max(float(np.max(np.abs(v))), 1e-300)))
        if pose is not None and rows.at(pose)[1].shape == jacobian.shape:
            out.append(pose)
    return out


def _kept(jacobian: Array, groups: list[int]) -> tuple[list[int], list[tuple[int, float]]]:
    """Independent rows, earlier ones preferred; and rows that nearly depend on earlier ones, each with the length that
    is left of it. Rows of a group share one unit: a row is scaled by the largest of its group."""
    basis = np.zeros((0, jacobian.shape[1]))
    keep: list[int] = []
    nearly: list[tuple[int, float]] = []
    norms = np.linalg.norm(jacobian, axis=1)
    for i, norm in enumerate(norms):
        if norm < VOID:
            continue
        row = jacobian[i] / norm
        rest = row - basis.T @ (basis @ row)
        rest -= basis.T @ (basis @ rest)
        size = float(np.linalg.norm(rest))
        left = size * float(norm / max(x for x, g in zip(norms, groups, strict=True) if g == groups[i]))
        if left > SMALL:
            basis = np.vstack([basis, rest / size])
            keep.append(i)
            if left < NEARLY:
                nearly.append((i, left))
    return keep, nearly
