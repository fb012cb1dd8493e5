"""Files of strangers run as they are: equal to a plain loop of mj_step on the same file, with what their health must say."""

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.cli import main
from mechlab.errors import MechlabError, Untrustworthy
from mechlab.experiment.recording import Recording
from mechlab.formats import load_recording

pytestmark = pytest.mark.filterwarnings("ignore::mechlab.errors.LeftOutWarning")
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


THROWN = """<mujoco model="thrown"><option timestep="0.01" integrator="implicitfast"/>
  <default><geom type="capsule" contype="0" conaffinity="0"/><joint axis="0 1 0" damping=".1"/></default>
  <worldbody><body><joint name="shoulder"/><geom fromto="0 0 0 .4 0 0" size=".04" mass="3"/>
    <body pos=".4 0 0"><joint name="elbow" range="-60 -5"/><geom fromto="0 0 0 .35 0 0" size=".03" mass="1.5"/>
      <body pos=".35 0 0"><joint name="wrist"/><geom fromto="0 0 0 .15 0 0" size=".03" mass=".7"/></body></body></body></worldbody>
  <keyframe><key qpos=".5 .9 -.3"/></keyframe>
</mujoco>"""


def test_a_stop_that_throws_a_joint_back_is_named(tmp_path: Path) -> None:
    """The soft stop takes energy, which is in the balance: what is left falls with the timestep, which a share that was not booked
    would not."""
    path = written(tmp_path, THROWN)
    found = [ml.simulate(path, duration=0.5, timestep=h).health.finding("energy_balance") for h in (0.01, 0.0025, 0.000625)]
    assert "the stop of joint elbow throws back" in found[0].sentence and found[0].severity != "ok"
    assert found[2].severity == "ok" and "stop" not in found[2].sentence
    assert found[1].value < 0.5 * found[0].value and found[2].value < 0.5 * found[1].value
    coarse = STIFF.replace("1e5", "39000").replace("0.01", "0.0101")
    assert "stop" not in ml.simulate(written(tmp_path, coarse), duration=0.5).health.finding("energy_balance").sentence


def test_the_error_of_the_timestep_is_stated(tmp_path: Path) -> None:
    """Against the same file at a hundredth of its timestep: the stated errors are no smaller than the true ones."""
    made = ml.simulate(written(tmp_path, LOOP), duration=0.2)
    fine = ml.simulate(written(tmp_path, LOOP), duration=0.2, timestep=1e-5, at=made.t.tolist())
    for name in ("turn", "knee", "sway_rate", "end_x"):
        error = max(abs(made[name][k] - fine.at(name, t)) for k, t in enumerate(made.t))
        # stated: 2 |x(h) - x(2h/3)| / (1 - 2/3), twice the error of a method of first order and at most six times that of a higher one
        assert error <= made.errors[name] < 6.0 * error


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


