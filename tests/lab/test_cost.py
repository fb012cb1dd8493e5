"""The stated cost of a run: all CPU seconds of the call, by what they were spent on."""

import time
from dataclasses import dataclass, fields

import pytest

import mechlab as ml
from mechlab.clock import CostParts, costed, move_cost, spent_on
from mechlab.experiment.recording import Cost
from mechlab.formats import load_recording


def burn(seconds):
    """Spend CPU time of the process."""
    until = time.process_time() + seconds
    while time.process_time() < until:
        pass


@dataclass(frozen=True)
class Made:
    cost: Cost = Cost()


# What is between two looks at the clock costs microseconds; tens of milliseconds are told apart with ease.
NEAR = 5e-3


def test_every_second_belongs_to_the_innermost_block():
    @costed
    def run():
        burn(0.01)
        with spent_on("record"):
            burn(0.02)
            with spent_on("check"):
                burn(0.03)
            with pytest.raises(ZeroDivisionError), spent_on("check"):
                _ = 1 / 0
            burn(0.01)
        return Made(Cost(0.5, 7, 8))

    cost = run().cost
    assert (cost.cpu_s, cost.steps, cost.evaluations) == (0.5, 7, 8)
    assert cost.parts.build == pytest.approx(0.01, abs=NEAR)
    assert cost.parts.record == pytest.approx(0.03, abs=NEAR)
    assert cost.parts.check == pytest.approx(0.03, abs=NEAR)
    assert cost.parts.integrate == cost.parts.probe == cost.parts.imports == 0.0


def test_all_of_a_probe_is_probe_but_its_imports_and_the_run_that_was_taken():
    @costed
    def inner():
        with spent_on("integrate"):
            burn(0.02)
        with spent_on("imports"):
            burn(0.01)
        return Made()

    @costed
    def run():
        with spent_on("probe"):
            one = inner()
            assert one.cost.parts.integrate == 0.0 and one.cost.parts.probe == pytest.approx(0.02, abs=NEAR)
            inner()
        move_cost("probe", "integrate", 0.015)
        return Made()

    parts = run().cost.parts
    assert parts.probe == pytest.approx(0.025, abs=NEAR)
    assert parts.imports == pytest.approx(0.02, abs=NEAR)
    assert parts.integrate == pytest.approx(0.015, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("fourbar", {"duration": 0.2}),
        ("fourbar", {"duration": 0.2, "max_error": 1e-4}),
        ("pendulum", {"duration": 0.2, "max_error": 1e-4}),
        ("fourbar", {"duration": 0.2, "engine": "one_freedom"}),
        ("fourbar", {"duration": 0.2, "engine": "pinocchio"}),
        ("andrews", {"engine": "analytic"}),
    ],
)
def test_the_stated_cost_is_the_cpu_time_of_the_call(name, options, tmp_path):
    began = time.process_time()
    run = ml.simulate(name, **options)
    whole = time.process_time() - began
    cost = run.cost
    assert cost.total_s == pytest.approx(sum(getattr(cost.parts, x.name) for x in fields(CostParts)), rel=1e-12)
    # reading of keys and the return itself are not in it
    assert 0.9 * whole - NEAR < cost.total_s <= whole
    assert min(getattr(cost.parts, x.name) for x in fields(CostParts)) >= 0.0
    assert cost.parts.integrate > 0.0 and cost.parts.record > 0.0
    assert (cost.parts.probe > 0.0) == (options.get("engine") != "analytic")
    assert run.to_dict()["cost"]["parts"]["check"] == cost.parts.check
    assert f"{cost.total_s:.3g} s of CPU (" in str(run)
    run.save(tmp_path / "run.npz")
    assert load_recording(tmp_path / "run.npz").cost == cost
