"""The step loop: against scipy's integration of equations written by hand, against runs, and what it does when things go wrong."""

import math
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechlab as ml
from mechlab.engines.mujoco.step_watch import BLOCK, KEPT, UntrustedSession
from mechlab.errors import MechlabError, Untrustworthy
from mechlab.mechanism.parts import Control, Winding

MASS, LENGTH, ARMATURE = 0.5, 0.4, 0.01
INERTIA = MASS * LENGTH**2 + ARMATURE + 1e-9


def arm(zero=0.0, damping=0.0, joint_range=None, **drive):
    """A point mass on a rod about the horizontal axis y; at 0 it hangs."""
    b = ml.Builder("arm", gravity=(0.0, 0.0, -9.81))
    joint = ml.revolute("swing", "y", zero=zero, damping=damping, armature=ARMATURE, range=joint_range)
    b.body("rod", joint, inertia=ml.Inertia(MASS, com=(0.0, 0.0, -LENGTH), tensor=(1e-9, 1e-9, 1e-9, 0, 0, 0)))
    b.frame("tip", "rod", at=(0.0, 0.0, -LENGTH))
    b.drive("swing", **drive)
    return b.build()


def by_hand(torque, t, damping=0.0, start=(0.0, 0.0)):
    """Angle and rate of the arm under torque(k, x, v) of the action k, by DOP853; the torque jumps between actions."""

    def slope(t, y, k):
        x, v = y
        return [v, (torque(k, x, v) - damping * v - MASS * 9.81 * LENGTH * math.sin(x)) / INERTIA]

    out, y = [np.array(start)], np.array(start)
    for k in range(len(t) - 1):
        y = solve_ivp(slope, (t[k], t[k + 1]), y, args=(k,), method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
        out.append(y)
    return np.array(out)


def test_a_motor_moves_as_the_equation_says():
    actions = 0.8 * np.sin(np.arange(60))
    t = 0.01 * np.arange(61)
    expected = by_hand(lambda k, x, v: actions[k], t)
    with ml.session(arm()) as s:
        assert s.action_names == ("swing",) and s.action_units == ("N m",) and s.substeps == 10
        seen = [s.observation] + [s.step([a]) for a in actions]
        np.testing.assert_allclose(np.array(seen), expected, atol=1e-9)
        assert s.time == pytest.approx(0.6) and s.health.trusted
        run = s.recording()
    np.testing.assert_allclose(run["swing_force"][:-1], actions, atol=1e-12)
    np.testing.assert_allclose(run["swing_command"][:-1], actions, atol=1e-12)


@pytest.mark.parametrize("target", [None, 0.7])
def test_the_command_of_a_servo_is_its_physical_target(target):
    """stiffness (target - value) - damping rate, whatever zero the joint and target the drive declare."""
    m = arm(zero=0.3, stiffness=30.0, damping=0.5, target=target)
    t, wanted = 0.01 * np.arange(81), 0.9
    # value = 0.3 + coordinate; gravity pulls on the coordinate
    expected = by_hand(lambda k, x, v: 30.0 * (wanted - 0.3 - x) - 0.5 * v, t)
    with ml.session(m) as s:
        assert s.rest_action == pytest.approx([0.3 if target is None else target]) and s.action_units == ("rad",)
        seen = np.array([s.observation] + [s.step({"swing": wanted}) for _ in range(80)])
        assert s.trusted
    np.testing.assert_allclose(seen[:, 0] - 0.3, expected[:, 0], atol=1e-5)
    np.testing.assert_allclose(seen[:, 1], expected[:, 1], atol=1e-4)


def test_the_command_of_a_drive_with_damping_alone_is_its_target_rate():
    t = 0.01 * np.arange(41)
    expected = by_hand(lambda k, x, v: 0.5 * (3.0 - v), t)
    m = arm()
    m = replace(m, drives=(replace(m.drives[0], damping=0.5),))
    with ml.session(m) as s:
        assert s.action_units == ("rad/s",) and s.rest_action == [0.0]
        seen = np.array([s.observation] + [s.step([3.0]) for _ in range(40)])
    np.testing.assert_allclose(seen, expected, atol=1e-6)


def test_the_command_of_a_winding_is_its_voltage():
    constant, resistance, voltage = 0.4, 2.0, 6.0
    t = 0.01 * np.arange(51)
    expected = by_hand(lambda k, x, v: constant / resistance * (voltage - constant * v), t)
    with ml.session(arm(winding=Winding(constant, resistance))) as s:
        assert s.action_units == ("V",)
        seen = np.array([s.observation] + [s.step([voltage]) for _ in range(50)])
        run = s.recording()
        assert run.health.trusted
    np.testing.assert_allclose(seen, expected, atol=1e-5)
    v = run["swing_rate"]
    np.testing.assert_allclose(run["swing_force"], constant / resistance * (voltage - constant * v), rtol=1e-9)


@pytest.mark.parametrize("stiffness", [0.0, 30.0])
def test_the_command_of_a_drive_from_a_file_is_in_its_units(stiffness):
    """gear (gain u + push) - stiffness value - damping rate, with u clamped to its range."""
    control = Control(gain=4.0, gear=5.0, push=0.02, range=(-0.5, 0.5))
    m = arm(zero=0.3, stiffness=stiffness, damping=0.5)
    m = replace(m, drives=(replace(m.drives[0], control=control),))
    t, actions = 0.01 * np.arange(41), 0.7 * np.cos(0.3 * np.arange(40))
    expected = by_hand(
        lambda k, x, v: 5.0 * (4.0 * np.clip(actions[k], -0.5, 0.5) + 0.02) - stiffness * (0.3 + x) - 0.5 * v, t
    )
    with ml.session(m) as s:
        assert (s.action_low, s.action_high) == ([-0.5], [0.5])
        seen = np.array([s.observation] + [s.step([a]) for a in actions])
        assert s.recording()["swing_command"][:-1] == pytest.approx(np.clip(actions, -0.5, 0.5))
    np.testing.assert_allclose(seen[:, 0] - 0.3, expected[:, 0], atol=1e-5)


def test_at_rest_it_moves_as_a_run_of_the_scene():
    """The command at rest is what a drive does in `simulate`; steps and solver are the same."""
    run = ml.simulate("fourbar", scene="free-run", duration=0.5, at=[0.5])
    with ml.session("fourbar", scene="free-run", observe=["rocker_angle"]) as s:
        assert s.scene.laws == ()
    held = ml.load(arm(stiffness=30.0, damping=0.5))
    reference = ml.simulate(held, duration=0.5, swing_0=0.2, timestep=1e-3, settings=None)
    with ml.session(held, start=lambda rng: {"swing_0": 0.2}, settings=reference.settings) as s:
        for _ in range(50):
            s.step()
        assert s.observation[0] == pytest.approx(reference.at("swing", 0.5), abs=1e-9)
    assert run.health.trusted


def test_loads_of_the_user_and_of_the_scene_act():
    """A constant load is one more torque; it stands in the forces and in the energy balance."""
    t = 0.01 * np.arange(41)
    expected = by_hand(lambda k, x, v: 0.3 + 0.5, t)
    with ml.session(arm(), swing_force=0.5) as s:
        seen = np.array([s.observation] + [s.step([0.3]) for _ in range(40)])
        run = s.recording()
    np.testing.assert_allclose(seen, expected, atol=2e-6)
    assert run.health.trusted and run["swing_force"] == pytest.approx(0.8)


def test_a_law_of_the_scene_on_a_driven_joint_gives_way_and_that_is_told():
    with ml.session("delta6", scene="head-tracking") as s:
        assert not s.scene.laws and len(s.action_names) == 6
        s.step()
        assert "in place of computed_torque on" in s.recording().acts


def test_observations_by_name():
    with ml.session("fourbar", observe=["C", "rocker_angle", "coupler_angle_rate"]) as s:
        assert s.observation_names == ("rocker_angle", "coupler_angle_rate", "C_x", "C_y", "C_z")
        for k in range(20):
            seen = s.step([1.0 + 0.01 * k])
        run = s.recording()
        for name, x in zip(s.observation_names, seen, strict=True):
            assert x == pytest.approx(run[name][-1], abs=1e-12), name  # recorded by the numpy tree
        assert seen is not s.observation and np.array_equal(seen, s.observation)


@pytest.mark.parametrize(("options", "culprit"), [
    ({"observe": ["rocker_angel"]}, "rocker_angel"), ({"observe": ["C", "C"]}, "given twice"), ({"hold": -1.0}, "hold"),
    ({"scene": "no-such"}, "no-such"),
])  # fmt: skip
def test_bad_options_are_named(options, culprit):
    with pytest.raises(MechlabError, match=culprit):
        ml.session("fourbar", **options)


def test_bad_actions_are_refused_by_name_and_leave_the_state():
    with ml.session("fourbar") as s:
        before = s.step([1.01])
        for bad, culprit in (([math.nan], "crank_angle"), ({"crank_angle": math.inf}, "crank_angle"),
                             ([1.0, 2.0], "1 numbers"), ({"crank": 1.0}, "crank_angle")):  # fmt: skip
            with pytest.raises(MechlabError, match=culprit):
                s.step(bad)
        assert np.array_equal(before, s.observation) and s.action == pytest.approx([1.01])


def test_reset_and_seed_give_the_same_motion():
    def play(s, seed):
        first = s.reset(seed=seed)
        return np.array([first] + [s.step(s.rng.uniform(0.9, 1.1, 1)) for _ in range(20)])

    with ml.session("fourbar", start=lambda rng: {"crank_angle_0": 1.0 + 0.1 * rng.standard_normal()}) as s:
        one, two, other = play(s, 3), play(s, 3), play(s, 4)
    assert np.array_equal(one, two) and not np.array_equal(one, other)
    assert one[0, 0] != pytest.approx(1.0, abs=1e-6)


def test_a_blow_up_is_told_and_not_lost():
    """A motor against no load: the rate passes the limit of 1e6 rad/s."""
    b = ml.Builder("rotor", gravity=(0.0, 0.0, 0.0))
    b.body("wheel", ml.revolute("spin"), inertia=ml.Inertia(1.0, tensor=(1e-3, 1e-3, 1e-3, 0, 0, 0)))
    b.drive("spin")
    s = ml.session(b.build())
    with pytest.raises(Untrustworthy, match="spin"):
        for _ in range(10 * BLOCK):
            s.step([1e4])
    with pytest.raises(Untrustworthy, match=r"reset\(\)"):
        s.step([0.0])
    run = s.recording()
    assert not run.health.trusted and "1e+06 rad/s" in run.message or "rate of spin" in run.message
    assert np.all(np.isfinite(run.q)) and np.abs(run.v).max() < 1e6
    s.reset()
    assert s.step([0.0]) is not None and s.trusted
    with pytest.warns(UntrustedSession, match="1 motions before"):
        s.close()
    with pytest.raises(MechlabError, match="closed"):
        s.step([0.0])


def test_energy_that_the_engine_makes_is_found():
    """The default softness of MuJoCo pumps energy: the session says so when it is closed."""
    s = ml.session("fourbar", scene="free-run", settings="defaults", hold=0.02)
    s.model.actuator_gainprm[:] = 0.0
    s.model.actuator_biasprm[:] = 0.0
    for _ in range(50):
        s.step()
    assert not s.trusted
    with pytest.warns(UntrustedSession):
        s.close()


def test_the_work_of_a_stiff_servo_is_accounted_for():
    """Its transients are shorter than an action; the actions are stepped again where the ends say too little."""
    with ml.session("fourbar") as s:
        for k in range(100):
            s.step([1.0 + 0.02 * (k % 7)])
        found = s.health.finding("energy_balance")
    assert found.value < 1e-2 and found.severity != "error"


def test_long_motions_are_kept_in_bounded_memory(monkeypatch):
    with ml.session(arm(damping=0.1), hold=None) as s:
        s.rows = s.rows[: KEPT + 1]
        for k in range(KEPT + 500):
            s.step([0.2 * math.sin(0.001 * k)])
        run = s.recording()
        assert run.t[0] == 0.0 and run.t[-1] == pytest.approx(s.time) and run.health.trusted
        assert len(s.rows) == KEPT + 1


def test_a_session_beside_runs_with_laws():
    """The engine has one control callback for the process: runs in between neither block nor change a session."""

    def play(between):
        with ml.session("fourbar") as s:
            for k in range(30):
                s.step([1.0 + 0.01 * k])
                if between and k % 10 == 0:
                    ml.simulate("fourbar", scene="driven-crank", duration=0.01)
            return s.observation

    assert np.array_equal(play(False), play(True))


def test_sessions_and_runs_in_two_threads_do_not_see_each_other():
    def play(_):
        with ml.session("fourbar") as s:
            return [s.step([1.0 + 0.01 * k])[0] for k in range(40)]

    def runs(_):
        return ml.simulate(
            "fourbar", scene="constant-torque", duration=0.05, laws={"rocker_angle": lambda t, p: 0.01}
        ).final()

    alone = play(0), runs(0)
    with ThreadPoolExecutor(2) as pool:
        played, ran = pool.map(play, range(3)), pool.map(runs, range(3))
        assert all(x == alone[0] for x in played) and all(x == alone[1] for x in ran)


def test_no_warnings_of_the_engine_are_printed(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    s = ml.session(arm())
    s.data.qvel[0] = math.nan
    with pytest.raises(Untrustworthy), warnings.catch_warnings():
        warnings.simplefilter("error")
        s.step([0.0])
    assert "WARNING" not in "".join(capfd.readouterr()) and not list(tmp_path.iterdir())
    assert any(f.name == "engine_warnings" and f.severity == "error" for f in s.health.findings) or not s.trusted
