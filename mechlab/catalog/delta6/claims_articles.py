"""Claims C49 to C55 of two articles: on the length of B-spline curves, on which toolpaths of the delta are built, and on
Boolean algebras of continuous functions, by which its workspace is put together."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from mechlab.analytic import bspline
from mechlab.analytic.regions import EXACT, SMOOTH, Algebra, indicator
from mechlab.catalog.bibliography import B_SPLINES, REGIONS
from mechlab.kit.claims import Evidence, Ledger, above, equals, evidence, fails, holds, near, none, only_if, true
from mechlab.mechanism.geometry import Array

LENGTHS = Ledger(B_SPLINES)
CLAMPED = (0.0, 0.0, 0.0, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.0, 1.0, 1.0)
PLANE = bspline.BSpline(3, CLAMPED, ((0, 0), (60, 80), (120, -40), (180, 60), (240, 0), (300, 90), (340, 20), (400, 0)))
"""A smooth cubic of five spans (the example of the source is lost)."""
STANDS_STILL = bspline.BSpline(3, (0, 0, 0, 0, 1, 1, 1, 1), ((0, 0), (100, 100), (0, 100), (100, 0)))
"""A cubic with a cusp in its middle: C' = 300 (1 - 2u) (1 - 2u, 1), of length 100 (2 sqrt 2 - 1)."""
PANELS = (16, 64, 256)
WANTED = 1e-3
"""What a toolpath needs: a thousandth of its unit, with 64 panels a span."""
SPEED, DECELERATION = 400.0, 1000.0


def _orders(curve: bspline.BSpline, length: float) -> tuple[dict[str, float], float, float]:
    """Errors of Simpson by panels, the order between the last two, the error with 64 panels."""
    errors = [abs(float(bspline.simpson_spans(curve, n).sum()) - length) for n in PANELS]
    order = math.log(errors[1] / errors[2]) / math.log(PANELS[2] / PANELS[1])
    return {f"Simpson, {n} panels a span: off by": e for n, e in zip(PANELS, errors, strict=True)}, order, errors[1]


def _off_centre(curve: bspline.BSpline) -> bspline.BSpline:
    """The part 0..0.77 of a cubic Bezier curve: the same cusp, where no node of Simpson's formula hides it."""
    u = 0.77
    points = np.array(curve.points)
    left = [points[0]]
    while len(points) > 1:  # de Casteljau
        points = (1 - u) * points[:-1] + u * points[1:]
        left.append(points[0])
    return bspline.BSpline(3, curve.knots, tuple(tuple(p) for p in left))


@LENGTHS.claim(
    "C49", "abstract", "The length follows from the polynomial form within each segment and Simpson's formula.",
    "polynomial and Simpson",
    holds(when=true("smooth", "cusp")),
    only_if("the curve nowhere stands (nearly) still inside a span: at a cusp |C'| has a corner, the formula loses its fourth "
            "order, and comparing two panel counts underrates the error; splitting the span there restores it",
            when=true("smooth")),
    fails("Simpson's formula does not give the length"),
)  # fmt: skip
def simpson() -> Evidence:
    """The method on a smooth curve and on one with a cusp that no node hits, against adaptive quadrature."""
    computed: dict[str, Any] = {}
    good = {}
    for name, curve in (("smooth", PLANE), ("cusp", _off_centre(STANDS_STILL))):
        length = float(bspline.quadrature_spans(curve).sum())
        errors, order, error = _orders(curve, length)
        computed |= {f"{name}: length by adaptive quadrature": length} | {f"{name}: {k}": v for k, v in errors.items()}
        computed |= {
            f"{name}: order": order,
            f"{name}: Gauss split where slow, off by": bspline.arc_length(curve).length - length,
        }
        good[name] = error < WANTED and order > 3.5
    return evidence(computed, **good)


@LENGTHS.claim(
    "C50", "introduction, where the scan ends", "The chords of the control polygon give some idea of the length.", "sum of chords",
    holds(when=near("ratio", 0.05, of=1.0)),
    only_if("an upper bound is enough: here it is {percent:.0f} % too long", when=above(1.0, "ratio")),
    fails("the chords are no bound"),
)  # fmt: skip
def control_polygon() -> Evidence:
    """Sum of the chords between the control points against the length."""
    length, chords = bspline.arc_length(PLANE).length, bspline.control_polygon_length(PLANE)
    computed = {"length": length, "sum of chords": chords, "ratio": chords / length}
    return evidence(computed, percent=100 * (chords / length - 1))


@LENGTHS.claim(
    "C51", "introduction", "The length must be known to find the point where braking begins.", "needed for braking",
    holds("without it the tool would begin at u = {naive:.3f} instead of {u:.3f}, {off:.3g} off",
          when=above(0.01, "off_share")),
    fails("the parameter itself tells where to brake"),
)  # fmt: skip
def start_of_braking() -> Evidence:
    """Braking at the arc length, and at the share of the parameter that the share of the length would be."""
    travel = bspline.Travel(PLANE)
    found = bspline.braking(PLANE, SPEED, 0.0, DECELERATION, travel)
    naive = 1.0 - found.distance / travel.length
    left = travel.length - float(travel.length_at(naive))
    computed = {
        "u where braking must begin": found.parameter, "u in proportion to the length": naive,
        "way needed": found.distance, "way left from there": left,
    }  # fmt: skip
    off = abs(left - found.distance)
    return evidence(computed, naive=naive, u=found.parameter, off=off, off_share=off / found.distance)


ALGEBRAS = Ledger(REGIONS)
CASES = 200_000


def _values() -> tuple[Array, Array, Array]:
    """Random values of three functions; a tenth of them 0, where the border is."""
    rng = np.random.default_rng(7)
    values = rng.standard_normal((3, CASES))
    values[rng.random(values.shape) < 0.1] = 0.0
    return values[0], values[1], values[2]


