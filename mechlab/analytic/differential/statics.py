"""Mass matrix, moments and steady motions of the closed differential.

The mass matrix is constant in the speeds (w1, w3) of the blocks. Moments: what the planets pass on, the source's starting rule
and the exact moment on a held output. Steady motions: with drag to the housing, and with a backstop. M_H1 drives H1,
M_H2 > 0 resists H2; moments in N m.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.differential.train import FloatArray, Train
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Inertias:
    """Moments of inertia [kg m2] and masses [kg]; J2, m2, J5, m5 are of one planet; each carrier has `planets` of
    them, axes at r_H1, r_H2 [m]. J_H1, J_H2: carriers without planets. Raises MechlabError for negative or non-finite
    values."""

    J_H1: float
    J14: float
    J36: float
    J_H2: float
    J2: float
    m2: float
    J5: float
    m5: float
    planets: int
    r_H1: float
    r_H2: float

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if not (np.isfinite(value) and value >= 0):
                raise MechlabError(f"{f.name} = {value!r}: expected a finite number, zero or more.")


def mass_matrix(train: Train, inertias: Inertias) -> FloatArray:
    """(2, 2) J of T = 1/2 w^T J w, w = (w1, w3):

    J = diag(J14, J36) + (J_H1 + k m2 r_H1^2) u1 u1^T + (J_H2 + k m5 r_H2^2) u2 u2^T + k J2 s2 s2^T + k J5 s5 s5^T.
    """
    i, k = inertias, inertias.planets
    (u1, u2), (s2, s5) = train.carriers, train.spins
    out = np.diag([i.J14, i.J36])
    for size, row in (
        (i.J_H1 + k * i.m2 * i.r_H1**2, u1),
        (i.J_H2 + k * i.m5 * i.r_H2**2, u2),
        (k * i.J2, s2),
        (k * i.J5, s5),
    ):
        out = out + size * np.outer(row, row)
    return np.asarray(out)


def carrier_mass_matrix(train: Train, J: FloatArray) -> FloatArray:
    """(2, 2) Jh in (w_H1, w_H2): Jh (w_H1', w_H2')^T = (M_H1, -M_H2)^T. Raises MechlabError when a = b."""
    if not train.regular:
        raise MechlabError("both carriers turn as one (z1/z3 = z4/z6): there is no mass matrix in their speeds.")
    inverse = np.linalg.inv(train.carriers)
    return np.asarray(inverse.T @ J @ inverse)


def momentum_row(train: Train, inertias: Inertias) -> FloatArray:
    """(2,) l of the angular momentum about the axis, L = l . (w1, w3). Only torques from the housing and the outer
    moments change L; internal friction does not."""
    i, k = inertias, inertias.planets
    (u1, u2), (s2, s5) = train.carriers, train.spins
    orbits = (i.J_H1 + k * i.m2 * i.r_H1**2) * u1 + (i.J_H2 + k * i.m5 * i.r_H2**2) * u2
    return np.asarray(np.array([i.J14, i.J36]) + orbits + k * i.J2 * s2 + k * i.J5 * s5)


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
    """(..., 2) generalized force Q on blocks 14 and 36: J w' = Q. Both vanish only when M_H1 = M_H2 = 0 (a != b)."""
    m = mesh_moments(train, M_H1, M_H2)
    return np.stack(np.broadcast_arrays(m.M21 - m.M54, m.M23 - m.M56), axis=-1)


def start_moment(train: Train, M_H1: ArrayLike) -> FloatArray:
    """Moment on the held output by the rule of the source: M_H1 r_H2/(2 r_H1) (r1/r4 + r3/r6)."""
    r_H1, r_H2 = 0.5 * (train.z1 + train.z3), 0.5 * (train.z4 + train.z6)
    lever = train.z1 / train.z4 + train.z3 / train.z6
    return np.asarray(np.asarray(M_H1, dtype=float) * r_H2 / (2.0 * r_H1) * lever)


def internal_moment(train: Train, M_H1: ArrayLike) -> FloatArray:
    """Moment M5 on planet 5 with the output held, by the rule of the source: 1/2 M_H1 (r5/r_H1) (r1/r4 - r3/r6)."""
    r_H1 = 0.5 * (train.z1 + train.z3)
    lever = train.z1 / train.z4 - train.z3 / train.z6
    return np.asarray(0.5 * np.asarray(M_H1, dtype=float) * train.z5 / r_H1 * lever)


def start_ratio(train: Train) -> float:
    """u_H1-5 = w_H1/w5 with the output held: (z3 z4 - z6 z1)/(z3 z4 + z1 z4) z5/z6."""
    z = train
    return (z.z3 * z.z4 - z.z6 * z.z1) / (z.z3 * z.z4 + z.z1 * z.z4) * z.z5 / z.z6


