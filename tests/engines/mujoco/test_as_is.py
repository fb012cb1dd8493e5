"""Files of strangers run as they are: equal to a plain loop of mj_step on the same file, with what their health must say."""

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording
from mechlab.formats import load_recording

pytestmark = pytest.mark.filterwarnings("ignore::mechlab.experiment.model_file.LeftOutWarning")
BALL = """<mujoco model="ball"><option timestep="0.001"/>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 .1" rgba=".4 .5 .4 1"/>
    <body name="ball" pos="0 0 .5"><joint name="fall" type="slide" axis="0 0 1" damping=".01"/>
      <geom type="sphere" size=".1" mass="2" solref="-20000 -20"/><site name="top" pos="0 0 .1"/></body>
  </worldbody>
</mujoco>"""
PENDULUM = """<mujoco model="servo"><option timestep="0.002" integrator="RK4"/>
  <worldbody><body><joint name="swing" axis="0 1 0" damping=".1"/>
    <geom type="capsule" fromto="0 0 0 0 0 -.5" size=".02" mass="1" contype="0" conaffinity="0"/></body></worldbody>
  <actuator><position name="servo" joint="swing" kp="30" gear="2"/></actuator>
  <keyframe><key name="up" qpos="1.5" qvel="-2" ctrl=".4"/></keyframe>
</mujoco>"""
LOOP = """<mujoco model="bars"><option timestep="0.001" integrator="implicitfast"/>
  <default><geom type="capsule" size=".01" contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="crank"><joint name="turn" axis="0 1 0"/><geom fromto="0 0 0 0 0 .1" mass=".1"/>
      <body name="rod" pos="0 0 .1"><joint name="knee" axis="0 1 0"/><geom fromto="0 0 0 .3 0 .1" mass=".3"/>
        <site name="end" pos=".3 0 .1"/></body></body>
    <body name="rocker" pos=".3 0 0"><joint name="sway" axis="0 1 0"/><geom fromto="0 0 0 0 0 .2" mass=".2"/>
      <site name="pin" pos="0 0 .2"/></body>
  </worldbody>
  <equality><connect name="close" site1="end" site2="pin"/></equality>
</mujoco>"""
FREE = """<mujoco model="top"><option timestep="0.001" gravity="0 0 -1"/>
  <worldbody>
    <body name="block" pos=".1 .2 3" euler="20 30 40"><freejoint name="free"/>
      <geom type="box" size=".1 .2 .3" mass="3"/><site name="corner" pos=".1 .2 .3"/>
      <body name="arm" pos="0 0 .3" euler="0 25 0"><joint name="wrist" type="ball"/>
        <geom type="box" pos="0 0 .2" size=".02 .03 .2" mass="1"/><site name="tip" pos="0 .1 .4"/></body></body>
  </worldbody>
  <keyframe><key qpos="0 0 3 .5 .5 .5 .5 .8 .6 0 0" qvel=".3 0 .2 1 2 3 -1 4 2"/></keyframe>
</mujoco>"""
FILES = {"ball": BALL, "servo": PENDULUM, "bars": LOOP, "top": FREE}
SITES = {"ball": "top", "bars": "end", "top": "tip"}


def written(folder: Path, text: str, name: str = "model") -> Path:
    path = folder / f"{name}.xml"
    path.write_text(text)
    return path


