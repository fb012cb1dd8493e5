"""Motions at constant input speed.

One-way rotation under dry friction in closed form (half-phases, mean speed) and its limits (existence, sticking, zero
mean speed); periodic orbits without friction by shooting, with Floquet multipliers, and Poincare sections.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.analytic.impulse.model import (
    Impulse,
    even_acceleration,
    first_integral,
    harmonic_motion,
    shape,
    slip_speed,
)
from mechlab.analytic.roots import brentq
from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]
NODES = 128
"""Gauss-Legendre nodes of a half-phase; its integrand is smooth, so that this number reaches double precision."""
EXISTS = "exists"
NO_BALANCE = "no such regime: the constant load M0 is not smaller than the friction M1"
TOO_WEAK = "no such regime: sin(psi_m) would exceed 1, the impulses are too weak for this load"
STICKS = "no such regime: the output shaft sticks between its half-phases"
STALLS = "no such regime: the output shaft would reach the input speed"
EDGE = 1e-9
"""Relative distance from M0 = M1 at which a search ends: at equality the forward half-phase has no duration."""
SAMPLES = 101
"""Points of the scan for the last limit: the shaft sticks under a friction near the load as well as under a large one."""


@dataclass(frozen=True)
class OneWayRegime:
    """One-way rotation (arrays (...) of one shape): mean_speed, speeds [rad/s], half-phases psi_a to psi_b forward and
    psi_b to psi_a + 2 pi back, times [s], mean motor torque [N m]; `sine` = sin(psi_m), whose limit is 1; `reason`
    (...) of strings: "exists" or why there is none; then the numbers are NaN. `without_sticking` is the mean speed by the
    formula, which ignores sticking: where the output shaft would stick, no motion has it."""

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
class HalfPhases:
    """Half-phases (arrays (...) of one shape) whether or not the motion exists: Delta [rad], sin(psi_m), psi_a, psi_b [rad], and
    `sticking_margin` [N m]: by how much the driving torque exceeds the friction where the output shaft turns round; it sticks
    where that is negative."""

    delta: Array
    sine: Array
    psi_a: Array
    psi_b: Array
    sticking_margin: Array


def phases(p: Impulse, speed: float, M0: ArrayLike, M1: ArrayLike) -> HalfPhases:
    """The half-phases of `unidirectional`; NaN where M0 >= M1 (unless both are 0); where sine > 1, only `delta`
    and `sine` are numbers."""
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
    return HalfPhases(np.asarray(delta), np.asarray(sine), np.asarray(psi_a), np.asarray(psi_b), np.asarray(margin))


def unidirectional(p: Impulse, speed: float, M0: ArrayLike | None = None, M1: ArrayLike | None = None) -> OneWayRegime:
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
        forward = half_time(p, speed, psi_a, psi_b, M0 + M1)
        back = half_time(p, speed, psi_b, psi_a + 2.0 * np.pi, M0 - M1)
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
    return OneWayRegime(
        kept(speed - 2.0 * np.pi / (p.q * total)), kept(forward), kept(back), kept(torque), kept(psi_a), kept(psi_b),
        np.asarray(sine), np.asarray(reason.astype(str)), np.asarray(speed - 2.0 * np.pi / (p.q * total)),
    )  # fmt: skip


@cache
def _legendre() -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(NODES)


def half_time(p: Impulse, speed: float, start: Array, end: Array, resisting: Array) -> Array:
    """Time [s] from psi = start, where beta' = 0, to psi = end under a constant resisting torque."""
    x, weight = _legendre()
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
        beta, rate = y.tolist()
        psi = p.q * (speed * t - beta)
        return np.array([rate, even_acceleration(p, speed, psi, rate, p.M0, beta)])

    at = None if times is None else np.asarray(times, dtype=float)
    done = solve_ivp(f, (0.0, duration), np.asarray(start, dtype=float), "DOP853", at, rtol=TOLERANCE, atol=TOLERANCE)
    return np.asarray(done.y)


