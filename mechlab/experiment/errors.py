"""The error of a run: the order with which it falls with the timestep, the error that remains, and the error of every channel.

    p = log2(|x(h) - x(h/2)| / |x(h/2) - x(h/4)|),     error of x(h) ~ |x(h) - x(kh)| / (k^p - 1)      (Richardson)

A method whose order is lost is wrong in a way that neither closure nor energy shows. The error of a channel follows from a second
run of the same scene,

    error = factor max_t |x(t) - y(t)|,     plus a few units in the last place of the largest value,

x being the run that is kept and y a coarser or other one: factor 1 where nothing is known of how fast runs converge,
1 / (2^p - 1) for a step twice as large with a method of order p.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from mechlab.experiment.recording import Finding, Health, Recording
from mechlab.experiment.scene import Settings
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

SLACK = 0.5
"""An order that is lower than expected by more than this is lost; orders are whole numbers, so this is half their
distance."""
ROUNDING = 1e-12
"""Changes below this, relative to the largest value (at least 1), are rounding and give no order."""
CONVERGENT = 0.4
"""An observed order below this counts as no convergence."""
SAFETY = 2.0
"""A stated error is Richardson's estimate times this factor, so that it bounds the true error."""
SAFETY_SEEN = 1.5
"""The safety factor where both a finer and a coarser run show the order."""


@dataclass(frozen=True)
class Order:
    """expected and measured order; `coarse` |x(h) - x(h/2)| and `fine` |x(h/2) - x(h/4)| [rad or m]. `measured` is NaN
    where the changes are rounding, or a run ended early (`reason` says which)."""

    expected: int
    measured: float
    coarse: float
    fine: float
    reason: str = ""

    @property
    def lost(self) -> bool:
        """True when the order is lower than expected."""
        return self.measured < self.expected - SLACK


def expected_order(settings: Settings, rows: bool) -> int:
    """Order of the positions: 4 for RK4, 1 for the other fixed-step methods; 2 for RK4 with MuJoCo's constraint rows
    (loops, gears), which are springs with a softness proportional to h^2."""
    if settings.integrator != "RK4":
        return 1
    return 2 if rows and settings.engine == "mujoco" else 4


def observed_order(states: Callable[[float], Array], timestep: float, expected: int) -> Order:
    """The order of a run from the steps h = timestep, its half and quarter.

    states(h): coordinates (n, nq) at n times that do not depend on h; fewer than n rows for a run that ended early.
    """
    runs = [np.asarray(states(timestep / 2**k), dtype=float) for k in range(3)]
    if len({x.shape for x in runs}) > 1 or not all(np.all(np.isfinite(x)) for x in runs):
        return Order(expected, math.nan, math.nan, math.nan, "a run did not come through")
    coarse, fine = (float(np.max(np.abs(a - b), initial=0.0)) for a, b in zip(runs[:2], runs[1:], strict=True))
    floor = ROUNDING * max(1.0, float(np.max(np.abs(runs[2]), initial=0.0)))
    if coarse <= 8.0 * floor or fine <= floor:
        return Order(expected, math.nan, coarse, fine, "the change with the step is rounding")
    return Order(expected, math.log2(coarse / fine), coarse, fine)


def order_finding(order: Order, timestep: float, why: Iterable[str] = ()) -> Finding:
    """Finding "order": a warning with expected and measured order when the order is lost; `why`: possible causes."""
    if math.isnan(order.measured):
        severity = "ok" if "rounding" in order.reason else "warning"
        text = f"order check at steps of {timestep:g} s, its half and quarter: {order.reason}; the order cannot be told"
        return Finding("order", float(order.expected), float(order.expected), "", severity, text)
    text = (
        f"order of the error: expected {order.expected}, measured {order.measured:.2f} (changes of {order.coarse:.3g} and "
        f"{order.fine:.3g} rad or m from steps of {timestep:g} s to half and quarter)"
    )
    if not order.lost:
        return Finding("order", order.measured, order.expected - SLACK, "", "ok", text)
    text += (
        "; the run does not converge" if order.measured < CONVERGENT else "; smaller steps help less than they should"
    )
    reasons = ", ".join(why)
    text += f". What may have lowered it: {reasons}" if reasons else ""
    return Finding("order", order.measured, order.expected - SLACK, "", "warning", text)


def error_from_coarser(twice: float, fourfold: float | None, order: int) -> float:
    """Error of x(h) [rad or m] from its changes against x(2h) and x(4h), for a method of at most order `order`.

    It uses the observed order p = log2(fourfold / twice - 1), clipped to 1..`order`. Where the observed order is above
    `order`, h and 2h agree by accident (a kink, or error terms that cancel), and the larger estimate counts. fourfold
    None: the run with 4h ended early; then the order is taken as 2 at most.
    """
    if fourfold is None:
        return SAFETY * twice / (2.0 ** min(order, 2) - 1.0)
    seen = math.log2(fourfold / twice - 1.0) if 0.0 < twice < 0.5 * fourfold else 0.0 if twice > 0.0 else math.inf
    p = min(max(seen, 1.0), order)
    return SAFETY * max(twice / (2.0**p - 1.0), fourfold / (4.0**p - 1.0))


def error_from_finer(change: float, share: float) -> float:
    """Error of x(h) [rad or m] from its change against x(share h), share < 1: a bound for any order of at least 1."""
    return SAFETY * change / (1.0 - share)


