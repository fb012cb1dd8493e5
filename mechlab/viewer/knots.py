"""A recording as few coordinates and their rates at chosen times, between which the page takes cubic Hermite polynomials.

Knots are recorded times. Between two of them a polynomial of the third degree has their coordinates and rates; a recorded time
is left out while no body is off there by more than a tolerance, by the bound sum |dq| x lever over the joints that carry it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mechlab.experiment.recording import Recording, basic_channels
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array

TIGHTEST = 5e-7
"""Tolerance of a recording that is small enough, relative to the radius of the mechanism."""
LOOSER = 8.0
"""Factor between two tolerances that are tried."""
MOST_BYTES = 2_000_000
"""Of coordinates and rates, before compression: 8 bytes a number."""
LONGEST = 512
"""Most recorded samples from one knot to the next."""
CHUNK = 2000
"""Poses that are compared at once."""


@dataclass(frozen=True, eq=False)
class Knots:
    """t (k,) [s], q (k, nq), rates (k, nq): time derivatives of the coordinates (of the four numbers of a quaternion, too).
    error: largest distance [m] of a drawn point from where it was at a recorded time; between: the same, estimated, between
    recorded times; recorded: their number."""

    t: Array
    q: Array
    rates: Array
    error: float
    between: float
    recorded: int

    def at(self, times: Array) -> Array:
        """Coordinates (n, nq) at times (n,) [s] as the page shows them."""
        return hermite(self.t, self.q, self.rates, times)


def hermite(t: Array, q: Array, rates: Array, times: Array) -> Array:
    """The cubic Hermite polynomials through q (k, nq) with `rates` at t (k,), at times (n,); Burden & Faires, section 3.4."""
    if len(t) == 1:
        return np.repeat(q, len(times), axis=0)
    i = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 2)
    h = (t[i + 1] - t[i])[:, None]
    s = (times - t[i])[:, None] / h
    rest = 1.0 - s
    ends = rest**2 * (1.0 + 2.0 * s) * q[i] + s**2 * (1.0 + 2.0 * rest) * q[i + 1]
    return np.asarray(ends + h * s * rest * (rest * rates[i] - s * rates[i + 1]))


def coordinate_rates(m: Mechanism, q: Array, v: Array) -> Array:
    """(n, nq) time derivatives of coordinates q (n, nq) at rates v (n, nv): w' = -(x, y, z) . omega / 2, (x, y, z)' = (w omega +
    (x, y, z) x omega) / 2 of a quaternion, omega in the body."""
    out = np.zeros_like(q)
    for joint in m.joints:
        own, rate = q[:, m.q_slice[joint.name]], v[:, m.v_slice[joint.name]]
        if joint.nq == 1:
            out[:, m.q_slice[joint.name]] = rate
        else:
            w, axis = own[:, :1], own[:, 1:]
            out[:, m.q_slice[joint.name]] = 0.5 * np.hstack(
                [-np.sum(axis * rate, axis=1, keepdims=True), w * rate + np.cross(axis, rate)]
            )
    return out


Indices = NDArray[np.intp]
Drawn = Callable[[Recording], tuple[Mechanism, Array]]


def drawn_rates(recording: Recording, drawn: Drawn | None) -> Array:
    """(n, nq) time derivatives of the coordinates that are drawn: those of the run, or of drawn(recording) by central
    differences along the recorded rates. Of a recording without rates: those of cubic splines."""
    if not np.any(recording.v) and len(recording.t) > 3:
        from scipy.interpolate import CubicSpline

        q = recording.q if drawn is None else drawn(recording)[1]
        return np.asarray(CubicSpline(recording.t, q).derivative()(recording.t))
    own = coordinate_rates(recording.mechanism, recording.q, recording.v)
    if drawn is None:
        return own
    step = 1e-5 / max(1.0, float(np.abs(own).max(initial=0.0)))  # 1e-10 of the rates by h^2, 1e-11 by rounding

    def moved(by: float) -> Array:
        q = recording.q + by * own
        channels, _ = basic_channels(recording.mechanism, q, recording.v)
        return drawn(replace(recording, q=q, channels=recording.channels | channels))[1]

    return (moved(step) - moved(-step)) / (2.0 * step)


def continuous(m: Mechanism, q: Array, rates: Array) -> tuple[Array, Array]:
    """Coordinates and rates whose quaternions do not change their sign from one time to the next."""
    q, rates = q.copy(), rates.copy()
    for joint in m.joints:
        if joint.nq == 4:
            columns = m.q_slice[joint.name]
            turned = np.einsum("ij,ij->i", q[1:, columns], q[:-1, columns]) < 0.0
            sign = np.cumprod(np.concatenate([[1.0], np.where(turned, -1.0, 1.0)]))[:, None]
            q[:, columns] *= sign
            rates[:, columns] *= sign
    return q, rates


def choose_knots(
    m: Mechanism, t: Array, q: Array, rates: Array, corners: Mapping[int, Array], radius: float, poses: Callable[[Array], Array],
) -> Knots:  # fmt: skip
    """Knots of the coordinates q (n, nq) with time derivatives `rates` at t (n,): the tightest tolerance whose knots fit into
    MOST_BYTES. radius [m] of all that is drawn; poses(q) -> (n, nb, 4, 4) of the bodies; corners: index of a body -> (c, 3) points
    of it [m]."""
    q, rates = continuous(m, q, rates)
    most = max(2, MOST_BYTES // (16 * max(1, m.nq)))
    tolerance = TIGHTEST * radius
    chains = _levers(m, radius)
    while True:
        keep = _thinned(t, q, rates, chains, tolerance)
        if len(keep) <= most:
            break
        tolerance *= LOOSER
    coarse = np.unique(np.append(keep[::2], keep[-1]))
    # half of the knots: 16 times the error of a method of the fourth order
    shown = [hermite(t[k], q[k], rates[k], t) if len(k) < len(t) else q for k in (keep, coarse)]
    error, halved = _distances(corners, poses, q, shown)
    return Knots(t[keep], q[keep], rates[keep], error, max(error, halved / 16.0), len(t))


def _levers(m: Mechanism, radius: float) -> Array:
    """(bodies and shafts, nq) bound on the way of any drawn point of each for a unit of each coordinate [m]: a rotation about
    a point at most two radii away, a slide. A quaternion turns by twice the change of its numbers."""
    own = np.zeros(m.nq)
    for joint in m.joints:
        own[m.q_slice[joint.name]] = 1.0 if joint.kind == "prismatic" else (2.0 if joint.nq == 1 else 4.0) * radius
    rows: dict[str, Array] = {}
    for body in m.bodies:
        row = rows.get(body.parent, np.zeros(m.nq)).copy()
        for joint in body.joints:
            row[m.q_slice[joint.name]] = own[m.q_slice[joint.name]]
        rows[body.name] = row
    columns = {j.name: m.q_slice[j.name].start for j in m.joints}
    shafts = []
    for shaft in m.shafts:
        if shaft.shapes:
            row = rows.get(shaft.body, np.zeros(m.nq)).copy()
            for name, ratio in shaft.coefficients:
                row[columns[name]] += 2.0 * radius * abs(float(ratio))
            shafts.append(row)
    return np.array([*rows.values(), *shafts]).reshape(-1, m.nq)


def _thinned(t: Array, q: Array, rates: Array, levers: Array, tolerance: float) -> Indices:
    """Indices of knots: pieces of LONGEST samples, each halved until its bound is below the tolerance."""
    last = len(t) - 1
    open_pieces = list(itertools.pairwise(sorted({*range(0, last, LONGEST), last}))) if last else []
    kept = {0, last}
    while open_pieces:
        inside = [np.arange(a + 1, b) for a, b in open_pieces]
        lengths = np.array([len(x) for x in inside])
        ends = np.array(open_pieces)
        owner = np.repeat(np.arange(len(open_pieces)), lengths)
        worst = np.zeros(len(open_pieces))
        if owner.size:
            k = np.concatenate(inside)
            worst = _worst(t, q, rates, levers, ends, owner, k)
        kept.update(ends.ravel().tolist())
        halves = []
        for (a, b), bad in zip(open_pieces, worst > tolerance, strict=True):
            if bad:
                halves += [(a, (a + b) // 2), ((a + b) // 2, b)]
        open_pieces = halves
    return np.array(sorted(kept))


def _worst(t: Array, q: Array, rates: Array, levers: Array, ends: Indices, owner: Indices, k: Indices) -> Array:
    """(pieces,) largest bound [m] of the samples k (n,) in the pieces `owner` (n,) between samples `ends` (pieces, 2)."""
    worst = np.zeros(len(ends))
    for first in range(0, len(k), CHUNK):
        here, own = k[first : first + CHUNK], owner[first : first + CHUNK]
        a, b = ends[own, 0], ends[own, 1]
        h = (t[b] - t[a])[:, None]
        s = (t[here] - t[a])[:, None] / h
        rest = 1.0 - s
        shown = rest**2 * (1.0 + 2.0 * s) * q[a] + s**2 * (1.0 + 2.0 * rest) * q[b]
        shown += h * s * rest * (rest * rates[a] - s * rates[b])
        bound = np.max(np.abs(shown - q[here]) @ levers.T, axis=1, initial=0.0)
        np.maximum.at(worst, own, bound)
    return worst


def _distances(corners: Mapping[int, Array], poses: Callable[[Array], Array], true: Array, shown: Sequence[Array]) -> list[float]:
    """Largest distance [m] of a corner between true coordinates (n, nq) and each of the shown ones."""
    worst = [0.0] * len(shown)
    homogeneous = {k: np.vstack([points.T, np.ones(len(points))]) for k, points in corners.items()}
    for first in range(0, len(true), CHUNK):
        part = slice(first, first + CHUNK)
        there = poses(true[part])[:, :, :3]
        for i, other in enumerate(shown):
            if other is true:
                continue
            apart = there - poses(other[part])[:, :, :3]
            for k, points in homogeneous.items():
                way = (apart[:, k].reshape(-1, 4) @ points).reshape(len(apart), 3, -1)
                way *= way
                worst[i] = max(worst[i], math.sqrt(way.sum(axis=1).max(initial=0.0)))
    return worst
