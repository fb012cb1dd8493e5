"""Planar Assur groups: driver, the five dyads, class III and IV with every assembly mode, and their paths over a cycle.

Points are complex numbers x + iy with velocity and acceleration; all functions broadcast over positions and designs.
"""

from mechlab.analytic.assur.continuation import ClosedCurve, closed_curve, follow_dyad
from mechlab.analytic.assur.cycle import Branch, GroupMotion, follow, mode_rates
from mechlab.analytic.assur.dyads import ChangePoint, Dyad, prp, rpp, rpr, rrp, rrr
from mechlab.analytic.assur.folds import Family, Fold, empty_arcs, folds, solve_fold
from mechlab.analytic.assur.plane import Guide, Point, Scalar, driver, fixed, fixed_guide, rigid, scalar
from mechlab.analytic.assur.two_loops import Modes, TwoLoops, all_modes, class_four, class_three, two_loops

__all__ = [
    "Branch", "ChangePoint", "ClosedCurve", "Dyad", "Family", "Fold", "GroupMotion", "Guide", "Modes", "Point", "Scalar",
    "TwoLoops", "all_modes", "class_four", "class_three", "closed_curve", "driver", "empty_arcs", "fixed", "fixed_guide",
    "folds", "follow", "follow_dyad", "mode_rates", "prp", "rigid", "rpp", "rpr", "rrp", "rrr", "scalar", "solve_fold", "two_loops",
]  # fmt: skip
