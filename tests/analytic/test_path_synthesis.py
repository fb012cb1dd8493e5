"""Path synthesis against ruler and compasses, and against printed linkages."""

import cmath
import math

import numpy as np
import pytest

from mechlab.analytic.path_synthesis.curves import points, slopes
from mechlab.analytic.path_synthesis.dwell import dwell_sixbars
from mechlab.analytic.path_synthesis.path import path_fivebars, path_fourbars
from mechlab.analytic.path_synthesis.slotted_dwell import SlottedDwell, slotted_dwells
from mechlab.analytic.path_synthesis.straight import straight_fourbars
from mechlab.analytic.path_synthesis.task import PathLinkage, PathTask
from mechlab.errors import MechlabError
from mechlab.kit.compass import at, meet

LOOP = [(0.5, 1.1), (0.4, 1.1), (0.3, 1.1), (0.2, 1.0), (0.1, 0.9), (0.05, 0.75), (0.02, 0.6), (0, 0.5), (0, 0.4), (0.03, 0.3), (0.1, 0.25),
        (0.15, 0.2), (0.2, 0.3), (0.3, 0.4), (0.4, 0.5), (0.5, 0.7), (0.6, 0.9), (0.6, 1.0)]  # fmt: skip
"""Eighteen points, the crank turning on by 20 degrees from each to the next: Kunjur and Krishnamurty 1997; Cabrera, Simon and Prado,
Optimal synthesis of mechanisms with genetic algorithms, Mechanism and Machine Theory 37, 2002."""
LOOP_TARGETS = np.array([complex(*p) for p in LOOP])
LOOP_TIMING = np.radians(20.0) * np.arange(18)


def by_compass(o: complex, w: complex, d: complex, b: float, c: float, p: complex, mode: int, t: float) -> complex:
    """Coupler point by compasses: crank pin, joint, point."""
    a = o + w * cmath.exp(1j * t)
    joint = meet(a, b, d, c, mode)
    return a + p * (joint - a) / b


def drawn(f: PathLinkage) -> np.ndarray:
    """The points of a linkage that was found, by compasses."""
    o, w, d, v, p = (complex(f.row[k], f.row[k + 1]) for k in (0, 2, 4, 6, 10))
    ends = [d + v * cmath.exp(1j * f.ratio * t) for t in f.angles]
    return np.array([by_compass(o, w, e, f.row[8], f.row[9], p, f.mode, t) for e, t in zip(ends, f.angles, strict=True)])


def known(t: np.ndarray) -> np.ndarray:
    """Points of a four-bar .1, .3, .25, .3 that stands askew."""
    turned = cmath.exp(0.4j)
    return np.array([2.0 + turned * by_compass(0j, 0.1, 0.3, 0.3, 0.25, 0.2 + 0.15j, 1, x) for x in t])


@pytest.mark.parametrize("mode", [1, -1])
def test_slopes_are_those_of_differences(mode: int) -> None:
    x, t, h = np.array([[0.1, 0.2, 0.3, 0.1, 1.0, 0.1, 0.05, 0.02, 1.1, 0.9, 0.4, 0.3]]), np.linspace(0.0, 2.0, 5)[None], 1e-6
    side = np.array([mode])
    by_size, by_angle = slopes(x, points(x, side, -2, t), -2, t)
    for k, unit in enumerate(np.eye(12)):
        ahead, back = (points(x + s * h * unit, side, -2, t).point for s in (1, -1))
        np.testing.assert_allclose(by_size[..., k], (ahead - back) / (2 * h), atol=1e-8)
    ahead, back = (points(x, side, -2, t + s * h).point for s in (1, -1))
    np.testing.assert_allclose(by_angle, (ahead - back) / (2 * h), atol=1e-8)


def test_five_points_with_timing_are_met_in_closed_form_and_give_back_their_fourbar() -> None:
    t = np.array([0.3, 0.7, 1.2, 1.9, 2.3])
    found = path_fourbars(PathTask(known(t), t, 5.0))
    for f in found:
        if not f.defect:
            np.testing.assert_allclose(drawn(f), known(t), atol=1e-10)
            np.testing.assert_allclose(np.diff(f.angles), np.diff(t), atol=1e-15)
    ours = [f for f in found if abs(abs(complex(*f.row[2:4])) - 0.1) < 1e-8 and abs(f.row[8] - 0.3) < 1e-8 and not f.defect]
    assert len(ours) == 1 and ours[0].row[9] == pytest.approx(0.25, abs=1e-8) and ours[0].mode == 1
    # the second of Roberts' three cognates whose crank turns alike has the same curve and the same timing
    assert sum(not f.defect for f in found) >= 2