def plain(text: str, times: np.ndarray) -> list[tuple[mujoco.MjModel, mujoco.MjData]]:
    """Copies of the data of a plain loop at times that are whole steps, evaluated there."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    out, done = [], 0
    for step in np.rint(times / model.opt.timestep).astype(int).tolist():
        while done < step:
            mujoco.mj_step(model, data)
            done += 1
        seen = mujoco.MjData(model)
        seen.qpos[:], seen.qvel[:], seen.ctrl[:], seen.act[:] = data.qpos, data.qvel, data.ctrl, data.act
        seen.qacc_warmstart[:] = data.qacc_warmstart
        mujoco.mj_forward(model, seen)
        out.append((model, seen))
    return out


def run(folder: Path, name: str, **options: object) -> Recording:
    return ml.simulate(written(folder, FILES[name], name), duration=0.6, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", FILES)
def test_the_motion_is_that_of_mj_step_on_the_file(name: str, tmp_path: Path) -> None:
    """Rates are the same numbers, points of the bodies those that the engine has; sampling changes nothing."""
    made = run(tmp_path, name)
    assert made.settings.engine == "file" and made.scene == "as-is"
    for k, (_, data) in enumerate(plain(FILES[name], made.t)):
        assert np.max(np.abs(made.v[k] - data.qvel)) <= 1e-12
        if name in SITES:
            place = [made[f"{SITES[name]}_{axis}"][k] for axis in "xyz"]
            assert np.max(np.abs(data.site(SITES[name]).xpos - place)) < 1e-12


def test_a_ball_bounces_and_comes_to_rest_on_its_floor(tmp_path: Path) -> None:
    made = ml.simulate(written(tmp_path, BALL), duration=6.0)
    weight = 2 * 9.81
    assert np.min(made["top_z"]) > 0.15
    assert made["ball_contact_z"][-1] == pytest.approx(weight, rel=1e-3)
    assert made["ground_contact_z"] == pytest.approx(-made["ball_contact_z"])
    assert made["ball_contact_z"][0] == 0.0
    balance = made.health.finding("energy_balance")
    assert balance.severity != "error" and balance.value < 0.02
    assert "contacts of 2 geoms" in made.acts


def test_an_actuator_stands_at_the_control_of_the_keyframe(tmp_path: Path) -> None:
    """kp (ctrl - gear q) gear, and the words say where it starts."""
    made = run(tmp_path, "servo")
    assert (made["swing"][0], made["swing_rate"][0]) == (1.5, -2.0)
    assert made["swing_force"] == pytest.approx(2 * 30 * (0.4 - 2 * made["swing"]), abs=1e-12)
    assert "starts at the keyframe up" in made.acts and "controls of the keyframe" in made.acts
    assert made.health.trusted


def test_soft_loops_are_measured(tmp_path: Path) -> None:
    """The gap of the default softness, against the distance of the two sites in the plain loop."""
    made = run(tmp_path, "bars")
    gaps = [np.linalg.norm(d.site("end").xpos - d.site("pin").xpos) for _, d in plain(LOOP, made.t)]
    found = made.health.finding("loop_gap")
    assert max(gaps) / math.sqrt(3.0) <= found.value <= max(gaps)
    assert found.value > 1e-4 and "close" in found.sentence


def test_initial_values_and_loads_act_in_addition(tmp_path: Path) -> None:
    """Without contact: a fall with damping c from the given state under the given load, by its closed form."""
    made = ml.simulate(written(tmp_path, BALL), duration=0.2, fall_0=2.0, fall_rate_0=1.0, fall_force=5.0)
    m, c, t = 2.0, 0.01, 0.2
    end = (5.0 - m * 9.81) / c
    # semi-implicit Euler at 1 ms: its error is h a t / 2 = 7e-4 m
    assert made["fall"][-1] == pytest.approx(2.0 + end * t + (1.0 - end) * m / c * (1 - math.exp(-c * t / m)), abs=1e-3)
    assert made["fall_force"][-1] == 5.0


def test_laws_from_python_act_in_addition(tmp_path: Path) -> None:
    """A load of exactly the weight, as a function: the ball stays where it is, to rounding."""
    made = ml.simulate(
        written(tmp_path, BALL), scene="as-is", duration=0.3, laws={"fall": lambda t, plant: 2.0 * 9.81 - plant.value("fall")}
    )
    assert np.max(np.abs(made["fall"])) < 1e-12


def test_our_own_model_is_run_on_request(tmp_path: Path) -> None:
    """Without contacts the ball falls through the floor, as a mechanism does."""
    path = written(tmp_path, BALL)
    made = ml.simulate(path, duration=1.0, engine="mujoco")
    assert made["top_z"][-1] < -3.0 and made.settings.engine == "mujoco"
    with pytest.raises(MechlabError, match="as-is is run by the engine 'file' alone"):
        ml.simulate(path, scene="as-is", engine="mujoco")
    with pytest.raises(MechlabError, match="this is none"):
        ml.simulate("fourbar", engine="file")


STIFF = """<mujoco><option timestep="0.01"/><worldbody><body><joint name="x" type="slide" stiffness="1e5" ref="0" springref=".1"/>
  <geom size=".1" mass="1"/></body></worldbody></mujoco>"""


def test_a_run_that_blows_up_ends_and_says_when(tmp_path: Path) -> None:
    """A spring of 316 rad/s at 10 ms: the explicit step is unstable (h w > 2); MuJoCo would start anew without a word."""
    made = ml.simulate(written(tmp_path, STIFF), duration=1.0)
    assert made.exit_code == 3 and made.t[-1] < 0.2
    assert "blew up" in made.health.finding("blow_up").sentence


def test_energy_that_the_steps_made_is_an_error(tmp_path: Path) -> None:
    """A pendulum of small steps is accounted for; an orbit of coarse steps is not."""
    good = run(tmp_path, "servo").health.finding("energy_balance")
    assert good.severity == "ok" and good.value < 1e-3
    coarse = STIFF.replace("1e5", "39000").replace("0.01", "0.0101")
    found = ml.simulate(written(tmp_path, coarse), duration=0.5).health
    assert found.finding("energy_balance").severity == "error" and not found.trusted


def test_the_error_of_the_timestep_is_stated(tmp_path: Path) -> None:
    """Against the same file at a hundredth of its timestep: the stated errors are no smaller than the true ones."""
    made = ml.simulate(written(tmp_path, LOOP), duration=0.2)
    fine = ml.simulate(written(tmp_path, LOOP), duration=0.2, timestep=1e-5, at=made.t.tolist())
    for name in ("turn", "knee", "sway_rate", "end_x"):
        true = max(abs(made[name][k] - fine.at(name, t)) for k, t in enumerate(made.t))
        assert true <= made.errors[name] < 30.0 * true


def test_times_are_met_exactly(tmp_path: Path) -> None:
    """Also between steps, by the cubic through the steps around them, and at an end that is no whole number of steps."""
    made = ml.simulate(written(tmp_path, PENDULUM), duration=0.1015, at=(0.05, 0.0633))
    assert made.t[-1] == 0.1015 and 0.05 in made.t
    fine = ml.simulate(written(tmp_path, PENDULUM), duration=0.1015, at=(0.0633,), timestep=1e-4)
    # of the cubic: 3/128 (h w)^4 x with h = 2 ms, w = 40 rad/s, x = 1.5 rad
    assert made.samples()[1]["swing"] == pytest.approx(fine.at("swing", 0.0633), abs=2e-6)


def test_files_that_mechlab_wrote_run_as_before(tmp_path: Path) -> None:
    ml.load("fourbar").save(tmp_path)
    made = ml.simulate(tmp_path / "fourbar.xml", duration=0.05)
    assert made.settings.engine == "mujoco" and made.scene == "hold"


def test_a_recording_of_a_file_is_saved_and_read(tmp_path: Path) -> None:
    made = run(tmp_path, "ball", out=tmp_path / "run.npz")
    again = load_recording(tmp_path / "run.npz")
    assert again.settings == made.settings and again.acts == made.acts and np.array_equal(again.q, made.q)
    assert ml.view(tmp_path / "run.npz", html=tmp_path / "run.html").exit_code in (0, 3)
