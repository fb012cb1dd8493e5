"""Tooth synthesis against brute force, and the source's inequalities against the conditions they come from."""

import math
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from scipy.optimize import brentq

from mechlab.analytic import planetary_synthesis as closed
from mechlab.errors import MechlabError

CASES = 200_000


# Counts by an independent enumeration, 18 <= z <= 120 (z4 free), z1 <= 30, pressure angle 20..30 deg.
@pytest.mark.parametrize(
    ("ratio", "planets", "count", "standard", "smallest"),
    [(6, 3, 11425, 1339, (18, 36, 18, 90)), (6, 4, 2575, 721, (18, 36, 18, 90)), (4, 3, 3342, 515, (18, 18, 18, 54))],
)
def test_counts(ratio: int, planets: int, count: int, standard: int, smallest: tuple[int, ...]) -> None:
    found = closed.series_planets(ratio, planets)
    assert len(found) == count and np.count_nonzero(found.z4 == found.z1 + 2 * found.z2) == standard
    assert (found.z1[0], found.z2[0], found.z3[0], found.z4[0]) == smallest
    assert np.all(np.diff(found.size) >= 0) and np.all(found.size == found.z1 + 2 * found.z2 + 2 * found.z3)
    assert np.all(found.neighbours >= 0.0) and np.all(found.pressure_angle <= math.radians(30.0) + 1e-12)


def brute(ratio: Fraction, planets: int, ranges: list[range], widest: float) -> set[tuple[int, ...]]:
    """Every condition from the drawing: centres as points, tips as circles, working angle from the centre distance."""
    out = set()
    cos20 = math.cos(math.radians(20.0))
    for z1, z2, z3 in product(*ranges):
        z4 = z1 * (ratio - 1)
        if z4.denominator != 1 or (z1 + z4) % planets:
            continue
        a12, a34 = 0.5 * (z1 + z2), 0.5 * (z1 + z2) + 0.5 * (z2 + z3)
        cosine = 0.5 * (z3 + z4) * cos20 / a34
        if cosine > cos20 * (1 + 1e-12) or cosine < math.cos(widest):
            continue
        rays = (0.0, 2 * math.pi / planets)
        tips = ((a12, z2 / 2 + 1), (a34, z3 / 2 + 1))
        centres = [(r * math.cos(t), r * math.sin(t), tip) for t in rays for r, tip in tips]
        pairs = [(0, 2), (1, 3), (0, 3)]
        if all(math.dist(centres[i][:2], centres[j][:2]) >= centres[i][2] + centres[j][2] - 1e-12 for i, j in pairs):
            out.add((z1, z2, z3, int(z4)))
    return out


@pytest.mark.parametrize(
    ("ratio", "planets", "widest"), [("6", 3, 30), ("17/3", 4, 26), ("9/2", 5, 40), ("11", 3, 30), ("12", 3, 22)]
)
def test_brute_force_finds_the_same(ratio: str, planets: int, widest: float) -> None:
    ranges = [range(12, 25), range(12, 80), range(12, 60)]
    found = closed.series_planets(Fraction(ratio), planets, *ranges, pressure_angle_max=math.radians(widest))
    same = set(zip(found.z1.tolist(), found.z2.tolist(), found.z3.tolist(), found.z4.tolist(), strict=True))
    assert same == brute(Fraction(ratio), planets, ranges, math.radians(widest))


def random_cases() -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(1)
    n = 2 * CASES
    values = (rng.uniform(1.05, 20, n), rng.uniform(0.1, 4, n), rng.uniform(0.8, 1.2, n), rng.uniform(0.8, 1.2, n),
              rng.integers(3, 9, n))  # fmt: skip
    ok = closed.exists(*values[:4])
    cases = tuple(x[ok][:CASES] for x in values)
    assert len(cases[0]) == CASES
    return cases


def test_corrected_bounds_agree_with_brute_force_and_printed_ones_do_not() -> None:
    i, y, t1, t2, k = random_cases()
    s = np.sin(np.pi / k)
    z2 = (t2 * (i - 1) - 1) / (1 + t1 * (1 + y) - y * t2)  # z1 = 1
    z3, z4 = y * z2, i - 1
    assert np.max(np.abs(1 + z2 + (z2 + z3) * t1 - (z3 + z4) * t2) / (1 + z2 + z3)) < 1e-12
    direct = (1 + z2) * s >= z2, (z3 + z4) * s >= z3
    bounds = closed.within_bounds(i, y, t1, t2, k)
    assert [np.count_nonzero(a != b) for a, b in zip(direct, bounds, strict=True)] == [0, 0]
    assert 0.05 < np.mean((i <= closed.ratio_bound_2(y, t1, t2, k, printed=True)) != direct[0]) < 0.3
    bound, upper = closed.ratio_bound_3(y, t1, t2, k)
    assert np.array_equal((i >= bound) != direct[1], upper)


def test_example_of_the_bound() -> None:
    assert math.isclose(closed.ratio_bound_2(1.0, 1.0, 1.1, 3), 13.074, abs_tol=5e-4)
    assert math.isclose(closed.ratio_bound_2(1.0, 1.0, 1.1, 3, printed=True), 40.67, abs_tol=5e-3)
    assert math.isclose(closed.ratio_bound_2(1.0, 1.1, 0.9, 3), 18.63, abs_tol=5e-3)


def test_example_with_a_large_shift() -> None:
    assert math.isclose(math.degrees(closed.working_angle(20, 43, 35, 100)), 25.8806, abs_tol=5e-5)
    found = closed.series_planets(6, 3, [20], [43], [35])
    assert len(found) == 1 and math.isclose(found.shift[0], 3.440, abs_tol=5e-4)


@pytest.mark.parametrize("teeth", [(18, 36, 18, 90), (20, 43, 35, 100), (21, 20, 30, 42)])
def test_the_profile_shift_brings_the_gears_to_their_centre_distance(teeth: tuple[int, int, int, int]) -> None:
    z1, z2, z3, z4 = teeth
    standard = math.radians(20.0)
    x = float(closed.profile_shift(*teeth))
    wanted = math.tan(standard) - standard + 2.0 * x * math.tan(standard) / (z3 + z4)
    angle = brentq(lambda a: math.tan(a) - a - wanted, 0.1, 1.2, xtol=1e-14)
    # arccos near 20 deg and the solver's 1e-14 leave twelve digits
    assert math.isclose((z3 + z4) * math.cos(standard) / math.cos(angle), z1 + 2 * z2 + z3, rel_tol=1e-12)


def test_refusals() -> None:
    with pytest.raises(MechlabError, match="more than 1"):
        closed.series_planets(1, 3)
    with pytest.raises(MechlabError, match="20 deg or more"):
        closed.series_planets(6, 3, pressure_angle_max=0.1)
    with pytest.raises(MechlabError, match="z2"):
        closed.series_planets(6, 3, z2=[])
    with pytest.raises(MechlabError, match="too large"):
        closed.working_angle(18, 18, 18, 90)
