"""What the transmission must show, through the public API and the command line. MuJoCo 4.0.0, Pinocchio 4.1.0."""

import json
import math
import xml.etree.ElementTree as ET

import numpy as np
import pytest

import mechlab as ml
from mechlab.catalog import impulse_transmission as entry
from mechlab.catalog.impulse_transmission.parameters import Parameters, warnings
from mechlab.catalog.impulse_transmission.scenes import SCENES
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.experiment.check import Verdict
from mechlab.formats import from_json, from_mjcf, to_json, to_mjcf


def told(words: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, dict]:
    code = main([*words.split(), "--json"])
    return code, json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    "check", [pytest.param(c, id=c.id, marks=[pytest.mark.slow] if c.slow else []) for c in entry.ENTRY.checks]
)
def test_check(check) -> None:
    found = check.run(Parameters())
    assert found.passed, f"{found.difference} > {found.tolerance}: {found.values} {found.note}"


@pytest.mark.parametrize("claim", entry.ENTRY.claims, ids=lambda c: c.id)
def test_claim(claim) -> None:
    expected = {"M1": "HOLDS", "M2": "HOLDS", "M3": "MISPRINT", "M6": "FAILS", "M7": "FAILS", "M9": "FAILS", "M10": "HOLDS",
                "M11": "HOLDS", "M15": "CANNOT"}  # fmt: skip
    assert claim.test().verdict is Verdict[expected.get(claim.id, "HOLDS_ONLY_IF")]


def test_mean_speed_from_both_witnesses(capsys) -> None:
    code, said = told("solve impulse_transmission input_speed=150 M0=2 M1=10", capsys)
    assert code == 0 and said["max_difference"] < 1e-7
    assert set(said["answers"]["hybrid"]) >= {"mean_speed", "forward_time", "return_time", "mean_motor_torque"}
    assert math.isclose(said["answers"]["analytic"]["mean_speed"], -5.494296, abs_tol=1e-6)


@pytest.mark.parametrize("load", ["M0=20 M1=10", "M0=0 M1=5000"])
def test_beyond_the_limit_there_is_no_such_regime(load, capsys) -> None:
    code, said = told(f"solve impulse_transmission input_speed=150 {load}", capsys)
    assert code == 4 and said["status"] == "no such regime"
    assert "mean_speed" not in said["answers"]["analytic"] and "mean_speed" not in said["answers"]["hybrid"]


def test_where_it_sticks_the_simulation_answers_and_the_closed_form_declines() -> None:
    answers = ml.solve("impulse_transmission", input_speed=150, q="4/5", M0=0, M1=750)
    assert "sticks" in answers.answers["analytic"].cannot and "0.118885" in answers.answers["analytic"].cannot
    assert answers.exit_code == 0 and answers["hybrid"]["mean_speed"] > 0.2


@pytest.mark.parametrize("engine", ["hybrid", "analytic"])
def test_figure_4_ends_where_the_specification_says(engine, capsys) -> None:
    code, said = told(f"simulate impulse_transmission --scene fig4 --duration 0.3 --engine {engine}", capsys)
    end = said["final"]
    assert code == 0
    # DOP853 1e-10 with events, scipy 1.17, specification A6.
    expected = {"beta": -0.069692731, "beta_rate": -25.7149253, "alpha_rate": 217.5751425, "motor_torque": 144.387078}
    assert all(math.isclose(end[k], x, abs_tol=1e-6) for k, x in expected.items())


def test_mujoco_runs_it_and_says_how_friction_fares() -> None:
    run = ml.simulate("impulse_transmission", scene="fig4", duration=0.3, engine="mujoco")
    assert run.health.trusted and "first order" in run.health.finding("friction").sentence
    # First order in a step of 1e-4 s: 0.078 for Euler by the specification, C2.
    assert abs(run.channel("beta")[-1] + 0.069692731) < 0.15


def test_full_fidelity_moves_alike() -> None:
    runs = [
        ml.simulate("impulse_transmission", scene="fig4", duration=0.05, fidelity=f, engine="hybrid")
        for f in ("minimal", "full")
    ]
    for name in ("alpha", "beta", "beta_rate", "motor_torque"):
        assert math.isclose(runs[0].channel(name)[-1], runs[1].channel(name)[-1], abs_tol=1e-6)
    mechanism, q = entry.expand(Parameters(), runs[0])
    assert mechanism == runs[1].mechanism or q.shape[1] == 7
    assert np.allclose(q[-1], runs[1].q[-1], atol=1e-6)


