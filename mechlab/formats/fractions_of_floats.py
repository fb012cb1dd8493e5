"""Ratios that were written as decimals, exact again."""

from __future__ import annotations

from fractions import Fraction


def exact(value: float) -> Fraction:
    """The simplest fraction whose float is exactly `value`: 0.35714285714285715 is 5/14 again."""
    whole = Fraction(value)
    bound = 1
    while bound < 10**9:
        bound *= 10
        found = whole.limit_denominator(bound)
        if float(found) == value:
            return found
    return Fraction(str(value))
