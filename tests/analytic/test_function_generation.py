"""Function generation: Freudenstein's equation against the closure of the four-bars that come out."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from mechlab import catalog
from mechlab.analytic import function_generation
from mechlab.analytic.function_generation import FunctionFourbar, FunctionTask, chebyshev_points, function_fourbars
from mechlab.catalog import freudenstein
from mechlab.kit.compass import at, meet


def task_of(
    f: Callable[[np.ndarray], np.ndarray], low: float, high: float, count: int, turn: float, out: float, **more: float
) -> FunctionTask:
    """The function spread over its ranges [rad], at Chebyshev's points."""
    x = chebyshev_points(low, high, count)
    y0, y1 = f(np.array([low, high]))

    def wanted(s: np.ndarray) -> np.ndarray:
        return out * (f(low + (high - low) * s / turn) - y0) / (y1 - y0)

    return FunctionTask(turn * (x - low) / (high - low), wanted(turn * (x - low) / (high - low)), turn, wanted=wanted, **more)


def by_compass(f: FunctionFourbar, turned: float) -> float:
    """Output on its scale with the input at `turned` on its scale, by circles about the crank pin and the pivot."""
    a = at(f.crank, f.first + turned)
    # mode +1: the joint lies left of the way from the crank pin to the pivot D
    c = meet(a, f.coupler, 1.0 + 0j, f.rocker, f.mode) - 1.0
    return math.remainder(math.atan2(c.imag, c.real) - f.first_out, 2 * math.pi)


def largest(f: FunctionFourbar, task: FunctionTask) -> float:
    """Largest error over the range, by compasses [rad]."""
    turned = np.linspace(0.0, task.turn, 401)
    wanted = task.wanted(turned)  # type: ignore[misc]
    return max(abs(math.remainder(by_compass(f, s) - w, 2 * math.pi)) for s, w in zip(turned, wanted, strict=True))


def test_spacing_of_chebyshev_as_it_is_printed() -> None:
    """Hartenberg and Denavit 1964; for 1 < x < 2: 1.067, 1.500, 1.933."""
    np.testing.assert_allclose(chebyshev_points(1.0, 2.0, 3), [1.067, 1.5, 1.933], atol=5e-4)
    np.testing.assert_allclose(np.cos(5 * np.arccos(chebyshev_points(-1.0, 1.0, 5))), 0.0, atol=1e-14)


@pytest.mark.parametrize(
    ("name", "count"), [("log", 3), ("log", 4), ("log", 5), ("power", 3), ("power", 12), ("sine", 5), ("square", 3), ("square", 9)]
)
def test_functions_of_the_textbooks_are_met_at_their_points(name: str, count: int) -> None:
    """y = log10 x (Freudenstein 1955), x^1.5, sin x, x^2: up to five points exactly, by the closure of the linkage."""
    f, low, high, turn, out = {
        "log": (np.log10, 1.0, 2.0, 60.0, 60.0), "power": (lambda x: x**1.5, 1.0, 4.0, 90.0, 90.0),
        "sine": (np.sin, 0.0, 0.5 * np.pi, 120.0, 60.0), "square": (lambda x: x**2, 0.0, 1.0, 90.0, 90.0),
    }[name]  # fmt: skip
    task = task_of(f, low, high, count, math.radians(turn), math.radians(out), least=math.radians(20.0))
    best = function_fourbars(task)[0]
    errors = [math.remainder(by_compass(best, s) - w, 2 * math.pi) for s, w in zip(task.turned, task.output, strict=True)]
    # five unknowns: up to five points are met, more in the mean
    assert max(map(abs, errors)) < (1e-9 if count <= 5 else math.radians(0.3))
    np.testing.assert_allclose(errors, best.errors, atol=1e-9)
    assert largest(best, task) == pytest.approx(best.range_error, rel=0.02, abs=1e-7) and best.range_error < math.radians(0.3)


