"""Travelling along a curve: the parameter at an arc length, and where to begin to brake."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.bspline.curve import BSpline, FloatArray
from mechlab.analytic.bspline.length import fine_pieces, integrals
from mechlab.errors import MechlabError, NoSolution

ITERATIONS = 60


@dataclass(frozen=True)
class Travel:
    """Arc length s and parameter u of a curve, one from the other. The table has one entry for each smooth piece."""

    curve: BSpline

    @cached_property
    def _table(self) -> tuple[FloatArray, FloatArray]:
        pieces = fine_pieces(self.curve)
        lengths = integrals(self.curve, pieces)
        return pieces, np.concatenate([[0.0], np.cumsum(lengths)])

    @property
    def length(self) -> float:
        """Length of the curve."""
        return float(self._table[1][-1])

    def length_at(self, u: ArrayLike) -> FloatArray:
        """s(u), any shape; u is clipped to the curve."""
        pieces, sums = self._table
        v = np.clip(np.asarray(u, dtype=np.float64), self.curve.start, self.curve.end)
        k = np.clip(np.searchsorted(pieces[:, 2], v.ravel()), 0, len(pieces) - 1)
        part = pieces[k].copy()
        part[:, 2] = v.ravel()
        return np.asarray((sums[k] + integrals(self.curve, part)).reshape(v.shape))

    def parameter_at(self, s: ArrayLike) -> FloatArray:
        """u(s), any shape: Newton from the secant of its piece, kept inside a bracket that bisection shrinks, so that a
        cusp, where du/ds is unbounded, does no harm. Raises MechlabError for s outside the curve."""
        pieces, sums = self._table
        wanted = np.asarray(s, dtype=np.float64)
        if np.any(wanted < -1e-9 * sums[-1]) or np.any(wanted > (1 + 1e-9) * sums[-1]):
            raise MechlabError(
                f"s: expected 0 to {sums[-1]:.10g}, got {float(wanted.min()):.10g} to {float(wanted.max()):.10g}."
            )
        flat = np.clip(wanted.ravel(), 0.0, sums[-1])
        k = np.clip(np.searchsorted(sums, flat, side="right") - 1, 0, len(pieces) - 1)
        low, high = pieces[k, 1].copy(), pieces[k, 2].copy()
        rise = sums[k + 1] - sums[k]
        u = low + (high - low) * np.divide(flat - sums[k], rise, out=np.zeros(len(flat)), where=rise > 0)
        for _ in range(ITERATIONS):
            part = pieces[k].copy()
            part[:, 2] = u
            miss = sums[k] + integrals(self.curve, part) - flat
            low, high = np.where(miss < 0, u, low), np.where(miss > 0, u, high)
            speed = self.curve.speed(u)
            newton = u - np.divide(miss, speed, out=np.full(len(u), np.inf), where=speed > 0)
            inside = (newton > low) & (newton < high)
            following = np.where(miss == 0.0, u, np.where(inside, newton, 0.5 * (low + high)))
            done = np.abs(following - u) <= 4 * np.finfo(float).eps * np.maximum(1.0, np.abs(u))
            u = following
            if done.all():
                break
        return np.asarray(u.reshape(wanted.shape))


@dataclass(frozen=True)
class Braking:
    """Where braking begins: distance before the end, arc length and parameter there, the point."""

    distance: float
    length: float
    parameter: float
    point: FloatArray


def braking_distance(speed: float, exit_speed: float, deceleration: float) -> float:
    """(v^2 - ve^2) / (2 a). Raises MechlabError unless v >= ve >= 0 and a > 0."""
    for name, value, good in (
        ("exit_speed", exit_speed, exit_speed >= 0.0), ("speed", speed, speed >= exit_speed),
        ("deceleration", deceleration, deceleration > 0.0),
    ):  # fmt: skip
        if not good or not np.isfinite(value):
            wanted = {
                "exit_speed": "at least 0",
                "speed": f"at least exit_speed = {exit_speed:g}",
                "deceleration": "more than 0",
            }
            raise MechlabError(f"{name} = {value:g}; expected a finite number, {wanted[name]}.")
    return (speed**2 - exit_speed**2) / (2.0 * deceleration)


def braking(
    curve: BSpline, speed: float, exit_speed: float, deceleration: float, travel: Travel | None = None
) -> Braking:
    """Where to begin to brake from `speed` to reach the end with `exit_speed`: s = L - (v^2 - ve^2) / (2 a).

    Raises NoSolution when the curve is shorter than that, MechlabError for speeds that are no braking.
    """
    run = travel or Travel(curve)
    distance = braking_distance(speed, exit_speed, deceleration)
    if distance > run.length:
        fastest = np.sqrt(exit_speed**2 + 2.0 * deceleration * run.length)
        raise NoSolution(
            f"braking from {speed:g} to {exit_speed:g} takes {distance:.6g}, the curve is only {run.length:.6g} long; "
            f"the fastest start on it is {fastest:.6g}. Slow down, or brake harder."
        )
    s = run.length - distance
    u = float(run.parameter_at(s))
    return Braking(distance, s, u, curve.at(u))
