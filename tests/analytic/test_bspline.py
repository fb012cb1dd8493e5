"""B-spline curves: arc lengths against closed forms and adaptive quadrature, errors of the rules, inverse, braking."""

import math

import numpy as np
import pytest
from scipy.interpolate import BSpline as ScipySpline

from mechlab.analytic import bspline
from mechlab.analytic.bspline import BSpline, Travel
from mechlab.errors import MechlabError, NoSolution

# Lengths in the source of the numbers, to 1e-9.
LENGTH_A, LENGTH_B, LENGTH_C = 462.770036091, 690.148067522, 27.177195233
ROOT = 1 / math.sqrt(3)


def clamped(degree, points, inner=None):
    inner = np.linspace(0, 1, len(points) - degree + 1)[1:-1] if inner is None else inner
    return BSpline(degree, (*[0.0] * (degree + 1), *inner, *[1.0] * (degree + 1)), tuple(map(tuple, points)))


def cubic_of(*powers):
    """The cubic Bezier curve of coordinates a0 + a1 u + a2 u^2 + a3 u^3."""
    rows = [(a, a + b / 3, a + 2 * b / 3 + c / 3, a + b + c + d) for a, b, c, d in powers]
    return BSpline(3, (0, 0, 0, 0, 1, 1, 1, 1), tuple(zip(*rows, strict=True)))


def cusp(lift=0.0, c=ROOT, d=0.3, g=100.0):
    """C' = g (u - c)(1, u - d) + g lift (0, 1): a cusp at c, or nearly so."""
    return cubic_of((0, -g * c, g / 2, 0), (0, g * (c * d + lift), -g * (c + d) / 2, g / 3))


CURVE_A = clamped(3, [(0, 0), (60, 80), (120, -40), (180, 60), (240, 0), (300, 90), (340, 20), (400, 0)])
ANGLE = np.linspace(0, 3.5 * np.pi, 10)
CURVE_B = clamped(5, np.column_stack([80 * np.cos(ANGLE), 80 * np.sin(ANGLE), 30 * ANGLE]), [0.15, 0.2, 0.55, 0.9])
CURVE_C = cusp()


def cusp_length(c=ROOT, d=0.3, g=100.0):
    def f(w):
        return (1 + w * w) ** 1.5 / 3 + (d - c) / 2 * (w * math.sqrt(1 + w * w) + math.asinh(w))

    return g * (f(1 - d) - 2 * f(c - d) + f(-d))


@pytest.mark.parametrize(("curve", "length"), [(CURVE_A, LENGTH_A), (CURVE_B, LENGTH_B), (CURVE_C, LENGTH_C)])
def test_lengths_of_the_three_curves(curve, length):
    found = bspline.arc_length(curve)
    assert found.length == pytest.approx(length, abs=1e-9)
    assert abs(found.length - bspline.quadrature_spans(curve).sum()) < 1e-11
    assert found.spans.sum() == pytest.approx(found.length, abs=1e-12) and len(found.spans) == len(curve.breaks) - 1
    assert found.error < 1e-10


def test_the_cusp_in_closed_form():
    found = bspline.arc_length(CURVE_C)
    assert found.length == pytest.approx(cusp_length(), abs=1e-12) and cusp_length() == pytest.approx(
        27.177195232822, abs=1e-11
    )
    assert found.cusps == pytest.approx([1 / math.sqrt(3)], abs=1e-9) == found.slow
    for c in (0.1, 0.5, 0.77):  # a cusp at a Simpson node hides its loss; a split does not care
        assert bspline.arc_length(cusp(c=c)).length == pytest.approx(cusp_length(c=c), abs=1e-11)


