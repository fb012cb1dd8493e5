"""Initial states of many motions of one mechanism at once: what `mechlab.experiment.scene.initial_state` does for one.

Poses are led from the reference pose to their values together (`mechlab.mechanism.closing`), rates are the smallest ones that meet
J v = 0 and the given rates, by the pseudo-inverse of all rows at each pose. Only where the values fix the pose: else it would depend
on the way there.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mechlab.mechanism.closing import close_many
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_rows import ManyRows
from mechlab.mechanism.model import Mechanism

MET = 1e-9
"""Share of the largest given rate by which a rate may be missed; as in `initial_rates`."""
RANK = 1e-11
LARGEST = 60
"""Rates up to which all matrices of a block fit into memory, and into the processor's."""


def many_initial_states(
    mechanism: Mechanism, values: Mapping[str, Array], rates: Mapping[str, Array], count: int
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """q (n, nq), v (n, nv) with the values and rates, each (n,), of joints or shafts; and (n,) where they are sure.

    The others are to be found one by one: they do not close, change the assembly mode, or their values do not fix the pose.
    """
    m, reference = mechanism, mechanism.reference()
    q, v, sure = np.tile(reference, (count, 1)), np.zeros((count, m.nv)), np.zeros(count, dtype=bool)
    if m.nv > LARGEST or m.length_scale != 1.0:
        return q, v, sure
    rows = ManyRows(m, tuple(values))
    first = rows.at(reference[None])
    if np.linalg.matrix_rank(first.rows[0], tol=1e-8) < m.nv:
        return q, v, sure
    targets = [np.asarray(x, dtype=float) for x in values.values()]
    if not np.isfinite(targets).all() or not all(np.isfinite(x).all() for x in rates.values()):
        return q, v, sure
    found = close_many(rows, reference, targets)
    q, sure = found.q, found.closed
    wanted = np.zeros((count, first.gap.shape[1] + len(rates)))
    for k, x in enumerate(rates.values()):
        wanted[:, first.gap.shape[1] + k] = x
    moving = np.flatnonzero(sure & wanted.any(axis=1))
    if len(moving):
        asked = np.array([m.row(name) for name in rates])
        closure = rows.at(q[moving]).rows[:, : first.gap.shape[1]]
        matrix = np.concatenate([closure, np.broadcast_to(asked, (len(moving), *asked.shape))], axis=1)
        goal = wanted[moving][:, :, None]
        v[moving] = (np.linalg.pinv(matrix, rcond=RANK) @ goal)[:, :, 0]
        off = np.max(np.abs(matrix @ v[moving][:, :, None] - goal), axis=(1, 2))
        sure[moving] &= off <= MET * np.maximum(1.0, np.max(np.abs(goal), axis=(1, 2)))
    return q, v, sure