@ALGEBRAS.claim(
    "C52", "characteristic of a function",
    "chi(f) = (1 + sgn f) / 2 is a two-valued variable, 1 where f >= 0 and 0 elsewhere.", "{0, 1}",
    holds(when=true("two_valued")),
    only_if("sgn 0 is taken as +1; with sgn 0 = 0 it gives 1/2 on the border", when=true("two_valued_with_sgn_1")),
    fails("more than two values"),
)  # fmt: skip
def characteristic() -> Evidence:
    """chi(f) = (1 + sgn f) / 2 as numbers."""
    x, _, _ = _values()
    plain, other = (sorted({float(v) for v in values}) for values in ((1.0 + np.sign(x)) / 2.0, indicator(x)))
    computed = {"values with sgn 0 = 0": plain, "values with sgn 0 = 1": other}
    return evidence(computed, two_valued=plain == [0.0, 1.0], two_valued_with_sgn_1=other == [0.0, 1.0])


def _laws(form: Algebra, x: Array, y: Array, z: Array) -> Iterator[tuple[str, Array, Array]]:
    a, o = form.meet, form.join
    yield "commutative", a(x, y), a(y, x)
    yield "associative", a(a(x, y), z), a(x, a(y, z))
    yield "distributive", a(x, o(y, z)), o(a(x, y), a(x, z))
    yield "absorption", o(x, a(x, y)), x
    yield "idempotent", a(x, x), x
    yield "De Morgan", -a(x, y), o(-x, -y)


@ALGEBRAS.claim(
    "C53", "abstract, continuous functions",
    "On classes of equivalent continuous functions a Boolean algebra can be built that is isomorphic to that of the sets of space.",
    "isomorphic",
    fails("{wrong} signs break a law", when=true("wrong")),
    holds(when=none("points of f and of not f")),
    only_if("sets are counted alike that differ on the border f = 0: {{f >= 0}} is closed, {{-f >= 0}} is too, and both have "
            "the border; the complement of a closed set is open. Equivalent is read as of the same sign: the scan ends before it is said"),
)  # fmt: skip
def boolean_algebra() -> Evidence:
    """The laws of a Boolean algebra on signs, with min and max and with R-functions; and the complement on the border."""
    x, y, z = _values()
    computed: dict[str, Any] = {}
    wrong = 0
    for form in (EXACT, SMOOTH):
        signs, values = 0, 0.0
        for _, p, q in _laws(form, x, y, z):
            signs += int(np.count_nonzero((p >= 0.0) != (q >= 0.0)))  # their characteristics
            values = max(values, float(np.max(np.abs(p - q))))
        computed |= {f"{form.name}: signs that break a law": signs, f"{form.name}: largest difference in value": values}
        wrong += signs
    both = int(np.count_nonzero(indicator(x) + indicator(-x) == 2))
    computed |= {"points of f and of not f": both, "points with f = 0": int(np.count_nonzero(x == 0.0))}
    return evidence(computed, wrong=wrong)


@ALGEBRAS.claim(
    "C54", "abstract, continuously differentiable functions",
    "The same can be done with continuously differentiable functions.", "isomorphic",
    fails("the slope jumps", when=above(1e-3, "jump")),
    holds(when=near("corner", 1e-6, of=0.0)),
    only_if("corners are left out: where both functions vanish the slope of an R-function jumps as that of min does"),
)  # fmt: skip
def smooth_algebra() -> Evidence:
    """Continuously differentiable operations: one-sided slopes of the R-function and of min across the line x = y."""
    h = 1e-7
    x = np.linspace(0.1, 3.0, 50)
    jump = {
        form.name: float(np.max(np.abs((form.meet(x + h, x) - 2 * form.meet(x, x) + form.meet(x - h, x)) / h)))
        for form in (EXACT, SMOOTH)
    }
    slopes = [float(SMOOTH.meet(s * h, 0.0)) / h for s in (1.0, -1.0)]
    computed: dict[str, Any] = {f"{k}: jump of the slope where f = g": v for k, v in jump.items()}
    computed["R_0: slopes to both sides where f = g = 0"] = [slopes[0], -slopes[1]]
    return evidence(computed, jump=jump[SMOOTH.name], corner=slopes[0] + slopes[1])


@ALGEBRAS.claim(
    "C55", "characteristic of the opposite function", "chi(-f) = not chi(f).", "chi(-f) = not chi(f)",
    holds(when=none("points where the law fails, chi = 1 where f >= 0")),
    only_if("f is not 0: on the border {{f >= 0}} and {{-f >= 0}} both hold, so that both characteristics are 1. With sgn 0 = 0 both are "
            "1/2, which is its own opposite, but chi then has three values (C52)",
            when=equals("points where the law fails, chi = 1 where f >= 0", of="points with f = 0")
            & none("points where chi(-f) = 1 - chi(f) fails, sgn 0 = 0")),
    fails("it fails off the border too"),
)  # fmt: skip
def opposite() -> Evidence:
    """chi(-f) against not chi(f), for both readings of chi on the border."""
    x, _, _ = _values()
    plain = (1.0 + np.sign(x)) / 2.0, (1.0 + np.sign(-x)) / 2.0
    return evidence({
        "points where the law fails, chi = 1 where f >= 0": int(np.count_nonzero(indicator(-x) != 1 - indicator(x))),
        "points where chi(-f) = 1 - chi(f) fails, sgn 0 = 0": int(np.count_nonzero(plain[1] != 1.0 - plain[0])),
        "points with f = 0": int(np.count_nonzero(x == 0.0)), "points": len(x),
    })  # fmt: skip
