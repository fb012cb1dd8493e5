"""Positions are off by no more than the error that is stated, where other estimates failed: a five-bar that nearly passes a singular
position, on Pinocchio with stabilized rows, whose errors of second and of fourth order in the step cancel at some step; Myard's linkage by
its energy, whose poses are closed to a share of the error alone. Truth: Pinocchio's DOP853 at 1e-12, to 1e-8."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

import mechlab as ml
from mechlab.lab.accuracy.convergence import error_of_steps
from mechlab.lab.methods import Problem, method
from mechlab.studies.chart.score import reference_of, tracked

NEAR_SINGULAR = (
    {"rod_left": 0.24853764252676225, "base": 0.20311862284584833, "mass_per_length": 1.0370436181983755},
    {"rod_left": 0.29302199978525095, "crank_right": 0.10224312095207211},
)
CASES = [("fivebar", p, "minimal", 1.0, 1e-4) for p in NEAR_SINGULAR] + [("myard", {}, "full", 1.0, 1e-3)]


@pytest.mark.parametrize(("name", "parameters", "fidelity", "duration", "target"), CASES)
def test_positions_are_off_by_no_more_than_stated(
    name: str, parameters: dict[str, float], fidelity: str, duration: float, target: float
) -> None:
    design = ml.load(name, **parameters).for_scene("free-run")
    run = ml.simulate(design, scene="free-run", fidelity=fidelity, duration=duration, max_error=target)
    problem = Problem(design, replace(design.scene("free-run", fidelity), duration=duration))
    names = reference_of(problem).names
    truth = method("Pinocchio DOP853").run(problem, 1e-12)
    at = np.searchsorted(run.t, np.linspace(0.0, duration, problem.outputs + 1) * (1.0 - 1e-12))
    mine, theirs = tracked(problem, names, run.q[at], run.v[at]), tracked(problem, names, truth.q, truth.v)
    away, stated = float(np.max(np.abs(mine - theirs))), run.health.finding("max_error").value
    assert run.exit_code == 0 and away <= stated <= target
    assert away > 1e-8  # else the truth tells nothing


@pytest.mark.parametrize("second", [-8.0, -5.0, -3.0, -1.0, 1.0, 5.0])
@pytest.mark.parametrize("steps", [(4.0, 2.0, 1.0), (2.5, 1.25, 1.0), (3.0, 1.5, 1.0)])
def test_errors_of_two_orders_that_cancel_are_not_taken_for_none(second: float, steps: tuple[float, ...]) -> None:
    """Errors h^4 + b h^2: with b of the other sign two runs agree at some step, and neither is right."""
    errors = [h**4 + second * h**2 for h in steps]
    changes = [abs(a - b) for a, b in itertools.pairwise(errors)]
    # error control states twice the estimate
    assert 2.0 * error_of_steps(changes, steps, (1.0, 4.0), False, False, False) >= abs(errors[-1])