@pytest.mark.parametrize("lift", [0.1, 1e-2, 1e-3, 1e-4, 1e-5])
def test_near_cusps(lift):
    curve = cusp(lift)
    found = bspline.arc_length(curve)
    fine = np.linspace(0, 1, 20001)
    nodes, weights = np.polynomial.legendre.leggauss(12)
    slowest = fine[np.argmin(curve.speed(fine))]
    # independent: panels graded geometrically towards the slowest point of a fine sample
    ends = np.unique(
        np.clip(np.concatenate([slowest + s * 0.5 ** np.arange(0, 34) for s in (-1, 1)] + [[slowest, 0, 1]]), 0, 1)
    )
    half = np.diff(ends) / 2
    u = ends[:-1, None] + half[:, None] * (1 + nodes)
    truth = float((half * (curve.speed(u) @ weights)).sum())
    assert found.length == pytest.approx(
        truth, abs=1e-8 if lift < 1e-4 else 1e-10
    )  # the sample knows the place to 2.5e-5


def test_errors_of_the_rules_are_those_of_the_source():
    def off(curve, rule, n, length):
        return abs(float(rule(curve, n).sum()) - bspline.arc_length(curve).length)

    def plain(curve, n):
        return bspline.gauss_spans(curve, n, split=False)

    table = {  # (rule, panels or nodes) -> errors of A, B, C
        (bspline.simpson_spans, 16): (2.3e-3, 3.1e-3, 2.9e-2),
        (bspline.simpson_spans, 64): (8.9e-6, 1.2e-5, 6.8e-3),
        (bspline.simpson_spans, 256): (3.5e-8, 4.8e-8, 1.5e-4),
        (plain, 8): (4.3e-4, 3.3e-4, 0.33),
        (plain, 16): (7.2e-9, 8.2e-9, 4.5e-2),
    }
    for (rule, n), errors in table.items():
        for curve, error in zip((CURVE_A, CURVE_B, CURVE_C), errors, strict=True):
            assert off(curve, rule, n, None) == pytest.approx(error, rel=0.05)  # two digits are printed
    assert off(CURVE_C, bspline.gauss_spans, 8, None) < 1e-13  # split at the cusp each side is smooth
    for n in (16, 64):
        assert bspline.simpson_bound(CURVE_A, n) == pytest.approx({16: 1.8e-2, 64: 7.0e-5}[n], rel=0.03)
        assert off(CURVE_A, bspline.simpson_spans, n, None) < bspline.simpson_bound(CURVE_A, n)
    assert bspline.simpson_bound(CURVE_C) == math.inf
    assert bspline.control_polygon_length(CURVE_A) == pytest.approx(687.7, abs=0.05)


def test_the_bound_uses_the_right_fourth_derivative():
    from mechlab.analytic.bspline.length import _fourth

    a, c = CURVE_A.breaks[1], CURVE_A.velocity[1]
    x = np.array([0.05, 0.1, 0.15])
    h = 2e-3
    stencil = (1, -4, 6, -4, 1)
    numeric = sum(w * CURVE_A.speed(a + x + k * h) for w, k in zip(stencil, (-2, -1, 0, 1, 2), strict=True)) / h**4
    np.testing.assert_allclose(_fourth(c, x), numeric, rtol=1e-2)  # h^2 f^(6) / 6


def test_points_and_power_form_against_scipy():
    u = np.linspace(0, 1, 41)
    for curve in (CURVE_A, CURVE_B):
        theirs = ScipySpline(np.array(curve.knots), np.array(curve.points), curve.degree)
        np.testing.assert_allclose(curve.at(u, 2), theirs(u, nu=2), rtol=1e-12, atol=1e-9)
        k = np.clip(np.searchsorted(curve.breaks, u, side="right") - 1, 0, len(curve.breaks) - 2)
        mine = [[np.polyval(row, x - curve.breaks[i]) for row in curve.velocity[i]] for i, x in zip(k, u, strict=True)]
        np.testing.assert_allclose(mine, theirs(u, nu=1), rtol=1e-9, atol=1e-9)


