"""Burmester's problem: four-bars that carry a body through five positions exactly.

Position k puts the point m of the body at P_k = d_k + e^(i t_k) m. A dyad with the pivot c leads it if all |P_k - c| are equal:

    (P_k - P_1) . c = (|P_k|^2 - |P_1|^2) / 2,    k = 2 ... 5

|m|^2 cancels, so the rows (x, y, right side) are affine in m, and m must make the 4 x 3 matrix of the rows lose a rank. Two of its 3 x 3
minors are cubics in m; their resultant has the circle points among its roots, at most four of them real (Burmester 1888; McCarthy and
Soh, Geometric Design of Linkages, 2011).
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
POSITIONS = 5
NODES = 16
"""Nodes on a circle at which the resultant, of degree nine, is evaluated."""
ASKEW = 0.7374
"""Turn [rad] of the axes in which the resultant is taken; any will do."""
EXACT = 1e-9
"""Residual of a dyad, relative to the size of the positions, below which it is a solution: ten digits after Newton's method."""


@dataclass(frozen=True)
class LeadingDyad:
    """A pivot of the ground, a point of the body (in its axes, from its origin), and the length of the link between them [m]."""

    pivot: complex
    point: complex
    length: float


@dataclass(frozen=True)
class LeadingFourbar:
    """Two dyads and their coupler [m]; the first drives. same_mode: the pin of the second lies on one side of the line from the pin of the
    first to the pivot of the second in all positions, so that the four-bar can pass through them without being taken apart."""

    first: LeadingDyad
    second: LeadingDyad
    coupler: float
    same_mode: bool


def leading_dyads(places: ArrayLike, angles: ArrayLike) -> tuple[LeadingDyad, ...]:
    """All dyads RR that lead a body through five positions: places d (5,) as x + i y [m], angles t (5,) [rad].

    Raises MechlabError for another number of positions, or where two of them are the same.
    """
    d, t = np.asarray(places, dtype=complex), np.asarray(angles, dtype=float)
    if d.shape != (POSITIONS,) or t.shape != (POSITIONS,):
        raise MechlabError(f"motion synthesis: expected {POSITIONS} places and {POSITIONS} angles, got {d.size} and {t.size}.")
    if not (np.all(np.isfinite(d)) and np.all(np.isfinite(t))):
        raise MechlabError("motion synthesis: places and angles must be finite numbers.")
    turns = np.exp(1j * t)
    for a, b in combinations(range(POSITIONS), 2):
        if abs(d[a] - d[b]) < 1e-12 * max(1e-300, float(np.max(np.abs(d)))) and abs(turns[a] - turns[b]) < 1e-12:
            raise MechlabError(f"motion synthesis: positions {a + 1} and {b + 1} are the same.")
    middle = complex(d.mean())
    size = float(np.max(np.abs(d - middle))) or 1.0
    found = list[LeadingDyad]()
    # candidates are told apart by y: the axes of the body are turned, lest two of its pins lie at the same height
    turned = [m * np.exp(1j * ASKEW) for m in _circle_points((d - middle) / size, turns * np.exp(1j * ASKEW))]
    for m in turned:
        polished = _polished((d - middle) / size, turns, m)
        if polished is None:
            continue
        m, c = polished
        dyad = LeadingDyad(middle + size * c, size * m, size * abs((d[0] - middle) / size + turns[0] * m - c))
        if all(abs(dyad.point - x.point) > 1e-6 * size for x in found):
            found.append(dyad)
    return tuple(found)


def leading_fourbars(places: ArrayLike, angles: ArrayLike) -> tuple[LeadingFourbar, ...]:
    """All four-bars of two such dyads, driven by that with which they stay in one mode, if there is one; those come first."""
    d, turns = np.asarray(places, dtype=complex), np.exp(1j * np.asarray(angles, dtype=float))
    out = []
    for pair in combinations(leading_dyads(places, angles), 2):
        ways = []
        for a, b in (pair, pair[::-1]):
            pin, joint = d + turns * a.point, d + turns * b.point
            side = np.imag(np.conj(b.pivot - pin) * (joint - pin))
            ways.append(LeadingFourbar(a, b, abs(a.point - b.point), bool(np.all(side > 0) or np.all(side < 0))))
        out.append(max(ways, key=lambda f: f.same_mode))
    return tuple(sorted(out, key=lambda f: not f.same_mode))


