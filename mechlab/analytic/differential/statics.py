"""Moments in the closed differential: what the planets pass on, the source's starting rule, and what is true at start.

M_H1 drives H1, M_H2 > 0 resists H2. Moments in N m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.differential.inertia import carrier_mass_matrix
from mechlab.analytic.differential.train import FloatArray, Train


@dataclass(frozen=True)
class MeshMoments:
    """Moments of balanced planets on the blocks: M21, M23 drive wheels 1 and 3; M54, M56 resist wheels 4 and 6."""

    M21: FloatArray
    M23: FloatArray
    M54: FloatArray
    M56: FloatArray


def mesh_moments(train: Train, M_H1: ArrayLike, M_H2: ArrayLike) -> MeshMoments:
    """Each mesh of a planet carries half the force on its axis: M21 = a M_H1, M23 = (1-a) M_H1, M54 = b M_H2,
    M56 = (1-b) M_H2. Exact when the planets have no moment of inertia or turn at constant speed."""
    one, two = np.asarray(M_H1, dtype=float), np.asarray(M_H2, dtype=float)
    return MeshMoments(train.a * one, (1.0 - train.a) * one, train.b * two, (1.0 - train.b) * two)


def block_torques(train: Train, M_H1: ArrayLike, M_H2: ArrayLike) -> FloatArray:
    """(..., 2) generalised force Q on blocks 14 and 36: J w' = Q. Both vanish only when M_H1 = M_H2 = 0 (a != b)."""
    m = mesh_moments(train, M_H1, M_H2)
    return np.stack(np.broadcast_arrays(m.M21 - m.M54, m.M23 - m.M56), axis=-1)


def start_moment(train: Train, M_H1: ArrayLike) -> FloatArray:
    """Moment on the held output by the source: M_H1 r_H2/(2 r_H1) (r1/r4 + r3/r6)."""
    r_H1, r_H2 = 0.5 * (train.z1 + train.z3), 0.5 * (train.z4 + train.z6)
    lever = train.z1 / train.z4 + train.z3 / train.z6
    return np.asarray(np.asarray(M_H1, dtype=float) * r_H2 / (2.0 * r_H1) * lever)


def internal_moment(train: Train, M_H1: ArrayLike) -> FloatArray:
    """Moment M5 on planet 5 with the output held, by the source: 1/2 M_H1 (r5/r_H1) (r1/r4 - r3/r6)."""
    r_H1 = 0.5 * (train.z1 + train.z3)
    lever = train.z1 / train.z4 - train.z3 / train.z6
    return np.asarray(0.5 * np.asarray(M_H1, dtype=float) * train.z5 / r_H1 * lever)


def start_ratio(train: Train) -> float:
    """u_H1-5 = w_H1/w5 with the output held: (z3 z4 - z6 z1)/(z3 z4 + z1 z4) z5/z6."""
    z = train
    return (z.z3 * z.z4 - z.z6 * z.z1) / (z.z3 * z.z4 + z.z1 * z.z4) * z.z5 / z.z6


def held_output_moment(train: Train, J: FloatArray, M_H1: ArrayLike) -> FloatArray:
    """What the held output really feels: the reaction to the accelerating train, -Jh12/Jh11 M_H1. It depends on the
    inertias alone, and is gone when the input has stopped accelerating."""
    jh = carrier_mass_matrix(train, J)
    return np.asarray(-jh[0, 1] / jh[0, 0] * np.asarray(M_H1, dtype=float))


def printed_z4(z1: float, z2: float, z5: float, force_ratio: float) -> float:
    """z4 by the source's synthesis (12) with (13): z4 = (z1 + z2) F/R - z5, F/R the ratio of the forces on the planet
    axes. It follows from (11) with w1 = w3 silently taken; it can be negative."""
    return (z1 + z2) * force_ratio - z5


def power_rate(train: Train, J: FloatArray, M_H1: float, M_H2: float) -> float:
    """d/dt (M_H1 w_H1 - M_H2 w_H2) = Q^T J^-1 Q [W/s] under constant moments: positive whenever Q is not zero."""
    q = block_torques(train, M_H1, M_H2)
    return float(q @ np.linalg.solve(J, q))
