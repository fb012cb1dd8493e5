"""Claims of an article on the length of B-spline curves, on which toolpaths of the delta are built."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import bspline
from mechlab.experiment.entry import Claim, ClaimResult, Verdict

SOURCE = "Calculation of the length of a B-spline curve"
CLAMPED = (0.0, 0.0, 0.0, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.0, 1.0, 1.0)
PLANE = bspline.BSpline(3, CLAMPED, ((0, 0), (60, 80), (120, -40), (180, 60), (240, 0), (300, 90), (340, 20), (400, 0)))
"""A smooth cubic of five spans (the example of the source has not come down to us)."""
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


def simpson() -> ClaimResult:
    """The method on a smooth curve and on one with a cusp that no node hits, against adaptive quadrature."""
    computed: dict[str, object] = {}
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
    if all(good.values()):
        return ClaimResult(computed, Verdict.HOLDS)
    if good["smooth"]:
        because = (
            "the curve nowhere stands (nearly) still inside a span: at a cusp |C'| has a corner, the formula loses its fourth "
            "order, and comparing two panel counts underrates the error; splitting the span there restores it"
        )
        return ClaimResult(computed, Verdict.HOLDS_ONLY_IF, because)
    return ClaimResult(computed, Verdict.FAILS, "Simpson's formula does not give the length")


def _off_centre(curve: bspline.BSpline) -> bspline.BSpline:
    """The part 0..0.77 of a cubic Bezier curve: the same cusp, where no node of Simpson's formula hides it."""
    u = 0.77
    points = np.array(curve.points)
    left = [points[0]]
    while len(points) > 1:  # de Casteljau
        points = (1 - u) * points[:-1] + u * points[1:]
        left.append(points[0])
    return bspline.BSpline(3, curve.knots, tuple(tuple(p) for p in left))


def control_polygon() -> ClaimResult:
    """Sum of the chords between the control points against the length."""
    length, chords = bspline.arc_length(PLANE).length, bspline.control_polygon_length(PLANE)
    computed = {"length": length, "sum of chords": chords, "ratio": chords / length}
    if abs(chords / length - 1.0) < 0.05:
        return ClaimResult(computed, Verdict.HOLDS)
    if chords > length:
        return ClaimResult(
            computed,
            Verdict.HOLDS_ONLY_IF,
            f"an upper bound is enough: here it is {100 * (chords / length - 1):.0f} % too long",
        )
    return ClaimResult(computed, Verdict.FAILS, "the chords are no bound")


def start_of_braking() -> ClaimResult:
    """Braking at the arc length, and at the share of the parameter that the share of the length would be."""
    travel = bspline.Travel(PLANE)
    found = bspline.braking(PLANE, SPEED, 0.0, DECELERATION, travel)
    naive = 1.0 - found.distance / travel.length
    left = travel.length - float(travel.length_at(naive))
    computed = {
        "u where braking must begin": found.parameter, "u in proportion to the length": naive,
        "way needed": found.distance, "way left from there": left,
    }  # fmt: skip
    if abs(left - found.distance) > 0.01 * found.distance:
        short = f"without it the tool would begin at u = {naive:.3f} instead of {found.parameter:.3f}, {abs(left - found.distance):.3g} off"
        return ClaimResult(computed, Verdict.HOLDS, short)
    return ClaimResult(computed, Verdict.FAILS, "the parameter itself tells where to brake")


CLAIMS = (
    Claim("C49", "abstract",
          "The length follows from the polynomial form within each segment and Simpson's formula.",
          "polynomial and Simpson", simpson, SOURCE),
    Claim("C50", "introduction",
          "The chords of the control polygon give some idea of the length.", "sum of chords", control_polygon, SOURCE),
    Claim("C51", "introduction",
          "The length must be known to find the point where braking begins.", "needed for braking", start_of_braking, SOURCE),
)  # fmt: skip
