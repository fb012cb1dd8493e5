"""The first integral at constant input speed without a spring: phase portraits in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.analytic.impulse.model import Impulse, shape
from mechlab.errors import MechlabError

Array = NDArray[np.float64]


def first_integral(p: Impulse, speed: float, psi: ArrayLike, slip: ArrayLike, resisting: ArrayLike) -> Array:
    """E = (q/2) A3(psi) s^2 - R psi - a6 w^2 cos psi [N m], constant while the resisting torque R is.

    slip s = w - beta' (...) [rad/s]; psi (...) [rad], not reduced modulo 2 pi. Holds for c = 0; raises MechlabError else.
    """
    _no_spring(p)
    s = shape(p)
    psi, slip = np.asarray(psi, dtype=float), np.asarray(slip, dtype=float)
    inertia = s.B3 + s.b3 * np.cos(psi)
    return np.asarray(0.5 * p.q * inertia * slip**2 - np.asarray(resisting) * psi - s.a6 * speed**2 * np.cos(psi))


def slip_speed(p: Impulse, speed: float, psi: ArrayLike, energy: ArrayLike, resisting: ArrayLike) -> Array:
    """s = w - beta' >= 0 [rad/s] at psi on the curve of a value of the first integral; NaN where it does not reach."""
    _no_spring(p)
    s = shape(p)
    psi = np.asarray(psi, dtype=float)
    square = 2.0 * (np.asarray(energy) + np.asarray(resisting) * psi + s.a6 * speed**2 * np.cos(psi))
    square = square / (p.q * (s.B3 + s.b3 * np.cos(psi)))
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(square))


def _no_spring(p: Impulse) -> None:
    if p.c != 0.0:
        raise MechlabError(f"impulse: the first integral needs c = 0, got {p.c:g} N m/rad; integrate instead.")
