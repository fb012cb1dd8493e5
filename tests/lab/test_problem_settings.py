"""Settings by nature: `stiff` for dry friction and quick motors in MuJoCo, a static line for motors quicker than a step."""

import math
from dataclasses import replace

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.mujoco.runner import run as run_mujoco
from mechlab.experiment.laws import Constant, DcMotor
from mechlab.experiment.scene import PRESETS, Scene, Settings
from mechlab.lab.problem_settings import FASTEST, FRICTION_STEP, motor_findings, settings_for, with_static_motors
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute


def wheel(friction: float = 0.0) -> Mechanism:
    b = Builder("wheel", gravity=(0.0, 0.0, 0.0))
    b.body("wheel", revolute("turn", friction=friction), inertia=Inertia.axial(1.0, 1.0, 0.5))
    return b.build()


def motor(lag: float) -> DcMotor:
    """Stall torque 1, no-load speed 4, time constant `lag`; unit inertia: the speed settles with 4 s."""
    return DcMotor("turn", 2.0, 0.5, 1.0, lag, 0.0)


def scene(*laws) -> Scene:
    return Scene("start", "full", 0.5, laws)


def test_dry_friction_gets_stiff_in_mujoco() -> None:
    chosen = settings_for(Settings(), wheel(0.1), scene(Constant("turn", 1.0)))
    assert (chosen.preset, chosen.integrator, chosen.timestep) == ("stiff", "discrete", FRICTION_STEP)
    smooth = settings_for(Settings(), wheel(), scene(Constant("turn", 1.0)))
    assert smooth == Settings()


def test_a_quick_motor_gets_stiff_with_a_step_that_resolves_it() -> None:
    for lag, step in ((1e-4, 1e-4), (6e-4, 2.5e-4), (1e-9, FASTEST)):
        chosen = settings_for(Settings(), wheel(), scene(motor(lag)))
        assert (chosen.preset, chosen.timestep) == ("stiff", step)
    assert settings_for(Settings(), wheel(), scene(motor(0.1))) == Settings()
    assert settings_for(Settings(), wheel(), scene(motor(0.0))) == Settings()


@pytest.mark.parametrize(("damping", "step", "integrator"), [(2e3, 1e-3, "RK4"), (4e3, 2e-4, "RK4"), (1e5, 2.5e-4, "discrete")])
def test_a_damper_with_which_the_default_step_blows_up_is_resolved_or_taken_implicitly(damping, step, integrator) -> None:
    b = Builder("damped", gravity=(0.0, 0.0, 0.0))
    b.body("wheel", revolute("turn", damping=damping), inertia=Inertia.axial(1.0, 1.0, 0.5))
    m, free = b.build(), Scene("free", "full", 0.1, (), initial_rates={"turn": 1.0})
    chosen = settings_for(Settings(), m, free)
    assert (chosen.timestep, chosen.integrator) == (step, integrator)
    # rate exp(-c t / J), J = 1 kg m2: it comes to rest after a turn of 1 / c. A step of RK4 turns by what is lost in rate, over c, and
    # `discrete` by its implicit rate: the first is within 1e-12, the second within a step at the first rate
    turn = run_mujoco(m, free, chosen).channel("turn")[-1]
    assert abs(turn - 1.0 / damping) < (1e-12 if integrator == "RK4" else 0.1 / damping)
    if integrator == "RK4":  # so does Pinocchio, which has the same steps
        run = ml.simulate(m, scene="free-motion", engine="pinocchio", duration=0.1, turn_rate_0=1.0)
        assert run.settings.timestep == step and abs(run.channel("turn")[-1] - 1.0 / damping) < 1e-12


@pytest.mark.parametrize("preset", ["draft", "defaults"])
def test_a_scene_that_wants_a_quick_look_keeps_it(preset) -> None:
    assert settings_for(PRESETS[preset], wheel(0.1), scene()) == PRESETS[preset]


def test_a_motor_below_the_timestep_is_a_static_line_and_it_is_said() -> None:
    made = with_static_motors(scene(motor(4e-4)), Settings(timestep=1e-3))
    assert made.laws[0].inductance == 0.0 and made.laws[0].neglected == 4e-4
    done = run_mujoco(wheel(), made, Settings(timestep=1e-3))
    (finding,) = motor_findings(made, done)
    # The motor with its lag, 4e-4 s, reaches each rate by that much later: rate x lag behind.
    assert finding.severity == "error" and math.isclose(finding.value, 4e-4 * done.channel("turn_rate").max())
    assert "static line" in finding.sentence
    (small,) = motor_findings(replace(made, tolerance=1e-3), done)
    assert small.severity == "warning"
    # J w' = 1 - w / 4 without lag; RK4 at 1 ms.
    assert math.isclose(done.channel("turn_rate")[-1], 4.0 * (1.0 - math.exp(-0.125)), rel_tol=1e-9)
    assert np.allclose(done.channel("turn_force"), 1.0 - 0.25 * done.channel("turn_rate"), rtol=1e-9)


@pytest.mark.parametrize("how", [Settings(timestep=1e-4), Settings(engine="hybrid"), Settings(engine="analytic")])
def test_a_motor_that_can_be_followed_keeps_its_lag(how) -> None:
    made = with_static_motors(scene(motor(4e-4)), how)
    done = run_mujoco(wheel(), made, Settings(timestep=1e-4))
    assert made.laws[0].inductance == 4e-4 and motor_findings(made, done) == ()


def test_a_users_mechanism_with_friction_runs_stiff_and_what_the_user_says_stands() -> None:
    plain = ml.simulate(wheel(0.5), duration=0.3, turn_rate_0=1.0, engine="mujoco")
    assert plain.settings.preset == "stiff" and "first order" in plain.health.finding("friction").sentence
    # w = 1 - t / 2; the engine's friction is of first order in 0.1 ms.
    assert math.isclose(plain.channel("turn_rate")[-1], 0.85, abs_tol=1e-3)
    chosen = ml.simulate(wheel(0.5), duration=0.05, turn_rate_0=1.0, engine="mujoco", settings="accurate")
    assert chosen.settings == PRESETS["accurate"]
    coarse = ml.simulate(wheel(0.5), duration=0.05, turn_rate_0=1.0, engine="mujoco", timestep=5e-4)
    assert (coarse.settings.preset, coarse.settings.timestep) == ("stiff", 5e-4)