def periodic_orbit(p: Impulse, speed: float) -> Orbit:
    """The orbit of period 2 pi / (q w) for c > 0, M1 = 0 by Newton's method from the harmonics.

    The Jacobian of the map is by central differences. Raises NoSolution when Newton does not converge, or when the
    output shaft would become as fast as the input shaft (resonance).
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


@dataclass(frozen=True)
class OneWayLimits:
    """Limits of the regime of `unidirectional`; None where there is none.

    existence_speed, sticking_speed: the least input speed [rad/s] at M0 and M1 for which sin(psi_m) <= 1, and for which the
    output shaft does not stick. existence_load, sticking_load: the largest M0 [N m] at M1 and the input speed.
    existence_friction, sticking_friction: the largest M1 [N m] at M0 and the input speed. standstill_load: the M0 [N m] at
    which the mean speed is 0, where it does not stick. frictionless_mean_speed [rad/s]: M0 = 0, M1 -> 0.
    """

    existence_speed: float | None
    sticking_speed: float | None
    existence_load: float | None
    sticking_load: float | None
    existence_friction: float | None
    sticking_friction: float | None
    standstill_load: float | None
    frictionless_mean_speed: float


def limits(p: Impulse, speed: float) -> OneWayLimits:
    """The limits at an input speed [rad/s]. Raises MechlabError unless speed > 0, c = 0 and 0 <= M0 < M1."""
    if not (speed > 0.0 and p.c == 0.0 and 0.0 <= p.M0 < p.M1):
        raise MechlabError(
            f"impulse: limits of one-way rotation need an input speed > 0, c = 0 and M0 < M1, got {speed:g} rad/s, "
            f"c = {p.c:g} N m/rad, M0 = {p.M0:g}, M1 = {p.M1:g} N m."
        )

    def exists(w: float, M0: float, M1: float) -> float:
        return 1.0 - float(phases(p, w, M0, M1).sine)

    def slips(w: float, M0: float, M1: float) -> float:
        """A number with the sign of the sticking margin; negative where sin(psi_m) > 1 and no motion exists."""
        found = phases(p, w, M0, M1)
        return float(found.sticking_margin) / M1 if found.sine <= 1.0 else 1.0 - float(found.sine) - 1.0

    least = speed * float(np.sqrt(phases(p, speed, p.M0, p.M1).sine))  # sin(psi_m) goes with 1 / w^2
    largest = 2.0 * p.M1

    def of_load(f: Callable[[float, float, float], float]) -> float | None:
        return _last(lambda x: f(speed, min(x, p.M1 * (1.0 - EDGE)), p.M1), 0.0, p.M1)

    def of_friction(f: Callable[[float, float, float], float]) -> float | None:
        low, high = (p.M0 * (1.0 + EDGE) if p.M0 > 0.0 else EDGE * p.M1), largest
        while f(speed, p.M0, high) > 0.0:
            high *= 2.0
        return _last(lambda x: f(speed, p.M0, x), low, high)

    def fast() -> float:
        high = 2.0 * least
        while slips(high, p.M0, p.M1) < 0.0:
            high *= 2.0
        return float(brentq(lambda w: slips(w, p.M0, p.M1), least, high, xtol=1e-13 * least, rtol=1e-14))

    sticking_load = of_load(slips)
    return OneWayLimits(
        least, fast(), of_load(exists), sticking_load, of_friction(exists), of_friction(slips),
        _standstill(p, speed, sticking_load), frictionless_mean_speed(p, speed),
    )  # fmt: skip


def _last(f: Callable[[float], float], low: float, high: float) -> float | None:
    """The last x at which f falls through 0; None where f < 0 at all samples, `high` where f(high) >= 0."""
    x = np.linspace(low, high, SAMPLES)
    above = np.flatnonzero([f(float(y)) >= 0.0 for y in x])
    if not len(above):
        return None
    k = int(above[-1])
    return high if k == SAMPLES - 1 else float(brentq(f, x[k], x[k + 1], xtol=1e-13 * high, rtol=1e-14))


def _standstill(p: Impulse, speed: float, largest: float | None) -> float | None:
    """M0 between 0 and `largest` at which the mean speed is 0."""
    if largest is None:
        return None

    def mean(M0: float) -> float:
        return float(unidirectional(p, speed, M0, p.M1).without_sticking)

    ends = mean(0.0), mean(largest * (1.0 - EDGE))
    if not ends[0] * ends[1] <= 0.0:
        return None
    return float(brentq(mean, 0.0, largest * (1.0 - EDGE), xtol=1e-13 * largest, rtol=1e-14))
