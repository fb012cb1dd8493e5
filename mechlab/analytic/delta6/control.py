"""Error law of the computed-torque control, and the target motion of the source.

Command: a_T + kv (v_T - v) + kp (x_T - x). With an exact model the error e = x - x_T obeys e'' + kv e' + kp e = 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6.geometry import FloatArray, finite, freeze, number, vectors
from mechlab.analytic.roots import brentq
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

SOURCE_START_ANGLES = freeze([0.05, 0.1, 0.3])
"""alpha, beta, gamma of the source's example at t = 0, rad."""

SOURCE_START_RATES = freeze([0.6, 0.8, 0.4])
"""Their rates at t = 0, rad/s."""

SOURCE_VELOCITY_GAIN = 240.0
"""kv, 1/s, in the order in which the source lists its two gains."""

SOURCE_POSITION_GAIN = 480.0
"""kp, 1/s^2."""


@dataclass(frozen=True)
class ControlTargets:
    """Wanted alpha, beta, gamma with rates and accelerations, each (..., 3)."""

    angles: FloatArray
    rates: FloatArray
    accelerations: FloatArray


@dataclass(frozen=True)
class ErrorResponse:
    """Error and its rate, in the broadcast shape of the inputs."""

    error: FloatArray
    error_rate: FloatArray


def source_targets(time: ArrayLike) -> ControlTargets:
    """alpha = .1 sin 10t, beta = .1 cos 10t, gamma = .2 sin 5t. time (...) -> (..., 3), s, rad."""
    t = finite("time", time)
    s10, c10, s5, c5 = np.sin(10.0 * t), np.cos(10.0 * t), np.sin(5.0 * t), np.cos(5.0 * t)
    return ControlTargets(
        np.stack([0.1 * s10, 0.1 * c10, 0.2 * s5], axis=-1),
        np.stack([c10, -s10, c5], axis=-1),
        np.stack([-10.0 * s10, -10.0 * c10, -5.0 * s5], axis=-1),
    )


SOURCE_START_ERRORS = freeze(SOURCE_START_ANGLES - source_targets(0.0).angles)
"""Errors of alpha, beta, gamma of the source's example at t = 0, actual - target, rad."""

SOURCE_START_ERROR_RATES = freeze(SOURCE_START_RATES - source_targets(0.0).rates)
"""Their rates at t = 0, rad/s."""


def command(
    targets: ControlTargets,
    angles: ArrayLike,
    rates: ArrayLike,
    velocity_gain: float = SOURCE_VELOCITY_GAIN,
    position_gain: float = SOURCE_POSITION_GAIN,
) -> FloatArray:
    """Commanded accelerations a_T + kv (v_T - v) + kp (x_T - x), (..., 3), rad/s^2."""
    return np.asarray(
        targets.accelerations
        + velocity_gain * (targets.rates - vectors("rates", rates))
        + position_gain * (targets.angles - vectors("angles", angles))
    )


def error_response(
    time: ArrayLike, error: ArrayLike, error_rate: ArrayLike, velocity_gain: ArrayLike, position_gain: ArrayLike
) -> ErrorResponse:
    """Solution of e'' + kv e' + kp e = 0 from e(0) = error, e'(0) = error_rate.

    With a = kv/2, w = sqrt(a^2 - kp), C = e^-at cosh wt, S = e^-at sinh(wt) / w: e = e0 C + (e0' + a e0) S and
    e' = e0' C - (kp e0 + a e0') S. For a^2 < kp cosh and sinh become cos and sin; S is evaluated so that it passes
    smoothly through critical damping. All arguments broadcast: time[:, None] with errors of shape (3,) gives (n, 3).
    """
    t, e0, r0, kv, kp = np.broadcast_arrays(
        finite("time", time),
        finite("error", error),
        finite("error_rate", error_rate),
        finite("velocity_gain", velocity_gain),
        finite("position_gain", position_gain),
    )
    a = 0.5 * kv
    square = a * a - kp
    w = np.sqrt(np.abs(square))
    over = square >= 0.0
    real_w, imaginary_w = np.where(over, w, 0.0), np.where(over, 0.0, w)
    # kp / (a + w) is the slow root without the cancellation of a - w; both agree up to rounding elsewhere.
    slow = np.where(over & (a > 0.0), -kp / np.where(a > 0.0, a + real_w, 1.0), real_w - a)
    envelope = np.exp(np.where(over, slow, -a) * t)
    decay = 2.0 * real_w * t
    c = envelope * np.where(over, 0.5 * (1.0 + np.exp(-decay)), np.cos(imaginary_w * t))
    s = envelope * t * np.where(over, _one_minus_exp(decay), np.sinc(imaginary_w * t / np.pi))
    return ErrorResponse(np.asarray(e0 * c + (r0 + a * e0) * s), np.asarray(r0 * c - (kp * e0 + a * r0) * s))


