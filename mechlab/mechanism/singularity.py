"""Singular positions: their kinds at a pose, and which of many poses is nearest to one."""

from __future__ import annotations

import numpy as np

from mechlab.mechanism.batch_sparse import smallest_of_closures
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.many_states import ManyStates
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.state_rows import state_rows
from mechlab.mechanism.structure import generic, largest_rank, null_space, structure

PASS = 0.05
"""A motion that comes within this share of its usual distance of a singular position passes it."""


def singularity(
    mechanism: Mechanism, q: Array, output: Array | None = None, threshold: float = 1e-6
) -> tuple[str, ...]:
    """Kinds of singularity at coordinates q: "constraint" (rank of the constraints falls: the mechanism gains a freedom
    that no drive sees or rows become dependent), "parallel" (with the drives held a motion remains), "serial" (the
    output (k, nv) rows lose rank on the motions the constraints allow). Gosselin & Angeles 1990; Zlatanov 1994.

    Rows are measured by their size at a generic pose, so that a row which vanishes at q is seen.
    """
    constraints = ConstraintSet(mechanism)
    jacobian = constraints.jacobian(TreeKinematics(mechanism, q))
    usual = np.linalg.norm(generic(mechanism)[1], axis=1)
    best = structure(mechanism)
    kinds: list[str] = []
    values = _scaled_values(jacobian, usual)
    if best.rank and (len(values) < best.rank or values[best.rank - 1] < threshold):
        kinds.append("constraint")
    basis = null_space(jacobian, threshold)
    drives = np.array([mechanism.row(d.on) for d in mechanism.drives]).reshape(-1, mechanism.nv)
    if len(drives):
        sizes = np.concatenate([usual, np.linalg.norm(drives, axis=1)])
        held = _scaled_values(np.vstack([jacobian, drives]), sizes)
        wanted = best.rank + best.driven
        if len(held) < wanted or held[wanted - 1] < threshold:
            kinds.append("parallel")
    if output is not None and basis.shape[1]:
        values = np.asarray(np.linalg.svd(output @ basis, compute_uv=False), dtype=np.float64)
        wanted = min(output.shape[0], best.mobility)
        if len(values) < wanted or values[wanted - 1] < threshold * max(1.0, values[0]):
            kinds.append("serial")
    return tuple(kinds)


def nearest_to_singular(mechanism: Mechanism, poses: Array) -> tuple[int, float]:
    """Index of the pose in q (n, nq) nearest to a singular position of the constraints, and its distance: the smallest
    singular value of the Jacobian at the usual rank, over its median of all poses; 1 without loops. Rows are scaled by
    their size at a generic pose."""
    smallest = _smallest(mechanism, poses)
    if smallest is None:
        return 0, 1.0
    k = int(np.argmin(smallest))
    return k, float(smallest[k] / max(float(np.median(smallest)), 1e-300))


def may_pass_singular(mechanism: Mechanism, poses: Array) -> bool:
    """Whether a motion through the poses q (n, nq) may come within PASS of its usual distance (see `nearest_to_singular`) of a singular
    position of the constraints, there or between two poses, where the distance changes no faster than between any two neighbours:

        least distance between k and k + 1  >=  (d_k + d_k+1 - max |d_j+1 - d_j|) / 2

    Elsewhere the closed poses are one smooth set, and two motions that start alike cannot part.
    """
    smallest = _smallest(mechanism, poses)
    if smallest is None:
        return False
    least = float(np.min(smallest))
    if len(smallest) > 1:
        fastest = float(np.max(np.abs(np.diff(smallest))))
        least = min(least, 0.5 * (float(np.min(smallest[1:] + smallest[:-1])) - fastest))
    return least <= PASS * float(np.median(smallest))


def _smallest(mechanism: Mechanism, poses: Array) -> Array | None:
    """(n,) smallest singular values of the Jacobian at its usual rank, rows scaled by their size at a generic pose; None without loops."""
    if not (mechanism.loops or mechanism.curves):  # the rows of relations are the same in every pose
        return None
    rank = largest_rank(mechanism)
    if not rank:
        return None
    q, generic_rows = generic(mechanism)
    smallest = smallest_of_closures(mechanism, q, poses, rank)
    if smallest is None:
        usual = np.linalg.norm(generic_rows, axis=1)
        jacobians = state_rows(mechanism).jacobian(ManyStates(mechanism, poses))
        smallest = _scaled_values(jacobians, usual)[:, rank - 1]
    return np.asarray(smallest)


def _scaled_values(matrix: Array, sizes: Array) -> Array:
    """Singular values of a matrix, or of each of many, with its rows divided by `sizes`, those at a generic pose."""
    if matrix.size == 0:
        return np.zeros(0)
    scaled = matrix / np.where(sizes > 1e-14, sizes, 1.0)[:, None]
    return np.asarray(np.linalg.svd(scaled, compute_uv=False), dtype=np.float64)
