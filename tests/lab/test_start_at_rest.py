"""Motions by their energy that start at rest, or nearly: the turning point lies beside the start, where energy less potential is rounding.
Truth: Pinocchio, by DOP853 at 1e-11, whose poses are projected onto the closure."""

from dataclasses import replace

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.protocol import engine
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Settings
from mechlab.lab.accuracy.solve import solve_to
from mechlab.lab.methods import Problem
from mechlab.studies.chart.score import reference_of, tracked

SHARP = Settings("pinocchio", "DOP853", tolerance=1e-11, preset="sharp")
KNOWN = {"rad": 1e-8, "m": 1e-8, "rad/s": 1e-8, "m/s": 1e-8}
"""Errors of the truth, as shares of the size of a channel; of accelerations and forces 1e-6."""


def largest_errors(run: Recording, truth: Recording) -> dict[str, float]:
    """Channel -> largest difference at the times of the truth, less what the truth leaves open."""
    at = np.searchsorted(run.t, truth.t * (1.0 - 1e-12))
    out = {}
    for name in run.errors.keys() & truth.channels.keys():
        right = truth.channels[name]
        open_ = KNOWN.get(run.units[name], 1e-6) * max(1.0, float(np.max(np.abs(right))))
        out[name] = max(0.0, float(np.max(np.abs(run.channels[name][at] - right))) - open_)
    return out


@pytest.mark.parametrize(
    ("name", "parameters"), [("chebyshev", {"ground": 0.185, "gravity": 12.1}), ("scissor_lift", {"bar": 0.342}), ("bennett", {})]
)
def test_a_motion_from_rest_is_told_by_its_energy(name: str, parameters: dict[str, float]) -> None:
    design = ml.load(name, **parameters).for_scene("free-run")
    plan = replace(design.scene("free-run"), duration=0.2)  # before the scissor lift is flat
    # assembly leaves rates of rounding: the start is not at rest to the last bit
    run = ml.simulate(design, scene="free-run", duration=plan.duration, max_error=1e-6)
    truth = engine("pinocchio").run(design.mechanism(plan.fidelity), plan, SHARP, run.t[::4])
    wrong = largest_errors(run, truth)
    assert run.exit_code == 0 and run.settings.integrator == "energy"
    assert not [n for n, x in wrong.items() if x > run.errors[n]]
    first = next(n for n in run.channels if n.endswith("_accel"))
    assert run.channels[first][0] == pytest.approx(truth.channels[first][0], rel=1e-6)


@pytest.mark.parametrize("rate", [s * w for s in (1.0, -1.0) for w in (1e-15, 1e-9, 1e-7, 1e-5, 1e-3, 1e-2)])
@pytest.mark.parametrize("name", ["chebyshev", "fourbar"])
def test_slow_starts_are_as_exact_as_others(name: str, rate: float) -> None:
    design = ml.load(name).for_scene("free-run")
    joint = next(iter(design.scene("free-run").initial_rates))
    plan = replace(design.scene("free-run"), duration=0.25, initial_rates={joint: rate})
    run = ml.simulate(design, scene="free-run", duration=plan.duration, max_error=1e-9, **{f"{joint}_rate_0": rate})
    truth = engine("pinocchio").run(design.mechanism(plan.fidelity), plan, SHARP, run.t[::20])
    wrong = largest_errors(run, truth)
    assert run.exit_code == 0 and not [n for n, x in wrong.items() if x > run.errors[n]]


def test_positions_of_a_motion_with_a_short_event_are_off_by_no_more_than_stated() -> None:
    """The steps only just resolve a fast pass: the changes of three runs fall with the fourth power, the error with the second."""
    design = ml.load("schatz", bar=0.15341038688055258).for_scene("driven")
    plan = replace(design.scene("driven", "full"), duration=0.25)
    run = ml.simulate(design, scene="driven", fidelity="full", duration=0.25, max_error=1e-6)
    problem = Problem(design, plan)
    truth = reference_of(problem)
    at = np.searchsorted(run.t, np.linspace(0.0, 0.25, problem.outputs + 1) * (1.0 - 1e-12))
    away = float(np.max(np.abs(tracked(problem, truth.names, run.q[at], run.v[at]) - truth.values)))
    assert truth.own_error < 1e-9 < away <= run.health.finding("max_error").value <= 1e-6


