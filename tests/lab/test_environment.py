"""Environments for reinforcement learning: gymnasium's own checks, and many environments against one."""

import builtins
import sys
import warnings

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.mujoco.step_watch import BLOCK
from mechlab.errors import EngineMissing, MechlabError

gymnasium = pytest.importorskip("gymnasium")
check_env = pytest.importorskip("gymnasium.utils.env_checker").check_env


def near(observation, action, place):
    """Reward of being near 1.2 rad, less the time that has gone by."""
    return -abs(float(observation[0]) - 1.2) - 0.01 * place.time


def far(observation, place):
    return bool(observation[0] > 1.35)


def shaken(rng):
    return {"crank_angle_0": 1.0 + 0.05 * rng.standard_normal()}


def one(**options):
    return ml.environment("fourbar", **{"reward": near, "terminated": far, "seconds": 0.2, "start": shaken, **options})


@pytest.mark.parametrize("observe", [(), ("crank_angle", "C")])
def test_gymnasiums_checker_passes(observe):
    env = one(observe=observe)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(env)
    # what it recommends and we decline: joints of a four-bar have no ranges, actions have physical units; and without a registered
    # name it cannot make a second environment
    told = [str(w.message) for w in caught]
    assert all("infinity" in x or "normalized" in x or "render modes" in x for x in told), told


def test_spaces_hold_ranges_and_limits():
    b = ml.Builder("slide", gravity=(0.0, 0.0, 0.0))
    b.body("block", ml.prismatic("x", "x", range=(-0.5, 1.5)), inertia=ml.Inertia(2.0, tensor=(1, 1, 1, 0, 0, 0)))
    b.drive("x", limit=7.0)
    env = ml.environment(b.build(), reward=lambda o, a, s: 0.0)
    assert env.action_space.low == [-7.0] and env.action_space.high == [7.0]
    np.testing.assert_allclose(env.observation_space.low, [-0.7, -1e6])
    np.testing.assert_allclose(env.observation_space.high, [1.7, 1e6])
    env.close()


def test_an_episode_ends_in_time_or_with_the_task():
    env = one()
    env.reset(seed=1)
    ends = [env.step(np.array([1.0]))[2:4] for _ in range(20)]
    assert ends[-1] == (False, True) and not any(any(x) for x in ends[:-1])
    env.reset(seed=1)
    for _ in range(20):
        seen, reward, over, late, _ = env.step(np.array([1.5]))
        assert reward == pytest.approx(near(seen, None, env.session))
        if over:
            break
    assert over and seen[0] > 1.35 and not late
    env.close()


def rotor():
    b = ml.Builder("rotor", gravity=(0.0, 0.0, 0.0))
    b.body("wheel", ml.revolute("spin"), inertia=ml.Inertia(1.0, tensor=(1e-4, 1e-4, 1e-4, 0, 0, 0)))
    b.drive("spin")
    return b.build()


def test_a_motion_that_cannot_go_on_is_truncated_and_told():
    """Torque / inertia = 1e8 rad/s2: beyond 1e6 rad/s after 10 ms."""
    env = ml.environment(rotor(), reward=lambda o, a, s: 1.0, seconds=60.0, hold=0.02)
    env.reset(seed=0)
    for _ in range(200):
        seen, reward, over, late, info = env.step(np.array([1e4]))
        if late:
            break
    assert late and not over and reward == 0.0 and "spin" in info["untrusted"]
    assert np.all(np.isfinite(seen)) and env.observation_space.contains(seen)
    env.reset(seed=0)
    assert env.step(np.array([0.0]))[3] is False
    with pytest.warns(UserWarning, match="spin"):
        env.close()
    many = ml.environments(rotor(), count=3, reward=lambda o, a, s: 1.0, seconds=60.0, hold=0.02)
    many.reset(seed=0)
    seen, rewards, over, late, info = many.step(np.array([[0.0], [1e4], [1.0]]))
    assert late.tolist() == info["untrusted"].tolist() == [False, True, False] and rewards.tolist() == [1.0, 0.0, 1.0]
    assert np.all(np.isfinite(seen))
    seen, rewards, over, late, info = many.step(np.zeros((3, 1)))
    assert not late.any() and rewards.tolist() == [1.0, 0.0, 1.0] and not info  # the second was reset by this step
    many.close()


@pytest.mark.parametrize("observe", [(), ("crank_angle", "C", "rocker_angle_rate")])
def test_many_move_as_one_and_as_gymnasiums_own_vector(observe):
    """Against SyncVectorEnv of single environments: the same seeds, actions, ends, resets. Engine and steps are the same: to
    the last bits of the solver's start."""
    count = 4
    many = ml.environments(
        "fourbar", count=count, reward=near, terminated=far, seconds=0.2, start=shaken, observe=observe, threads=2
    )
    loop = gymnasium.vector.SyncVectorEnv([lambda: one(observe=observe) for _ in range(count)])
    assert (
        many.single_action_space == loop.single_action_space
        and many.observation_space.shape == loop.observation_space.shape
    )
    a, b = many.reset(seed=5)[0], loop.reset(seed=5)[0]
    np.testing.assert_array_equal(a, b)
    rng, ends = np.random.default_rng(0), 0
    for _ in range(50):
        actions = rng.uniform(0.9, 1.5, (count, 1))
        mine, theirs = many.step(actions), loop.step(actions)
        for x, y in zip(mine[:4], theirs[:4], strict=True):
            np.testing.assert_allclose(x, y, rtol=0, atol=1e-9)
        ends += int((mine[2] | mine[3]).sum())
    assert ends > count  # resets were compared too
    many.close()
    loop.close()


