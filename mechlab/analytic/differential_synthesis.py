"""Teeth of the closed gear differential for two wanted ratios.

Input carrier with planet 2 between sun 1 and ring 3, output carrier with planet 5 between sun 4 and ring 6; suns on
one shaft, rings on one drum. With a = z1 / (z1 + z3) and b = z4 / (z4 + z6) the ratio input : output is a / b while
the drum 36 is braked and (1 - a) / (1 - b) while the suns 14 are. Rings fit when z3 = z1 + 2 z2, z6 = z4 + 2 z5; so
a, b < 1/2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import MechlabError

IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class DifferentialTeeth:
    """`teeth` (n, 6): z1 .. z6 of each solution, sorted by the larger ring; `a`, `b`: the sun shares that the ratios
    demand; `stages`: how many input and output stages fit; `limits`: smallest and largest sun share in the search."""

    teeth: IntArray
    a: Fraction
    b: Fraction
    stages: tuple[int, int]
    limits: tuple[float, float]


def sun_shares(ratio_36_braked: Fraction, ratio_14_braked: Fraction) -> tuple[Fraction, Fraction]:
    """a and b from i36 = a / b and i14 = (1 - a) / (1 - b): b = (1 - i14) / (i36 - i14), a = i36 b.

    Raises MechlabError for equal ratios: then a = b, both ratios are 1 and the carriers turn as one.
    """
    if ratio_36_braked == ratio_14_braked:
        raise MechlabError(
            f"ratio_36_braked and ratio_14_braked are both {ratio_36_braked}; they must differ: equal ratios mean equal "
            "stages, whose carriers turn as one"
        )
    b = (1 - ratio_14_braked) / (ratio_36_braked - ratio_14_braked)
    return ratio_36_braked * b, b


def stage_teeth(share: Fraction, planets: int, teeth: Sequence[int], tolerance: float = 0.0) -> IntArray:
    """(n, 3) sun, planet, ring of every stage that fits: sun / (sun + ring) = share (relative error at most
    `tolerance`), ring = sun + 2 planet, all among `teeth`, planets evenly placed and apart:
    (sun + planet) sin(pi / planets) >= planet + 2."""
    sun, planet = _suns_and_planets(teeth)
    centre = sun + planet
    if tolerance == 0.0:
        ok = sun * share.denominator == 2 * share.numerator * centre
    else:
        ok = np.abs(sun / (2.0 * centre * float(share)) - 1.0) <= tolerance
    ok &= _assembles(sun, planet, planets, teeth)
    rows = np.column_stack([sun, planet, sun + 2 * planet])[ok]
    return np.asarray(rows[np.lexsort((rows[:, 0], rows[:, 2]))])


def share_limits(planets: int, teeth: Sequence[int]) -> tuple[float, float]:
    """Smallest and largest sun share that a stage with these teeth can have (NaN when none fits)."""
    sun, planet = _suns_and_planets(teeth)
    ok = _assembles(sun, planet, planets, teeth)
    shares = 0.5 * sun[ok] / (sun[ok] + planet[ok])
    return (float(shares.min()), float(shares.max())) if len(shares) else (math.nan, math.nan)


def closed_differential_teeth(
    ratio_36_braked: Fraction,
    ratio_14_braked: Fraction,
    planets: int = 3,
    teeth: Sequence[int] = range(18, 201),
    tolerance: float = 0.0,
) -> DifferentialTeeth:
    """All pairs of stages with these two ratios, every wheel with one of the tooth counts `teeth`. Raises MechlabError for
    equal ratios, fewer than one planet, and tooth counts that are empty or below 1."""
    if planets < 1 or not len(teeth) or min(teeth) < 1:
        raise MechlabError(
            f"planets = {planets}, teeth {list(teeth)}; expected at least one planet and tooth counts of at least 1"
        )
    a, b = sun_shares(ratio_36_braked, ratio_14_braked)
    first, second = (stage_teeth(x, planets, teeth, tolerance) for x in (a, b))
    n, m = len(first), len(second)
    pairs = np.hstack([np.repeat(first, m, axis=0), np.tile(second, (n, 1))]).reshape(n * m, 6)
    order = np.lexsort((pairs.sum(axis=1), np.maximum(pairs[:, 2], pairs[:, 5])))
    return DifferentialTeeth(pairs[order], a, b, (n, m), share_limits(planets, teeth))


def _suns_and_planets(teeth: Sequence[int]) -> tuple[IntArray, IntArray]:
    """Tooth counts of sun and planet, (n,) each: all pairs."""
    counts = np.unique(np.asarray(teeth, dtype=np.int64))
    sun, planet = np.meshgrid(counts, counts, indexing="ij")
    return sun.ravel(), planet.ravel()


def _assembles(sun: IntArray, planet: IntArray, planets: int, teeth: Sequence[int]) -> NDArray[np.bool_]:
    ok = np.isin(sun + 2 * planet, np.asarray(teeth)) & (2 * (sun + planet) % planets == 0)
    if planets > 1:
        ok &= (sun + planet) * math.sin(math.pi / planets) >= planet + 2
    return np.asarray(ok)