def test_slopes_of_the_errors_are_those_of_differences() -> None:
    task = task_of(np.log10, 1.0, 2.0, 9, 0.7, 0.5)
    for row in np.array([[0.45, 1.1, 0.6, 1.2, 2.0], [-0.45, 1.1, -0.6, 1.2, -1.0]]):  # on both sides of the way from A to D
        ahead, back = (function_generation._errors(task, row + s * 1e-6 * np.eye(5), task.turned, task.output) for s in (1, -1))
        np.testing.assert_allclose(function_generation._slopes(task, row), (ahead - back).T / 2e-6, atol=1e-8)
    # too short a coupler: no linkage, nothing to go by
    assert not np.any(function_generation._slopes(task, np.array([0.45, 0.1, 0.2, 1.2, 2.0])))


def test_a_fourbar_is_given_back_by_five_points_of_its_motion() -> None:
    """Bars 1, .45, 1.1, .6, output angles by compasses."""
    turned = np.radians([0.0, 21.0, 47.0, 80.0, 110.0])
    source = FunctionFourbar(0.45, 1.1, 0.6, 1, 1.2, 0.0, np.zeros(5), 0.0, 0.0, True, "")
    angle = np.array([by_compass(source, s) for s in turned])
    found = function_fourbars(FunctionTask(turned, angle - angle[0], float(turned[-1])))
    sizes = [(f.crank, f.coupler, f.rocker) for f in found if not f.defect]
    assert any(np.allclose(s, (0.45, 1.1, 0.6), atol=1e-7) for s in sizes), sizes
    given = FunctionTask(turned[:3], angle[:3] - angle[0], float(turned[2]), first=1.2, first_out=float(angle[0]))
    (alone,) = function_fourbars(given)
    assert (alone.crank, alone.coupler, alone.rocker) == pytest.approx((0.45, 1.1, 0.6), abs=1e-9)


def test_the_logarithm_is_better_than_that_of_the_catalog_in_the_same_ranges() -> None:
    """The entry freudenstein has its scales where they are easy to read; free scales err less, twelve points still less."""
    p = catalog.entry("freudenstein").parameters()
    three = task_of(np.log10, 1.0, 2.0, 3, p.turn, p.turn_out, first=p.first, first_out=p.first_out)
    (theirs,) = function_fourbars(three)
    lengths = {s.name: s.sizes[0] for s in freudenstein.linkage(p).steps if s.kind == "crank"}
    assert theirs.crank == pytest.approx(abs(lengths["input"]) / p.ground, rel=1e-9)
    free = task_of(np.log10, 1.0, 2.0, 3, p.turn, p.turn_out, least=math.radians(20.0))
    many = task_of(np.log10, 1.0, 2.0, 12, p.turn, p.turn_out, least=math.radians(20.0))
    errors = [largest(theirs, three), largest(function_fourbars(free)[0], free), largest(function_fourbars(many)[0], many)]
    assert errors[1] < 0.5 * errors[0] and errors[2] < errors[1], errors


def test_the_logarithm_errs_as_little_as_a_four_bar_can() -> None:
    """y = log10 x for 1 <= x <= 2, 60 by 60 deg: .0037 deg is the largest error that Hartenberg and Denavit, Kinematic Synthesis of
    Linkages, 1964, give for Freudenstein's optimum (the book not at hand: the number is checked by what follows). Five unknowns: the
    largest error is least where it is reached at six places, in turn above and below (Chebyshev's alternation), here by compasses."""
    task = task_of(np.log10, 1.0, 2.0, 12, math.radians(60.0), math.radians(60.0), least=math.radians(20.0))
    best = function_fourbars(task)[0]
    turned = np.linspace(0.0, task.turn, 1201)
    wanted = task.wanted(turned)  # type: ignore[misc]
    error = np.degrees([math.remainder(by_compass(best, s) - w, 2 * math.pi) for s, w in zip(turned, wanted, strict=True)])
    assert round(float(np.max(np.abs(error))), 4) == 0.0037
    reached = error[np.abs(error) > 0.99 * np.max(np.abs(error))]
    assert np.count_nonzero(np.diff(np.sign(reached))) == 5
    three = task_of(np.log10, 1.0, 2.0, 3, math.radians(60.0), math.radians(60.0), least=math.radians(20.0))
    assert best.range_error < 0.51 * function_fourbars(three)[0].range_error


