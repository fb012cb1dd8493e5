"""Mass matrix of the closed differential: constant, in the speeds (w1, w3) of the blocks."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from mechlab.analytic.differential.train import FloatArray, Train
from mechlab.errors import MechlabError


@dataclass(frozen=True)
class Inertias:
    """Moments of inertia [kg m2] and masses [kg]; J2, m2, J5, m5 are of one planet, `planets` stand on each carrier,
    whose axes lie at r_H1, r_H2 [m]. Carriers are bare. Raises MechlabError for negative or non-finite values."""

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
    moments change L; friction inside does not."""
    i, k = inertias, inertias.planets
    (u1, u2), (s2, s5) = train.carriers, train.spins
    orbits = (i.J_H1 + k * i.m2 * i.r_H1**2) * u1 + (i.J_H2 + k * i.m5 * i.r_H2**2) * u2
    return np.asarray(np.array([i.J14, i.J36]) + orbits + k * i.J2 * s2 + k * i.J5 * s5)
