"""Power that runs round in a train of gears instead of from input to output: the largest circulation in its power graph."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linprog

from mechlab.errors import MechlabError


def circulating_power(members: ArrayLike, powers: ArrayLike) -> float:
    """The largest power [W] on any edge that flows round without need.

    members (m, 3): the member numbers of gear a, gear b and carrier of each mesh; powers (m, 3) [W] that the mesh gives to
    each. Nodes are members and meshes; an edge carries the power between them, in its sense. What comes in, goes out and is
    lost at each node stays; the least sum of edge flows that still does it is a linear program; what it saves circulates.
    """
    who, given = np.asarray(members, dtype=int), np.asarray(powers, dtype=float)
    if who.shape != given.shape or who.ndim != 2 or who.shape[1] != 3:
        raise MechlabError(f"members and powers: expected two arrays (meshes, 3), got {who.shape} and {given.shape}.")
    amounts, balance = _edges(who, given)
    scale = float(np.max(amounts, initial=0.0))
    if scale == 0.0:
        return 0.0
    needed = linprog(np.ones(len(amounts)), A_eq=balance, b_eq=balance @ (amounts / scale),
                     bounds=[(0.0, x) for x in amounts / scale], method="highs")  # fmt: skip
    if not needed.success:
        raise MechlabError(f"the power graph has no flow: {needed.message}")
    saved = scale * float(np.max(amounts / scale - needed.x))
    return saved if saved > 1e-9 * scale else 0.0


def _edges(who: NDArray[np.int_], given: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Amounts (edges,) and the incidence matrix (nodes, edges): -1 where an edge leaves, +1 where it arrives."""
    labels = {x: k for k, x in enumerate(np.unique(who).tolist())}
    amounts, columns = [], []
    for i, row in enumerate(given):
        for member, p in zip(who[i].tolist(), row.tolist(), strict=True):
            column = np.zeros(len(labels) + len(given))
            column[labels[member]], column[len(labels) + i] = np.sign(p), -np.sign(p)
            columns.append(column)
            amounts.append(abs(p))
    return np.array(amounts), np.array(columns).T