def error_from_near(change: float, factor: float, twice: float | None, order: int) -> float:
    """Error of x(h) [rad or m] from its change against x(factor h), 1 < factor < 2. Without the change against x(2h) it bounds
    any order of at least 1. With it the order is what twice / change shows, (2^p - 1) / (factor^p - 1), clipped to 1 and the smaller
    of `order` and 2, and the smaller factor SAFETY_SEEN is enough."""
    if twice is None or not change > 0.0:
        return SAFETY * change / (factor - 1.0)
    first, second = 1.0 / (factor - 1.0), 3.0 / (factor**2 - 1.0)
    p = min(max(1.0 + (twice / change - first) / (second - first), 1.0), order, 2.0)
    return SAFETY_SEEN * change / (factor**p - 1.0)


def error_between(half: float, twice: float, order: int) -> float:
    """Error of x(h) [rad or m] from its changes against x(h/2) and x(2h), by the order p = log2(twice / half), clipped
    to 1 and the smaller of `order` and 2. The observed order allows the smaller factor SAFETY_SEEN."""
    p = min(max(math.log2(twice / half), 1.0), order, 2.0) if half > 0.0 and twice > 0.0 else 1.0
    return SAFETY_SEEN * half / (1.0 - 0.5**p)


SMALLER = "take a smaller timestep or --max-error"
"""Advice where the timestep is what is wrong."""


def step_error_finding(value: float, tolerance: float, text: str, advice: str = SMALLER) -> Finding:
    """Finding "step_error": the error that the timestep leaves [rad or m]; severity "error", with the advice, beyond the scene's
    tolerance."""
    sentence = f"error left by the timestep: at most about {value:.2g} rad or m {text}"
    if value <= tolerance:
        return Finding("step_error", value, tolerance, "rad or m", "ok", f"{sentence} (tolerance {tolerance:g})")
    sentence += f", beyond the tolerance {tolerance:g} of the scene; {advice}"
    return Finding("step_error", value, tolerance, "rad or m", "error", sentence)


SAME_TIME = 1e-9
"""Two recorded times are equal when they differ by at most this share of the duration."""
UNITS = 16.0 * 2.2e-16
"""Least error of a channel by rounding, relative to its largest value."""


def differences(fine: Recording, coarse: Recording, factor: float) -> dict[str, float]:
    """Channel of `fine` -> `factor` times its largest difference from `coarse` at the times of both, in its unit.

    Infinite for a channel that `coarse` lacks, or with a value that is finite in one run only; infinite for all
    channels where `coarse` does not reach the end of `fine` or shares fewer than two of its times. Angles are not
    reduced modulo 2 pi.
    """
    mine, other = shared_times(fine, coarse)
    reaches = len(mine) > 1 and mine[-1] == len(fine.t) - 1 or len(fine.t) == 1 == len(mine)
    names = [n for n in fine.channels if reaches and n in coarse.channels and math.isfinite(factor)]
    out = dict.fromkeys(fine.channels, math.inf)
    if names:
        a, b = (np.array([r.channels[n] for n in names], dtype=float) for r in (fine, coarse))
        gaps, sizes = _gaps(a[:, mine], b[:, other]).max(axis=1), np.abs(np.where(np.isfinite(a), a, 0.0)).max(axis=1)
        out |= dict(zip(names, (factor * gaps + UNITS * sizes).tolist(), strict=True))
    return out


def with_errors(recording: Recording, others: Sequence[tuple[Recording, float]]) -> Recording:
    """The recording with the error of every channel: the sum of the `differences` to the others, each with its factor.

    Infinite without other runs. The finding "channel_errors" names the channels whose error could not be estimated.
    """
    found = [differences(recording, other, factor) for other, factor in others]
    errors = {n: sum(x[n] for x in found) if found else math.inf for n in recording.channels}
    unknown = [n for n, e in errors.items() if not math.isfinite(e)]
    if not unknown:
        return replace(recording, errors=errors)
    which = "any channel" if len(unknown) == len(errors) else ", ".join(unknown)
    text = f"the error of {which} could not be estimated: no second run tells it"
    finding = Finding("channel_errors", float(len(unknown)), 0.0, "channels", "warning", text)
    return replace(recording, errors=errors, health=recording.health + Health((finding,)))


def shared_times(a: Recording, b: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the samples of `a` and of `b` at the times that both recorded."""
    near = np.clip(np.searchsorted(b.t, a.t), 1, max(len(b.t) - 1, 1)) if len(b.t) > 1 else np.zeros(len(a.t), int)
    if len(b.t) > 1:
        near -= np.abs(b.t[near - 1] - a.t) < np.abs(b.t[near] - a.t)
    span = max(float(a.t[-1] - a.t[0]), 1e-12)
    mine = np.flatnonzero(np.abs(b.t[near] - a.t) <= SAME_TIME * span)
    return mine, near[mine]


def largest_difference(a: np.ndarray, b: np.ndarray, factor: float = 1.0) -> float:
    """factor max |a - b|; values that are not finite have difference 0 where both are the same, else infinity."""
    return float(factor * np.max(_gaps(a, b), initial=0.0))


def _gaps(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """|a - b|; of values that are not finite 0 where both are the same, else infinity."""
    with np.errstate(invalid="ignore"):
        gaps = np.abs(a - b)
    if np.isfinite(gaps).all():
        return gaps
    same = (a == b) | (np.isnan(a) & np.isnan(b))
    return np.where(same, 0.0, np.where(np.isfinite(gaps), gaps, math.inf))
