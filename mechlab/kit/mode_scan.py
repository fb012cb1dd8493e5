"""Checks the assembly modes of a class III or IV group without its polynomial: by a scan over one turn, and by
closure."""

from __future__ import annotations

import numpy as np

from mechlab.analytic.assur import Modes, TwoLoops
from mechlab.experiment.entry import CheckResult
from mechlab.mechanism.geometry import Array


def scan_modes(group: TwoLoops, points: int = 2880) -> int:
    """Number of modes that a scan of `points` finds for one position (arrays (2, 1)).

    For each theta_t the first closure has up to two theta_u, cos(theta_u + arg q - arg base) = c. Both sheets meet where
    |c| = 1, with infinite slope; therefore each arc of |c| <= 1 is scanned as one closed loop, theta_t = middle + half
    cos s and the sheet sign(sin s), and sign changes of the second closure along it are counted.
    """
    w, p, q, l = (np.asarray(x)[:, 0] for x in (group.w, group.p, group.q, group.l))

    def cosine(t: Array) -> Array:
        base = w[0] + p[0] * np.exp(1j * t)
        size = np.maximum(np.abs(base), 1e-300)
        return np.asarray((l[0] ** 2 - size**2 - np.abs(q[0]) ** 2) / (2.0 * size * np.abs(q[0])))

    def second(t: Array, sheet: Array) -> Array:
        base = w[0] + p[0] * np.exp(1j * t)
        u = np.angle(base) - np.angle(q[0]) + sheet * np.arccos(np.clip(cosine(t), -1.0, 1.0))
        return np.asarray(np.abs(w[1] + p[1] * np.exp(1j * t) + q[1] * np.exp(1j * u)) - l[1])

    total = 0
    for low, high in _arcs(
        float(abs(w[0])), float(abs(p[0])), float(abs(q[0])), float(l[0]), float(np.angle(w[0]) - np.angle(p[0]))
    ):
        if high - low > 2.0 * np.pi - 1e-9:
            t = np.linspace(-np.pi, np.pi, points + 1)
            for sheet in (1.0, -1.0):
                total += _changes(second(t, np.full_like(t, sheet)))
            continue
        s = np.linspace(0.0, 2.0 * np.pi, points + 1) + 0.5 * np.pi / points
        t = 0.5 * (low + high) + 0.5 * (high - low) * np.cos(s)
        total += _changes(second(t, np.sign(np.sin(s))))
    return total


def try_modes(group: TwoLoops, modes: Modes) -> CheckResult:
    """Checks every mode over the positions by two ratios that must be 1: distance closed by a link over its length, and
    det J over the determinant by central differences of (|z|^2 - l^2) / 2 in both angles."""
    step = 1e-4
    length, det = [], []
    for k in range(int(np.max(modes.count))):
        t, u, given = modes[k]
        some = ~np.isnan(given)
        length.append((np.abs(group.z(t, u)[0]) / group.l)[:, some])
        by_t, by_u = (
            (group.residual(t + a, u + b) - group.residual(t - a, u - b)) / (4.0 * step)
            for a, b in ((step, 0.0), (0.0, step))
        )
        det.append((given / (by_t[0] * by_u[1] - by_u[0] * by_t[1]))[some])
    ratios = np.concatenate([np.ravel(x) for x in (*length, *det)])
    # Central differences of a sine have the error step^2 / 6 = 2e-9; where two modes are close, det J suffers cancellation.
    return CheckResult({"analytic": ratios}, 1e-6, np.ones(len(ratios)), f"{len(np.concatenate(det))} modes")


def _changes(values: Array) -> int:
    return int(np.count_nonzero(np.sign(values[1:]) != np.sign(values[:-1])))


def _arcs(w: float, p: float, q: float, l: float, middle: float) -> list[tuple[float, float]]:
    """Arcs of theta_t in which q and l can close the triangle: |q - l| <= |w + p exp(i theta_t)| <= q + l.

    The base |w + p exp(i theta_t)| is longest at `middle`.
    """
    longest, shortest = w + p, abs(w - p)
    if shortest > q + l or longest < abs(q - l):
        return []

    def angle(size: float) -> float:
        """Distance from `middle` at which |base| has that size."""
        c = (size**2 - w**2 - p**2) / max(2.0 * w * p, 1e-300)
        return float(np.arccos(np.clip(c, -1.0, 1.0)))

    near = angle(q + l) if longest > q + l else 0.0
    far = angle(abs(q - l)) if shortest < abs(q - l) else np.pi
    if near == 0.0 and far == np.pi:
        return [(middle - np.pi, middle + np.pi)]
    if near == 0.0:
        return [(middle - far, middle + far)]
    if far == np.pi:
        return [(middle + near, middle + 2.0 * np.pi - near)]
    return [(middle + near, middle + far), (middle - far, middle - near)]
