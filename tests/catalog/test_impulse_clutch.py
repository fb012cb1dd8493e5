"""Torque without and with a one-way clutch to the housing: momentum and energy balances, integration, MuJoCo, the optimum."""

from dataclasses import replace

import numpy as np
import pytest

import mechlab as ml
from mechlab.analytic.impulse import Impulse, clutched, simulated_clutch
from mechlab.catalog.impulse_transmission.questions import closed_cycle
from mechlab.catalog.impulse_transmission.scenes import SPEED
from mechlab.catalog.impulse_transmission.torque import best_load, over_load
from mechlab.errors import MechlabError, NoSolution


@pytest.mark.parametrize(("M0", "M1", "torque"), [(18.0, 750.0, 66.1), (0.0, 20.0, 1.95), (2.0, 10.0, None)])
def test_without_a_clutch_the_mean_torques_are_equal(M0: float, M1: float, torque: float | None) -> None:
    """Angular momentum: nothing but motor and resistance acts from outside. 66.1 and 1.95 N m are the figures of the specification."""
    run = closed_cycle(Impulse(M0=M0, M1=M1), SPEED)
    assert run is not None and run.stuck_psi == 0.0
    output = M0 + M1 * (run.forward_time - run.return_time) / (run.forward_time + run.return_time)
    assert run.mean_motor_torque == pytest.approx(output, rel=1e-9)
    if torque is not None:
        assert run.mean_motor_torque == pytest.approx(torque, abs=0.05)
    if M0 == 18.0:
        assert M0 * run.mean_speed / (run.mean_motor_torque * SPEED) == pytest.approx(9e-4, rel=0.02)  # .09 %


@pytest.mark.parametrize(("M0", "M1"), [(18.0, 750.0), (18.0, 0.0), (750.0, 0.0), (500.0, 100.0), (2800.0, 0.0)])
@pytest.mark.parametrize("q", [4 / 3, 4 / 5, 3 / 5])
def test_closed_form_against_integration(M0: float, M1: float, q: float) -> None:
    p = Impulse(M0=M0, M1=M1, q=q)
    try:
        found = clutched(p, SPEED)
    except NoSolution:
        with pytest.raises(NoSolution):
            simulated_clutch(p, SPEED)
        return
    other = simulated_clutch(p, SPEED)
    for name in ("psi_a", "psi_b", "forward_time", "rest_time", "motor_torque", "holding_torque"):
        assert getattr(found, name) == pytest.approx(getattr(other, name), rel=1e-8, abs=1e-9), name
    assert found.mean_speed == pytest.approx(other.mean_speed, abs=1e-7)
    # momentum and energy, of the integration that uses neither
    total = other.forward_time + other.rest_time
    assert other.motor_torque + other.holding_torque == pytest.approx(M0 + M1 * other.forward_time / total, rel=1e-8)
    assert other.motor_torque * SPEED == pytest.approx((M0 + M1) * other.mean_speed, rel=1e-7, abs=1e-6)


def test_what_has_no_cycle_is_refused() -> None:
    largest = 0.1262 * SPEED**2  # a6 - a5 = 0.12622 kg m2 by hand from nm, h, k, q, b
    with pytest.raises(NoSolution, match="do not overcome"):
        clutched(Impulse(M0=1.01 * largest, M1=0.0), SPEED)
    assert clutched(Impulse(M0=0.99 * largest, M1=0.0), SPEED).mean_speed < 0.1
    for wrong in ({"c": 1.0}, {"M0": 0.0}, {"q": -1.0}):
        with pytest.raises(MechlabError, match="clutch to the housing needs"):
            clutched(Impulse(**{"M0": 100.0, "M1": 0.0, **wrong}), SPEED)
    with pytest.raises(MechlabError, match="input speed"):
        clutched(Impulse(M0=100.0, M1=0.0), -1.0)
    assert ml.solve("impulse_transmission", clutch_at_speed=SPEED, M0=5000, M1=0).exit_code == 4


def test_the_scene_moves_as_the_closed_form() -> None:
    """Mean speed between two stops in MuJoCo, five cycles apart; the samples are 0.5 ms apart, of 0.17 s."""
    run = ml.simulate("impulse_transmission", scene="housing-clutch", duration=0.2)
    beta, rate, t = run.channel("beta"), run.channel("beta_rate"), run.t
    stops = [k for k in range(1, len(t)) if rate[k] < 0.05 <= rate[k - 1]]
    mean = (beta[stops[5]] - beta[stops[0]]) / (t[stops[5]] - t[stops[0]])
    expected = clutched(replace(Impulse(), M0=750.0, M1=0.0), SPEED)
    assert mean == pytest.approx(expected.mean_speed, rel=0.01)
    assert rate.min() > -1e-3
    with pytest.raises(MechlabError, match="no closed form of the motion"):
        ml.simulate("impulse_transmission", scene="housing-clutch", duration=0.02, engine="analytic")
    cycle = (t >= t[stops[0]]) & (t <= t[stops[5]])
    assert np.mean(run.channel("alpha_force")[cycle]) == pytest.approx(expected.motor_torque, rel=0.05)


def test_optimize_finds_the_load_of_largest_power() -> None:
    found = ml.optimize("impulse_transmission", M0=(100.0, 2700.0), M1=0.0, clutch_at_speed=SPEED, maximize="useful_power")
    load, cycle = best_load(Impulse(), SPEED)
    assert found.best.x[0] == pytest.approx(load, rel=1e-3)
    assert found.best.values["useful_power"] == pytest.approx(load * cycle.mean_speed, rel=1e-6)
    # no load of a scan gives more, and neighbours give less
    over = over_load(Impulse(), SPEED, 400)
    assert np.max(over["load"] * over["speed"]) <= load * cycle.mean_speed * (1 + 1e-9)