def test_a_reference_whose_loops_all_but_lose_rows_says_how_far_its_poses_are_known() -> None:
    """Where the scissor lift is flat, poses that are open by 1e-8 m are 4e-7 m from the closed ones, as the motion by its energy tells."""
    design = ml.load("scissor_lift", bar=0.3418018668052643).for_scene("free-run")
    problem = Problem(design, replace(design.scene("free-run"), duration=0.25))
    truth = reference_of(problem)
    run = ml.simulate(design, scene="free-run", duration=0.25, max_error=1e-9)
    at = np.searchsorted(run.t, np.linspace(0.0, 0.25, problem.outputs + 1) * (1.0 - 1e-12))
    away = float(np.max(np.abs(tracked(problem, truth.names, run.q[at], run.v[at]) - truth.values)))
    assert run.exit_code == 0 and 1e-7 < away < 2.0 * truth.own_error


@pytest.mark.parametrize(
    ("name", "joint", "start", "rate"),
    [
        ("berkof_lowen", "crank_angle", 0.99457, -1.6e-10),
        ("double_cardan", "driver_angle", -0.11875, -8.8e-7),
        ("equipoised", "angle", -0.96, 4.8e-8),
    ],
)
def test_motions_whose_energy_is_rounding_are_run_by_steps(name: str, joint: str, start: float, rate: float) -> None:
    """Balanced mechanisms that all but stand: their kinetic energy is less than the rounding of the weights that cancel."""
    design = ml.load(name).for_scene("free-run")
    plan = replace(design.scene("free-run"), duration=0.3, initial={joint: start}, initial_rates={joint: rate})
    run = solve_to(design, plan, 1e-5)
    truth = reference_of(Problem(design, plan))
    away = float(np.max(np.abs(tracked(Problem(design, plan), truth.names, run.q, run.v) - truth.values)))
    assert run.reached and "energy" not in run.method and away <= run.estimate + 1e-12


def test_accelerations_of_a_turned_governor_are_those_of_a_straight_one() -> None:
    """Rows of its planar pins that are rounding were taken for constraints: the recorded accelerations jumped."""
    straight, turned = (
        ml.simulate("watt_governor", scene="free-run", duration=0.05, max_error=1e-4, spindle_0=x, spindle_rate_0=0.0) for x in (0.0, -0.24)
    )
    for name in ("arm_1", "arm_1_accel", "sleeve_accel"):
        size = np.abs(straight.channels[name]).max()
        assert turned.channels[name] == pytest.approx(straight.channels[name], abs=1e-5 * size)
    m = turned.mechanism
    right = engine("pinocchio").accelerations(m, turned.q[0], turned.v[0], np.zeros(m.nv)) @ m.row("arm_1")
    assert turned.channels["arm_1_accel"][0] == pytest.approx(right, rel=1e-6) and abs(right) > 10.0


@pytest.mark.parametrize("name", ["swash_plate", "cam_follower"])
def test_a_check_that_cannot_be_as_exact_refuses_no_motion_near_rest(name: str) -> None:
    """MuJoCo's rows leave 1e-8 of a motion of 3e-7, and change by more than that when they are made harder."""
    design = ml.load(name).for_scene("free-run")
    joint = design.mechanism("minimal" if "minimal" in design.entry.fidelities else "full").scalar_names[0]
    plan = replace(design.scene("free-run"), duration=0.3, initial_rates={joint: 1e-6})
    found, problem = solve_to(design, plan, 1e-9), Problem(design, plan)
    truth = reference_of(problem)
    away = float(np.max(np.abs(tracked(problem, truth.names, found.q, found.v) - truth.values)))
    assert found.reached and away <= found.estimate + truth.own_error + 1e-12  # the truth is run to 1e-12
