"""Small oscillations of the output shaft on its spring at constant input speed: three harmonics."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.analytic.impulse.model import Impulse, shape
from mechlab.errors import unknown

Array = NDArray[np.float64]
KINDS = ("printed", "consistent")


def harmonic_amplitudes(p: Impulse, speed: float, kind: str = "consistent") -> tuple[float, float, float]:
    """Amplitudes [rad] of sin qwt, sin 2qwt, sin 3qwt of beta for M0 = M1 = 0, c > 0.

    "consistent" keeps every term of the third order; "printed" is the source's D1 and D3, which keep A5 beta'^2 only.
    Raises MechlabError for another kind. Fails where b3 and a5 are comparable to B3, and near `resonances`.
    """
    if kind not in KINDS:
        raise unknown("kind of harmonics", kind, KINDS)
    s, w, q = shape(p), speed, p.q
    stiff = [p.c - m * m * s.B3 * q**2 * w**2 for m in (1, 2, 3)]
    D0 = (s.a6 - s.a5) * w**2 / stiff[0]
    D2 = 0.5 * q * w**2 * D0 * (3.0 * s.a5 - s.a6 + q * s.b3) / stiff[1]
    if kind == "printed":
        force = 0.25 * s.a5 * D0**2 * q**2 * w**2
        return D0 - force / stiff[0], D2, -force / stiff[2]
    square, cross, beat = D0**2 * w**2 * q**2, D2 * q * w**2, 0.5 * (s.a5 - s.a6)
    F1 = 0.375 * square * (2.0 * s.b3 * q - s.a5 - s.a6) + cross * (2.0 * s.b3 * q - 2.0 * s.a5 + beat)
    F3 = -0.125 * square * (7.0 * s.a5 - s.a6 + 2.0 * s.b3 * q) + cross * (2.0 * s.b3 * q + 2.0 * s.a5 + beat)
    return D0 + F1 / stiff[0], D2, F3 / stiff[2]


def harmonic_motion(p: Impulse, speed: float, t: ArrayLike, kind: str = "consistent") -> tuple[Array, Array]:
    """beta and beta' (...) at times t (...) [s] of the three harmonics; psi = 0 at t = 0."""
    amplitudes = harmonic_amplitudes(p, speed, kind)
    phase = p.q * speed * np.asarray(t, dtype=float)
    beta = sum(d * np.sin((m + 1) * phase) for m, d in enumerate(amplitudes))
    rate = sum((m + 1) * p.q * speed * d * np.cos((m + 1) * phase) for m, d in enumerate(amplitudes))
    return np.asarray(beta), np.asarray(rate)


def resonances(p: Impulse, speed: float) -> tuple[float, float, float]:
    """c / (m^2 B3 q^2 w^2) for m = 1, 2, 3: near 1 the m-th harmonic is in resonance."""
    base = shape(p).B3 * p.q**2 * speed**2
    return p.c / base, p.c / (4.0 * base), p.c / (9.0 * base)
