"""The periodic motion of the transmission on a spring with its motor, and whether neighbouring motions come to it.

The planet angle psi = q (alpha - beta) takes the place of time, so that a cycle is psi + 2 pi exactly: dpsi/dt = q (alpha' - beta'). The
rest of the state is z = (beta, alpha', beta', Md); alpha itself enters the equations through psi alone. The cycle is a fixed point of
the map of z over a turn of psi, the multipliers are the eigenvalues of its derivative (Floquet): below 1 in absolute value it attracts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.impulse.model import Array, Impulse, slope
from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass

STEPS = np.array([1e-6, 1e-3, 1e-4, 1e-2])
"""Differences of beta [rad], alpha', beta' [rad/s], Md [N m] for the derivative of the map: their squares leave 1e-9 of it."""
TOLERANCE = 1e-11


@dataclass(frozen=True)
class MotorOrbit:
    """Where the cycle begins, start (beta, alpha', beta', Md) at psi = 0; its period [s]; the four multipliers, largest first."""

    start: Array
    period: float
    multipliers: NDArray[np.complex128]

    @property
    def approach(self) -> float:
        """Share of its distance by which the slowest of the neighbouring motions comes nearer in a cycle; below 0 it goes away."""
        return float(1.0 - np.abs(self.multipliers[0]))


def after_turns(p: Impulse, states: Array, turns: int = 1) -> tuple[Array, Array]:
    """The states (k, 4) after so many turns of psi from 0, and the times that they take (k,) [s]; M1 = 0."""
    from scipy.integrate import solve_ivp

    if p.M1 != 0.0:
        raise MechlabError(f"impulse: M1 = {p.M1:g} N m; the map over a turn is smooth without dry friction alone.")

    def f(psi: float, flat: Array) -> Array:
        beta, u, v, motor, _ = flat.reshape(5, -1)
        rates = slope(p, np.stack([psi / p.q + beta, beta, u, v, motor], axis=-1))
        return np.asarray(np.vstack([v, rates[:, 2], rates[:, 3], rates[:, 4], np.ones_like(v)]) / (p.q * (u - v))).ravel()

    start = np.vstack([np.asarray(states, dtype=float).T, np.zeros(len(states))])
    done = solve_ivp(f, (0.0, 2.0 * np.pi * turns), start.ravel(), "DOP853", rtol=TOLERANCE, atol=TOLERANCE)
    end = done.y[:, -1].reshape(5, -1)
    return end[:4].T, end[4]


def motor_orbit(p: Impulse, guess: Array) -> MotorOrbit:
    """The cycle next to a guess (4,) by Newton's method on the map over a turn. Raises NoSolution where there is none, MechlabError for
    M1 other than 0."""
    z = np.asarray(guess, dtype=float)
    for _ in range(20):
        around, times = after_turns(p, np.vstack([z, z + np.diag(STEPS), z - np.diag(STEPS)]))
        gap, derivative = around[0] - z, ((around[1:5] - around[5:]) / (2.0 * STEPS[:, None])).T
        if not np.isfinite(around).all():
            break
        if np.max(np.abs(gap) * [1.0, 1e-2, 1e-2, 1e-2]) < 1e-10:
            values = np.linalg.eigvals(derivative)
            return MotorOrbit(z, float(times[0]), values[np.argsort(-np.abs(values))].astype(complex))
        z = z - np.linalg.solve(derivative - np.eye(4), gap)
    raise NoSolution("impulse: no periodic motion with the motor was found next to the guess; is a harmonic in resonance?")