def held_output_moment(train: Train, J: FloatArray, M_H1: ArrayLike) -> FloatArray:
    """Exact moment on the held output: the reaction to the accelerating train, -Jh12/Jh11 M_H1. It comes from the
    inertias alone and vanishes once the input no longer accelerates."""
    jh = carrier_mass_matrix(train, J)
    return np.asarray(-jh[0, 1] / jh[0, 0] * np.asarray(M_H1, dtype=float))


def printed_z4(z1: float, z2: float, z5: float, force_ratio: float) -> float:
    """z4 by the source's synthesis (12) with (13): z4 = (z1 + z2) F/R - z5, F/R the ratio of the forces on the planet
    axes. It follows from (11) with the unstated assumption w1 = w3; it can be negative."""
    return (z1 + z2) * force_ratio - z5


def power_rate(train: Train, J: FloatArray, M_H1: float, M_H2: float) -> float:
    """d/dt (M_H1 w_H1 - M_H2 w_H2) = Q^T J^-1 Q [W/s] under constant moments: positive whenever Q is not zero."""
    q = block_torques(train, M_H1, M_H2)
    return float(q @ np.linalg.solve(J, q))


@dataclass(frozen=True)
class SteadyState:
    """Speeds [rad/s] of the carriers, moment on the input [N m], share of the input power that reaches the load."""

    w_H1: FloatArray
    w_H2: FloatArray
    M_H1: FloatArray
    efficiency: FloatArray


def mobility(train: Train, drag_14: float, drag_36: float) -> FloatArray:
    """(2, 2) Y of (w_H1, w_H2) = Y (M_H1, -M_H2) for viscous drag of the blocks against the housing [N m s]."""
    if not (drag_14 > 0 and drag_36 > 0):
        raise MechlabError(f"drag_14, drag_36 = {drag_14!r}, {drag_36!r}: a steady state needs both positive.")
    u = train.carriers
    return np.asarray(u @ np.diag([1.0 / drag_14, 1.0 / drag_36]) @ u.T)


def housing_drag(train: Train, drag_14: float, drag_36: float, M_H1: ArrayLike, M_H2: ArrayLike) -> SteadyState:
    """Steady state under constant moments and viscous drag on the housing; it is unique and asymptotically stable."""
    y = mobility(train, drag_14, drag_36)
    one, two = np.broadcast_arrays(np.asarray(M_H1, dtype=float), np.asarray(M_H2, dtype=float))
    h1, h2 = y[0, 0] * one - y[0, 1] * two, y[0, 1] * one - y[1, 1] * two
    return SteadyState(h1, h2, one, two * h2 / (one * h1))


def drag_ratio(train: Train, drag_ratio_36_to_14: float, load: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """(ratio w_H1/w_H2, efficiency) of `housing_drag` against load = M_H2/M_H1. Only the ratio of the drags matters, so
    the efficiency does not tend to 1 as friction vanishes."""
    y = mobility(train, 1.0, drag_ratio_36_to_14)
    mu = np.asarray(load, dtype=float)
    ratio = (y[0, 0] - y[0, 1] * mu) / (y[0, 1] - y[1, 1] * mu)
    return ratio, mu / ratio


def drag_stall(train: Train, drag_ratio_36_to_14: float) -> float:
    """Load ratio M_H2/M_H1 at which the output of `housing_drag` stands still, Y12/Y22."""
    y = mobility(train, 1.0, drag_ratio_36_to_14)
    return float(y[0, 1] / y[1, 1])


def backstop(train: Train, internal_drag: float, w_H1: ArrayLike, M_H2: ArrayLike) -> SteadyState:
    """Input speed held at w_H1, one-way stop w3 >= 0, viscous drag between the blocks; for a > b, w_H1 > 0, M_H2 >= 0.

    Below M_H2 = ci w_H1/(a (a-b)) the train is a slipping clutch: M_H1 = M_H2, w_H2 = w_H1 - (a-b)^2 M_H2/ci. Above it
    block 36 stands: w_H2 = (b/a) w_H1, M_H1 = (b M_H2 + ci w_H1/a)/a.
    """
    a, b = train.a, train.b
    if not (a > b and internal_drag > 0):
        raise MechlabError("backstop: it needs z1/z3 > z4/z6 and a drag between the blocks greater than zero.")
    h1, load = np.broadcast_arrays(np.asarray(w_H1, dtype=float), np.asarray(M_H2, dtype=float))
    slips = load <= internal_drag * h1 / (a * (a - b))
    h2 = np.where(slips, h1 - (a - b) ** 2 * load / internal_drag, b / a * h1)
    one = np.where(slips, load, (b * load + internal_drag * h1 / a) / a)
    with np.errstate(divide="ignore", invalid="ignore"):
        return SteadyState(h1, h2, one, np.where(load == 0, 0.0, load * h2 / (one * h1)))
