"""Charts: references agree with print, defaults are seen not to converge, the recommendation is what the points say."""

import math

import numpy as np
import pytest

from mechlab import api
from mechlab.errors import NoSolution
from mechlab.experiment.recording import Trace
from mechlab.integrate import count_work
from mechlab.lab.methods import METHODS, Method, Problem, method
from mechlab.studies.chart.advice import is_flat, recommend
from mechlab.studies.chart.data import ChartPoint, pareto
from mechlab.studies.chart.run import Budget, chart, refine
from mechlab.studies.chart.score import Score, reference_of, score

PROBLEMS = ("pendulum", "n_fourbar", "andrews", "bricard", "flyball", "slider_crank")


def point(name: str, step: float, cpu: float, error: float, status: str = "ok") -> ChartPoint:
    return ChartPoint(name, step, "step", cpu, error, error, 0.0, 0.0, status, default="defaults" in name)


@pytest.mark.parametrize("name", PROBLEMS)
def test_reference_gives_the_printed_values(name: str) -> None:
    checks = {c.id: c for c in api.load(name).entry.checks}
    measured = checks["B2"].run(None)
    assert measured.passed, measured.difference


def test_a_scene_without_a_closed_form_is_held_against_pinocchio() -> None:
    """The entry has own equations for its driven scene alone; the free one is compared all the same."""
    lived = api.load("platform_3rrr").for_scene("free-run")
    problem = Problem(lived, lived.scene("free-run", None, 0.1), 10)
    truth = reference_of(problem)
    assert "Pinocchio" in truth.text and truth.own_error < 1e-9
    run = method("MuJoCo RK4, hard").run(problem, 2.5e-4)
    # softness of the loops at 2.5e-4 s: some micrometres
    assert score(problem, truth, run).error < 1e-4


def test_a_reference_that_loses_energy_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """A linkage in free fall whose run is slower by a thousandth from the middle on, as where tight steps meet a flat pose."""
    lived = api.load("watt").for_scene("free-run")
    problem = Problem(lived, lived.scene("free-run", None, 0.2), 50)
    assert reference_of(problem).own_error < 1e-6
    run = Method.run

    def slowed(self: Method, at: Problem, value: float) -> Trace:
        found = run(self, at, value)
        found.v[25:] *= 0.999
        return found

    monkeypatch.setattr(Method, "run", slowed)
    with pytest.raises(NoSolution, match="no account of 0.00"):
        reference_of(problem)


def test_pareto_and_recommendation() -> None:
    points = [
        point("a", 1e-2, 1.0, 1e-3),
        point("a", 5e-3, 2.0, 1e-5),
        point("b", 1e-2, 1.5, 1e-2),
        point("b", 1e-3, 9.0, math.nan, "diverged"),
    ]
    assert [p.error for p in pareto(points)] == [1e-3, 1e-5]
    assert recommend(points, 1e-4, "m").point.cpu_s == 2.0
    missed = recommend(points, 1e-9, "m")
    assert not missed.met and missed.point.error == 1e-5


def test_flat_defaults_are_told_from_convergence() -> None:
    flat = [point("x", 2.0**-k, 1.0, 2.0) for k in range(5)]
    falling = [point("x", 2.0**-k, 1.0, 2.0 * 4.0**-k) for k in range(5)]
    assert is_flat(flat, 1e-3) and not is_flat(falling, 1e-3)


@pytest.mark.slow
def test_defaults_of_mujoco_do_not_converge_on_the_n_fourbar() -> None:
    some = [method("MuJoCo implicitfast, defaults"), method("MuJoCo implicitfast, hard"), method("Pinocchio DOP853")]
    found = chart(api.load("n_fourbar"), methods=some[:2], budget=Budget(one=0.05, method=2.0, repeat=0.0))
    soft = [p.error for p in found.points if p.default and p.ok]
    # measured with MuJoCo 4.0.0: 2.0 m at every step from 12.5 to 0.25 ms (wrong phase: the diameter of the path)
    assert len(soft) >= 4 and min(soft) > 1.0
    assert found.notes and "does not converge" in found.notes[0]
    assert found.recommendation.point.method == "MuJoCo implicitfast, hard"


def test_every_method_has_its_own_name_and_an_engine() -> None:
    assert len({m.name for m in METHODS}) == len(METHODS)
    assert {m.engine for m in METHODS} == {"mujoco", "pinocchio", "one_freedom", "hybrid", "analytic"}


def test_a_run_that_cannot_be_afforded_is_not_begun() -> None:
    """Steps that cost 0.1 s at a step of 1: runs of 0.1, 0.2 and 0.4 s fit into 1 s, one of 0.8 s does not."""
    begun: list[float] = []

    def run(step: float) -> Trace:
        begun.append(step)
        count_work(0.1 / step)
        return Trace(np.zeros((2, 1)), np.zeros((2, 1)), 0.1 / step, round(1.0 / step))

    budget = Budget(one=10.0, method=1.0, repeat=0.0)
    found = refine("m", "step", False, [1.0, 0.5, 0.25, 0.125], run, lambda trace: Score(1e-3, 1e-3, 0.0, 0.0), budget)
    assert begun == [1.0, 0.5, 0.25]
    assert [p.ok for p in found] == [True, True, True, False]
    assert "0.72 s of work" in found[-1].reason and "0.3 s are left" in found[-1].reason
    begun.clear()
    # a sharper tolerance may cost the same: with 0.4 s each the third is not begun
    refine("m", "tolerance", False, [1e-3, 1e-4, 1e-5], lambda x: run(0.25), lambda trace: Score(1e-3, 1e-3, 0.0, 0.0), budget)
    assert len(begun) == 2
