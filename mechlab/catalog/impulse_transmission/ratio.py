"""Which ratio q the source drew its figures with: motions of every candidate against the readable numbers on the axes.

The fraction q is damaged in the scan: it shows 4 over 5 in two of three sets, one sign like a g in the third; 4/5 itself is b/k, which
leaves (7) without its third harmonic. Axes are
drawn to fit their curves, so the outermost number of an axis is closer to the end of the curve than one step of the grid. The misfit of
an axis end is how much farther the curve ends, over the span of the axis. Both orders of the torques M1 and Mn are tried, and for figure 4,
whose initial angle has lost its comma, every initial phase; figure 5 has no initial state, so its steady motion is taken, by the motor's
static characteristic. The axis of figure 3 has no readable number.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any, cast

import numpy as np

from mechlab.analytic.impulse import Impulse, harmonic_motion, slope, unidirectional
from mechlab.catalog.impulse_transmission.scenes import FIGURE_7, SPEED, of_scene
from mechlab.kit.portrait import flow
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

CANDIDATES = {"4/5": 4 / 5, "4/3": 4 / 3, "5/3": 5 / 3, "3/5": 3 / 5, "4/9": 4 / 9, "4/6": 4 / 6, "4/7": 4 / 7, "4/8": 4 / 8, "4/2": 2.0}
ORDERS = {"M1, Mn": "", "Mn, M1": "-swapped"}
PHASES = 24
"""Initial phases of the planets that are tried for figure 4, besides that of 1.127 rad."""
TIMESTEP, WIDTH = 2.5e-4, 0.4
"""Timestep [s], and rate [rad/s] below which dry friction is smoothed: wide enough for RK4 to be stable at M1 = 750."""


@dataclass(frozen=True)
class Axis:
    """Readable numbers of an axis: the outermost, and the steps of the grid that the end of a curve may lie from each."""

    figure: str
    low: float
    high: float
    step: float
    hidden: int = 0

    def inside(self, low: float, high: float) -> bool:
        """Whether a curve stays within a step of the outermost numbers."""
        return bool(low > self.low - self.step and high < self.high + (1 + self.hidden) * self.step)

    def misfit(self, low: Any, high: Any) -> Any:
        """How far the ends of a curve lie from the numbers beyond a step, over the span of the axis; the larger end. hidden: places of
        numbers that the name of the axis covers at its upper end."""
        below = np.abs(np.asarray(low) - self.low) - self.step
        missing, beyond = (self.high - self.step) - np.asarray(high), np.asarray(high) - (self.high + (1 + self.hidden) * self.step)
        return np.maximum(0.0, np.maximum(below, np.maximum(missing, beyond))) / (self.high - self.low)


AXES = {
    "figure 2": Axis("figure 2, beta' [rad/s]", -4.0, 4.0, 2.0),
    "figure 4": Axis("figure 4, beta [rad]", -0.3, 0.3, 0.1),
    "figure 5": Axis("figure 5, beta [rad]", 18.4, 19.4, 0.2),
    "figure 7": Axis("figure 7, beta [rad]", -0.1, 0.08, 0.02, hidden=1),
}
"""The name of the axis stands where 0.1 would in figure 7. The numbers 20 and -10 of its axis of beta' fit every candidate."""


@dataclass(frozen=True)
class Fit:
    """A candidate with one order of the torques: the range of the curve in each figure and its misfit; alpha_0 [rad] is the initial angle
    of figure 4 that fits best, printed_alpha_0 the range of its curve from 1.127 rad."""

    q: str
    order: str
    ranges: dict[str, tuple[float, float]]
    misfits: dict[str, float]
    alpha_0: float
    printed_alpha_0: tuple[float, float]

    @property
    def order_exchanged(self) -> bool:
        """Whether the second torque of the lists is taken for M1."""
        return bool(ORDERS[self.order])

    @property
    def total(self) -> float:
        """Root of the mean square of the misfits."""
        return self.without()

    def without(self, *figures: str) -> float:
        """Root of the mean square of the misfits, without those of some figures."""
        return float(np.sqrt(np.mean([x**2 for name, x in self.misfits.items() if name not in figures])))


