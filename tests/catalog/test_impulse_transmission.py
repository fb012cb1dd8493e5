"""What the transmission must show, through the public API and the command line. MuJoCo 4.0.0, Pinocchio 4.1.0."""

import json
import math
import xml.etree.ElementTree as ET

import numpy as np
import pytest

import mechlab as ml
from mechlab.analytic.impulse import WithMotor, coefficients, motor_torque_at
from mechlab.catalog import impulse_transmission as entry
from mechlab.catalog.impulse_transmission.build import Parameters, warnings
from mechlab.catalog.impulse_transmission.scenes import SCENES, simulate
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.experiment.entry import Verdict
from mechlab.formats import from_json, from_mjcf, to_json, to_mjcf
from mechlab.integrate import integrate_hybrid
from mechlab.lab.methods import METHODS, Problem, method


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
    expected = {"M1": "HOLDS", "M2": "HOLDS", "M3": "MISPRINT", "M5": "UNREADABLE", "M6": "FAILS", "M9": "FAILS",
                "M10": "HOLDS", "M11": "HOLDS", "M15": "CANNOT", "M16": "UNREADABLE",
                "M20": "UNREADABLE"}  # fmt: skip
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
    assert not run.health.trusted and "first order" in run.health.finding("friction").sentence
    assert run.health.finding("step_error").severity == "error"
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


def test_sticking_time_is_that_of_a_time_stepping_scheme() -> None:
    """Moreau's scheme (friction as an impulse within its limit in every step, no events) against located events."""
    p = Parameters(**SCENES["sticking"].overrides)
    i, h = p.impulse, 1e-6
    alpha, beta, u, v, motor = p.start
    stuck = []
    for n in range(8000):
        A1, A2, A3, A4, A5, A6 = coefficients(i, i.q * (alpha - beta))
        one = motor - A4 * (u - v) ** 2 - A6 * v * v
        two = -i.M0 - A5 * (u - v) ** 2 + A6 * u * u
        det = A1 * A3 - A2 * A2
        u, v = u + h * (A3 * one - A2 * two) / det, v + h * (A1 * two - A2 * one) / det
        impulse = min(max(-v * det / A1, -i.M1 * h), i.M1 * h)
        u, v = u - A2 / det * impulse, v + A1 / det * impulse
        alpha, beta = alpha + h * u, beta + h * v
        motor += h * (motor_torque_at(i, u) - motor) / i.tau
        if abs(v) < 1e-12:
            stuck.append(n * h)
    # First order: the stop and the start lie within a few steps of 1 us of the events, of a stick of 0.46 ms.
    run = integrate_hybrid(WithMotor(i), p.start, [0.0, 0.008], rtol=1e-11)
    assert [(e.before, e.after) for e in run.events] == [(1, 0), (0, -1)]
    assert math.isclose(stuck[0], run.events[0].t, abs_tol=4e-6) and math.isclose(
        stuck[-1], run.events[1].t, abs_tol=4e-6
    )
    assert math.isclose(len(stuck) * h, run.stuck_time[0], abs_tol=8e-6)


def test_chart_methods_show_what_the_naive_sign_costs() -> None:
    design = ml.load("impulse_transmission").for_scene("sticking")
    problem = Problem(design, design.scene("sticking", None, 0.09), 40)
    truth = entry.reference(design.parameters, problem.scene).q[::10]
    found = {}
    for name, value in (
        ("Pinocchio RK4, friction by sign", 0.75e-3),
        ("Pinocchio RK4, friction by tanh", 0.75e-3),
        ("MuJoCo RK4, hard", 0.75e-3),
        ("hybrid DOP853", 1e-3),
    ):
        way = method(name)
        assert not way.available(problem)
        trace = way.run(problem, value)
        found[name] = (np.abs(trace.q - truth).max(), trace.evaluations)
    exact, evaluations = found.pop("hybrid DOP853")
    # 480 evaluations of RK4 beside 503 of located events: 0.030 rad against 0.00028; Pinocchio 4.1.0, MuJoCo 4.0.0.
    assert evaluations < 550 and exact < 1e-3
    assert all(error > 20.0 * exact for error, _ in found.values())
    assert found["Pinocchio RK4, friction by sign"][1] == 480


def test_methods_that_do_not_say_how_they_take_friction_are_left_out() -> None:
    rough, smooth = (
        Problem(d, d.scene(s)) for s in ("fig4", "fig7") for d in [ml.load("impulse_transmission").for_scene(s)]
    )
    for m in (m for m in METHODS if m.engine == "pinocchio"):
        assert bool(m.available(rough)) != bool(m.friction) and (not m.friction or m.available(smooth))


def test_mujoco_is_within_its_stated_error() -> None:
    run = ml.simulate("impulse_transmission", scene="fig4", duration=0.3, engine="mujoco")
    off = abs(run.channel("beta")[-1] + 0.069692731)  # specification A6
    assert run.settings.preset == "stiff" and 0.01 < off < run.health.finding("step_error").value


@pytest.mark.parametrize("engine", ["mujoco", "hybrid"])
def test_a_static_motor_is_said(engine) -> None:
    run = ml.simulate("impulse_transmission", scene="fig7", duration=0.01, tau=1e-6, engine=engine)
    finding = run.health.finding("static_motor")
    rate = run.channel("alpha_rate")
    assert finding.severity == "warning" and math.isclose(
        finding.value, 1e-6 * np.max(np.abs(rate - rate[0])), rel_tol=1e-9
    )
    coarse = ml.simulate("impulse_transmission", scene="fig7", duration=0.01, tau=5e-4, timestep=1e-3, engine="mujoco")
    rate = coarse.channel("alpha_rate")
    assert math.isclose(
        coarse.health.finding("static_motor").value, 5e-4 * np.max(np.abs(rate - rate[0])), rel_tol=1e-9
    )


def test_a_portrait_with_friction_says_how_far_it_is_off() -> None:
    found = ml.portrait("impulse_transmission", "phase", beta_0=[-0.2, 0.2], beta_rate_0=[-20.0, 20.0], duration=0.1)
    assert "off from exact friction" in found.portrait.notes[0]
    p = Parameters(beta_0=-0.2, beta_rate_0=-20.0)
    exact = simulate(p, np.array([0.0, 0.1]))[0][-1]
    ends = [found.portrait.arrays[name][0, -1] for name in ("beta", "beta_rate")]
    # The note of the same computation gives 0.02 rad and 1 rad/s for 0.5 s.
    assert np.allclose(ends, exact[[1, 3]], atol=[0.02, 1.0])
