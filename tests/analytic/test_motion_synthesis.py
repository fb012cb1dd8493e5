"""Motion synthesis by least squares against ruler and compasses: positions of published and of drawn linkages."""

import cmath
import math

import numpy as np
import pytest

from mechlab.analytic.path_synthesis.curves import Geared
from mechlab.analytic.path_synthesis.guided_body import GuidedBody
from mechlab.analytic.path_synthesis.path import path_fourbars
from mechlab.analytic.path_synthesis.sixbar import Sixbar, both_modes
from mechlab.analytic.path_synthesis.sixbar_path import path_sixbars
from mechlab.analytic.path_synthesis.task import PathLinkage, PathTask
from mechlab.errors import MechlabError
from mechlab.kit.compass import at, meet
from tests.analytic.test_sixbar_synthesis import ON_ROCKER, ROW

DRAWN = np.array([0.0, 0.0, 1.0, 0.0, 2.6, 0.0, 0.0, 0.0, 3.2, 2.6, -2.7, 0.5, -0.4, 1.2, 3.4, 2.4, 0.7, -1.8])
"""A Watt six-bar of our own, as ROW; its second link turns by .8 rad."""


def placed(row: np.ndarray, on_rocker: bool | None, mode: int, side: int, t: float) -> tuple[complex, float]:
    """Point and direction of the last link by compasses; on_rocker None: the coupler of a four-bar."""
    o, w, d, p = (complex(row[k], row[k + 1]) for k in (0, 2, 4, 10))
    a = o + w * at(1.0, t)
    b = meet(a, row[8], d, row[9], mode)
    turn = (b - a) / row[8]
    if on_rocker is None:
        return a + p * turn, cmath.phase(turn)
    s, q, c = complex(*row[12:14]), complex(*row[16:18]), a + p * turn
    pivot = d + s * (b - d) / row[9] if on_rocker else s
    turn = (meet(c, row[14], pivot, row[15], side) - c) / row[14]
    return c + q * turn, cmath.phase(turn)


