"""The comparison of error control with peers: the search for the cheapest setting, ratios, the table; one real chart."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab import api
from mechlab.cli import main
from mechlab.engines.peers.engine import INTEGRATORS, PEERS, controlled, installed
from mechlab.engines.peers.process import PeerStopped
from mechlab.errors import MechlabError
from mechlab.experiment.recording import Trace
from mechlab.lab.methods import METHODS, PEER_METHODS, Method, Problem
from mechlab.studies.chart import peers as chart_peers
from mechlab.studies.chart.data import PeerRow, PeerTable
from mechlab.studies.chart.peers import TARGETS, _Search
from mechlab.studies.chart.run import Budget, chart
from mechlab.studies.chart.score import Reference, reference_of


def swing(duration: float = 1.0) -> tuple[Problem, Reference]:
    d = ml.load("pendulum").for_scene(None)
    problem = Problem(d, d.scene(None, None, duration))
    return problem, reference_of(problem)


class Pretender:
    """A method whose error is h^order and whose cost is the number of steps; stands in for a peer."""

    def __init__(self, problem: Problem, order: int, cost: float, stop: float = math.inf) -> None:
        self.order, self.cost, self.stop = order, cost, stop
        reference = problem.design.entry.reference
        assert reference is not None
        found = reference(problem.design.parameters, problem.scene)
        at = np.searchsorted(found.t, np.linspace(0.0, problem.scene.duration, problem.outputs + 1) * (1 - 1e-12))
        self.q, self.v = found.q[at], found.v[at]
        self.asked: list[float] = []

    def run(self, method: Method, problem: Problem, value: float) -> Trace:
        self.asked.append(value)
        cpu = self.cost * problem.scene.duration / value
        if cpu > self.stop:
            raise PeerStopped("late")
        return Trace(self.q + value**self.order, self.v, math.nan, 1, total_s=cpu)


@pytest.fixture
def pretend(monkeypatch: pytest.MonkeyPatch) -> tuple[Problem, Reference, Pretender]:
    problem, truth = swing()
    made = Pretender(problem, 2, 1e-5)
    monkeypatch.setattr(Method, "run", lambda self, p, value: made.run(self, p, value))
    monkeypatch.setattr(
        Method, "available", lambda self, p: "" if self.name == "Exudyn generalized-alpha" else "not asked"
    )
    return problem, truth, made


def test_the_cheapest_setting_is_found_between_two_of_the_sweep(
    pretend: tuple[Problem, Reference, Pretender],
) -> None:
    problem, truth, made = pretend
    search = _Search(problem, truth, 1.0)
    method = next(m for m in PEER_METHODS if m.name == "Exudyn generalized-alpha")
    search.sweep(method)
    for target in (1e-7, 3e-9):
        best = search.fastest(target)
        assert best is not None and best.error <= target
        # an angle off by e moves the mass by up to e: the largest step that meets the target is sqrt(target), the sweep
        # halves, three bisections leave a factor 2^(1/8), and steps divide the distance of the outputs (2 %)
        assert best.total_s < 1e-5 / math.sqrt(target) * 2 ** (1 / 8) * 1.02
    # cost of one run reaches 1 s at 1e-5 s of step, an error of 1e-10
    assert min(made.asked) < 4e-5


def test_a_sweep_ends_when_a_run_is_stopped_and_says_so(pretend: tuple[Problem, Reference, Pretender]) -> None:
    problem, truth, made = pretend
    made.stop = 5e-3
    search = _Search(problem, truth, 1.0)
    search.sweep(PEER_METHODS[0])
    assert search.points[-1].status == "not run" and search.points[-1].reason == "late"
    assert sum(p.status == "not run" for p in search.points) == 1
    assert search.fastest(1e-9) is None


def test_where_no_peer_reaches_a_target_the_table_says_so() -> None:
    nan = math.nan
    rows = (
        PeerRow(1e-3, 0.02, 1e-5, "energy quadrature", True, "Drake RK3", 1e-4, 0.01, 5e-4),
        PeerRow(1e-9, 0.03, 1e-10, "energy quadrature", True, "", nan, nan, 2e-6),
        PeerRow(1e-9, 0.03, 1e-8, "energy quadrature", True, "Drake RK3", 1e-4, 0.01, 5e-10),
    )
    assert rows[0].ratio == pytest.approx(2.0)
    assert math.isnan(rows[1].ratio)
    assert math.isnan(rows[2].ratio)  # ours claims what it does not keep: no ratio to boast of
    table = PeerTable(rows, (), {}, {"drake": "1.51"}, "m", 0.3)
    told = table.to_dict()["peers"]
    assert told[0]["ratio"] == pytest.approx(2.0) and told[0]["peer"] == "Drake RK3"
    assert told[1]["peer"] is None and told[1]["peer_cpu_s"] is None and told[1]["ratio"] is None
    assert "none reaches it in 0.3 s" in table.text()


def test_our_clock_holds_the_building_of_models_every_time() -> None:
    from mechlab.catalog.pendulum import build

    problem, _ = swing(0.5)
    for _ in range(2):
        cpu_s, made = chart_peers.whole_run(problem, 1e-3)
        assert build.cache_info().misses >= 1  # a table that was emptied counts from 0
        parts = made.cost.parts
        assert cpu_s == pytest.approx(parts.build + parts.integrate + parts.probe + parts.check + parts.record)
        assert parts.build > 0.0


def test_peers_stay_out_of_a_chart_that_does_not_ask_for_them() -> None:
    assert not {m.engine for m in METHODS} & set(PEERS)
    for m in PEER_METHODS:
        assert m.integrator in INTEGRATORS[m.engine]
        assert (m.control == "tolerance") == controlled(m.engine, m.integrator)
    assert len({m.name for m in (*METHODS, *PEER_METHODS)}) == len(METHODS) + len(PEER_METHODS)


def test_a_chart_without_peers_installed_still_comes_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mechlab.engines.peers.engine.find_spec", lambda name: None)
    monkeypatch.setattr(chart_peers, "REPEATS", 1)
    some = [m for m in METHODS if m.name == "own equations, scipy DOP853"]
    d = ml.load("pendulum")
    found = chart(d, duration=0.5, methods=some, budget=Budget(one=0.01, method=0.5, repeat=0.0), peers=True)
    data = found.to_dict()
    assert [r["target"] for r in data["peers"]] == list(TARGETS)
    for row in data["peers"]:
        assert row["peer"] is None and row["ours_cpu_s"] > 0.0
        assert row["ours_error"] <= row["target"]
    assert all("mechanism-lab[peers]" in found.skipped[m.name] for m in PEER_METHODS)


def test_an_mjcf_file_has_no_peers(tmp_path: Path) -> None:
    with pytest.raises(MechlabError, match="peers are given a mechanism"):
        api.chart(tmp_path / "some.xml", peers=True)


def test_fidelities_and_peers_exclude_each_other(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["chart", "fourbar", "--peers", "--fidelities"]) == 2
    assert "--fidelities does not go with --peers" in capsys.readouterr().err


@pytest.mark.slow
def test_a_real_comparison_judges_peers_by_the_reference(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if not installed("exudyn"):
        pytest.skip("exudyn is not installed")
    monkeypatch.setattr(chart_peers, "PEER_METHODS", [m for m in PEER_METHODS if m.name == "Exudyn RK44"])
    problem, truth = swing(2.0)
    table = chart_peers.compare(problem, truth)
    assert [r.peer for r in table.rows] == ["Exudyn RK44"] * 3
    for row in table.rows:
        assert row.peer_error <= row.target and row.ours_error <= row.target and row.ratio > 0.0
    errors = [p.error for p in table.points if 1e-9 < p.error < 1e-3]
    falls = [b / a for a, b in zip(errors[:-1], errors[1:], strict=True)]
    assert np.median(falls) == pytest.approx(1 / 16, rel=0.5)  # order 4
    made = chart(ml.load("pendulum"), duration=0.5, methods=METHODS[:1], budget=Budget(0.01, 0.3, 0.0))
    drawn = replace(made, points=(*made.points, *table.points), peers=table)
    files = drawn.save(tmp_path / "chart.svg")
    assert "Exudyn RK44" in files["svg"].read_text()
    assert "Exudyn RK44" in drawn.text() and "ratio" in drawn.text()
