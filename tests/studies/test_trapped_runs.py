"""Runs that go wrong, each seeded with one trap of the table in test_traps.py, and the finding that tells it."""

from dataclasses import replace
from fractions import Fraction

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.mujoco.findings import _slip
from mechlab.engines.mujoco.model import to_mujoco
from mechlab.engines.mujoco.runner import run
from mechlab.experiment.findings import restart_finding
from mechlab.experiment.held_rates import HeldRates, RateHold, capture_finding
from mechlab.experiment.laws import Constant, OneSidedStop, Servo
from mechlab.experiment.motion import Hold, Ramp
from mechlab.experiment.recording import Finding, Health
from mechlab.experiment.scene import PRESETS, Scene, Settings, preset
from mechlab.lab.step_error import with_step_error
from mechlab.mechanism import Builder, Inertia, Mechanism, Shaft, revolute
from tests.mechanism.samples import fourbar, planetary
from tests.mechanism.trains import disc
from tests.studies.test_traps import FAST, two_discs


def severities(health: Health) -> dict[str, str]:
    """Name -> severity of all findings that are not ok."""
    return {f.name: f.severity for f in health.findings if f.severity != "ok"}


def looked_at(mechanism: Mechanism, scene: Scene, settings: Settings) -> dict[str, str]:
    """What a run of a scene is warned of, the estimate of its step error included."""
    return severities(with_step_error(run(mechanism, scene, settings), scene).health)


# -- soft loops --------------------------------------------------------------------------------------------------------------


def test_default_softness_is_told() -> None:
    found = looked_at(fourbar(), FAST, PRESETS["defaults"])
    assert found["settings"] == "warning" and found["loop_open"] == "error"
    assert looked_at(fourbar(), FAST, Settings()) == {}


def test_default_softness_loses_energy_and_that_is_told() -> None:
    """A loop that is not torn, but damps: a heavy pendulum on a slow four-bar."""
    slow = replace(FAST, initial_rates={"crank": 0.5}, duration=1.0)
    soft = preset("accurate", timeconst=None, impedance=None)
    assert looked_at(fourbar(), slow, soft).get("energy_balance") in ("warning", "error")
    assert "energy_balance" not in looked_at(fourbar(), slow, Settings())


@pytest.mark.parametrize(
    "settings",
    [preset("accurate", impedance=0.9, timestep=5e-4), preset("accurate", timeconst=40.0, timestep=5e-4)],
    ids=["impedance .9", "time constant 40 h"],
)
def test_soft_loops_that_stay_closed_are_told_by_the_step_error(settings: Settings) -> None:
    scene = replace(FAST, tolerance=1e-5, duration=1.0, initial_rates={"crank": 12.0})
    soft = with_step_error(run(fourbar(), scene, settings), scene)
    found = soft.health.finding("step_error")
    right = run(fourbar(), scene, preset("accurate", timestep=2.5e-4))
    error = np.max(np.abs(soft.channel("crank") - np.interp(soft.t, right.t, right.channel("crank"))))
    assert soft.health.finding("loop_gap").severity == "ok" and error > 1e-4
    assert found.severity == "error" and found.value > error


def test_first_order_closes_the_loop_and_loses_the_motion() -> None:
    scene = replace(FAST, initial_rates={"crank": 3.0}, tolerance=1e-3)
    done = with_step_error(run(fourbar(), scene, preset("accurate", integrator="implicitfast", timestep=2e-4)), scene)
    gap, moved = done.health.finding("loop_gap"), done.health.finding("step_error")
    right = run(fourbar(), scene, preset("accurate", timestep=2e-4))
    error = np.max(np.abs(right.channel("crank") - done.channel("crank")))
    assert gap.severity == "ok" and error > 1e-3
    assert moved.severity == "error" and error < moved.value < 3.0 * error


def test_a_step_that_is_too_large_is_told() -> None:
    coarse = looked_at(fourbar(), FAST, Settings(timestep=8e-3))
    assert "error" in coarse.values() or coarse.get("step_error") == "error"


def test_the_singular_position_of_the_n_fourbar_is_told_at_a_coarse_step() -> None:
    done = ml.simulate("n_fourbar", duration=2.0, timestep=0.01)
    assert severities(done.health)["loop_gap"] == "warning" and severities(done.health)["step_error"] == "error"
    fine = severities(ml.simulate("n_fourbar", duration=0.5).health)
    assert fine == {}


# -- integrators and laws ---------------------------------------------------------------------------------------------------


