"""How far a soft constraint row of MuJoCo lags behind under load, before anything is run."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def reactions(mass: ArrayLike, rows: ArrayLike, force: ArrayLike) -> FloatArray:
    """(rows,) multipliers f of M a = force + J^T f, J a = 0; the smallest where rows repeat others. mass (n, n), rows
    (m, n), force (n,)."""
    m, j, q = (np.asarray(x, dtype=float) for x in (mass, rows, force))
    free = np.linalg.solve(m, np.column_stack([q, j.T]))
    compliance = j @ free[:, 1:]
    size = 1.0 / np.sqrt(np.diag(compliance))
    scaled = compliance * size[:, None] * size
    return np.asarray(size * np.linalg.lstsq(scaled, -size * (j @ free[:, 0]), rcond=1e-10)[0])


def predicted_lag(
    mass: ArrayLike, rows: ArrayLike, force: ArrayLike, timeconst: float, impedance: float, damping_ratio: float = 1.0
) -> FloatArray:
    """(rows,) residual |r| = (1-d) tc^2 zeta^2 A |f| of soft rows in quasi-steady motion, A = J M^-1 J^T of the row, f its
    multiplier, tc the time constant [s] (at least two timesteps), d the impedance. Light loaded parts lag most."""
    m, j = np.asarray(mass, dtype=float), np.asarray(rows, dtype=float)
    compliance = np.einsum("ij,ji->i", j, np.linalg.solve(m, j.T))
    return np.asarray(
        (1.0 - impedance) * (timeconst * damping_ratio) ** 2 * compliance * np.abs(reactions(m, j, force))
    )
