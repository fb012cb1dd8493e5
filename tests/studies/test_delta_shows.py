"""What the delta must show, through the public API and the command line. MuJoCo 4.0.0, Pinocchio 4.1.0."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab import api
from mechlab.analytic import delta6 as closed_form
from mechlab.cli import main

POSE = {"x": 0.05, "y": 0.0, "z": 0.0, "alpha": 0.1, "beta": -0.2, "gamma": 0.3}


def test_three_witnesses_agree_on_the_drives() -> None:
    answers = ml.solve("delta6", **POSE)
    assert set(answers.answers) == {"analytic", "pinocchio", "mujoco"}
    for witness in answers.answers:
        assert set(answers[witness]) == {"q1", "q2", "q3", "phi1", "phi2", "phi3"}
    assert answers.max_difference < 1e-9
    assert answers.exit_code == 0


def test_forward_is_the_inverse_of_inverse_in_every_witness() -> None:
    drives = ml.solve("delta6", **POSE)["analytic"]
    back = ml.solve("delta6", **drives)
    for witness in ("analytic", "pinocchio", "mujoco"):
        for key, value in POSE.items():
            assert math.isclose(back[witness][key], value, abs_tol=1e-9)


def test_rates_are_the_derivative_of_positions() -> None:
    drives = ml.solve("delta6", **POSE)["analytic"]
    rates = {"q1_rate": 0.1, "q2_rate": -0.2, "q3_rate": 0.05, "phi1_rate": 0.4, "phi2_rate": -0.3, "phi3_rate": 0.2}
    answer = ml.solve("delta6", **drives, **rates)
    assert answer.max_difference < 1e-9
    h = 1e-6
    moved = [
        ml.solve("delta6", **{k: v + s * h * rates[f"{k}_rate"] for k, v in drives.items()})["analytic"]
        for s in (1, -1)
    ]
    for a in "xyz":
        # Central difference of step 1e-6: rounding 1e-16 / 1e-6.
        assert math.isclose((moved[0][a] - moved[1][a]) / (2 * h), answer["pinocchio"][f"{a}_rate"], abs_tol=1e-8)
    turned = [closed_form.rotation_matrix(m["alpha"], m["beta"], m["gamma"]) for m in moved]
    spin = (turned[0] - turned[1]) @ turned[1].T / (2 * h)
    for k, (i, j) in enumerate(((2, 1), (0, 2), (1, 0))):
        assert math.isclose(spin[i, j], answer["mujoco"][("wx", "wy", "wz")[k]], abs_tol=1e-5)


def test_arrays_go_in_and_come_out() -> None:
    x = np.linspace(-0.05, 0.05, 5)
    answers = ml.solve("delta6", x=x, y=0.0, z=0.0, alpha=0.0, beta=0.0, gamma=0.0)
    assert answers["analytic"]["q1"].shape == answers["pinocchio"]["q1"].shape == (5,)
    assert answers.max_difference < 1e-9


def test_out_of_reach_has_no_values_and_says_so() -> None:
    answers = ml.solve("delta6", x=0.5, y=0, z=0, alpha=0, beta=0, gamma=0)
    assert answers.exit_code == 4 and answers.status.value == "out of reach"
    assert all(not a.values for a in answers.answers.values())


def test_beta_90_is_answered_and_flagged() -> None:
    answers = ml.solve("delta6", x=0, y=0, z=0, alpha=0.2, beta=math.pi / 2, gamma=0.1)
    assert answers.exit_code == 0 and "singular" in answers.status.value
    assert answers.max_difference < 1e-9


def test_any_parameter_may_stand_among_the_keys(capsys: pytest.CaptureFixture[str]) -> None:
    words = "solve delta6 x=0.01 y=0 z=0 alpha=0 beta=.1 gamma=0 rod_length=.5 leg_azimuths=-20deg,95deg,225deg k_bevel=17/22 --json"
    assert main(words.split()) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["max_difference"] < 1e-9
    geometry = closed_form.Delta6(
        rod_length=0.5, leg_azimuths=(math.radians(-20), math.radians(95), math.radians(225)), k_bevel=17 / 22
    )
    expected = closed_form.inverse(geometry, np.array([0.01, 0.0, 0.0]), 0.0, 0.1, 0.0).require()
    assert np.allclose(
        [document["answers"]["pinocchio"][k] for k in ("q1", "q2", "q3", "phi1")], expected[:4], atol=1e-9
    )


def test_head_tracking_follows_the_error_law() -> None:
    result = api.simulate("delta6", scene="head-tracking", duration=3, at=(1, 3))
    assert result.exit_code == 0
    printed = {1: (0.006484, 0.000451, 0.039921), 3: (0.000115, 0.000008, 0.000707)}  # A9
    for sample in result.samples():
        for name, value in zip(("alpha", "beta", "gamma"), printed[round(sample["t"])], strict=True):
            assert math.isclose(sample[f"error_{name}"], value, abs_tol=1e-5)


def test_head_tracking_with_the_gains_in_the_other_order() -> None:
    swapped = api.simulate("delta6", scene="head-tracking-swapped", duration=1.0, at=(1.0,)).samples()[0]
    law = closed_form.error_response(1.0, np.array([0.05, 0.0, 0.3]), np.array([-0.4, 0.8, -0.6]), 480.0, 240.0)
    for k, name in enumerate(("alpha", "beta", "gamma")):
        assert math.isclose(swapped[f"error_{name}"], float(law.error[k]), abs_tol=1e-5)


def test_pure_rotation_moves_the_linear_forces_though_the_centre_stands() -> None:
    recording = ml.simulate("delta6", scene="pure-rotation")
    assert max(np.ptp(recording.channel(f"O_{a}")) for a in "xyz") < 1e-6
    forces = np.array([recording.channel(f"q{k}_force") for k in (1, 2, 3)])
    assert np.ptp(forces) > 0.1


def test_gravity_hold_holds() -> None:
    recording = ml.simulate("delta6", scene="gravity-hold")
    assert recording.health.trusted
    assert max(np.ptp(recording.channel(f"D_{a}")) for a in "xyz") < 1e-6


@pytest.mark.parametrize("fidelity", ["minimal", "parts", "full"])
def test_files_are_reloaded_and_the_same_every_time(fidelity: str, tmp_path: Path) -> None:
    first = ml.generate("delta6", {}, tmp_path / "a", fidelity)
    ml.generate("delta6", {}, tmp_path / "b", fidelity)
    names = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*") if p.is_file())
    assert names == sorted(p.relative_to(tmp_path / "b") for p in (tmp_path / "b").rglob("*") if p.is_file())
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    assert {"delta6.xml", "scene.xml", "delta6.urdf", "delta6.json"} <= {str(n) for n in names}
    assert ml.find(str(first.files["json"])).build(None, "full") == ml.load("delta6").mechanism(fidelity)


def test_home_keyframe_holds_against_gravity_in_plain_mujoco(tmp_path: Path) -> None:
    import mujoco

    ml.generate("delta6", {}, tmp_path, "full")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    start = data.qpos.copy()
    mujoco.mj_step(model, data, nstep=500)
    # Softness of the loops lets the platform settle by less than 0.1 mm; a wrong control signal would drop it by cm.
    drives = [int(model.joint(n).qposadr[0]) for n in ("q1", "q2", "q3", "phi1", "phi2", "phi3")]
    assert np.abs(data.qpos[drives] - start[drives]).max() < 1e-4
    for k in range(model.nu):
        data.ctrl[k] += 0.02 if k < 3 else 0.2
        mujoco.mj_step(model, data, nstep=1000)
    moved = data.qpos[drives] - start[drives]
    assert np.all(moved[:3] > 0.015) and np.all(moved[3:] > 0.15)


def test_a_run_that_blows_up_says_when_and_why() -> None:
    result = api.simulate("delta6", scene="gravity-hold", timestep=0.02, duration=0.5)
    assert result.exit_code == 3
    assert result.recording.t[-1] < 0.5
    assert any(c.isdigit() for c in result.message)


def test_run_makes_everything(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "delta6", "-o", str(tmp_path / "out")]) == 0
    text = capsys.readouterr().out
    for name in ("delta6.xml", "scene.xml", "delta6.urdf", "delta6.json", "run.npz", "delta6.html"):
        assert (tmp_path / "out" / name).is_file() and name in text
    again = ml.load_recording(tmp_path / "out" / "run.npz")
    assert again.health.trusted and again.channel("D_x").shape == again.t.shape


@pytest.mark.parametrize(
    ("words", "culprit"),
    [
        ("show delta6 rod_length=-1", "rod_length"),
        ("show delta6 rod_length=nan", "rod_length"),
        ("solve delta6 x=abc", "x"),
        ("show delta6 rodlength=1", "rod_length"),
        ("show delta7", "delta6"),
        ("show delta6 rod_length=37deg", "expected a number [m], got 37deg"),
        ("simulate delta6 --scene nope", "pose-sweep"),
        ("simulate delta6 --engine bullet", "mujoco"),
        ("generate delta6 --fidelity kinematic -o X", "minimal"),
        ("simulate delta6 q1_0=9", "q1"),
    ],
)
def test_wrong_input_is_one_message_that_names_the_culprit(
    words: str, culprit: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code = main(words.split())
    error = capsys.readouterr().err
    assert code in (1, 4) and culprit in error and "Traceback" not in error
    assert len(error.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_an_unwritable_folder_is_told(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    assert main(["generate", "fourbar", "-o", str(tmp_path / "file" / "x")]) == 1
    assert "cannot write" in capsys.readouterr().err


def test_a_sidecar_with_a_cycle_is_told(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    ml.generate("fourbar", {}, tmp_path)
    path = tmp_path / "fourbar.json"
    path.write_text(path.read_text().replace('"parent": "ground"', '"parent": "coupler"', 1))
    assert main(["show", str(path)]) == 1
    assert "cycle" in capsys.readouterr().err