def test_double_and_unclamped_knots():
    corner = BSpline(2, (0, 0, 0, 1, 1, 2, 2, 2), ((0, 0), (1, 0), (2, 0), (2, 1), (2, 2)))
    assert bspline.arc_length(corner).length == pytest.approx(4.0, abs=1e-13)  # two straight legs with a corner
    assert len(corner.breaks) == 3
    uniform = BSpline(3, tuple(range(10)), ((0, 0), (1, 2), (3, 2), (4, 0), (5, 1), (6, 0)))
    assert (uniform.start, uniform.end) == (3.0, 6.0)
    assert bspline.arc_length(uniform).length == pytest.approx(bspline.quadrature_spans(uniform).sum(), abs=1e-12)
    circle = np.linspace(0, 2 * np.pi, 60)
    line = BSpline(1, (0, *range(60), 59), tuple(zip(np.cos(circle), np.sin(circle), strict=True)))
    assert bspline.arc_length(line).length == pytest.approx(59 * 2 * math.sin(math.pi / 59), abs=1e-12)


def test_the_inverse_of_the_arc_length():
    run = Travel(CURVE_A)
    quarters = run.parameter_at(run.length * np.array([0.25, 0.5, 0.75]))
    np.testing.assert_allclose(quarters, [0.150257811, 0.452746239, 0.801730187], atol=1e-9)
    for curve in (CURVE_A, CURVE_B, CURVE_C, cusp(1e-4)):
        run = Travel(curve)
        s = np.linspace(0, run.length, 301).reshape(7, 43)
        u = run.parameter_at(s)
        assert u.shape == s.shape and np.all(np.diff(u.ravel()) > 0)
        np.testing.assert_allclose(run.length_at(u), s, atol=1e-11 * run.length)
    with pytest.raises(MechlabError, match="s: expected"):
        run.parameter_at(run.length * 1.1)


@pytest.mark.parametrize(
    ("speed", "leave", "length", "u"),
    [(200, 0, 442.770036, 0.977673583), (200, 50, LENGTH_A - 18.75, 0.979146494), (400, 0, LENGTH_A - 80, 0.889764445)],
)
def test_braking_on_curve_a(speed, leave, length, u):
    found = bspline.braking(CURVE_A, speed, leave, 1000)
    assert found.length == pytest.approx(length, abs=1e-6) and found.parameter == pytest.approx(u, abs=1e-9)
    if (speed, leave) == (200, 0):
        np.testing.assert_allclose(found.point, [381.3460, 7.1926], atol=1e-4)


def test_no_braking():
    with pytest.raises(NoSolution, match="962"):
        bspline.braking(CURVE_A, 2000, 0, 1000)
    for bad, name in (((100, 200, 10), "speed"), ((100, -1, 10), "exit_speed"), ((100, 0, 0), "deceleration")):
        with pytest.raises(MechlabError, match=name):
            bspline.braking_distance(*bad)


@pytest.mark.parametrize(
    ("degree", "knots", "points", "said"),
    [
        (0, (0, 1), ((0,),), "degree"),
        (2.5, (0,), ((0,),), "degree"),
        (3, (0, 0, 1, 1), ((0, 0), (1, 1)), "at least 4 points"),
        (1, (0, 0, 1), ((0, 0), (1, 1)), r"1 \+ 1 = 4 knots, got 3"),
        (1, (0, 1, 0.5, 1), ((0, 0), (1, 1)), "knot 2 = 0.5 follows 1"),
        (1, (0, 1, 1, 2), ((0, 0), (1, 1)), "no length"),
        (1, (0, 0, math.nan, 1), ((0, 0), (1, 1)), "knots: expected a list of finite"),
        (1, (0, 0, 1, 1), ((0, 0), (1,)), "points: expected a list of points"),
        (1, (0, 0, 1, 1), "ab", "points"),
    ],
)
def test_bad_curves_are_named(degree, knots, points, said):
    with pytest.raises(MechlabError, match=said):
        BSpline(degree, knots, points)
