"""B-spline curves: points, arc length, its inverse, and where to brake."""

from mechlab.analytic.bspline.curve import BSpline
from mechlab.analytic.bspline.length import (
    LengthReport,
    arc_length,
    control_polygon_length,
    gauss_spans,
    quadrature_spans,
    simpson_bound,
    simpson_spans,
    smooth_pieces,
)
from mechlab.analytic.bspline.speed_law import SpeedLaw
from mechlab.analytic.bspline.travel import Braking, SpeedRamp, Travel, braking, braking_distance

__all__ = [
    "BSpline",
    "Braking",
    "LengthReport",
    "SpeedLaw",
    "SpeedRamp",
    "Travel",
    "arc_length",
    "braking",
    "braking_distance",
    "control_polygon_length",
    "gauss_spans",
    "quadrature_spans",
    "simpson_bound",
    "simpson_spans",
    "smooth_pieces",
]
