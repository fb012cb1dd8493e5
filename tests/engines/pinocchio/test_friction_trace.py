"""Dry friction written as sign() or tanh(): how wrong, and how dear, beside located events. Pinocchio 4.1.0."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from mechlab.engines.own.hybrid import run
from mechlab.engines.pinocchio import friction_trace
from mechlab.errors import MechlabError
from mechlab.experiment.laws import Harmonic
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism import Builder, Inertia, revolute

# Unit inertia, friction 0.5, shaken by 0.4 sin 6 t from 1 rad/s: it slides, then stands still for good, as 0.4 < 0.5.
SCENE = Scene("shake", "full", 2.5, (Harmonic("turn", 0.4, 6.0),), initial_rates={"turn": 1.0})
OUTPUTS = 10


def wheel():
    b = Builder("wheel", gravity=(0.0, 0.0, 0.0))
    b.body("wheel", revolute("turn", friction=0.5), inertia=Inertia.axial(1.0, 1.0, 0.5))
    return b.build()


def where_it_stands() -> tuple[float, float]:
    """Time and angle at which it comes to rest, from the integral of its equation of motion."""
    stop = brentq(lambda t: 1.0 - 0.5 * t + (1.0 - math.cos(6.0 * t)) / 15.0, 1.5, 2.5)
    return stop, stop - 0.25 * stop**2 + (stop - math.sin(6.0 * stop) / 6.0) / 15.0


def fixed(friction: str, step: float):
    return friction_trace.trace_friction(wheel(), SCENE, Settings(engine="pinocchio", timestep=step), OUTPUTS, friction)


def test_the_naive_sign_is_worse_at_the_same_cost_and_trembles() -> None:
    stop, angle = where_it_stands()
    exact = run(wheel(), SCENE, Settings(engine="hybrid", tolerance=1e-9), np.linspace(0.0, 2.5, OUTPUTS + 1))
    assert math.isclose(exact.q[-1, 0], angle, abs_tol=1e-8) and exact.v[-1, 0] == 0.0
    assert f"{2.5 - stop:.5g}"[:6] in exact.health.finding("friction").sentence
    naive = fixed("sign", 6.25e-3)  # a step that does not divide the time of the stop
    assert naive.complete and naive.evaluations == 4 * naive.steps == 1600
    assert naive.evaluations > 3 * exact.cost.evaluations
    assert abs(naive.q[-1, 0] - angle) > 1e4 * abs(exact.q[-1, 0] - angle)
    assert 1e-5 < abs(naive.v[-1, 0]) < 6.25e-3  # within limit x step / inertia of standstill, and never at it


@pytest.mark.parametrize("friction", ["sign", "tanh"])
def test_its_error_falls_with_the_first_power_of_the_step(friction) -> None:
    angle = where_it_stands()[1]
    errors = [abs(fixed(friction, h).q[-1, 0] - angle) for h in (25e-3, 6.25e-3)]
    # RK4 is of order 4 for smooth forces; over the jump a factor of 4 in the step gives about 4, not 256.
    assert 2.5 < errors[0] / errors[1] < 8.0


def test_step_size_control_chatters_at_the_naive_sign(monkeypatch) -> None:
    monkeypatch.setattr(friction_trace, "MOST_EVALUATIONS", 3000)
    how = Settings(engine="pinocchio", integrator="DOP853", tolerance=1e-6)
    naive = friction_trace.trace_friction(wheel(), SCENE, how, OUTPUTS, "sign")
    assert not naive.complete and naive.evaluations == 3000
    reached = float(naive.reason.split("t = ")[1].split(" s")[0])
    # It slides to the stop cheaply, then 3000 evaluations do not carry it over the next tenth of a second.
    assert where_it_stands()[0] - 0.01 < reached < where_it_stands()[0] + 0.1
    exact = run(wheel(), SCENE, Settings(engine="hybrid", tolerance=1e-6))
    assert exact.t[-1] == 2.5 and exact.cost.evaluations < 1000


def test_another_word_for_friction_is_named() -> None:
    with pytest.raises(MechlabError, match="sign, tanh"):
        fixed("stiction", 0.1)
