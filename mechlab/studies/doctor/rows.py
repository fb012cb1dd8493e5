"""The structure of a MuJoCo model by the rank of its equality rows, at poses that satisfy its equalities."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.equality_rows import EqualityRows
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import Redundancy, null_space

POSES, SPREAD = 4, 0.1
VOID, SMALL, NEARLY = 1e-12, 1e-8, 1e-3
"""A row shorter than VOID is zero. A unit row whose part independent of the others is below SMALL is redundant; below
NEARLY, nearly redundant."""


@dataclass(frozen=True)
class EngineStructure:
    """Structure of a model with nv degrees of freedom. rows: names of the equality rows; rank: the largest of several
    poses; nearly: nearly redundant rows, each with the length of its independent part; gaps: residuals (rows,) at the
    reference."""

    nv: int
    rows: tuple[str, ...]
    rank: int
    reference_rank: int
    redundant: tuple[Redundancy, ...]
    nearly: tuple[tuple[str, float], ...]
    gaps: Array

    @property
    def freedoms(self) -> int:
        """Degrees of freedom, local ones included."""
        return self.nv - self.rank


def engine_structure(model: mujoco.MjModel, qpos: Array, size: float) -> EngineStructure:
    """The structure at the pose qpos (nq,) and at poses near it; the size of the model [m] limits the steps of slide
    joints."""
    with engine():
        rows = EqualityRows(model, qpos)
        gaps, first = rows.at(rows.start)
        names = rows.names()
        found = [first, *_elsewhere(rows, first, size)]
    groups = rows.groups
    ranks = [len(_kept(j, groups)[0]) for j in found]
    best = found[int(np.argmax(ranks))]
    keep, nearly = _kept(best, groups)
    return EngineStructure(
        model.nv, names, max(ranks), ranks[0], _redundant(best, keep, names),
        tuple((names[i], x) for i, x in nearly), gaps,
    )  # fmt: skip


def _elsewhere(rows: EqualityRows, jacobian: Array, size: float) -> list[Array]:
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
        if pose is not None:
            there = rows.at(pose)[1]
            if there.shape == jacobian.shape:
                out.append(there)
    return out


def _kept(jacobian: Array, groups: list[int]) -> tuple[list[int], list[tuple[int, float]]]:
    """Indices of independent rows, earlier ones preferred; and those with a suspiciously small independent part. Rows
    of a group have one unit, so that part is relative to the longest row of the group."""
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


def _redundant(jacobian: Array, keep: list[int], names: tuple[str, ...]) -> tuple[Redundancy, ...]:
    out = []
    for i, name in enumerate(names):
        if i in keep:
            continue
        earlier = [k for k in keep if k < i]
        c = np.linalg.lstsq(jacobian[earlier].T, jacobian[i], rcond=None)[0] if earlier else np.zeros(0)
        terms = tuple((names[k], float(x)) for k, x in zip(earlier, c, strict=True) if abs(x) > 1e-9)
        out.append(Redundancy(name, terms))
    return tuple(out)
