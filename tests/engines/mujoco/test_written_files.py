"""What `generate` writes runs in plain MuJoCo: each file is stepped here by mj_step alone, as somebody else would."""

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab import api, catalog
from mechlab.cli import main
from mechlab.engines.mujoco.model_file import written as file_trial
from mechlab.experiment.scene import Settings
from mechlab.formats import to_json, to_mjcf
from mechlab.mechanism import Builder, Mechanism, revolute

MODELS = Path(__file__).parents[3] / "models"


def palletizer(stiffness: float = 2000.0, damping: float = 100.0) -> Mechanism:
    """An arm of two light links whose hand stays level, and stiff servos."""
    b = Builder("palletizer")
    b.bar("upper", revolute("shoulder", "y", zero=-1.0), 0.4, mass=0.1)
    b.bar("fore", revolute("elbow", "y", zero=1.3), 0.35, parent="upper", at=(0.4, 0.0, 0.0), mass=0.1)
    b.bar("hand", revolute("wrist", "y", zero=-0.3), 0.1, parent="fore", at=(0.35, 0.0, 0.0), mass=0.2)
    b.relation("level", wrist=1, elbow=1, shoulder=1)
    b.drive("shoulder", stiffness=stiffness, damping=damping)
    b.drive("elbow", stiffness=stiffness, damping=damping)
    return b.build()


MOST_STEPS = 5_000
"""Andrews' mechanism moves in milliseconds and is stepped as finely."""


def plain_run(model: mujoco.MjModel, seconds: float = 1.0, look: int = 1) -> tuple[float, float]:
    """The time that plain steps from the keyframe reach before a bad state, and the largest acceleration until then, of every `look`
    steps. Bad states are not missed in between: MuJoCo counts them, and a number that is not finite stays."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    counts = data.warning.number  # of each kind
    fastest, left = 0.0, round(seconds / model.opt.timestep)
    mujoco.set_mju_user_warning(lambda message: None)  # warnings are counted in the data
    try:
        while left > 0:
            mujoco.mj_step(model, data, min(look, left))
            left -= look
            here = float(np.max(np.abs(data.qacc), initial=0.0))
            if counts.any() or not np.isfinite(here):
                return float(data.time), np.inf
            fastest = max(fastest, here)
    finally:
        mujoco.set_mju_user_warning(None)
    return float(data.time), fastest


def test_a_servo_too_stiff_for_the_timestep_gets_another_one_and_that_is_said(tmp_path: Path) -> None:
    m = palletizer()
    asked, _ = plain_run(mujoco.MjModel.from_xml_string(to_mjcf(m, Settings())))
    assert asked < 0.1  # the settings of every other file blow this one up
    made = api.generate(m, out=tmp_path)
    reached, fastest = plain_run(mujoco.MjModel.from_xml_path(str(made.files["mjcf"])))
    # the servos hold the weight to 1e-3 rad: nothing accelerates faster than the weight alone would, g / l = 50 rad/s2
    assert reached > 0.99 and fastest < 50.0
    assert made.exit_code == 0 and len(made.warnings) == 1
    model = mujoco.MjModel.from_xml_path(str(made.files["mjcf"]))
    assert f'timestep="{model.opt.timestep:.6g}"' in made.warnings[0] and "too stiff" in made.warnings[0]
    assert mujoco.MjModel.from_xml_path(str(made.files["scene"])).opt.timestep == model.opt.timestep


def test_a_smaller_timestep_is_preferred_to_the_implicit_integrator() -> None:
    """RK4 takes a damper of rate d / m up to 2.785 / h: this one needs about a quarter of a millisecond."""
    b = Builder("damped")
    b.bar("arm", revolute("hinge", "y"), 0.3, mass=1.0).drive("hinge", stiffness=1.0, damping=0.03 * 8000.0)
    trial = file_trial.try_file(b.build())
    assert trial.settings.integrator == "RK4" and trial.settings.timestep == pytest.approx(1e-3 / 4)


@pytest.mark.parametrize("name", ["fourbar", "planetary_stage", "pendulum"])
def test_a_file_that_runs_is_left_as_it_is(name: str, tmp_path: Path) -> None:
    made = api.generate(name, out=tmp_path)
    assert not made.warnings and "came through" in made.sentence
    model = mujoco.MjModel.from_xml_path(str(made.files["mjcf"]))
    assert model.opt.timestep == ml.load(name).file_settings.timestep


def test_where_nothing_helps_the_file_is_written_and_not_trusted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(file_trial, "SMALLER", (2,))
    monkeypatch.setattr(file_trial, "IMPLICIT", ())
    (tmp_path / "p.json").write_text(to_json(palletizer()))
    assert main(["generate", str(tmp_path / "p.json"), "-o", str(tmp_path / "out"), "--json"]) == 3
    document = json.loads(capsys.readouterr().out)
    assert document["exit_code"] == 3 and (tmp_path / "out" / "palletizer.xml").is_file()
    assert "do not run the file as it is" in document["warnings"][0] and "timestep=" in document["warnings"][0]
    assert "does not come through" in document["message"]


def test_saving_from_python_warns(tmp_path: Path) -> None:
    file = tmp_path / "arm.py"
    file.write_text(
        "from mechlab.mechanism import Builder, revolute\n"
        "def arm(damping=100.0):\n    b = Builder('arm')\n    b.bar('bar', revolute('hinge', 'y'), 0.4, mass=0.1)\n"
        "    b.drive('hinge', stiffness=2000.0, damping=damping)\n    return b.build()\n"
    )
    with pytest.warns(UserWarning, match="too stiff"):
        ml.load(f"{file}:arm").save(tmp_path / "out")


@pytest.mark.machine
@pytest.mark.parametrize("name", catalog.NAMES)
def test_the_files_of_the_catalog_run_in_plain_mujoco(name: str) -> None:
    model = mujoco.MjModel.from_xml_path(str(MODELS / name / f"{name}.xml"))
    seconds = min(1.0, MOST_STEPS * model.opt.timestep)
    reached, fastest = plain_run(model, seconds, look=50)
    assert reached > 0.99 * seconds and np.isfinite(fastest)
