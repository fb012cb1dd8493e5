"""The closed gear differential: teeth and speeds, and the teeth for two wanted ratios.

Input carrier H1 with planets 2, output carrier H2 with planets 5, block 14 of both suns, block 36 of both rings. With
a = z1/(z1+z3) and b = z4/(z4+z6) all its constraints are

    w_H1 = a w1 + (1-a) w3,    w_H2 = b w1 + (1-b) w3,

hence two degrees of freedom. Speeds are absolute, positive in one common sense. The ratio input : output is a / b
while block 36 is braked and (1 - a) / (1 - b) while block 14 is. Rings fit when z3 = z1 + 2 z2, z6 = z4 + 2 z5; so
a, b < 1/2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.analytic.planetary_stage import TOUCHING, AssemblyConditions, neighbour_margin
from mechlab.analytic.planetary_stage import conditions as stage_conditions
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Train:
    """Tooth counts of sun 1, planet 2, ring 3, sun 4, planet 5, ring 6. Raises MechlabError unless they are positive
    and the axes of each stage align: z3 = z1 + 2 z2, z6 = z4 + 2 z5 (equation 13 of the source)."""

    z1: int
    z2: int
    z3: int
    z4: int
    z5: int
    z6: int

    def __post_init__(self) -> None:
        for name, z in vars(self).items():
            if not z > 0:
                raise MechlabError(f"{name} = {z!r}: a gear has at least one tooth.")
        for sun, planet, ring in (("z1", "z2", "z3"), ("z4", "z5", "z6")):
            wanted = getattr(self, sun) + 2 * getattr(self, planet)
            if getattr(self, ring) != wanted:
                raise MechlabError(
                    f"teeth: the axes do not align: {ring} = {getattr(self, ring)}, but {ring} = {sun} + 2 {planet} "
                    f"= {wanted}. Change {ring}, or {planet}."
                )

    @property
    def exact_shares(self) -> tuple[Fraction, Fraction]:
        """a and b as fractions."""
        return Fraction(self.z1, self.z1 + self.z3), Fraction(self.z4, self.z4 + self.z6)

    @property
    def a(self) -> float:
        """Share of sun 1 in the speed of H1."""
        return self.z1 / (self.z1 + self.z3)

    @property
    def b(self) -> float:
        """Share of sun 4 in the speed of H2."""
        return self.z4 / (self.z4 + self.z6)

    @property
    def u13(self) -> float:
        """Ratio of wheels 1 and 3 with H1 held, -z3/z1."""
        return -self.z3 / self.z1

    @property
    def u46(self) -> float:
        """Ratio of wheels 4 and 6 with H2 held, -z6/z4."""
        return -self.z6 / self.z4

    @property
    def carriers(self) -> FloatArray:
        """(2, 2) rows u1, u2: (w_H1, w_H2) = carriers @ (w1, w3)."""
        return np.array([[self.a, 1.0 - self.a], [self.b, 1.0 - self.b]])

    @property
    def spins(self) -> FloatArray:
        """(2, 2) rows s2, s5: absolute speeds of the planets (w2, w5) = spins @ (w1, w3)."""
        s2 = np.array([-self.z1, self.z3]) / (2.0 * self.z2)
        s5 = np.array([-self.z4, self.z6]) / (2.0 * self.z5)
        return np.array([s2, s5])

    @property
    def regular(self) -> bool:
        """False when a = b: then the carriers turn as one and their speeds do not fix those of the blocks."""
        a, b = self.exact_shares
        return a != b


@dataclass(frozen=True)
class Speeds:
    """Absolute speeds [rad/s] (or angles, or accelerations: the law is linear)."""

    w_H1: FloatArray
    w_H2: FloatArray
    w1: FloatArray
    w3: FloatArray
    w2: FloatArray
    w5: FloatArray


def speeds(train: Train, **known: ArrayLike) -> Speeds:
    """All speeds from exactly two of w_H1, w_H2, w1, w3 (arrays broadcast), by the two linear equations.

    Raises MechlabError unless two are given, or when they do not fix the others (both carriers, a = b).
    """
    rows = dict(zip(("w_H1", "w_H2", "w1", "w3"), np.vstack([train.carriers, np.eye(2)]), strict=True))
    if len(known) != 2 or not set(known) <= set(rows):
        raise MechlabError(f"speeds: expected exactly two of {', '.join(rows)}; got {', '.join(known) or 'none'}.")
    matrix = np.array([rows[name] for name in known])
    if set(known) == {"w_H1", "w_H2"} and not train.regular:
        raise MechlabError("both carriers turn as one (z1/z3 = z4/z6): their speeds do not fix those of the blocks.")
    right = np.stack(np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in known.values())), axis=-1)
    return _all(train, np.linalg.solve(matrix, right[..., None])[..., 0])


def printed_speeds(train: Train, w_H1: ArrayLike, w_H2: ArrayLike) -> Speeds:
    """Speeds by the source's own formulas: (18) for w3, then (16) for w1."""
    h1, h2 = np.asarray(w_H1, dtype=float), np.asarray(w_H2, dtype=float)
    u13, u46 = train.u13, train.u46
    w3 = (h2 * (1.0 - u46) - h1 * (1.0 - u13)) / (u13 - u46)
    return _all(train, np.stack(np.broadcast_arrays(u13 * (w3 - h1) + h1, w3), axis=-1))


def _all(train: Train, blocks: FloatArray) -> Speeds:
    carriers, planets = blocks @ train.carriers.T, blocks @ train.spins.T
    return Speeds(carriers[..., 0], carriers[..., 1], blocks[..., 0], blocks[..., 1], planets[..., 0], planets[..., 1])


def braked_ratios(train: Train) -> tuple[float, float]:
    """Ratios w_H1/w_H2 with block 36 braked, a/b, and with block 14 braked, (1-a)/(1-b)."""
    return train.a / train.b, (1.0 - train.a) / (1.0 - train.b)


def conditions(train: Train, planets: int) -> tuple[AssemblyConditions, AssemblyConditions]:
    """Assembly conditions of both stages for standard gears."""
    first, second = (train.z1, train.z2, train.z3), (train.z4, train.z5, train.z6)
    return stage_conditions(*first, planets), stage_conditions(*second, planets)


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
    return np.asarray(ok & (neighbour_margin(sun, planet, planets) >= TOUCHING))