def test_a_stiff_stop_blows_up_under_rk4_and_says_so() -> None:
    stop = OneSidedStop("a", 0.1, 1, 1e7)
    scene = Scene("hit", "full", 0.2, (stop,), {}, {"a": 5.0}, tolerance=1e-3)
    found = looked_at(two_discs(1e-3), scene, Settings())
    assert found.get("blow_up") == "error" or found.get("energy_balance") == "error"
    gentle = replace(scene, laws=(replace(stop, stiffness=100.0),))
    assert looked_at(two_discs(1e-3), gentle, Settings(timestep=2e-4)) == {}


def test_an_explicit_servo_on_a_bare_gear_blows_up_and_says_so() -> None:
    servo = Servo("a", Hold(0.5), 100.0, 3.0)
    scene = Scene("servo", "full", 0.1, (servo,))
    assert looked_at(two_discs(3e-4), scene, Settings())["blow_up"] == "error"
    assert "blow_up" not in looked_at(two_discs(1e-2), scene, Settings())


def test_a_stiff_velocity_servo_under_implicitfast_is_told() -> None:
    servo = Servo("a", Ramp(0.0, 2.0), 0.0, 1e4)
    scene = Scene("servo", "full", 0.1, (servo, Constant("b", 5.0)))
    assert "error" in looked_at(two_discs(3.0), scene, preset("draft", timestep=1e-3)).values()


def test_implicitfast_with_a_damped_tendon_across_branches_is_told() -> None:
    """The flyball governor: .24 m off at every step, since the derivative of the damping is dropped."""
    how = Settings(integrator="implicitfast", timestep=2.5e-4, preset="own")
    found = severities(ml.simulate("flyball", duration=0.2, settings=how).health)
    assert found["energy_balance"] == "warning" and found["step_error"] == "error"
    assert severities(ml.simulate("flyball", duration=0.1).health) == {}


def test_dry_friction_of_the_engine_is_told() -> None:
    done = ml.simulate("impulse_transmission", scene="fig4", engine="mujoco", duration=0.05)
    found = severities(done.health)
    assert found["step_error"] == "error"
    assert "friction" not in severities(ml.simulate("impulse_transmission", scene="fig7", duration=0.05).health)


def test_held_rates_with_too_large_a_step_are_told() -> None:
    law = HeldRates((RateHold("a", 0.0, -2.0, 2.0),), (Constant("a", 1.0),), time=1e-3)
    scene = Scene("rub", "full", 0.6, (law,), {}, {"a": 1.0})
    done = {h: run(two_discs(), scene, Settings(timestep=h)) for h in (1e-3, 4e-3)}
    late = {h: np.max(np.abs(r.channel("a_rate")[r.t > 0.55])) for h, r in done.items()}
    assert late[1e-3] < 1e-9 < late[4e-3]  # it chatters
    assert done[4e-3].health.finding("capture").severity == "error" and not done[4e-3].health.trusted
    assert done[1e-3].health.finding("capture").severity == "ok"
    assert capture_finding((law,), Settings(timestep=2.6e-3)).severity == "warning"  # type: ignore[union-attr]
    assert capture_finding((law,), Settings(timestep=2.2e-3, integrator="Euler")).severity == "error"  # type: ignore[union-attr]
    assert capture_finding((Constant("a", 1.0),), Settings()) is None


def test_accelerations_of_discrete_and_of_distance_loops_are_told() -> None:
    assert (
        "means over the next step"
        in run(two_discs(), Scene("s", "full", 0.05), preset("stiff")).health.finding("accelerations").sentence
    )
    from tests.mechanism.samples import two_chains

    m = two_chains("distance")
    told = run(m, Scene("s", "full", 0.02), Settings()).health
    assert "dJ/dt v" in told.finding("distance_loops").sentence


# -- runs that go wrong without a word ---------------------------------------------------------------------------------------


def spinning() -> Mechanism:
    b = Builder("stiff", gravity=(0, 0, 0))
    b.body("a", revolute("a", stiffness=1e8), inertia=disc(1.0))
    return b.build()


def test_a_blow_up_ends_the_run_where_the_engine_would_restart() -> None:
    done = run(spinning(), Scene("s", "full", 0.5, (), {"a": 0.1}), Settings())
    assert done.health.finding("blow_up").severity == "error" and done.t[-1] < 0.5
    assert np.all(np.isfinite(done.q))


