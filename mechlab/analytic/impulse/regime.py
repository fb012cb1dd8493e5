"""One-way rotation under dry friction at constant input speed: exact half-phases, mean speed, existence limit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.analytic.impulse.integral import first_integral, slip_speed
from mechlab.analytic.impulse.model import Impulse, shape

Array = NDArray[np.float64]
NODES = 128
"""Gauss-Legendre nodes of a half-phase; its integrand is smooth, so that they exhaust double precision."""
EXISTS = "exists"
NO_BALANCE = "no such regime: the constant load M0 is not smaller than the friction M1"
TOO_WEAK = "no such regime: sin(psi_m) would exceed 1, the impulses are too weak for this load"
STICKS = "no such regime: the output shaft sticks between its half-phases"
STALLS = "no such regime: the output shaft would reach the input speed"


@dataclass(frozen=True)
class Regime:
    """One-way rotation (arrays (...) of one shape): mean_speed, speeds [rad/s], half-phases psi_a to psi_b forward and
    psi_b to psi_a + 2 pi back, times [s], mean motor torque [N m]; `sine` = sin(psi_m), whose limit is 1; `reason`
    (...) of strings: "exists" or why there is none; then the numbers are NaN. `without_sticking` is the mean speed by the
    formula also where the output shaft would stick, which the formula does not know: there it is no motion."""

    mean_speed: Array
    forward_time: Array
    return_time: Array
    mean_motor_torque: Array
    psi_a: Array
    psi_b: Array
    sine: Array
    reason: NDArray[np.str_]
    without_sticking: Array

    @property
    def exists(self) -> NDArray[np.bool_]:
        """(...) where the regime exists."""
        return np.asarray(self.reason == EXISTS)


@dataclass(frozen=True)
class Phases:
    """Half-phases (arrays (...) of one shape) whether or not the motion exists: Delta [rad], sin(psi_m), psi_a, psi_b [rad], and
    `sticking_margin` [N m]: by how much the driving torque exceeds the friction where the output shaft turns round; it sticks
    where that is negative."""

    delta: Array
    sine: Array
    psi_a: Array
    psi_b: Array
    sticking_margin: Array


def phases(p: Impulse, speed: float, M0: ArrayLike, M1: ArrayLike) -> Phases:
    """The half-phases of `unidirectional`; NaN where M0 >= M1 (unless both are 0) or, beside `delta` and `sine`, sine > 1."""
    M0, M1 = np.broadcast_arrays(np.asarray(M0, dtype=float), np.asarray(M1, dtype=float))
    s = shape(p)
    strength = (s.a6 - s.a5) * speed**2
    balanced = (M1 > M0) | ((M0 == 0.0) & (M1 == 0.0))
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.where(M1 > 0.0, M0 / np.where(M1 > 0.0, M1, 1.0), 0.0)
        delta = np.where(balanced, np.pi * (1.0 - ratio), np.nan)
        sine = (M0 + M1) * delta / (2.0 * strength * np.sin(0.5 * delta))
        middle = np.pi - np.arcsin(sine)
        psi_a, psi_b = middle - 0.5 * delta, middle + 0.5 * delta
        # At standstill the driving torque must overcome the friction, forwards at psi_a and backwards at psi_b.
        margin = np.minimum(strength * np.sin(psi_a) - (M0 + M1), (M0 - M1) - strength * np.sin(psi_b))
    return Phases(np.asarray(delta), np.asarray(sine), np.asarray(psi_a), np.asarray(psi_b), np.asarray(margin))


def unidirectional(p: Impulse, speed: float, M0: ArrayLike | None = None, M1: ArrayLike | None = None) -> Regime:
    """The regime in which the output shaft goes forward once and back once per turn of the planets, without sticking.

    Delta = psi_b - psi_a = pi (1 - M0/M1), sin(psi_m) = (M0 + M1) Delta / (2 (a6 - a5) w^2 sin(Delta/2)), psi_m the
    middle, pi - asin; speeds from the first integral; mean speed = w - 2 pi / (q (t1 + t2)). M0, M1 (...) default to
    those of p; with M0 = M1 = 0 the limit M1 -> 0 at M0 = 0. c must be 0 (MechlabError).
    """
    M0, M1 = np.broadcast_arrays(
        np.asarray(p.M0 if M0 is None else M0, dtype=float), np.asarray(p.M1 if M1 is None else M1, dtype=float)
    )
    found = phases(p, speed, M0, M1)
    sine, psi_a, psi_b = found.sine, found.psi_a, found.psi_b
    with np.errstate(invalid="ignore", divide="ignore"):
        forward = _half(p, speed, psi_a, psi_b, M0 + M1)
        back = _half(p, speed, psi_b, psi_a + 2.0 * np.pi, M0 - M1)
        sticks = found.sticking_margin < 0.0
    reason = np.full(M0.shape, EXISTS, dtype=object)
    total = forward + back
    reason[np.asarray(~np.isfinite(total))] = STALLS
    reason[np.asarray(sticks)] = STICKS
    reason[np.asarray(~(np.abs(sine) <= 1.0))] = TOO_WEAK
    reason[np.isnan(found.delta)] = NO_BALANCE
    good = reason == EXISTS

    def kept(x: Array) -> Array:
        return np.where(good, x, np.nan)

    torque = ((M0 + M1) * forward + (M0 - M1) * back) / total
    return Regime(
        kept(speed - 2.0 * np.pi / (p.q * total)), kept(forward), kept(back), kept(torque), kept(psi_a), kept(psi_b),
        np.asarray(sine), np.asarray(reason.astype(str)), np.asarray(speed - 2.0 * np.pi / (p.q * total)),
    )  # fmt: skip


def _half(p: Impulse, speed: float, start: Array, end: Array, resisting: Array) -> Array:
    """Time [s] from psi = start, where beta' = 0, to psi = end under a constant resisting torque."""
    x, weight = np.polynomial.legendre.leggauss(NODES)
    start, end, resisting = start[..., None], end[..., None], resisting[..., None]
    psi = start + 0.5 * (end - start) * (x + 1.0)
    energy = first_integral(p, speed, start, speed, resisting)
    slip = slip_speed(p, speed, psi, energy, resisting)
    return np.asarray(np.sum(weight / (p.q * slip), axis=-1) * 0.5 * (end - start)[..., 0])


def frictionless_mean_speed(p: Impulse, speed: float) -> float:
    """Mean speed [rad/s] in the limit M1 -> 0 at M0 = 0: w [1 - 2 pi / int sqrt((B3 + b3 cos x)/(B3 + 2 nm k h cos x))].

    It does not depend on the friction. The trapezoidal rule over a period is spectrally accurate. NaN when the shaft
    would reach the input speed.
    """
    s = shape(p)
    cos = np.cos(2.0 * np.pi * np.arange(512) / 512)
    with np.errstate(invalid="ignore", divide="ignore"):
        turn = 2.0 * np.pi * np.mean(np.sqrt((s.B3 + s.b3 * cos) / (s.B3 + 2.0 * p.nm * p.k * p.h * cos)))
    return float(speed * (1.0 - 2.0 * np.pi / turn))