def test_bad_actions_and_scenes_are_named():
    env = one()
    env.reset(seed=0)
    with pytest.raises(MechlabError, match="crank_angle"):
        env.step(np.array([np.nan]))
    env.close()
    many = ml.environments("fourbar", count=2, reward=near)
    many.reset()
    with pytest.raises(MechlabError, match="crank_angle.*simulation 1"):
        many.step(np.array([[1.0], [np.inf]]))
    for wrong in (np.ones((2, 2)), np.ones(2), np.ones((3, 1))):
        with pytest.raises(MechlabError, match=r"expected the shape \(2, 1\).*crank_angle; got the shape"):
            many.step(wrong)
    with pytest.raises(MechlabError, match="count"):
        ml.environments("fourbar", count=0, reward=near)
    with pytest.raises(MechlabError, match="drives"):
        ml.environment("pendulum", reward=near)


def test_without_gymnasium_it_says_what_to_install(monkeypatch):
    real = builtins.__import__

    def blocked(name, *rest):
        if name.split(".")[0] == "gymnasium":
            raise ModuleNotFoundError("No module named 'gymnasium'", name="gymnasium")
        return real(name, *rest)

    monkeypatch.delitem(sys.modules, "mechlab.lab.environment", raising=False)
    monkeypatch.setattr(builtins, "__import__", blocked)
    with pytest.raises(EngineMissing, match=r"mechanism-lab\[rl\]"):
        ml.environment("fourbar", reward=near)


def test_a_loop_that_opens_breaks_its_environment_alone():
    """One of three four-bars is torn open by 0.3 rad; it is found at the next look at the loops."""
    many = ml.environments("fourbar", count=3, reward=near, hold=None, seconds=1.0)
    many.reset(seed=0)
    fleet = many.fleet
    for _ in range(BLOCK - 1):
        assert not many.step(np.ones((3, 1)))[4]
    start = fleet.session.gap_sensors[0]
    assert np.abs(fleet._sensed[:, start : start + 3]).max() < 1e-5
    fleet._qpos[1, fleet.session.map.qpos[2]] += 0.3
    late, info = many.step(np.ones((3, 1)))[3:]
    assert late.tolist() == info["untrusted"].tolist() == [False, True, False]
    many.close()


HOPPER = """<mujoco model="hopper"><option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 .1"/>
    <body name="step" mocap="true" pos="3 0 0"><geom type="box" size=".3 .3 .05"/></body>
    <body name="trunk" pos="0 0 .6" euler="10 20 30"><freejoint name="free"/><geom type="box" size=".1 .1 .05" mass="2"/>
      <site name="nose" pos=".1 0 0"/>
      <body name="leg" pos="0 0 -.05"><joint name="hip" axis="0 1 0" range="-40 40" damping=".1"/>
        <geom type="capsule" fromto="0 0 0 0 0 -.3" size=".03" mass=".5"/></body></body>
  </worldbody>
  <actuator><position name="servo" joint="hip" kp="20" ctrlrange="-.5 .5"/>
    <general name="slow" joint="hip" dyntype="filter" dynprm=".05" gainprm="3"/></actuator>
  <keyframe><key name="up" qpos="0 0 .6 .9 .1 .2 .3 .2" ctrl=".1 .2" act=".3" mpos="0 .3 .1"/></keyframe>
</mujoco>"""
"""A free body that hops on a floor and a step, whose place the keyframe says: contacts, a quaternion, an activation."""


@pytest.mark.filterwarnings("ignore::mechlab.errors.LeftOutWarning")
@pytest.mark.parametrize("observe", [(), ("hip", "free_turn", "hip_rate", "nose")])
def test_many_of_a_file_move_as_one_bit_for_bit(observe, tmp_path):
    path = tmp_path / "hopper.xml"
    path.write_text(HOPPER)

    def tilted(rng):
        return {"hip_0": 0.3 * rng.standard_normal(), "free_z_0": 0.1 * rng.standard_normal()}

    options = {"reward": near, "terminated": far, "seconds": 0.4, "start": tilted, "observe": observe, "hold": 0.02}
    count = 3
    many = ml.environments(path, count=count, threads=2, **options)
    singles = [ml.environment(path, **options) for _ in range(count)]
    seen = many.reset(seed=7)[0]
    np.testing.assert_array_equal(seen, [e.reset(seed=7 + k)[0] for k, e in enumerate(singles)])
    rng, ended, touched, ends = np.random.default_rng(1), np.zeros(count, dtype=bool), 0, 0
    for _ in range(60):
        actions = rng.uniform(-0.5, 0.5, (count, 2))
        got = many.step(actions)
        for k, e in enumerate(singles):
            alone = (e.reset()[0], 0.0, False, False) if ended[k] else e.step(actions[k])[:4]
            for x, y in zip(got[:4], alone, strict=True):
                np.testing.assert_array_equal(x[k], y)
            touched += e.session.data.ncon
        ended = got[2] | got[3]
        ends += int(ended.sum())
    assert touched and ends > count  # contacts and resets were compared, too
    many.close()
    for e in singles:
        e.close()


@pytest.mark.filterwarnings("ignore::mechlab.errors.LeftOutWarning")
def test_a_file_that_the_engine_gives_up_is_told_with_its_simulation(tmp_path):
    """A memory that holds no contact: the engine cannot take the step in which the body lands."""
    path = tmp_path / "hopper.xml"
    path.write_text(HOPPER.replace("<option", '<size memory="4K"/><option'))
    many = ml.environments(path, count=2, reward=near, seconds=9.0)
    many.reset(seed=0)
    with pytest.raises(MechlabError, match=r"simulation 0: .*memory"):
        for _ in range(300):
            many.step(np.zeros((2, 2)))