def positions(row: np.ndarray, on_rocker: bool | None, modes: tuple[int, int], t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,) and angles (n,) of the last link."""
    found = [placed(row, on_rocker, *modes, x) for x in t]
    return np.array([z for z, _ in found]), np.unwrap([a for _, a in found])


def task_of(z: np.ndarray, turns: np.ndarray) -> PathTask:
    """Free timing, bars up to ten times the extent, transmission angles of at least 10 deg."""
    return PathTask(z, None, 20.0 * float(np.max(np.abs(z - z.mean()))), math.radians(10.0), turns)


def missed(f: PathLinkage, task: PathTask) -> tuple[float, float]:
    """Largest distance [m] and largest error of angle [rad] of a linkage that was found, by compasses."""
    assert isinstance(f.curve, GuidedBody) and task.turns is not None
    base = f.curve.base
    on_rocker = base.on_rocker if isinstance(base, Sixbar) else None
    mode, side = both_modes(np.array(f.mode)) if isinstance(base, Sixbar) else (f.mode, 1)
    z, turns = positions(f.row, on_rocker, (int(mode), int(side)), f.angles)
    off = np.angle(np.exp(1j * (turns + f.row[-1] / f.curve.arm - task.turns)))
    return float(np.max(np.abs(z - task.targets))), float(np.max(np.abs(off)))


@pytest.mark.parametrize(("row", "on_rocker"), [(ROW[:12], None), (ROW, False), (ON_ROCKER, True)])
def test_bodies_are_those_of_compasses_and_slopes_those_of_differences(row: np.ndarray, on_rocker: bool | None) -> None:
    arm, shift, t, h = 0.37, 0.21, np.linspace(0.2, 1.4, 5)[None], 1e-6
    curve = GuidedBody(Geared() if on_rocker is None else Sixbar(on_rocker), arm)
    mode, x = np.array([1 if on_rocker is None else 3]), np.append(row, shift)[None]
    found = curve.points(x, mode, t)
    z, turns = positions(row, on_rocker, (1, 1), t[0])
    np.testing.assert_allclose(found.point[0, :, 0], z, atol=1e-14)
    np.testing.assert_allclose(found.point[0, :, 1], arm * np.exp(1j * (turns + shift / arm)), atol=1e-14)
    by_size, by_angle = curve.slopes(x, found, t)
    for k in curve.free:
        step = h * np.eye(len(row) + 1)[k]
        ahead, back = (curve.points(x + s * step, mode, t).point for s in (1, -1))
        np.testing.assert_allclose(by_size[..., k], (ahead - back) / (2 * h), atol=1e-8)
    ahead, back = (curve.points(x, mode, t + s * h).point for s in (1, -1))
    np.testing.assert_allclose(by_angle, (ahead - back) / (2 * h), atol=1e-8)


def test_eight_positions_of_a_published_six_bar_are_met_exactly_where_four_bars_fail() -> None:
    """Watt I of D. Ziolkowski, Sixbar_WattType1_Position_Analysis, 2020: bars of 84, 120, 108 and 132 mm, E and F 180 mm from B and D at
    30 and -50 deg, link and output of 120 mm. A Watt six-bar meets up to eight positions exactly (Plecnik, McCarthy and Wampler 2014)."""
    e, f = at(0.18, math.radians(30.0)), at(0.18, math.radians(-50.0))
    row = np.array([0.0, 0.0, 0.084, 0.0, 0.132, 0.0, 0.0, 0.0, 0.12, 0.108, e.real, e.imag, f.real, f.imag, 0.12, 0.12, 0.12, 0.0])
    z, turns = positions(row, True, (1, 1), np.radians(np.linspace(20.0, 320.0, 8)))
    assert np.ptp(turns) == pytest.approx(math.radians(141.26), abs=1e-4)
    task = task_of(z, turns)
    fourbars = path_fourbars(task)
    best = path_sixbars(task, fourbars)[0]
    far, off = missed(best, task)
    assert not best.defect and far < 1e-9 * task.extent and off < 1e-9
    assert all(max(missed(f, task)) > 0.02 * task.extent for f in fourbars)
    # from the first position to the last in small steps of the crank: in one piece and in the order of the positions
    assert np.all(np.diff(best.angles) > 0) or np.all(np.diff(best.angles) < 0)
    assert isinstance(best.curve, GuidedBody) and isinstance(best.curve.base, Sixbar)
    mode, side = (int(m) for m in both_modes(np.array(best.mode)))
    way, _ = positions(best.row, best.curve.base.on_rocker, (mode, side), np.linspace(best.angles[0], best.angles[-1], 2001))
    assert np.max(np.abs(np.diff(way))) < 0.02 * task.extent


def test_a_drawn_six_bar_is_met_at_sixteen_positions() -> None:
    """Twice as many positions as have exact solutions in general: only a linkage of the same motion meets them."""
    task = task_of(*positions(DRAWN, True, (1, 1), np.linspace(0.0, 5.9, 16)))
    fourbars = path_fourbars(task)
    best = path_sixbars(task, fourbars)[0]
    assert not best.defect and max(missed(best, task)) < 1e-9 * task.extent
    assert all(max(missed(f, task)) > 0.01 * task.extent for f in fourbars)


def test_a_fourbar_is_given_back_from_eight_positions_and_a_longer_arm_weighs_angles_more() -> None:
    row = np.array([0.1, -0.2, 0.1, 0.0, 0.4, -0.2, 0.0, 0.0, 0.3, 0.25, 0.12, -0.07])
    z, turns = positions(row, None, (1, 1), np.linspace(0.3, 5.0, 8))
    best = path_fourbars(task_of(z, turns + 0.4))[0]
    assert max(missed(best, task_of(z, turns + 0.4))) < 1e-9 and not best.defect
    # angles that no four-bar has: the longer arm leaves less of their error, and more of that of the points
    bent = turns + 0.1 * np.sin(3.0 * np.arange(8))
    far, off = zip(*(missed(path_fourbars(t)[0], t) for t in (PathTask(z, None, 5.0, 0.1, bent, arm) for arm in (0.01, 1.0))), strict=True)
    assert off[1] < 0.9 * off[0] and far[1] > 2.0 * far[0]


def test_positions_that_are_the_same_are_refused_and_turns_on_the_spot_are_not() -> None:
    z, turns = np.array([0.0, 0.0, 1.0 + 1j, 2.0]), np.array([0.0, 0.3, 0.5, 0.6])
    assert len(PathTask(z, None, 10.0, 0.1, turns).ways) == 3
    with pytest.raises(MechlabError, match="motion synthesis: positions 1 and 2 are the same"):
        PathTask(z, None, 10.0, 0.1, np.array([0.3, 0.3, 0.5, 0.6]))
    with pytest.raises(MechlabError, match="finite"):
        PathTask(z, None, 10.0, 0.1, np.array([0.3, math.nan, 0.5, 0.6]))


@pytest.mark.parametrize(("size", "place"), [(1e9, 0j), (1e-9, 0j), (1.0, 1e6 + 2e6j)])
def test_the_search_is_the_same_in_every_size_and_place(size: float, place: complex) -> None:
    """Four positions of four-bars, five of six-bars: moved and enlarged, the same linkages; digits are lost to the place alone."""
    z, turns = np.array([0.0, 1.0 + 0.1j, 2.0, 3.0 + 0.3j]), np.array([0.0, 0.3, 0.5, 0.2])
    here, there = task_of(z, turns), task_of(place + size * z, turns)
    far = 1e-6 + 1e-12 * abs(place)
    for f in path_fourbars(there)[:2]:
        assert not f.defect and max(missed(f, there)[0] / size, missed(f, there)[1]) < far
    assert len(path_fourbars(there)) > 0 and not path_fourbars(here)[0].defect
    best = path_sixbars(there, path_fourbars(there))[0]
    assert not best.defect and max(missed(best, there)[0] / size, missed(best, there)[1]) < far