def settling_time(
    error: ArrayLike, error_rate: ArrayLike, velocity_gain: float, position_gain: float, limit: ArrayLike
) -> FloatArray:
    """The time [s] after which |e| stays below `limit`, for the solution of `error_response`; 0 where it always does.

    error and error_rate (..., k) at t = 0, limit (...) -> (..., k). |e(t)| <= exp(-s t) (|e0| + (|e0'| + kv |e0| / 2) t),
    s the slower decay rate, bounds where the last crossing can be. Raises MechlabError unless both gains and the limit
    are above 0: otherwise the error need not settle.
    """
    kv, kp = number("velocity_gain", velocity_gain, above=0.0), number("position_gain", position_gain, above=0.0)
    bound = finite("limit", limit)
    if np.any(bound <= 0.0):
        raise MechlabError(f"limit = {float(bound.min()):g}; expected more than 0 rad")
    e, r, b = np.broadcast_arrays(finite("error", error), finite("error_rate", error_rate), bound[..., None])
    flat = [
        _last_crossing(*x, kv, kp) for x in zip(e.ravel().tolist(), r.ravel().tolist(), b.ravel().tolist(), strict=True)
    ]
    return np.array(flat).reshape(e.shape)


def _last_crossing(e0: float, r0: float, limit: float, kv: float, kp: float) -> float:
    a, w = 0.5 * kv, np.sqrt(abs(0.25 * kv * kv - kp))
    overdamped = a * a >= kp
    decay = kp / (a + w) if overdamped else a
    end = 1.0 / decay
    while np.exp(-decay * end) * (abs(e0) + (abs(r0) + a * abs(e0)) * end) > limit:
        end *= 2.0
    count = 2000 + int(20 * (0.0 if overdamped else w) * end)
    # the fast root acts near 0
    t = np.unique(np.concatenate([np.linspace(0.0, end, count), np.geomspace(1e-6 / kv, end, 2000)]))

    def rate(x: float) -> float:
        return float(error_response(x, e0, r0, kv, kp).error_rate)

    def excess(x: float) -> float:
        return abs(float(error_response(x, e0, r0, kv, kp).error)) - limit

    rates = error_response(t, e0, r0, kv, kp).error_rate
    turns = [brentq(rate, t[k], t[k + 1]) for k in np.flatnonzero(rates[:-1] * rates[1:] < 0.0)]
    t = np.unique(np.concatenate([t, turns]))
    above = np.flatnonzero(np.abs(error_response(t, e0, r0, kv, kp).error) > limit)
    if not len(above):
        return 0.0
    return float(brentq(excess, t[above[-1]], t[above[-1] + 1], xtol=1e-14))


def _one_minus_exp(x: FloatArray) -> FloatArray:
    """(1 - e^-x) / x, 1 at x = 0."""
    safe = np.where(x == 0.0, 1.0, x)
    return np.asarray(np.where(x == 0.0, 1.0, -np.expm1(-safe) / safe))