def test_sticking_is_cheap_and_stands_still() -> None:
    run = ml.simulate("impulse_transmission", scene="sticking", engine="hybrid")
    assert run.health.trusted and run.cost.evaluations < 1e5
    assert (
        "0.000461" in run.health.finding("friction").sentence
    )  # the closed form with events stands as long (next line)
    other = ml.simulate("impulse_transmission", scene="sticking", engine="analytic")
    assert "0.000461" in other.health.finding("friction").sentence
    assert abs(run.channel("beta")[-1] - other.channel("beta")[-1]) < 1e-8


@pytest.mark.parametrize("scene", list(SCENES))
def test_every_scene_runs_in_its_own_engine(scene) -> None:
    run = ml.simulate("impulse_transmission", scene=scene, duration=0.02)
    assert run.health.trusted and {"alpha", "beta", "alpha_rate", "beta_rate", "motor_torque"} <= set(run.channels)


def test_one_way_rotation_keeps_its_mean_speed() -> None:
    """From crossing to crossing of psi, not over a commensurate time."""
    run = ml.simulate("impulse_transmission", scene="unidirectional", duration=0.5)
    psi, t, beta = run.channel("psi"), run.t, run.channel("beta")
    turns = np.floor((psi[-1] - psi[0]) / (2 * math.pi))
    ends = [np.interp(psi[0] + 2 * math.pi * n, psi, x) for x in (t, beta) for n in (0, turns)]
    mean = (ends[3] - ends[2]) / (ends[1] - ends[0])
    # Linear interpolation between samples of 1 ms, and a motor that lets the speed ripple: per cent.
    assert math.isclose(mean, -5.494296, abs_tol=0.3)


def test_the_model_file_has_two_freedoms_no_rows_and_a_dc_motor() -> None:
    m = ml.load("impulse_transmission").mechanism("minimal")
    text = to_mjcf(m)
    root = ET.fromstring(text if isinstance(text, str) else text.text)
    motor = root.find("actuator/dcmotor")
    p = Parameters()
    assert motor is not None and motor.get("input") == "voltage"
    assert math.isclose(float(motor.get("resistance")), p.impulse.speed_per_torque)
    assert root.find("equality") is None and m.nv == 2
    assert from_json(to_json(m)) == m


def test_warnings_and_refusals() -> None:
    assert not warnings(Parameters())
    assert "contradict" in warnings(Parameters(slip_per_torque=0.0024))[0]
    assert "static" in warnings(Parameters(tau=1e-6))[0]
    assert "resonance" in warnings(Parameters(c=47000.0))[0]
    with pytest.raises(MechlabError, match="nm h"):
        ml.load("impulse_transmission", nJ3=0.01)


def test_a_motor_that_is_faster_than_any_step_is_static(capsys) -> None:
    run = ml.simulate("impulse_transmission", scene="fig7", duration=0.05, tau=1e-6)
    p = Parameters(**{**SCENES["fig7"].overrides, "tau": 1e-6})
    line = p.Mn - (run.channel("alpha_rate") - p.nominal_speed) / p.impulse.speed_per_torque
    assert run.health.trusted and np.allclose(run.channel("motor_torque"), line, rtol=1e-9)
    quick = ml.simulate("impulse_transmission", scene="fig7", duration=0.05, tau=1e-6, engine="analytic")
    assert math.isclose(run.channel("beta")[-1], quick.channel("beta")[-1], abs_tol=1e-4)


def test_input_may_be_the_carrier() -> None:
    run = ml.simulate("impulse_transmission", scene="fig7", duration=0.02, a=0.1, b=0, fidelity="full")
    # The relation theta = alpha is as soft as the preset makes it at 1 ms.
    assert run.health.trusted and np.allclose(run.channel("theta"), run.channel("alpha"), atol=1e-4)


def test_mjcf_is_read_back() -> None:
    m = ml.load("impulse_transmission").mechanism("minimal")
    text = to_mjcf(m)
    back = from_mjcf(text if isinstance(text, str) else text.text)
    assert back.drives[0].winding == m.drives[0].winding
