"""A curve of closed poses: any point of it, its length, and where another curve crosses it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_poses import displacement, moved
from mechlab.viewer.explore.continuation import Closing, Lane, correct, norms, row_sizes, smallest_values, tangents

GAUSS = np.polynomial.legendre.leggauss(4)
SCAN, ROOM = 151, 2e-3  # samples of a curve; share of its length that is kept free before a crossing


@dataclass(frozen=True, eq=False)
class Curve:
    """Closed poses along a curve: q (n, nq), unit tangents (n, nv), arc (n,) from 0."""

    closing: Closing
    drive: int
    q: Array
    tangent: Array
    arc: Array

    def sample(self, at: Array) -> Curve:
        """Closed poses at arcs (k,), to the accuracy of the cubic interpolation; without those that do not close."""
        m, drives = self.closing.mechanism, np.full(len(at), self.drive)
        i = np.clip(np.searchsorted(self.arc, at, side="right") - 1, 0, len(self.arc) - 2)
        length = self.arc[i + 1] - self.arc[i]
        u = ((at - self.arc[i]) / length)[:, None]
        jump, t0, t1 = displacement(m, self.q[i], self.q[i + 1]), self.tangent[i], self.tangent[i + 1]
        way = jump * (3 * u**2 - 2 * u**3) + length[:, None] * (t0 * (u - 2 * u**2 + u**3) + t1 * (u**3 - u**2))
        border = t0 + u * (t1 - t0)
        border /= norms(self.closing, border)[:, None]
        q, jacobian, _, closed = correct(self.closing, moved(m, self.q[i], way), drives, border * self.closing.scale**2)
        return Curve(self.closing, self.drive, q[closed], tangents(self.closing, jacobian, drives)[closed], at[closed])

    def rows(self, points: Curve) -> Array:
        """(k, nv, nv) the rows at points of the curve, with the tangent in place of the row of the drive."""
        jacobian = self.closing.equations(points.q)[1]
        jacobian[:, self.closing.first_drive + self.drive] = points.tangent * self.closing.scale**2
        return jacobian


def curve(closing: Closing, back: Lane, forth: Lane) -> Curve:
    """One curve through home from a lane in each sense, in the order in which the drive grows."""
    q = np.array([*back.q[:0:-1], *forth.q])
    tangent = np.array([*(-t for t in back.tangent[:0:-1]), *forth.tangent])
    return Curve(closing, forth.drive, q, tangent, arcs(closing, q, tangent))


def arcs(closing: Closing, q: Array, tangent: Array) -> Array:
    """(n,) arc lengths, of the cubic through each two points and their tangents."""
    jump = displacement(closing.mechanism, q[:-1], q[1:])
    length = norms(closing, jump)
    for _ in range(4):
        scaled = length[:, None]
        total = np.zeros(len(jump))
        for x, w in zip(*GAUSS, strict=True):
            u = 0.5 * (x + 1.0)
            rate = jump * (6 * u - 6 * u * u) + scaled * (
                tangent[:-1] * (1 - 4 * u + 3 * u * u) + tangent[1:] * (3 * u * u - 2 * u)
            )
            total += 0.5 * w * norms(closing, rate)
        length = total
    return np.concatenate([[0.0], np.cumsum(length)])


def uncrossed(path: Curve) -> tuple[Curve, bool, bool]:
    """The part of a curve around home that no other curve crosses, up to ROOM of its length before the crossings; and
    whether it was cut before home and after it."""
    total = float(path.arc[-1])
    home = float(path.arc[int(np.argmin(norms(path.closing, displacement(
        path.closing.mechanism, np.broadcast_to(path.closing.home, path.q.shape), path.q))))])  # fmt: skip
    grid = np.linspace(0.0, total, SCAN)
    seen = path.sample(grid)
    rows = path.rows(seen)
    sizes = row_sizes(rows)
    width = smallest_values(rows, sizes)
    low, high = 0.0, total
    for i in range(2, len(width) - 2):
        slope = max(abs(width[i - 2] - width[i - 1]), abs(width[i + 2] - width[i + 1])) / (total / (SCAN - 1))
        if width[i] > min(width[i - 1], width[i + 1]) or width[i] > slope * total / (SCAN - 1):
            continue
        at = _crossing(path, float(seen.arc[i - 1]), float(seen.arc[i + 1]), slope, sizes)
        if at is not None and abs(at - home) > ROOM * total:
            low, high = (max(low, at + ROOM * total), high) if at < home else (low, min(high, at - ROOM * total))
    if low == 0.0 and high == total:
        return path, False, False
    inside = path.arc[(path.arc > low) & (path.arc < high)]
    ends = np.concatenate([[low], inside, [high]])
    kept = path.sample(ends)
    return (
        Curve(path.closing, path.drive, kept.q, kept.tangent, arcs(path.closing, kept.q, kept.tangent)),
        low > 0,
        high < total,
    )


def _crossing(path: Curve, low: float, high: float, slope: float, sizes: Array) -> float | None:
    """The arc between low and high at which the rows become dependent, or None.

    There their smallest singular value falls to 0 at the rate `slope`. Two zooms by ten: rows that stay apart by less
    than `slope` times 1e-4 of the curve count as dependent, because the tangent is not defined there.
    """
    for _ in range(2):
        seen = path.sample(np.linspace(low, high, 21))
        if len(seen.arc) < 3:
            break
        width, step = smallest_values(path.rows(seen), sizes), (high - low) / 20
        i = int(np.argmin(width))
        if width[i] > 2.0 * slope * step:
            return None
        low, high = float(seen.arc[i]) - step, float(seen.arc[i]) + step
    return 0.5 * (low + high)