def test_a_known_curve_is_recovered_with_timing_and_without() -> None:
    t = np.sort(np.random.default_rng(1).uniform(0.0, 6.2, 24))
    for timing in (t, None):
        best = path_fourbars(PathTask(known(t), timing, 5.0, math.radians(10.0)))[0]
        assert np.max(np.abs(drawn(best) - known(t))) < 1e-9 and not best.defect


def test_the_loop_of_eighteen_points_is_met_better_than_printed() -> None:
    """Cabrera's genetic algorithm: r1 = 3.057878, r2 = .237803, r3 = 4.828954, r4 = 2.056456, sum of squares printed as .0337."""
    turned = cmath.exp(1.002168j)
    printed = np.array([
        complex(1.776808, -0.641991) + turned * by_compass(0j, at(0.237803, 0.226186), 3.057878, 4.828954, 2.056456,
                                                           complex(0.767038, 1.850828), 1, x) for x in LOOP_TIMING
    ])  # fmt: skip
    theirs = float(np.sum(np.abs(printed - LOOP_TARGETS) ** 2))
    assert theirs == pytest.approx(0.0337, abs=5e-5)  # as printed, to its last digit
    task = PathTask(LOOP_TARGETS, LOOP_TIMING, 10.0, math.radians(10.0))
    found = path_fourbars(task)
    ours = float(np.sum(np.abs(drawn(found[0]) - LOOP_TARGETS) ** 2))
    assert ours < 0.27 * theirs and ours == pytest.approx(found[0].squares, rel=1e-9)
    geared = path_fivebars(task, found)[0]
    better = float(np.sum(np.abs(drawn(geared) - LOOP_TARGETS) ** 2))
    assert geared.ratio and not geared.defect and better < 0.8 * ours


def test_a_vertical_line_of_six_points_is_met_exactly_and_in_order() -> None:
    """The first problem of Cabrera, Simon and Prado 2002, free timing; nine points determine a four-bar, six leave room."""
    targets = 20.0 + 1j * np.array([20.0, 25.0, 30.0, 35.0, 40.0, 45.0])
    for f in path_fourbars(PathTask(targets, None, 200.0, math.radians(15.0)))[:5]:
        np.testing.assert_allclose(drawn(f), targets, atol=1e-9)
        steps = np.diff(f.angles)
        assert not f.defect and (np.all(steps > 0) or np.all(steps < 0)) and np.ptp(f.angles) < 2 * np.pi


def test_a_linkage_that_must_be_taken_apart_is_called_so() -> None:
    """Five points on both branches of one coupler curve: the printed mode holds at some of them only."""
    t = np.array([0.3, 0.9, 1.5, 2.1, 2.7])
    mixed = np.array([by_compass(0j, 0.1, 0.3, 0.3, 0.25, 0.2 + 0.15j, m, x) for m, x in zip((1, 1, -1, 1, -1), t, strict=True)])
    found = path_fourbars(PathTask(mixed, t, 5.0))
    same = [f for f in found if abs(f.row[8] - 0.3) < 1e-6 and abs(f.row[9] - 0.25) < 1e-6 and abs(complex(*f.row[:2])) < 1e-6]
    assert all(f.defect == "branch" for f in same)
    for f in found:
        if not f.defect:
            assert np.max(np.abs(drawn(f) - mixed)) == pytest.approx(np.max(f.distances), abs=1e-9)


@pytest.mark.parametrize(
    ("targets", "timing", "message"),
    [([0, 1, 1, 2], None, "points 2 and 3 are the same"), ([0, 1, 2, 3], [0, 1, 0.5, 2], "must grow, or fall"),
     ([0, 1, 2, math.nan], None, "finite"), ([0, 1, 2, 3], [0, 3, 6, 9], "within one turn")],
)  # fmt: skip
def test_refusals(targets: list, timing: list | None, message: str) -> None:
    with pytest.raises(MechlabError, match=message):
        PathTask(np.array(targets, dtype=complex), None if timing is None else np.array(timing, dtype=float), 10.0)


