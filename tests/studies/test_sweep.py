"""Sweeps: numbers against the engines and closed forms called directly, gaps, and what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

import mechlab as ml
from mechlab.analytic import gear_linkage
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.studies.sweep.evaluate import evaluate
from mechlab.values import Range
from tests.studies.swinging import same

FIXED = {"z": 0.0, "alpha": 0.0, "beta": 0.0, "gamma": 0.0}


# -- answers ----------------------------------------------------------------------------------------------------------------


def test_the_closed_form_of_a_sweep_is_that_of_solve_with_gaps_where_it_has_none() -> None:
    found = ml.sweep("delta6", x=Range(-0.1, 0.1, 9), y=[-0.1, 0.03, 0.1], **FIXED)
    assert found.request.method == "closed form" and found.exit_code == 0
    design = ml.load("delta6")
    witness = next(q for q in design.entry.questions if "x" in q.given).witnesses["analytic"]
    for i, x in enumerate(found.dataset["x"].values):
        for j, y in enumerate((-0.1, 0.03, 0.1)):
            said = witness(design.parameters, FIXED | {"x": x, "y": y})
            assert (found.outcome[i, j] == 0) == bool(said.values) and (found.reason[i, j] == "") == bool(said.values)
            if said.values:  # arrays and numbers may round differently in the last place
                assert found["q2"][i, j] == pytest.approx(float(said.values["q2"]), rel=1e-14)
            else:
                assert np.isnan(found["q2"][i, j]) and "out of reach" in found.reason[i, j]
    assert 0 < found.counts["no_solution"] < 27


def test_parameters_and_given_quantities_sweep_together_in_the_users_order() -> None:
    crank, angle = np.linspace(0.02, 0.04, 3), np.linspace(0.0, 6.0, 7)
    found = ml.sweep("gear_linkage", {"crank_angle": angle, "crank": crank}, "output_rate, output_angle")
    assert found["output_rate"].shape == (7, 3) and [q.unit for q in found.request.quantities] == ["rad/s", "rad"]
    for k, length in enumerate(crank):
        truth = gear_linkage.motion(ml.load("gear_linkage", crank=length).parameters.linkage, angle, 1.0, 0.0)
        assert np.allclose(found["output_rate"][:, k], truth.output_rate, rtol=1e-14)


def test_engines_answer_point_by_point_and_differ_from_the_closed_form_by_rounding() -> None:
    values = {"crank": [0.08, 0.1], "crank_angle": [0.5, 2.5]}
    engine = ml.sweep("fourbar", values, "coupler_angle", witness="pinocchio")
    closed = ml.sweep("fourbar", values, "coupler_angle,max_difference")
    assert (engine.request.method, closed.request.method) == ("answers", "answers")
    assert np.allclose(engine["coupler_angle"], closed["coupler_angle"], atol=1e-10)
    assert np.nanmax(closed["max_difference"]) < 1e-9


def test_no_solution_anywhere_is_a_result_with_exit_code_4(capsys: pytest.CaptureFixture[str]) -> None:
    words = "sweep delta6 x=5:6:3 y=0 z=0 alpha=0 beta=0 gamma=0 --json"
    assert main(words.split()) == 4
    document = json.loads(capsys.readouterr().out)
    assert document["counts"]["no_solution"] == 3 and document["data"]["q1"] == [None] * 3
    assert all("out of reach" in x for x in document["data"]["reason"])


def test_values_out_of_range_are_gaps_unless_all_are(swing: str) -> None:
    found = ml.sweep("fourbar", crank=[-0.1, 0.1], crank_angle=0.5, quantities="coupler_angle")
    assert found.outcome.tolist() == [1, 0] and "must be > 0" in found.reason[0] and found.exit_code == 0
    with pytest.raises(MechlabError, match="must be > 0"):
        ml.sweep("fourbar", crank=[-0.1, -0.2], crank_angle=0.5)
    mixed = ml.sweep(swing, length=[-1.0, 1.0], hinge_0=0.2, duration=0.01)
    assert mixed.outcome.tolist() == [1, 0] and "line 7" in mixed.reason[0]


# -- simulations ------------------------------------------------------------------------------------------------------------


def test_a_rollout_has_the_bits_of_single_runs_whatever_the_threads(swing: str) -> None:
    angles = np.linspace(-1.0, 1.0, 16)
    asked = "hinge,hinge_rate,rms(hinge),energy_balance"
    found = ml.sweep(swing, {"length": [0.7, 1.0], "hinge_0": angles, "hinge_force": 0.3}, asked, duration=0.2)
    assert found.request.method == "rollout" and found.exit_code == 0
    for i, length in enumerate((0.7, 1.0)):
        for k in (0, 7, 15):
            run = ml.simulate(swing, length=length, hinge_0=angles[k], hinge_force=0.3, duration=0.2, engine="mujoco")
            assert (
                found["hinge"][i, k] == run.final()["hinge"] and found["hinge_rate"][i, k] == run.final()["hinge_rate"]
            )
            x = run.channel("hinge")
            assert found["rms(hinge)"][i, k] == pytest.approx(np.sqrt(np.trapezoid(x * x, run.t) / 0.2), rel=1e-12)
    assert 0.0 <= found["energy_balance"].max() < 1e-6  # RK4 at 1 ms: far inside the limit
    assert same(
        found,
        replace(
            found, flat=np.concatenate([evaluate(found.request, k, 2).values for k in range(found.request.blocks)])
        ),
    )


def test_a_channel_of_the_entry_and_gears_in_a_rollout() -> None:
    rates = np.linspace(-2.0, 2.0, 17)
    found = ml.sweep("pendulum", {"angle_rate_0": rates}, ["x", "min(y)"], duration=0.3)
    assert found.request.method == "rollout"
    run = ml.simulate("pendulum", angle_rate_0=rates[3], duration=0.3, engine="mujoco")
    assert found["x"][3] == pytest.approx(run.final()["x"], abs=1e-15)
    assert found["min(y)"][3] == pytest.approx(run.channel("y").min(), abs=1e-15)


def test_a_rollout_that_loses_its_energy_is_not_to_be_trusted_and_leaves_gaps() -> None:
    # sqrt(g / L) h is 0.06 and 2: RK4 damps the second, for which it is still stable, within a few steps
    values = {"gravity": [9.81, 9810.0], "angle_0": np.linspace(-3.0, 0.0, 16)}
    found = ml.sweep("pendulum", values, "angle,trusted,energy_balance", duration=1.0, timestep=0.02)
    assert found.request.method == "rollout" and found.exit_code == 3
    bad = found.outcome == 3
    assert bad[1].all() and not bad[0].any() and np.array_equal(np.isnan(found["angle"]), bad)
    assert np.array_equal(found["trusted"], (~bad).astype(float)) and found["energy_balance"][1].min() > 1e-2
    assert all("energy" in x or "blew up" in x for x in found.reason[1])


def test_loops_and_laws_are_run_one_by_one_with_their_whole_health() -> None:
    found = ml.sweep(
        "fourbar", {"speed": [3.0, 6.0]}, "rocker_angle,max(C_z),loop_gap,trusted", scene="free-run", duration=0.1
    )
    assert found.request.method == "runs"
    run = ml.simulate("fourbar", speed=6.0, scene="free-run", duration=0.1)
    assert found["rocker_angle"][1] == run.final()["rocker_angle"] and found["max(C_z)"][1] == run.channel("C_z").max()
    assert found["loop_gap"][1] == run.health.finding("loop_gap").value and found["trusted"].tolist() == [1.0, 1.0]


@pytest.mark.parametrize(("key", "values"), [("start_speed", np.linspace(-3.0, 3.0, 17)), ("coupler_length", np.linspace(0.7, 1.3, 17))])
def test_loops_are_rolled_out_over_starts_and_over_parameters_with_the_bits_of_single_runs(key: str, values: np.ndarray) -> None:
    asked = "B0_x,trusted,loop_gap,energy_balance,y"
    found = ml.sweep("n_fourbar", {key: values}, asked, scene="fall", duration=0.5, timestep=0.0025)
    assert found.request.method == "rollout" and found.exit_code == 0 and found["trusted"].all()
    for k in (0, 5, 16):
        run = ml.simulate("n_fourbar", {key: values[k]}, scene="fall", duration=0.5, timestep=0.0025, engine="mujoco")
        assert found["B0_x"][k] == run.final()["B0_x"] and found["y"][k] == pytest.approx(run.final()["y"], abs=1e-15)
        # residuals near 1e-7 m of lengths near 1 m, by other sums: equal to rounding
        assert found["loop_gap"][k] == pytest.approx(run.health.finding("loop_gap").value, abs=1e-15)


def test_a_structure_that_varies_is_rolled_out_too() -> None:
    found = ml.sweep("n_fourbar", {"N": [1, 2, 3, 4], "start_speed": [1.0, 1.5, 2.0, 2.5]}, "B0_x", duration=0.1)
    assert found.request.method == "rollout" and found.exit_code == 0
    assert found["B0_x"][2, 3] == ml.simulate("n_fourbar", N=3, start_speed=2.5, duration=0.1, engine="mujoco").final()["B0_x"]


def test_checks_are_swept_by_their_id() -> None:
    found = ml.sweep("pendulum", {"length": [0.5, 1.5]}, "B3,passed(B3)")
    check = next(c for c in ml.load("pendulum").entry.checks if c.id == "B3")
    truth = [check.run(ml.load("pendulum", length=x).parameters).difference for x in (0.5, 1.5)]
    assert found["B3"].tolist() == truth and found["passed(B3)"].tolist() == [1.0, 1.0]


def test_the_scene_says_what_is_swept_by_default() -> None:
    found = ml.sweep("pendulum", {"length": [0.5, 1.5]}, duration=0.05)
    assert [q.label for q in found.request.quantities] == list(ml.load("pendulum").scene().channels)


# -- what is wrong ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("pendulum", "--portrait"),
        ("pendulum lenth=1:2:3", "length"),
        ("pendulum length=1:2:3 --quantity zeta", "energy_balance"),
        ("pendulum length=1:2:3 --quantity passed(Z9)", "B3"),
        ("pendulum length=1:2:3 --quantity top(x)", "rms"),
        ("pendulum length=1:2:3 angle_0=0 foo=1", "foo"),
        ("fourbar crank_angle=0:1:3 --quantity coupler", "coupler_angle"),
        ("fourbar crank_angle=0:1:3 --witness drake", "pinocchio"),
        ("fourbar crank_angle=a,b", "expected numbers"),
        ("pendulum length=1:2:3 -o out.csv", ".nc"),
        ("pendulum length=1:2:3 --plot out.csv", ".png"),
        ("pendulum length=1:2:2 mass=1:2:2 gravity=1:2:2 --plot out.png", "3"),
        ("pendulum length=1:2:3 --resume", "-o FILE.nc"),
        ("pendulum length=1:2:100000000 mass=1:2:100", "more than fit"),
        ("impulse_transmission --portrait phase --quantity x", "--quantity"),
        ("delta6 x=0:1:3 y=0 z=0 alpha=0 beta=0 gamma=0 --scheduler tcp://127.0.0.1:1", "no Dask scheduler"),
    ],
)
def test_what_is_wrong_is_named(
    words: str, said: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    if "--scheduler" in words:
        from mechlab.studies.sweep import schedulers as cluster

        monkeypatch.setattr(cluster, "CONNECT", 0.2)
    assert main(["sweep", *words.split()]) in (1, 2)
    assert said in capsys.readouterr().err


# -- options ----------------------------------------------------------------------------------------------------------------


def test_options_of_runs_are_refused_where_a_sweep_asks_or_checks(capsys: pytest.CaptureFixture[str]) -> None:
    words = "sweep fourbar crank_angle=0:1:3 --quantity rocker_angle --scene no --engine no --fidelity no --duration -5"
    assert main(words.split()) == 1
    assert "--scene, --engine, --fidelity, --duration: this is a sweep of answers" in capsys.readouterr().err
    with pytest.raises(MechlabError, match="rocker_0_rate_0 instead of rocker_0_rate"):
        ml.sweep("n_fourbar", {"rocker_0_rate": [-1.0, -2.0]}, ["B0_x"], scene="fall", duration=1.0)
    with pytest.raises(MechlabError, match="--duration, angle_0: this is a sweep of checks"):
        ml.sweep("pendulum", {"angle_0": [0.1, 0.2]}, "B3", duration=1.0)


def test_trusted_is_a_quantity_where_the_first_run_fails_too() -> None:
    found = ml.sweep("n_fourbar", {"rocker_0_rate_0": [-1.0, -2.0]}, ["trusted"], scene="fall", duration=0.05)
    assert found["trusted"][0] == 1.0 and found.outcome.tolist() == [0, 4]


@pytest.mark.parametrize("wrong", [{"timestep": float("nan")}, {"duration": float("inf")}, {"timestep": "1deg"}])
def test_times_of_a_sweep_are_refused_by_name(wrong: dict) -> None:
    with pytest.raises(MechlabError, match=f"{next(iter(wrong))}: expected a"):
        ml.sweep("fourbar", crank=[0.1, 0.11], quantities=["rocker_angle"], **({"duration": 0.01} | wrong))
