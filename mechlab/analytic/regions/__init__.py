"""Implicit regions {f >= 0} with Boolean algebra: exact margins by min and max, smooth ones by R-functions."""

from mechlab.analytic.regions.algebra import EXACT, SMOOTH, Algebra, indicator, r_functions
from mechlab.analytic.regions.region import Both, Clause, Either, Outside, Region, Verdicts, all_of, any_of

__all__ = [
    "EXACT",
    "SMOOTH",
    "Algebra",
    "Both",
    "Clause",
    "Either",
    "Outside",
    "Region",
    "Verdicts",
    "all_of",
    "any_of",
    "indicator",
    "r_functions",
]
