"""Arc length of a B-spline, span by span: Simpson as in the source, and Gauss between minima of |C'|.

Where the curve stands still (a cusp) or nearly so, |C'(u)| is not smooth and every rule loses its order. |C'|^2 is a
polynomial, whose interior minima are found exactly: a span is split at the slow ones.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.bspline.curve import BSpline, FloatArray
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

SLOW = 0.05
"""A minimum of the speed below this share of the largest speed of its span splits the span."""
CUSP = 1e-6
"""Speed, as a share of the largest of the span, below which the curve counts as standing still."""
NODES = 24
MOST_HALVINGS = 40
ROUNDS = 12
TOLERANCE = 1e-13
"""Pieces are halved until Gauss on one and on its halves agree to this share of the length, at most ROUNDS times."""


@dataclass(frozen=True)
class LengthReport:
    """Lengths of the spans (spans,), their sum, and an estimate of the error of the sum. cusps: parameters where the
    curve stands still inside; slow: minima of the speed at which spans were split, cusps included."""

    spans: FloatArray
    length: float
    error: float
    cusps: tuple[float, ...]
    slow: tuple[float, ...]


def simpson_spans(curve: BSpline, panels: int = 64) -> FloatArray:
    """(spans,) lengths by composite Simpson with an even number of panels in each span, as in the source."""
    if panels < 2 or panels % 2:
        raise MechlabError(f"simpson: panels = {panels}; expected an even number of at least 2.")
    weights = np.ones(panels + 1)
    weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
    a, b = curve.breaks[:-1], curve.breaks[1:]
    share = np.linspace(0.0, 1.0, panels + 1)
    speed = _speed(curve.velocity, (b - a)[:, None] * share)
    return np.asarray((b - a) / (3.0 * panels) * (speed @ weights))


def simpson_bound(curve: BSpline, panels: int = 64, samples: int = 400) -> float:
    """Bound of Simpson's error, sum h (h / n)^4 / 180 max |f''''| with f = |C'|; the maximum is taken over samples.

    Infinite where the curve has a cusp: f'''' is unbounded there and the rule loses its order.
    """
    total = 0.0
    for a, b, c in zip(curve.breaks[:-1], curve.breaks[1:], curve.velocity, strict=True):
        h = float(b - a)
        if _minima(c, h, CUSP):
            return float("inf")
        x = np.linspace(0.0, h, samples)
        total += h * (h / panels) ** 4 / 180.0 * float(np.max(np.abs(_fourth(c, x))))
    return total


def gauss_spans(curve: BSpline, nodes: int = NODES, split: bool = True) -> FloatArray:
    """(spans,) lengths by Gauss-Legendre; split: at the slow minima of the speed."""
    return _by_span(curve, smooth_pieces(curve) if split else _whole(curve), nodes)


def arc_length(curve: BSpline) -> LengthReport:
    """Lengths exact to rounding: Gauss-Legendre between slow minima, pieces graded towards minima that are no cusps.

    The error is the sum of |one piece - its two halves| over all pieces, an estimate on the safe side, because
    the reported lengths are those of the halves.
    """
    pieces = fine_pieces(curve)
    halves = _halved(pieces)
    coarse, fine = integrals(curve, pieces), integrals(curve, halves)
    spans = np.zeros(len(curve.breaks) - 1)
    np.add.at(spans, halves[:, 0].astype(int), fine)
    total = float(spans.sum())
    error = float(np.abs(coarse - fine.reshape(-1, 2).sum(axis=1)).sum()) + len(spans) * np.finfo(float).eps * total
    cusps, slow = _slow_parameters(curve, CUSP), _slow_parameters(curve, SLOW)
    return LengthReport(spans, total, error, cusps, slow)


def control_polygon_length(curve: BSpline) -> float:
    """Sum of the chords between control points: an upper bound of the length, not an estimate."""
    return float(np.linalg.norm(np.diff(np.array(curve.points), axis=0), axis=1).sum())


def quadrature_spans(curve: BSpline) -> FloatArray:
    """(spans,) lengths by adaptive Gauss-Kronrod (scipy quad) of |C'(u)| through scipy's own spline evaluation; it is
    not told where cusps are."""
    from warnings import catch_warnings, simplefilter

    from scipy.integrate import IntegrationWarning, quad

    out = []
    with catch_warnings():
        simplefilter("ignore", IntegrationWarning)  # "roundoff detected": the tolerance asked for is rounding itself
        for a, b in zip(curve.breaks[:-1], curve.breaks[1:], strict=True):
            out.append(quad(lambda u: float(curve.speed(u)), a, b, epsabs=0.0, epsrel=1e-13, limit=400)[0])
    return np.array(out)


def smooth_pieces(curve: BSpline) -> FloatArray:
    """(k, 3) pieces of the curve on which |C'| is smooth: index of the span, first and last parameter.

    Spans are split at slow minima of |C'|^2; towards a minimum that is slow but no cusp, pieces are halved until they
    are as short as the distance at which the speed has doubled, because f'''' grows like 1 / minimum^3.
    """
    out: list[tuple[int, float, float]] = []
    for k, (a, b, c) in enumerate(zip(curve.breaks[:-1], curve.breaks[1:], curve.velocity, strict=True)):
        h = float(b - a)
        ends = [0.0, h]
        for x, share in _minima(c, h, SLOW):
            if 0.0 < x < h:
                ends.append(x)
            if share > CUSP:
                ends += _towards_minimum(x, share, h)
        ends = sorted(set(ends))
        out += [(k, float(a) + x, float(a) + y) for x, y in zip(ends[:-1], ends[1:], strict=True)]
    return np.array(out)


def fine_pieces(curve: BSpline) -> FloatArray:
    """`smooth_pieces`, halved further until Gauss on a piece agrees with its halves: for minima just above SLOW."""
    pieces = smooth_pieces(curve)
    for _ in range(ROUNDS):
        halves = _halved(pieces)
        whole, parts = integrals(curve, pieces), integrals(curve, halves).reshape(-1, 2).sum(axis=1)
        rough = np.abs(whole - parts) > TOLERANCE * parts.sum()
        if not rough.any():
            break
        pieces = np.concatenate([pieces[~rough], halves[np.repeat(rough, 2)]])
        pieces = pieces[np.argsort(pieces[:, 1], kind="stable")]
    return pieces


def _halved(pieces: FloatArray) -> FloatArray:
    halves = np.repeat(pieces, 2, axis=0)
    middle = 0.5 * (pieces[:, 1] + pieces[:, 2])
    halves[::2, 2], halves[1::2, 1] = middle, middle
    return halves


def _towards_minimum(x: float, share: float, h: float) -> list[float]:
    """Points on both sides of a near cusp, each half as far as the one before."""
    count = min(MOST_HALVINGS, int(np.ceil(np.log2(1.0 / share))))
    steps = h * 0.5 ** np.arange(1, count + 1)
    return [float(y) for s in steps for y in (x - s, x + s) if 0.0 < y < h]


def _whole(curve: BSpline) -> FloatArray:
    breaks = curve.breaks
    return np.column_stack([np.arange(len(breaks) - 1), breaks[:-1], breaks[1:]])


def _by_span(curve: BSpline, pieces: FloatArray, nodes: int) -> FloatArray:
    spans = np.zeros(len(curve.breaks) - 1)
    np.add.at(spans, pieces[:, 0].astype(int), integrals(curve, pieces, nodes))
    return spans


@cache
def _legendre(nodes: int) -> tuple[FloatArray, FloatArray]:
    return np.polynomial.legendre.leggauss(nodes)


def integrals(curve: BSpline, pieces: FloatArray, nodes: int = NODES) -> FloatArray:
    """(k,) integral of |C'| over each piece (span, first, last parameter), by Gauss-Legendre."""
    x, w = _legendre(nodes)
    span = pieces[:, 0].astype(int)
    low, half = pieces[:, 1] - curve.breaks[span], 0.5 * (pieces[:, 2] - pieces[:, 1])
    return np.asarray(half * (_speed(curve.velocity[span], low[:, None] + half[:, None] * (1.0 + x)) @ w))


def _speed(coefficients: FloatArray, x: FloatArray) -> FloatArray:
    """|C'| at x (k, m) in the local parameter of each row's span; coefficients (k, n, p)."""
    value = np.zeros((*x.shape, coefficients.shape[1]))
    for power in range(coefficients.shape[2]):
        value = value * x[..., None] + coefficients[:, None, :, power]
    return np.asarray(np.linalg.norm(value, axis=-1))


def _square(c: FloatArray) -> NDArray[np.float64]:
    """Coefficients of |C'|^2 of one span, highest power first."""
    return np.asarray(sum(np.convolve(row, row) for row in c))


def _minima(c: FloatArray, h: float, below: float) -> list[tuple[float, float]]:
    """Slow minima of the speed in [0, h], ends included: (place, speed as a share of the largest of the span).

    The stationary points are roots of a polynomial, scaled to [0, 1] for their conditioning.
    """
    scaled = c * h ** np.arange(c.shape[1] - 1, -1, -1)
    square = _square(scaled)
    x = np.linspace(0.0, 1.0, 65)
    top = float(np.sqrt(np.max(np.polyval(square, x))))
    if top == 0.0:
        return [(0.0, 0.0)]
    roots = np.roots(np.polyder(square / top**2)) if len(square) > 1 else np.empty(0)
    # a cusp is a double root of |C'|^2, which rounding may push off the axis by its square root
    real = roots[np.abs(roots.imag) < 1e-5].real
    places = np.unique(np.clip(np.concatenate([real[(real > -1e-9) & (real < 1.0 + 1e-9)], [0.0, 1.0]]), 0.0, 1.0))
    out: list[tuple[float, float]] = []
    for place in places:
        share = float(np.linalg.norm([np.polyval(row, place) for row in scaled])) / top
        if share < below and all(abs(place * h - x) > 1e-7 * h for x, _ in out):
            out.append((float(place * h), share))
    return out


def _slow_parameters(curve: BSpline, below: float) -> tuple[float, ...]:
    found = [
        float(a) + x
        for a, b, c in zip(curve.breaks[:-1], curve.breaks[1:], curve.velocity, strict=True)
        for x, _ in _minima(c, float(b - a), below)
    ]
    apart: list[float] = []
    for u in sorted(found):
        if not apart or u - apart[-1] > 1e-9 * (curve.end - curve.start):
            apart.append(u)
    return tuple(apart)


def _fourth(c: FloatArray, x: FloatArray) -> FloatArray:
    """Fourth derivative of f = sqrt(g), g = |C'|^2, by Faa di Bruno from the derivatives of g."""
    g = _square(c)
    d = [np.polyval(np.polyder(g, k), x) for k in range(5)]
    f = np.sqrt(d[0])
    f1 = d[1] / (2 * f)
    f2 = (d[2] - 2 * f1**2) / (2 * f)  # from (f^2)'' = 2 f f'' + 2 f'^2 and so on
    f3 = (d[3] - 6 * f1 * f2) / (2 * f)
    return np.asarray((d[4] - 8 * f1 * f3 - 6 * f2**2) / (2 * f))
