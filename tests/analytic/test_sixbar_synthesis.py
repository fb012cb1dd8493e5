"""Path and function synthesis with six-bars against ruler and compasses, and against what four-bars reach at the same points."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from mechlab.analytic.function_generation import function_fourbars
from mechlab.analytic.path_synthesis.path import path_fourbars
from mechlab.analytic.path_synthesis.sixbar import Sixbar, both_modes
from mechlab.analytic.path_synthesis.sixbar_function import function_sixbars
from mechlab.analytic.path_synthesis.sixbar_path import path_sixbars
from mechlab.analytic.path_synthesis.task import PathLinkage, PathTask
from mechlab.kit.compass import at, meet
from tests.analytic.test_function_generation import task_of
from tests.analytic.test_path_synthesis import LOOP_TARGETS, LOOP_TIMING

ROW = np.array([0.1, -0.2, 0.1, 0.0, 0.4, -0.2, 0.0, 0.0, 0.3, 0.25, 0.12, -0.07, -0.45, -0.48, 0.44, 0.47, 0.1, 0.12])
"""O, W, D, the unused crank, b, c, p, pivot, link, arm, tip."""
ON_ROCKER = np.concatenate([ROW[:10], [0.04, 0.24, 0.53, -0.11, 0.37, 0.3], ROW[16:]])


def by_compass(row: np.ndarray, on_rocker: bool, mode: int, side: int, t: float) -> complex:
    """Point of a six-bar by compasses: crank pin, joint, coupler point, joint of the dyad, point of its link."""
    o, w, d, p, s, q = (complex(row[k], row[k + 1]) for k in (0, 2, 4, 10, 12, 16))
    a = o + w * at(1.0, t)
    b = meet(a, row[8], d, row[9], mode)
    c = a + p * (b - a) / row[8]
    pivot = d + s * (b - d) / row[9] if on_rocker else s
    return c + q * (meet(c, row[14], pivot, row[15], side) - c) / row[14]


def drawn(f: PathLinkage) -> np.ndarray:
    """The points of a six-bar that was found."""
    assert isinstance(f.curve, Sixbar)
    mode, side = (int(m) for m in both_modes(np.array(f.mode)))
    return np.array([by_compass(f.row, f.curve.on_rocker, mode, side, t) for t in f.angles])


@pytest.mark.parametrize(("row", "on_rocker"), [(ROW, False), (ON_ROCKER, True)])
@pytest.mark.parametrize("mode", [1, -1])
@pytest.mark.parametrize("side", [1, -1])
def test_points_are_those_of_compasses_and_slopes_those_of_differences(row: np.ndarray, on_rocker: bool, mode: int, side: int) -> None:
    curve, t, h, both = Sixbar(on_rocker), np.linspace(0.2, 1.4, 5)[None], 1e-6, np.array([mode + 2 * side])
    found = curve.points(row[None], both, t)
    np.testing.assert_allclose(found.point[0], [by_compass(row, on_rocker, mode, side, x) for x in t[0]], atol=1e-14)
    by_size, by_angle = curve.slopes(row[None], found, t)
    for k in curve.free:
        step = h * np.eye(18)[k]
        ahead, back = (curve.points(row[None] + s * step, both, t).point for s in (1, -1))
        np.testing.assert_allclose(by_size[..., k], (ahead - back) / (2 * h), atol=1e-8)
    ahead, back = (curve.points(row[None], both, t + s * h).point for s in (1, -1))
    np.testing.assert_allclose(by_angle, (ahead - back) / (2 * h), atol=1e-8)


def test_the_curve_of_a_sixbar_is_met_where_no_fourbar_follows() -> None:
    """Eighteen points with timing are 36 numbers; a four-bar has ten, a six-bar sixteen: only a curve of its own kind is met."""
    t = np.sort(np.random.default_rng(3).uniform(0.0, 6.0, 18))
    targets = np.array([by_compass(ROW, False, 1, 1, x) for x in t])
    task = PathTask(targets, t, 10.0, math.radians(10.0))
    fourbars = path_fourbars(task)
    best = path_sixbars(task, fourbars)[0]
    assert not best.defect and np.max(np.abs(drawn(best) - targets)) < 1e-9 * task.extent
    assert all(np.max(f.distances) > 1e-3 * task.extent for f in fourbars)


@pytest.mark.parametrize(("timing", "share"), [(LOOP_TIMING, 0.5), (None, 0.5)])
def test_a_printed_loop_is_followed_better_by_a_sixbar(timing: np.ndarray | None, share: float) -> None:
    """The eighteen points of Kunjur and Krishnamurty 1997 (test_path_synthesis.py): squares of four-bars .00903 and, with free timing,
    .00307; those of six-bars are less than half of it, by compasses, in order and in one piece."""
    task = PathTask(LOOP_TARGETS, timing, 10.0, math.radians(10.0))
    fourbars = path_fourbars(task)
    best = next(f for f in path_sixbars(task, fourbars) if not f.defect and f.least_transmission_angle >= task.least)
    squares = float(np.sum(np.abs(drawn(best) - LOOP_TARGETS) ** 2))
    assert squares == pytest.approx(best.squares, rel=1e-9) and squares < share * fourbars[0].squares
    # the way from the first point to the last in small steps of the crank: no jump, and the order of the points
    assert isinstance(best.curve, Sixbar)
    mode, side = (int(m) for m in both_modes(np.array(best.mode)))
    way = np.array([by_compass(best.row, best.curve.on_rocker, mode, side, x) for x in np.linspace(best.angles[0], best.angles[-1], 2001)])
    assert np.max(np.abs(np.diff(way))) < 0.02 * task.extent and (np.all(np.diff(best.angles) > 0) or np.all(np.diff(best.angles) < 0))


def test_points_of_two_branches_are_called_so() -> None:
    """Points that one six-bar reaches in both modes of its dyad: what is found without a defect passes as near as it says."""
    t = np.linspace(0.3, 2.7, 6)
    mixed = np.array([by_compass(ROW, False, 1, s, x) for s, x in zip((1, -1, 1, -1, 1, -1), t, strict=True)])
    task = PathTask(mixed, t, 10.0, math.radians(10.0))
    for f in path_sixbars(task, path_fourbars(task)):
        if not f.defect:
            np.testing.assert_allclose(np.abs(drawn(f) - mixed), f.distances, atol=1e-9)
            assert f.least_transmission_angle > 0.0


@pytest.mark.parametrize(("f", "high", "turn", "out"), [(np.exp, 1.0, 100.0, 100.0), (np.sin, 0.5 * math.pi, 120.0, 60.0)])
def test_functions_are_generated_ten_times_better_than_by_fourbars(f: Callable, high: float, turn: float, out: float) -> None:
    """Largest errors over the range by compasses, transmission angles of both of at least 30 deg."""
    task = task_of(f, 0.0, high, 12, math.radians(turn), math.radians(out), least=math.radians(30.0))
    best = function_sixbars(task)[0]

    def output(s: float) -> float:
        a = at(1.0, best.first + s)
        c = a + best.point * (meet(a, best.coupler, best.ground, best.rocker, best.mode) - a) / best.coupler
        end = meet(c, best.link, best.pivot, best.output, best.side) - best.pivot
        return math.atan2(end.imag, end.real) - best.first_out

    turned = np.linspace(0.0, task.turn, 801)
    errors = [math.remainder(output(s) - w, 2 * math.pi) for s, w in zip(turned, task.wanted(turned), strict=True)]  # type: ignore[misc]
    assert np.max(np.abs(errors)) == pytest.approx(best.range_error, rel=0.02)
    fourbar = next(q for q in function_fourbars(task) if not q.defect and q.least_transmission_angle > math.radians(29.9))
    assert np.max(np.abs(errors)) < 0.1 * fourbar.range_error