WALKER = """<mujoco model="two"><option timestep="0.002" integrator="INTEGRATOR"/>
  <worldbody><geom type="plane" size="0 0 .1"/>
    <body pos="0 0 .18"><joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/>
      <geom type="box" size=".2 .1 .05" mass="2"/>
      <body name="leg"><joint name="hip" axis="0 1 0" damping=".02" armature=".01"/>
        <geom type="capsule" fromto="0 0 0 .25 0 -.1" size=".02" mass=".3"/></body></body></worldbody>
  <actuator><position name="servo" joint="hip" kp="20" gear="2" ctrlrange="-.5 .5" ctrllimited="true"/>
    <general joint="x" dyntype="filter" dynprm=".05" gainprm="3"/><motor name="lift" joint="z"/></actuator>
  <keyframe><key ctrl=".1 .2 .3" act=".4"/></keyframe>
</mujoco>"""


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicitfast", "discrete"])
def test_commands_are_the_controls_of_the_file(integrator: str, tmp_path: Path) -> None:
    """Bit by bit the plain loop that sets data.ctrl before each step: beyond the range, on a filter without a name, in contact; the
    third actuator stays at its keyframe. The last step is a shorter one."""
    text, h, last = WALKER.replace("INTEGRATOR", integrator), 0.002, 0.401 - 200 * 0.002
    swing, push = lambda t: math.sin(9.0 * t), lambda t: 2.0 if t > 0.1 else -1.0
    path = written(tmp_path, text)
    made = ml.simulate(path, scene="as-is", drives={"servo": swing, "actuator_1": push}, duration=0.401)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    wanted = {0.0: data.qvel.copy()}
    for k in range(201):
        data.ctrl[:2] = swing(k * h), push(k * h)
        model.opt.timestep = h if k < 200 else last
        mujoco.mj_step(model, data)
        wanted[0.401 if k == 200 else (k + 1) * h] = data.qvel.copy()
    assert all(np.array_equal(made.v[k], wanted[t]) for k, t in enumerate(made.t))
    clamped = np.clip([swing(t) for t in made.t], -0.5, 0.5)
    assert made["hip_force"] == pytest.approx(2 * 20 * (clamped - 2 * made["hip"]), abs=1e-9)
    assert np.any(made["ground_contact_z"] != 0.0) and "commands of servo, actuator_1" in made.acts
    # the run at two thirds of the timestep is under the commands, too: without them it is 0.4 rad off, stated as 2.4
    assert made.errors["hip"] < 0.25 * np.ptp(made["hip"])
    assert "1 other actuators at the controls of the keyframe" in made.acts
    assert "commands of" not in ml.simulate(path, duration=0.1).acts


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_the_work_of_commands_is_accounted_for(integrator: str, tmp_path: Path) -> None:
    """A force that jumps at every step on a body that moves freely: of what it does nothing is left over but the error of the step."""
    text = BALL.replace('timestep="0.001"', f'timestep="0.001" gravity="0 0 0" integrator="{integrator}"')
    text = text.replace("</worldbody>", '</worldbody><actuator><motor name="push" joint="fall"/></actuator>')
    push = {"push": lambda t: 200.0 * math.sin(900.0 * t)}
    made = ml.simulate(written(tmp_path, text), drives=push, duration=0.2)
    assert made.settings.engine == "file"  # without a name of a scene, too
    # rates are trapezoids of one force in a step, exact but for the damping: h c / m = 5e-6
    assert made.health.finding("energy_balance").value < 1e-5


def test_bad_commands_name_the_actuator(tmp_path: Path) -> None:
    path = written(tmp_path, WALKER.replace("INTEGRATOR", "Euler"))
    for drives, words in (
        ({"servos": 1.0}, "Did you mean 'servo'"),
        ({"servo": "20 deg"}, "'servo': expected a number, in the units of the file's control"),
        ({"servo": lambda t: math.nan if t > 0.05 else 0.0}, "actuator 'servo' at t = 0.052 s: expected a finite number"),
    ):
        with pytest.raises(MechlabError, match=words):
            ml.simulate(path, scene="as-is", drives=drives, duration=0.1)  # type: ignore[arg-type]
    with pytest.raises(MechlabError, match="this scene has no file"):
        ml.Scene(controls={"servo": ml.Hold(1.0)})


def test_a_memory_that_a_step_fills_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Boxes that overlap and fall need more than the file's memory: the run and the diagnosis each end in one message."""
    boxes = "".join(
        f'<body name="b{k}" pos="{0.15 * k} 0 .5"><freejoint/><geom type="box" size=".1 .1 .1" mass="1"/></body>' for k in range(12)
    )
    text = f'<mujoco><size memory="20K"/><worldbody><geom type="plane" size="9 9 .1"/>{boxes}</worldbody></mujoco>'
    path = written(tmp_path, text)
    with pytest.raises(MechlabError, match=r"model.xml: MuJoCo gave up after t = 0\.\d+ s .* Raise memory") as caught:
        ml.simulate(path, duration=0.5)
    assert "\n" not in str(caught.value)
    assert main(["doctor", str(path)]) == 3
    assert "the engine gave up" in capsys.readouterr().err


def test_a_session_of_our_model_says_so(tmp_path: Path) -> None:
    """It has no floor: the ball falls through it, as a mechanism does; of a file of ours nothing is to be said."""
    text = BALL.replace("</worldbody>", '</worldbody><actuator><motor name="push" joint="fall"/></actuator>')
    with ml.session(written(tmp_path, text), engine="mujoco") as s:
        for _ in range(80):
            s.step([0.0])
    assert s.recording()["top_z"][-1] < -1.0
    assert s.recording().acts.startswith("mechlab's model of model.xml, not the file as it is: ")
    with ml.session("fourbar") as own:
        own.step([0.0])
    assert "model of" not in own.recording().acts