def _rows(d: Complex, turns: Complex, m: complex) -> Complex:
    """(4, 3) rows (x, y, right side) at a body point m = x + i y."""
    return _rows_xy(d, turns, np.complex128(m.real), np.complex128(m.imag))


def _rows_xy(d: Complex, turns: Complex, x: np.complex128, y: np.complex128) -> Complex:
    """The same for coordinates x, y that may be complex numbers, as on the circles at which the resultant is taken."""
    c, s = turns.real, turns.imag
    px, py = d.real + c * x - s * y, d.imag + s * x + c * y
    # |P|^2 / 2 without |m|^2 / 2, which is the same in all positions
    half = 0.5 * np.abs(d) ** 2 + d.real * (c * x - s * y) + d.imag * (s * x + c * y)
    return np.column_stack([px[1:] - px[0], py[1:] - py[0], half[1:] - half[0]])


def _cubics(d: Complex, turns: Complex, y: np.complex128) -> Complex:
    """(2, 4) coefficients in x, highest first, of two minors for a given y."""
    nodes = np.exp(2j * np.pi * np.arange(4) / 4)
    values = np.array([[np.linalg.det(_rows_xy(d, turns, x, y)[list(k)]) for x in nodes] for k in ((0, 1, 2), (1, 2, 3))])
    return np.fft.fft(values, axis=1)[:, ::-1] / 4


def _circle_points(d: Complex, turns: Complex) -> list[complex]:
    """Candidates: real (x, y) where both cubics vanish."""
    nodes = 2.0 * np.exp(2j * np.pi * np.arange(NODES) / NODES)
    values = []
    for y in nodes:
        f, g = _cubics(d, turns, np.complex128(y))
        sylvester = np.zeros((6, 6), dtype=complex)
        for k in range(3):
            sylvester[k, k : k + 4], sylvester[3 + k, k : k + 4] = f, g
        values.append(np.linalg.det(sylvester))
    powers = np.fft.fft(values) / NODES / 2.0 ** np.arange(NODES)
    out = []
    for y in np.roots(powers[9::-1]):
        if abs(y.imag) > 1e-4 * max(1.0, abs(y)):
            continue
        f, g = _cubics(d, turns, np.complex128(y.real))
        roots = sorted(np.roots(f), key=lambda r: abs(np.polyval(g, r)))[:2]
        out += [complex(x.real, y.real) for x in roots if abs(x.imag) <= 1e-3 * max(1.0, abs(x))]
    return out


def _polished(d: Complex, turns: Complex, m: complex) -> tuple[complex, complex] | None:
    """Body point and pivot by Newton's method from a candidate; None where it is no solution."""
    rows = _rows(d, turns, m).real
    c = np.linalg.lstsq(rows[:, :2], rows[:, 2], rcond=None)[0]
    z = np.array([m.real, m.imag, *c])
    for _ in range(20):
        p = d + turns * complex(z[0], z[1])
        arm = p - complex(z[2], z[3])
        r = np.abs(arm[1:]) ** 2 - abs(arm[0]) ** 2
        by_x, by_y = 2 * np.real(np.conj(arm) * turns), 2 * np.real(np.conj(arm) * 1j * turns)
        step = arm[1:] - arm[0]
        jacobian = np.column_stack([by_x[1:] - by_x[0], by_y[1:] - by_y[0], -2 * step.real, -2 * step.imag])
        dz = np.linalg.lstsq(jacobian, -r, rcond=1e-14)[0]
        z = z + dz
        if np.max(np.abs(dz)) < 1e-14 * max(1.0, float(np.max(np.abs(z)))):
            break
    p = d + turns * complex(z[0], z[1])
    length = np.abs(p - complex(z[2], z[3]))
    good = np.all(np.isfinite(z)) and np.ptp(length) < EXACT * max(1.0, length[0]) and length[0] < 1e4
    return (complex(z[0], z[1]), complex(z[2], z[3])) if good and np.ptp(np.abs(p - p[0])) > EXACT else None
