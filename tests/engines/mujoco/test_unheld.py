"""Files that MuJoCo runs and no Mechanism holds: they are simulated, stepped, viewed and diagnosed as they are; all else says why not."""

import json
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.api.finding import read_file
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.formats import load_recording
from mechlab.mechanism.parts import MAX_BODIES

pytestmark = pytest.mark.filterwarnings("ignore::mechlab.errors.LeftOutWarning")
TORN = """<mujoco model="torn"><option timestep="0.001"/>
  <worldbody>
    <body name="a"><joint name="ja" axis="0 1 0" damping=".01"/><geom type="capsule" fromto="0 0 0 .1 0 0" size=".01"/>
      <site name="tip" pos=".1 0 0"/></body>
    <body name="b" pos="2 0 0"><joint name="jb" axis="0 1 0" damping=".01"/><geom type="capsule" fromto="0 0 0 .1 0 0" size=".01"/>
      <site name="end" pos=".1 0 0"/></body>
  </worldbody>
  <equality><connect name="reach" site1="tip" site2="end" solref=".2 1"/></equality>
  <actuator><motor name="push" joint="ja" ctrlrange="-1 1"/></actuator>
</mujoco>"""
"""A loop over 2 m that bars of 0.1 m cannot close; MuJoCo's soft row pulls at both."""
SOFT = """<mujoco model="soft"><option timestep="0.002"/>
  <worldbody><geom name="floor" type="plane" size="0 0 .1"/>
    <flexcomp name="jelly" type="grid" count="8 8 8" spacing=".1 .1 .1" pos="0 0 1" radius=".01" dim="3" mass="5">
      <contact selfcollide="none"/><edge damping="10"/></flexcomp></worldbody>
</mujoco>"""
"""A block that falls freely: 512 bodies, each on three slides."""
FILES = {"torn": (TORN, "reach.* stays open"), "soft": (SOFT, f"more than {MAX_BODIES} bodies")}


def written(folder: Path, text: str) -> Path:
    path = folder / "model.xml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("name", FILES)
def test_the_run_is_that_of_mj_step_and_says_why_there_is_no_mechanism(name: str, tmp_path: Path) -> None:
    text, reason = FILES[name]
    path = written(tmp_path, text)
    with pytest.warns(UserWarning, match=f"no Mechanism holds this file.*{reason}"):
        run = ml.simulate(path, duration=0.1)
    assert (run.settings.engine, run.scene) == ("file", "as-is")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(0.1 / model.opt.timestep))
    assert np.array_equal(run.v[-1], data.qvel) and np.abs(data.qvel).max() > 0.1
    file = read_file(path)
    for k in range(model.njnt):
        (joint,) = file.joints[mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, k) or f"#{k}"]
        assert run[joint][-1] == pytest.approx(data.qpos[k] - model.qpos0[k], abs=1e-12)


def test_a_session_steps_it_from_initial_values(tmp_path: Path) -> None:
    """Nothing is closed: the other joint stays where the file has it."""
    model = mujoco.MjModel.from_xml_string(TORN)
    data = mujoco.MjData(model)
    data.qpos[0], data.ctrl[0] = 0.3, 0.7
    with ml.session(written(tmp_path, TORN), observe=["ja", "jb", "tip"], start=lambda rng: {"ja_0": 0.3}) as s:
        assert s.observation[:2].tolist() == [0.3, 0.0]
        for _ in range(20):
            seen = s.step([0.7])
            mujoco.mj_step(model, data, nstep=s.substeps)
        mujoco.mj_kinematics(model, data)
        assert np.array_equal(seen[:2], data.qpos) and seen[2:] == pytest.approx(data.site("tip").xpos, abs=1e-12)
        assert s.recording()["ja"][-1] == pytest.approx(data.qpos[0], abs=1e-12)
        with pytest.warns(UserWarning, match="at reach"):
            s.close()


def test_it_is_recorded_viewed_and_diagnosed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, TORN)
    main(["simulate", str(path), "--duration", "0.05", "-o", str(tmp_path / "run.npz"), "--json"])
    told = json.loads(capsys.readouterr().out)
    assert "no Mechanism holds this file" in told["reading"][0] and told["engine"] == "file"
    assert load_recording(tmp_path / "run.npz").scene == "as-is"
    for option in ("html", "png"):
        ml.view(path, **{option: tmp_path / f"it.{option}"})  # type: ignore[arg-type]
        assert (tmp_path / f"it.{option}").stat().st_size > 1000
    found = ml.doctor(path)
    assert found.file is None and found.run is not None and "cannot hold this file as a Mechanism" in found.notes[0]


def test_its_actuators_and_joints_take_commands_and_laws(tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_string(TORN)
    data = mujoco.MjData(model)
    data.ctrl[0], data.qfrc_applied[1] = 0.4, -0.2
    mujoco.mj_step(model, data, nstep=100)
    run = ml.simulate(written(tmp_path, TORN), drives={"push": 0.4}, laws=[ml.Constant("jb", -0.2)], duration=0.1)
    assert run.v[-1] == pytest.approx(data.qvel, abs=1e-12)


def verbs() -> dict[str, Callable[[Path], object]]:
    return {
        "solve": lambda p: ml.solve(p, ja=1), "cycle": ml.cycle, "modes": ml.modes, "load": lambda p: ml.load(p).mechanism(),
        "generate": lambda p: ml.generate(p, out=p.parent / "out"), "check": ml.check, "edit": ml.edit,
        "engine": lambda p: ml.simulate(p, engine="mujoco"), "session": lambda p: ml.session(p, engine="mujoco"),
    }  # fmt: skip


@pytest.mark.parametrize("verb", verbs())
def test_what_needs_a_mechanism_says_why_there_is_none(verb: str, tmp_path: Path) -> None:
    with pytest.raises(MechlabError, match="no Mechanism holds this file, which this needs.*reach.* stays open"):
        verbs()[verb](written(tmp_path, TORN))


@pytest.mark.parametrize("verb", ["show", "solve", "check"])
def test_the_exit_code_is_1(verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([verb, str(written(tmp_path, TORN))]) == 1
    assert "no Mechanism holds this file" in capsys.readouterr().err