@pytest.mark.parametrize("name", FILES)
def test_a_session_steps_the_file_as_it_is(name: str, tmp_path: Path) -> None:
    """Bit for bit a loop of `mj_step` under `data.ctrl`; its recording is the same motion."""
    model = mujoco.MjModel.from_xml_string(FILES[name])
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    rng = np.random.default_rng(3)
    s = ml.session(written(tmp_path, FILES[name]), hold=0.01)
    assert s.hold == s.substeps * model.opt.timestep and np.array_equal(s.rest_action, data.ctrl)
    for _ in range(150):
        data.ctrl[:] = rng.uniform(-1.0, 1.0, model.nu)
        seen = s.step(data.ctrl.copy())
        mujoco.mj_step(model, data, nstep=s.substeps)
        assert np.array_equal(s.data.qpos, data.qpos) and np.array_equal(s.data.qvel, data.qvel)
    q, v = s.state
    np.testing.assert_allclose(seen[len(seen) - len(v) :], v, rtol=0, atol=0)
    run = s.recording()
    np.testing.assert_allclose(run.q[-1], q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(run.v[-1], v, rtol=0, atol=1e-12)
    assert run.acts.startswith("the file as it is") and run.t[-1] == pytest.approx(s.time)
    s.close()


def test_a_session_of_a_file_begins_anew_from_initial_values(tmp_path: Path) -> None:
    """The ball of 0.1 m rests on the floor, where our model would fall through it: fall = -0.4."""
    with ml.session(written(tmp_path, BALL), observe=["fall", "top"], start=lambda rng: {"fall_0": -0.3}) as s:
        assert s.observation[0] == pytest.approx(-0.3)
        s.step()
        assert s.reset(initial={"fall_0": -0.2})[0] == pytest.approx(-0.2)
        for _ in range(300):
            seen = s.step()
        assert seen[0] == pytest.approx(-0.4, abs=2e-3) and seen[3] == pytest.approx(0.2, abs=2e-3)
        assert "fall as given" in s.recording().acts


def test_a_long_session_of_a_file_is_recorded_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the kept rows are full, the controls alone are kept: the recording is still the whole motion."""
    monkeypatch.setattr("mechlab.engines.mujoco.step_watch.KEPT", 128)
    with ml.session(written(tmp_path, PENDULUM), hold=None) as s:
        for k in range(300):
            s.step({"servo": 0.1 * np.sin(0.05 * k)})
        run = s.recording()
        assert run.t[-1] == pytest.approx(0.6) and run["swing"][-1] == pytest.approx(s.observation[0], abs=1e-12)


def test_a_session_of_a_file_that_blows_up_says_so(tmp_path: Path) -> None:
    text = PENDULUM.replace('kp="30"', 'kp="-1e9"').replace('integrator="RK4"', "")
    s = ml.session(written(tmp_path, text))
    with pytest.raises(Untrustworthy, match="swing"):
        for _ in range(400):
            s.step([1.0])
    assert not s.health.trusted and s.health.finding("blow_up").severity == "error"
    with pytest.warns(UserWarning, match="swing"):
        s.close()
    with pytest.raises(MechlabError, match="loads"):
        ml.session(written(tmp_path, PENDULUM), swing_force=1.0)


def test_an_environment_of_a_file_has_its_contacts(tmp_path: Path) -> None:
    pytest.importorskip("gymnasium")
    text = BALL.replace("</worldbody>", '</worldbody><actuator><motor name="push" joint="fall" ctrlrange="-5 5"/></actuator>')
    env = ml.environment(written(tmp_path, text), reward=lambda o, a, s: 0.0)
    assert (env.action_space.low, env.action_space.high) == ([-5.0], [5.0])
    env.reset(seed=0)
    for _ in range(150):
        seen = env.step(np.zeros(1))[0]
    assert seen[0] > -0.45
    env.close()
