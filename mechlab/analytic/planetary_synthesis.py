"""Teeth of a planetary gear with series planets: sun 1 - planet 2 - planet 3 - fixed central gear 4, all meshes external.

Carrier output, centres on one ray, planet 3 outermost. With working pressure angles aw and t1 = cos aw12 / cos aw23,
t2 = cos aw12 / cos aw34:

    ratio           i = 1 + z4 / z1
    one ray         z1 + z2 + (z2 + z3) t1 = (z3 + z4) t2
    even planets    (z1 + z4) / k whole
    neighbours      2-2, 3-3 and 2-3': the tips of planets on neighbouring rays do not meet.

Source: synthesis of the planetary mechanism 2A-AA with regard to the pressure angles (equations numbered as there).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
STANDARD = math.radians(20.0)


@dataclass(frozen=True)
class SeriesPlanets:
    """All solutions as arrays (n,), the smallest `size` first.

    z1, z2, z3, z4: teeth. pressure_angle: of the mesh 3-4 [rad] (those of 1-2 and 2-3 are 20 deg). size: outer size
    (z1 + z2) + (z2 + z3) + z3 in modules. shift: sum of the profile shifts of the mesh 3-4, in modules. neighbours:
    clearance between the tips of neighbouring planets, in modules, the least of 2-2, 3-3, 2-3'.
    """

    z1: NDArray[np.int64]
    z2: NDArray[np.int64]
    z3: NDArray[np.int64]
    z4: NDArray[np.int64]
    pressure_angle: FloatArray
    size: NDArray[np.int64]
    shift: FloatArray
    neighbours: FloatArray

    def __len__(self) -> int:
        return len(self.z1)


def involute(angle: ArrayLike) -> FloatArray:
    """inv(a) = tan a - a."""
    a = np.asarray(angle, dtype=float)
    return np.asarray(np.tan(a) - a)


def series_planets(
    ratio: Fraction | int | float,
    planets: int,
    z1: Sequence[int] = range(18, 31),
    z2: Sequence[int] = range(18, 121),
    z3: Sequence[int] = range(18, 121),
    z4: Sequence[int] | None = None,
    pressure_angle_max: float = math.radians(30.0),
) -> SeriesPlanets:
    """All tooth counts in the given ranges with exactly that ratio, meshes 1-2 and 2-3 at 20 deg, mesh 3-4 between 20 deg
    and `pressure_angle_max` [rad], and every neighbour condition with the true centre distances (tips without profile
    shift). z4 None: any count that the ratio asks for. Raises MechlabError for a ratio of at most 1, fewer than one
    planet, or a pressure angle below 20 deg.
    """
    exact = ratio if isinstance(ratio, Fraction) else Fraction(str(ratio))
    if exact <= 1:
        raise MechlabError(f"ratio = {exact}; expected more than 1: the ratio is 1 + z4 / z1")
    if planets < 1:
        raise MechlabError(f"planets = {planets}; expected at least 1")
    if not STANDARD <= pressure_angle_max < 0.5 * math.pi:
        raise MechlabError(
            f"pressure_angle_max = {math.degrees(pressure_angle_max):g} deg; expected 20 deg or more, below 90 deg"
        )
    wanted = None if z4 is None else set(z4)
    two, three = (a.ravel() for a in np.meshgrid(_teeth("z2", z2), _teeth("z3", z3), indexing="ij"))
    found: list[NDArray[np.int64]] = []
    for sun in _teeth("z1", z1).tolist():
        four = sun * (exact - 1)
        if four.denominator != 1 or (wanted is not None and int(four) not in wanted) or (sun + int(four)) % planets:
            continue
        ok = _fits(sun, two, three, int(four), planets, pressure_angle_max)
        n = int(np.count_nonzero(ok))
        found.append(np.column_stack([np.full(n, sun), two[ok], three[ok], np.full(n, int(four))]))
    rows = np.concatenate(found) if found else np.zeros((0, 4), dtype=np.int64)
    size = rows[:, 0] + 2 * rows[:, 1] + 2 * rows[:, 2]
    rows = rows[np.lexsort((rows[:, 2], rows[:, 1], rows[:, 0], size))]
    a, b, c, d = rows.T
    aw = working_angle(a, b, c, d)
    shift = profile_shift(a, b, c, d)
    gap = 0.5 * np.min(neighbour_gaps(a, b, c, planets), axis=0) if planets > 1 else np.full(len(a), math.inf)
    return SeriesPlanets(a, b, c, d, aw, a + 2 * b + 2 * c, shift, gap)


def working_angle(z1: ArrayLike, z2: ArrayLike, z3: ArrayLike, z4: ArrayLike) -> FloatArray:
    """Working pressure angle of the mesh 3-4 [rad] when the meshes 1-2 and 2-3 work at 20 deg:
    cos aw34 = (z3 + z4) cos 20 deg / (z1 + 2 z2 + z3). Raises MechlabError where no angle fits: z3 + z4 is too
    large."""
    a, b, c, d = (np.asarray(z, dtype=float) for z in (z1, z2, z3, z4))
    cosine = (c + d) * math.cos(STANDARD) / (a + 2.0 * b + c)
    if np.any(cosine >= 1.0):
        raise MechlabError("the gears 3 and 4 are too large for their centre distance: z3 + z4 against z1 + 2 z2 + z3")
    return np.asarray(np.where(c + d == a + 2.0 * b + c, STANDARD, np.arccos(cosine)))


def profile_shift(z1: ArrayLike, z2: ArrayLike, z3: ArrayLike, z4: ArrayLike) -> FloatArray:
    """Profile shift of gear 4 [modules] that brings its mesh to the working angle aw, planet 3 without shift:
    (z3 + z4) (inv aw - inv 20 deg) / (2 tan 20 deg)."""
    aw = working_angle(z1, z2, z3, z4)
    teeth = np.asarray(z3, dtype=float) + np.asarray(z4, dtype=float)
    return np.asarray(teeth * (involute(aw) - involute(STANDARD)) / (2.0 * math.tan(STANDARD)))


def neighbour_gaps(z1: ArrayLike, z2: ArrayLike, z3: ArrayLike, planets: int) -> FloatArray:
    """(3, ...) clearance between the tips of neighbouring planets 2-2, 3-3 and 2-3', in half modules, at least 0.

    Centres at D12 = z1 + z2 and D34 = z1 + 2 z2 + z3 half modules (meshes 1-2 and 2-3 at 20 deg).
    """
    a, b, c = (np.asarray(z, dtype=float) for z in (z1, z2, z3))
    inner, outer = a + b, a + 2.0 * b + c
    s = math.sin(math.pi / planets)
    across = np.sqrt(inner**2 + outer**2 - 2.0 * inner * outer * math.cos(2.0 * math.pi / planets))
    return np.stack([2.0 * (inner * s - b - 2.0), 2.0 * (outer * s - c - 2.0), across - b - c - 4.0])


def _fits(z1: int, z2: NDArray[np.int64], z3: NDArray[np.int64], z4: int, planets: int, widest: float) -> BoolArray:
    centres, sums = z1 + 2 * z2 + z3, z3 + z4
    # At 20 deg both are equal integers: no rounding decides there.
    ok = (sums <= centres) & (sums * math.cos(STANDARD) >= centres * math.cos(widest) * (1.0 - 1e-13))
    if planets > 1:
        ok &= np.all(neighbour_gaps(z1, z2, z3, planets) >= 0.0, axis=0)
    return np.asarray(ok)


def _teeth(name: str, values: Sequence[int]) -> NDArray[np.int64]:
    out = np.array(sorted(set(values)), dtype=np.int64)
    if not len(out) or out[0] < 1:
        raise MechlabError(f"{name}: expected whole numbers of teeth of at least 1, got {list(values)[:5]}")
    return out


# -- the source's inequalities ---------------------------------------------------------------------------------------------


def relative_planet(ratio: ArrayLike, y: ArrayLike, t1: ArrayLike, t2: ArrayLike) -> FloatArray:
    """z2 / z1 = [t2 (i - 1) - 1] / [1 + t1 (1 + y) - y t2] with y = z3 / z2: equation (5)."""
    i, y, t1, t2 = (np.asarray(x, dtype=float) for x in (ratio, y, t1, t2))
    return np.asarray((t2 * (i - 1.0) - 1.0) / (1.0 + t1 * (1.0 + y) - y * t2))


def exists(ratio: ArrayLike, y: ArrayLike, t1: ArrayLike, t2: ArrayLike) -> BoolArray:
    """Conditions (6): i > 1, t2 (i - 1) > 1 (this is (7), i > (1 + t2) / t2), 1 + t1 + y (t1 - t2) > 0."""
    i, y, t1, t2 = (np.asarray(x, dtype=float) for x in (ratio, y, t1, t2))
    return np.asarray((i > 1.0) & (t2 * (i - 1.0) > 1.0) & (1.0 + t1 + y * (t1 - t2) > 0.0))


def neighbours_direct(
    ratio: ArrayLike, y: ArrayLike, t1: ArrayLike, t2: ArrayLike, planets: ArrayLike
) -> tuple[BoolArray, BoolArray]:
    """The two conditions (8) of the source: (z1 + z2) s >= z2 and (z3 + z4) s >= z3, s = sin(pi / k). Like the source
    they leave out the addendum term 2 / z1."""
    s = np.sin(math.pi / np.asarray(planets, dtype=float))
    b = relative_planet(ratio, y, t1, t2)
    c = np.asarray(y, dtype=float) * b
    return np.asarray((1.0 + b) * s >= b), np.asarray((c + np.asarray(ratio, dtype=float) - 1.0) * s >= c)


def ratio_bound_2(y: ArrayLike, t1: ArrayLike, t2: ArrayLike, planets: ArrayLike, printed: bool = False) -> FloatArray:
    """Upper bound (9) of the ratio from planets 2-2: [1 + t2 + (t1 - t2)(1 + y) s] / [t2 (1 - s)].

    printed: with the denominator 1 - t2 s of the source, which is right only for t2 = 1.
    """
    y, t1, t2 = (np.asarray(x, dtype=float) for x in (y, t1, t2))
    s = np.sin(math.pi / np.asarray(planets, dtype=float))
    below = 1.0 - t2 * s if printed else t2 * (1.0 - s)
    return np.asarray((1.0 + t2 + (t1 - t2) * (1.0 + y) * s) / below)


def ratio_bound_3(y: ArrayLike, t1: ArrayLike, t2: ArrayLike, planets: ArrayLike) -> tuple[FloatArray, BoolArray]:
    """Bound (11) of the ratio from planets 3-3, [(1 + t1)(1 + y) s - y (1 + t2)] / Bb with Bb = (1 + t1 (1 + y)) s - y t2,
    and whether it is an upper bound: it is where Bb < 0 (the source has a lower bound everywhere)."""
    y, t1, t2 = (np.asarray(x, dtype=float) for x in (y, t1, t2))
    s = np.sin(math.pi / np.asarray(planets, dtype=float))
    below = (1.0 + t1 * (1.0 + y)) * s - y * t2
    return np.asarray(((1.0 + t1) * (1.0 + y) * s - y * (1.0 + t2)) / below), np.asarray(below < 0.0)


def within_bounds(
    ratio: ArrayLike, y: ArrayLike, t1: ArrayLike, t2: ArrayLike, planets: ArrayLike
) -> tuple[BoolArray, BoolArray]:
    """The corrected bounds (9) and (11) as conditions on the ratio: the same truth values as `neighbours_direct`."""
    i = np.asarray(ratio, dtype=float)
    bound, upper = ratio_bound_3(y, t1, t2, planets)
    return np.asarray(i <= ratio_bound_2(y, t1, t2, planets)), np.asarray(np.where(upper, i <= bound, i >= bound))