@pytest.mark.parametrize(
    ("angle", "ground", "bar", "printed"), [(180, 2.2, 2.8, 0.096), (140, 2.5, 3.25, 0.023), (100, 2.725, 3.588, 0.004)]
)
def test_lines_are_straighter_than_the_optimum_proportions_of_hoeken(angle: float, ground: float, bar: float, printed: float) -> None:
    """Norton, Design of Machinery, table 3-1: Hoeken's linkage, the error in percent of the stroke."""
    t = math.pi + np.radians(angle) * np.linspace(-0.5, 0.5, 201)
    norton = np.array([by_compass(0j, 1.0, ground, bar, bar, 2 * bar, 1, x) for x in t])
    stroke = np.ptp(norton.real)
    theirs = 100.0 * np.ptp(norton.imag) / stroke
    assert theirs == pytest.approx(printed, abs=8e-4)  # bars are printed to three decimals
    best = straight_fourbars(math.radians(angle), 2 * bar / stroke, math.radians(20.0))[0]
    t = best.middle + np.radians(angle) * np.linspace(-0.5, 0.5, 201)
    ours = np.array([by_compass(0j, 1.0, best.ground, best.coupler, best.rocker, best.point, 1, x) for x in t])
    line = ours * cmath.exp(-1j * best.direction)
    width = 100.0 * np.ptp(line.imag) / np.ptp(line.real)
    assert width < 0.9 * theirs and width == pytest.approx(100.0 * best.deviation, rel=0.02)
    sizes = [1.0, best.ground, best.coupler, best.rocker, abs(best.point), abs(best.point - best.coupler)]
    assert max(sizes) / np.ptp(line.real) <= 1.001 * 2 * bar / stroke


def test_a_dwell_rests_and_swings_as_stated() -> None:
    wanted, swing = math.radians(120.0), math.radians(30.0)
    found = dwell_sixbars(wanted, swing, 8.0, math.radians(30.0))
    best = found[0]

    def output(t: float) -> float:
        p = by_compass(0j, 1.0, best.ground, best.coupler, best.rocker, best.point, 1, t)
        return cmath.phase(meet(p, best.link, best.pivot, best.output, best.side) - best.pivot)

    rest = np.unwrap([output(t) for t in best.first + wanted * np.linspace(0.0, 1.0, 301)])
    turn = np.unwrap([output(t) for t in np.linspace(0.0, 2 * math.pi, 721)])
    assert np.ptp(rest) == pytest.approx(best.deviation, rel=0.01) and best.deviation < math.radians(0.1)
    assert np.ptp(turn) == pytest.approx(best.swing, abs=1e-4) and best.swing > 0.999 * swing


def lever(f: SlottedDwell, t: np.ndarray) -> np.ndarray:
    """From the pivot of the lever to the coupler point, by compasses."""
    return np.array([by_compass(0j, 1.0, f.ground, f.coupler, f.rocker, f.point, 1, x) for x in t]) - f.pivot


def test_a_slotted_lever_rests_as_stated_and_stiller_than_a_link_on_an_arc() -> None:
    """60 deg of swing, a rest of 90 deg: by compasses the stated strip, swing and distances; a link on an arc: ten times the strip."""
    wanted, swing, least = math.radians(90.0), math.radians(60.0), math.radians(30.0)
    best = slotted_dwells(wanted, swing, 8.0, least, clearance=0.5)[0]
    rest = np.unwrap(np.angle(lever(best, best.first + wanted * np.linspace(0.0, 1.0, 301))))
    around = lever(best, np.linspace(0.0, 2 * math.pi, 721))
    assert np.ptp(rest) == pytest.approx(best.deviation, rel=0.01) and best.deviation < math.radians(0.01)
    assert np.ptp(np.unwrap(np.angle(around))) == pytest.approx(best.swing, abs=1e-4) and best.swing > 0.999 * swing
    # kept at 72 places of the turn, so a little less between them
    assert 0.495 < np.min(np.abs(around)) < np.max(np.abs(around)) <= 8.001
    assert best.deviation < 0.1 * dwell_sixbars(wanted, swing, 8.0, least)[0].deviation


def test_a_slotted_lever_rests_stiller_than_over_the_line_of_hoeken() -> None:
    """Hoeken's linkage 2 : 1 : 2.5 with a lever 10 cranks away (Norton, Design of Machinery, 3.9; the entry hoeken_dwell): as much swing,
    bars no longer, the same transmission angle."""
    hoeken = SlottedDwell(2.5, 2.5, 2.0, 5.0 + 0j, 10.0 + 4.0j, 0.5 * math.pi, 0.0, 0.0, 0.0, (0.0, 0.0), 0.0)
    wanted, around = math.pi, lever(hoeken, np.linspace(0.0, 2 * math.pi, 721))
    theirs = np.ptp(np.unwrap(np.angle(lever(hoeken, hoeken.first + wanted * np.linspace(0.0, 1.0, 301)))))
    swing, size = float(np.ptp(np.unwrap(np.angle(around)))), float(max(abs(hoeken.pivot), np.max(np.abs(around))))
    # crank and ground in line: the triangle of 3, or 1, and twice 2.5
    least = min(math.acos((12.5 - 9.0) / 12.5), math.acos((12.5 - 1.0) / 12.5))
    best = slotted_dwells(wanted, swing, size, least)[0]
    ours = np.ptp(np.unwrap(np.angle(lever(best, best.first + wanted * np.linspace(0.0, 1.0, 301)))))
    assert ours < 0.8 * theirs and best.longest <= 1.001 * size and best.swing > 0.999 * swing
