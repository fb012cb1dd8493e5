"""The structure of any MuJoCo model by the rank of its own equality rows, at poses that its own equations close."""

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
"""Below VOID a row is zero; below SMALL what others leave of a row of unit length is rounding; below NEARLY it is suspicious."""


@dataclass(frozen=True)
class EngineStructure:
    """nv coordinates; names of the equality rows; rank (largest of several poses) and rank in the reference pose; rows that
    repeat others; rows that nearly do: (row, what others leave of it, of unit length); residuals (rows,) at the reference."""

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
    """The structure about the pose qpos; `size` [m] of the model limits the step of slides."""
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
    """Independent rows, earlier ones preferred; and those of which the earlier ones leave suspiciously little. EqualityRows of a
    group have one unit: a row is measured by the largest of its group."""
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