def test_a_silent_restart_is_seen_in_the_states() -> None:
    """MuJoCo's own stepping with autoreset: finite numbers to the end, from the reference pose on."""
    b = Builder("pair", gravity=(0, -9.81, 0))
    b.body("a", revolute("a"), inertia=Inertia.point(1.0, (0.5, 0, 0)))
    m = b.build()
    model, data = to_mujoco(m, Settings())
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    t, q, v = [], [], []
    for k in range(1000):
        data.qfrc_applied[0] = 1e30 if k == 600 else 0.0  # a spike, as of a division by nearly zero
        mujoco.mj_step(model, data)
        t.append((k + 1) * 1e-3)
        q.append(data.qpos.copy())
        v.append(data.qvel.copy())
    times, poses, rates = np.array(t), np.array(q), np.array(v)
    assert np.all(np.isfinite(poses)) and np.max(np.abs(rates)) < 1e3
    found = restart_finding(m, times, poses, rates)
    assert isinstance(found, Finding) and found.severity == "error"
    assert found.value == pytest.approx(0.601, abs=2e-3)
    assert restart_finding(m, times[:600], poses[:600], rates[:600]) is None
    # Swinging back through the reference pose is no restart, however rarely one looks.
    fair = run(m, Scene("swing", "full", 10.0), Settings())
    for every in (1, 7, 60, 250):
        assert restart_finding(m, fair.t[::every], fair.q[::every], fair.v[::every]) is None


def test_light_loaded_gears_are_told_before_the_run() -> None:
    b = Builder("pair", gravity=(0, 0, 0))
    b.body("a", revolute("a"), inertia=disc(1e-6)).body("b", revolute("b"), at=(0.1, 0, 0), inertia=disc(1.0))
    b.gears("mesh", "a", "b", (1, 1))
    m = b.build()
    pull = Scene("pull", "full", 0.05, (Constant("a", 15.0),), tolerance=1e-4)
    assert looked_at(m, pull, Settings())["predicted_lag"] == "warning"
    light = replace(pull, laws=(Constant("a", 0.015),))
    assert looked_at(m, light, Settings()) == {}


def test_rows_that_slip_more_than_the_loads_explain_are_told() -> None:
    assert _slip(3e-6, 1e-7, 1e-4).severity == "warning" and "do not explain" in _slip(3e-6, 1e-7, 1e-4).sentence
    assert _slip(3e-6, 1e-7, 1e-6).severity == "error"
    assert _slip(1e-7, 1e-9, 1e-9).severity == "ok"  # too small to matter
    done = run(planetary(), Scene("push", "full", 0.2, (Constant("sun", 1.0),)), Settings())
    told = done.health.finding("relation_softness")
    assert told.severity == "ok" and told.value > 1e-9


def test_energy_of_shafts_is_in_the_balance() -> None:
    m = replace(two_discs(), shafts=(Shaft("s", (("a", Fraction(3)),), inertia=0.2),))
    done = run(m, Scene("push", "full", 0.5, (Constant("s", 2.0),)), Settings())
    assert done.health.finding("energy_balance").value < 1e-12
    # a'' = 3 x 2 / (0.5 + 9 x 0.2)
    assert done.channel("a_rate")[-1] == pytest.approx(0.5 * 6.0 / 2.3, rel=1e-12)


def test_a_drive_that_cannot_follow_is_told() -> None:
    weak = Servo("a", Ramp(0.0, 5.0), 50.0, 5.0, limit=0.1)
    found = looked_at(two_discs(), Scene("lag", "full", 0.5, (weak,)), Settings())
    assert found["saturation"] == "warning"
    assert "saturation" not in looked_at(two_discs(), Scene("f", "full", 0.5, (replace(weak, limit=1e3),)), Settings())


def test_large_projections_are_told() -> None:
    from mechlab.engines.pinocchio.runner import run as run_pinocchio

    told = {}
    fast = replace(FAST, initial_rates={"crank": 30.0}, duration=0.1)
    for h in (1e-4, 2e-3):
        done = run_pinocchio(
            fourbar(), fast, Settings(engine="pinocchio", integrator="semi_implicit_Euler", timestep=h)
        )
        told[h] = done.health.finding("closure_correction").severity
        assert done.health.finding("first_order").severity == "warning"
    assert told[2e-3] in ("warning", "error") and told[1e-4] == "ok"


def test_a_switched_mode_ends_the_run() -> None:
    """The four-bar jumps to its mirrored closure: soft rows let it through a position that rigid bars cannot pass."""
    from mechlab.experiment.findings import kinematic_findings
    from mechlab.mechanism import close

    m = fourbar()
    q = m.reference()
    guess = q.copy()
    guess[1:] += [0.8, -3.0]
    other = close(m, guess, {"crank": 1.0})
    states = np.array([q, other.q])
    assert other.closed and np.max(np.abs(other.q - q)) > 0.1
    told = {f.name: f for f in kinematic_findings(m, states, np.zeros((2, 3)), keep_mode=("crank",))}
    assert told["assembly_mode"].severity == "error" and "toggle" in told["assembly_mode"].sentence
    kept = {f.name: f for f in kinematic_findings(m, states[:1], np.zeros((1, 3)), keep_mode=("crank",))}
    assert kept["assembly_mode"].severity == "ok"