@cache
def fits() -> tuple[Fit, ...]:
    """Every candidate in both orders, the best one first."""
    sets = [(q, order) for q in CANDIDATES for order in ORDERS]
    second = _motions([_set("fig2", q, order) for q, order in sets], np.zeros(1), 0.08)
    fourth = [_set("fig4", q, order) for q, order in sets]
    alpha = 1.127 + 2.0 * np.pi * np.arange(PHASES + 1)[:, None] / (PHASES * np.array([p.q for p in fourth]))
    swings = _motions(fourth, alpha[:-1], 0.3)
    found = []
    for k, (q, order) in enumerate(sets):
        misfit_4 = AXES["figure 4"].misfit(*swings[:, k, :, 0].T)
        best = int(np.argmin(misfit_4))
        ranges = {
            "figure 2": _pair(second[0, k, :, 1]), "figure 4": _pair(swings[best, k, :, 0]), "figure 5": _steady(q, order),
            "figure 7": _loop(CANDIDATES[q]),
        }  # fmt: skip
        misfits = {name: float(AXES[name].misfit(*ranges[name])) for name in AXES}
        found.append(Fit(q, order, ranges, misfits, float(alpha[best, k]), _pair(swings[0, k, :, 0])))
    return tuple(sorted(found, key=lambda fit: fit.total))


def _pair(x: Array) -> tuple[float, float]:
    return float(x[0]), float(x[1])


def _set(scene: str, q: str, order: str) -> Impulse:
    return replace(of_scene(scene + ORDERS[order]).impulse, q=CANDIDATES[q])


class _Stacked:
    """Several transmissions as one whose constants are arrays (transmissions,): what `slope` needs of them."""

    def __init__(self, several: list[Impulse]) -> None:
        for name in ("q", "M0", "M1", "Mn", "nominal_speed", "speed_per_torque", "tau", "c"):
            setattr(self, name, np.array([getattr(p, name) for p in several]))
        self.inertias = tuple(np.array([p.inertias for p in several]).T)


def _motions(several: list[Impulse], alpha_0: Array, duration: float) -> Array:
    """(starts, transmissions, 2 ends, 2) least and largest beta and beta', from the initial state of the figure, but from alpha_0
    (starts,) or (starts, transmissions), by RK4 with smoothed friction: all at once."""
    p = of_scene("fig2" if duration < 0.1 else "fig4")
    start = np.empty((len(alpha_0), len(several), 5))
    start[:] = p.start
    start[..., 0] = np.reshape(alpha_0, (len(alpha_0), -1))
    stacked = cast(Impulse, _Stacked(several))
    y = flow(lambda t, y: slope(stacked, y, WIDTH), start, duration, TIMESTEP, int(round(duration / 1e-3)) + 1)[1]
    return np.stack([y[..., [1, 3]].min(axis=0), y[..., [1, 3]].max(axis=0)], axis=-2)


def _loop(q: float) -> tuple[float, float]:
    """Least and largest beta of the loop of figure 7, by three harmonics."""
    i = replace(FIGURE_7, q=q)
    beta = harmonic_motion(i, SPEED, np.linspace(0.0, 2.0 * np.pi / (q * SPEED), 401))[0]
    return float(beta.min()), float(beta.max())


def _steady(q: str, order: str) -> tuple[float, float]:
    """Least and largest beta of the steady rotation of figure 5 within 1 s, moved so that both ends fit equally well: no initial state
    is printed, and any common shift of both angles is a motion too."""
    p, speed = _set("fig5", q, order), SPEED
    for _ in range(30):  # speed at which the motor gives the mean torque that the regime takes
        regime = unidirectional(p, speed)
        speed = p.nominal_speed + p.speed_per_torque * (p.Mn - float(regime.mean_motor_torque))
    extent = float(regime.mean_speed) + ripple(p, speed)
    middle = 0.5 * (AXES["figure 5"].low + AXES["figure 5"].high)
    return middle - 0.5 * extent, middle + 0.5 * extent


def ripple(p: Impulse, speed: float) -> float:
    """Advance of beta in the forward half of a cycle without the mean advance [rad]: how far a second that begins and ends at the
    best moments exceeds the mean speed."""
    found = unidirectional(p, speed)
    # psi = q (w t - beta): beta over the forward half is w t1 - (psi_b - psi_a) / q.
    forward = speed * float(found.forward_time) - float(found.psi_b - found.psi_a) / p.q
    return forward - float(found.mean_speed) * float(found.forward_time)