def test_a_jump_of_the_branch_is_found() -> None:
    """Points of both modes of one four-bar satisfy Freudenstein's equation all the same."""
    one, other = (FunctionFourbar(0.45, 1.1, 0.6, m, 1.2, 0.0, np.zeros(3), 0.0, 0.0, True, "") for m in (1, -1))
    turned = np.radians([0.0, 40.0, 90.0])
    angle = np.array([by_compass(one, turned[0]), by_compass(other, turned[1]), by_compass(one, turned[2])])
    (found,) = function_fourbars(FunctionTask(turned, angle - angle[0], float(turned[-1]), first=1.2, first_out=float(angle[0])))
    assert found.crank == pytest.approx(0.45, abs=1e-9) and found.defect == "branch"


def test_the_reciprocal_of_the_textbook_is_met_and_bettered() -> None:
    """y = 1/x for 1 <= x <= 2, input from 30 to 120 deg, output from 240 to 330 deg: the example of Shigley and Uicker's Theory of Machines
    and Mechanisms, whose rounded angles 36.03, 75, 113.97 and 251.34, 300, 326.96 deg give 1/K = 2.480, 2.480 (|K| = .4032, .4032, 1.0130;
    book not at hand, so the digits are checked by their own arithmetic here). Errors of both linkages are ours, by compasses."""
    f, g = np.radians([36.03, 75.0, 113.97]), np.radians([251.34, 300.0, 326.96])
    k = np.linalg.solve(np.column_stack([np.cos(g), -np.cos(f), np.ones(3)]), np.cos(f - g))
    np.testing.assert_allclose(np.abs(k), [0.4032, 0.4032, 1.0130], atol=2e-4)
    scales = {"first": math.radians(30.0), "first_out": math.radians(240.0)}
    task = task_of(lambda x: 1.0 / x, 1.0, 2.0, 3, 0.5 * math.pi, 0.5 * math.pi, **scales)
    (exact,) = function_fourbars(task)
    # the book rounds its angles to .01 deg and y to .001, .18 deg of output
    assert (exact.crank, exact.coupler, exact.rocker) == pytest.approx((2.480, 0.917, 2.480), abs=6e-3)
    printed = FunctionFourbar(2.480, 0.917, 2.480, exact.mode, exact.first, exact.first_out, np.zeros(3), 0.0, 0.0, True, "")
    fitted = function_fourbars(task_of(lambda x: 1.0 / x, 1.0, 2.0, 9, 0.5 * math.pi, 0.5 * math.pi, **scales))[0]
    freed = task_of(lambda x: 1.0 / x, 1.0, 2.0, 9, 0.5 * math.pi, 0.5 * math.pi, least=math.radians(20.0))
    errors = np.degrees([largest(printed, task), largest(exact, task), largest(fitted, task), largest(function_fourbars(freed)[0], freed)])
    np.testing.assert_allclose(errors, [0.2563, 0.1061, 0.0386, 0.0128], rtol=0.02)


def test_an_output_that_turns_as_the_input_is_a_parallelogram() -> None:
    """Freudenstein's unknowns are not determined then: with f = g his equation holds for K1 = K2 and K3 = 1."""
    turned = np.radians([0.0, 20.0, 50.0])
    best = function_fourbars(FunctionTask(turned, turned, float(turned[-1])))[0]
    assert best.crank == best.rocker and best.coupler == 1.0 and not best.defect
    assert max(abs(by_compass(best, float(s)) - s) for s in turned) < 1e-12
    given = FunctionTask(turned, turned, float(turned[-1]), first=0.3, first_out=0.3)
    assert function_fourbars(given)[0].first == pytest.approx(0.3)
    apart = FunctionTask(turned, turned, float(turned[-1]), first=0.3, first_out=1.3)
    assert all(f.coupler != 1.0 or f.crank != f.rocker for f in function_fourbars(apart))
