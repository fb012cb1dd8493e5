"""`--max-error` with a unit controls the tracked channels in that unit; its budget is an option."""

import json
import math

import numpy as np
import pytest

import mechlab as ml
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.experiment.scene import Settings
from mechlab.lab.accuracy.rules import default_budget

SHARP = Settings("pinocchio", "DOP853", tolerance=1e-11, preset="sharp")


@pytest.mark.parametrize(("scene", "asked", "channels"), [
    ("internal-drag", "1W", ("outer_power",)),
    ("internal-drag", "1e-4rad/s", ("w_H1", "w_H2", "w1", "w3", "w2", "w5")),
    ("housing-drag", "50mNm", ()),
])  # fmt: skip
def test_channels_are_within_the_error_in_their_own_unit(scene: str, asked: str, channels: tuple[str, ...]) -> None:
    if not channels:
        with pytest.raises(MechlabError, match=r"no tracked channel is in N m; those of the scene are in rad/s, N m s, W"):
            ml.simulate("closed_differential", scene=scene, duration=0.4, max_error=asked)
        return
    run = ml.simulate("closed_differential", scene=scene, duration=1.0, max_error=asked)
    finding = run.health.finding("max_error")
    assert run.health.trusted and all(run.units[n] == finding.unit for n in channels)
    truth = ml.simulate("closed_differential", scene=scene, duration=1.0, settings=SHARP, at=run.t.tolist())
    at = np.clip(np.searchsorted(truth.t, run.t * (1.0 - 1e-12)), 0, len(truth.t) - 1)
    for n in channels:
        error = float(np.max(np.abs(run.channels[n] - truth.channels[n][at])))
        # the truth, at a tolerance of 1e-11, is known to 1e-8 of the size of a channel
        assert error <= run.errors[n] + 1e-8 * float(np.max(np.abs(run.channels[n])))
        assert run.errors[n] <= finding.limit


def test_all_recorded_channels_count_where_the_scene_names_none() -> None:
    """The drive torque of a four-bar, against its own equation of motion under the same servo."""
    run = ml.simulate("fourbar", duration=0.5, max_error="1mNm")
    assert run.health.trusted and run.errors["crank_angle_force"] <= 1e-3
    truth = ml.simulate("fourbar", duration=0.5, settings=SHARP, at=run.t.tolist())
    at = np.clip(np.searchsorted(truth.t, run.t * (1.0 - 1e-12)), 0, len(truth.t) - 1)
    error = np.max(np.abs(run.channels["crank_angle_force"] - truth.channels["crank_angle_force"][at]))
    assert error <= run.errors["crank_angle_force"] + 1e-6


def test_positions_may_have_their_unit_written() -> None:
    plain, written = (ml.simulate("slider_crank", duration=0.5, max_error=x) for x in (1e-4, "0.1mm"))
    assert np.array_equal(plain.q, written.q) and written.health.finding("max_error").limit == 1e-4


def test_an_error_of_power_that_jumps_is_refused_not_stated_small(capsys: pytest.CaptureFixture[str]) -> None:
    """Dry loads stick in no time; where an engine captures them the power is wrong by all of it for as long as that moment is early or
    late."""
    words = ["simulate", "closed_differential", "--scene", "held-input-dry-load", "--duration", "0.6", "--engine", "mujoco"]
    assert main([*words, "--max-error", "1W", "--json"]) == 3
    said = json.loads(capsys.readouterr().out)
    finding = next(f for f in said["health"] if f["name"] == "max_error")
    assert finding["severity"] == "error" and finding["unit"] == "W" and finding["value"] > 1.0
    assert said["errors"]["outer_power"] == finding["value"]


def test_the_budget_grows_with_the_duration_and_ends_the_search() -> None:
    assert default_budget(0.3) == pytest.approx(3.45) and default_budget(2.0) == 6.0 and default_budget(1e3) == 30.0
    few = ml.simulate("gear_linkage", scene="knife-drive", max_error=1e-9, budget=0.1)
    assert not few.health.trusted
    assert "budget of 0.1 s" in few.health.finding("max_error").sentence


@pytest.mark.parametrize("name", ["slider_crank", "pendulum"])
def test_less_than_rounding_is_not_reached(name: str) -> None:
    """1e-300 m was said to be reached, with an error of 0 m."""
    run = ml.simulate(name, duration=0.1, max_error=1e-300)
    found = run.health.finding("max_error")
    assert found.severity == "error" and found.value > 1e-17 and "cannot be reached" in found.sentence


@pytest.mark.parametrize(("options", "said"), [
    ({"budget": 1.0}, "budget: it is what max_error may spend"),
    ({"budget": 1.0, "max_error": 1e-3, "engine": "mujoco"}, "budget: it is what max_error may spend"),
    ({"budget": -1.0, "max_error": 1e-3}, "budget: expected a number > 0 s"),
    ({"budget": math.nan, "max_error": 1e-3}, "budget: expected a finite number"),
    ({"max_error": "1W"}, "no tracked channel is in W; those of the scene are in m"),
    ({"max_error": "1furlong"}, "the unit"),
    ({"max_error": "small"}, "expected a number"),
    ({"max_error": "-1N"}, "expected a number > 0"),
])  # fmt: skip
def test_bad_ones_get_one_clear_message(options: dict, said: str) -> None:
    with pytest.raises(MechlabError, match=said):
        ml.simulate("slider_crank", duration=0.1, **options)


def test_a_way_through_a_flat_pose_is_trusted_only_if_another_method_takes_it() -> None:
    """Where both chains of a Sarrus linkage stand in a line the equations do not decide how they fold next: Pinocchio's steps are made
    finer until it takes MuJoCo's way. Hart's linkage passes a pose past which they stay millimetres apart."""
    run = ml.simulate("sarrus", scene="free-run", low=0.4905, high=1.347, plate=0.1083, max_error=1e-4)
    assert run.health.finding("assembly_mode").value > 0
    assert run.health.trusted and run.health.finding("check_method").value < 1e-4
    assert run.health.finding("energy_balance").value < 1e-4  # a conservation law that neither method uses
    run = ml.simulate("hart", scene="free-run", fidelity="minimal", duration=1.0, short=0.1109, gravity=10.67, max_error=1e-4)
    assert not run.health.trusted and "does not confirm the way" in run.health.finding("max_error").sentence


def test_a_limit_position_of_the_drive_is_no_place_where_ways_part() -> None:
    """The crank of a four-bar turns back: its mode changes, while the closed poses go on smoothly. Another method that is less exact yet
    is no reason not to trust a run."""
    options = {"scene": "free-run", "fidelity": "minimal", "duration": 0.25, "mass_per_length": 0.9408, "first": 1.534}
    run = ml.simulate("freudenstein", max_error=1e-6, **options)
    assert run.health.finding("assembly_mode").value > 0 and run.health.trusted
    truth = ml.simulate("freudenstein", engine="pinocchio", timestep=5e-5, **options)  # RK4: 1/1500 of the error at .3 ms
    for name in ("B_x", "B_z", "A_x", "A_z"):
        true = abs(run.channels[name][-1] - truth.channels[name][-1])
        assert true <= run.errors[name] + 1e-10, name

