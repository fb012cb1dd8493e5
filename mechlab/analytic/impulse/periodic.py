"""Periodic orbits at constant input speed by shooting, their Floquet multipliers, and Poincare sections."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.analytic.impulse.equations import constant_speed_acceleration
from mechlab.analytic.impulse.harmonics import harmonic_motion
from mechlab.analytic.impulse.model import Impulse
from mechlab.errors import NoSolution

Array = NDArray[np.float64]
TOLERANCE = 1e-12


@dataclass(frozen=True)
class Orbit:
    """A periodic orbit without friction: period [s], (beta, beta') at psi = 0, Floquet multipliers (2,), and amplitudes
    of sin q w t, sin 2 q w t, sin 3 q w t in beta."""

    period: float
    start: Array
    multipliers: NDArray[np.complex128]
    sines: Array


def motion(p: Impulse, speed: float, start: ArrayLike, duration: float, times: ArrayLike | None = None) -> Array:
    """(2, n) beta and beta' from (beta, beta') at t = 0, where the input shaft passes alpha = 0; M1 = 0. At `times`, or the
    steps of DOP853 at a tolerance of 1e-12."""
    from scipy.integrate import solve_ivp

    def f(t: float, y: Array) -> Array:
        psi = p.q * (speed * t - y[0])
        return np.array([y[1], constant_speed_acceleration(p, speed, psi, y[1], p.M0, y[0])])

    at = None if times is None else np.asarray(times, dtype=float)
    done = solve_ivp(f, (0.0, duration), np.asarray(start, dtype=float), "DOP853", at, rtol=TOLERANCE, atol=TOLERANCE)
    return np.asarray(done.y)


def periodic_orbit(p: Impulse, speed: float) -> Orbit:
    """The orbit of period 2 pi / (q w) for c > 0, M1 = 0 by Newton's method from the harmonics.

    The Jacobian of the map is by central differences. Raises NoSolution when Newton does not converge, or leaves the
    motions in which the output shaft stays slower than the input shaft (resonance).
    """
    period = 2.0 * np.pi / (abs(p.q) * speed)
    beta, rate = harmonic_motion(p, speed, 0.0)
    y = np.array([float(beta), float(rate)])
    scale = np.array([1e-6, 1e-4])
    for _ in range(20):
        if not abs(y[1]) < speed:
            raise NoSolution(
                f"impulse: no orbit of period {period:.6g} s with small oscillations at {speed:g} rad/s: the output shaft would "
                f"reach {y[1]:.4g} rad/s, beyond the input shaft; a harmonic is in resonance."
            )
        gap = motion(p, speed, y, period)[:, -1] - y
        monodromy = np.column_stack([
            (motion(p, speed, y + d, period)[:, -1] - motion(p, speed, y - d, period)[:, -1]) / (2.0 * np.sum(d))
            for d in np.diag(scale)
        ])  # fmt: skip
        if np.max(np.abs(gap) * [1.0, 0.01]) < 1e-11:
            break
        y = y - np.linalg.solve(monodromy - np.eye(2), gap)
    else:
        raise NoSolution(
            f"impulse: shooting found no orbit of period {period:.6g} s at {speed:g} rad/s; is a harmonic in resonance?"
        )
    n = 64
    t = np.arange(n) * period / n
    spectrum = np.fft.rfft(motion(p, speed, y, period, t)[0]) / n
    return Orbit(period, y, np.asarray(np.linalg.eigvals(monodromy)), np.asarray(-2.0 * spectrum.imag[1:4]))


def section_points(p: Impulse, speed: float, start: ArrayLike, turns: int) -> Array:
    """(turns + 1, 2) points (beta, beta') of one motion, each time the input shaft has turned by 2 pi / q; M1 = 0."""
    period = 2.0 * np.pi / (abs(p.q) * speed)
    return motion(p, speed, start, turns * period, np.arange(turns + 1) * period).T
