"""Laws that the engine takes as springs and dampers, against the same laws evaluated in the callback at every stage."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.mujoco import drive
from mechlab.engines.mujoco.runner import run
from mechlab.engines.mujoco.springs import spring_dampers
from mechlab.engines.mujoco.trace import trace
from mechlab.experiment.held_rates import ViscousBetween
from mechlab.experiment.laws import Constant, DcMotor, FunctionLaw, Harmonic, Law, Motor, Servo, Viscous
from mechlab.experiment.motion import Hold, Ramp
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism import Inertia, Mechanism, prismatic, revolute

LAWS: tuple[Law, ...] = (
    Constant("hip", 0.4), Servo("hip", Hold(0.7), 30.0, 0.5, 0.2), Servo("slide", Hold(0.1), 200.0, 3.0), Motor("wheel", 0.3, 40.0),
    Viscous("slide", 0.7), Servo("wheel", Hold(0.2), 0.5, 0.01), DcMotor("hip", 2.0, 0.3, 2.0),
)  # fmt: skip


def machine() -> Mechanism:
    """A hinge and a slide with springs, dampers and zeros of their own, and a shaft with a spring over both."""
    b = ml.Builder("machine")
    hip = revolute("hip", "y", zero=0.3, stiffness=12.0, spring_rest=0.5, damping=0.1)
    b.body("arm", hip, inertia=Inertia.point(1.0, (0.2, 0.0, 0.1)))
    b.body("block", prismatic("slide", "x", zero=-0.2), parent="arm", inertia=Inertia.point(0.5))
    b.shaft("wheel", {"hip": 3, "slide": -2}, inertia=1e-3, stiffness=0.4, spring_rest=0.1, damping=0.02)
    return b.build()


def scene(*laws: Law) -> Scene:
    return Scene("free", "full", 0.5, laws, initial={"hip": 0.9, "slide": 0.05}, initial_rates={"hip": 3.0, "slide": -1.0})


@pytest.mark.parametrize("laws", [*[(law,) for law in LAWS], LAWS], ids=lambda x: x[0].kind if len(x) == 1 else "all")
def test_the_motion_is_that_of_the_laws(laws: tuple[Law, ...]) -> None:
    m, settings = machine(), Settings(timestep=1e-3)
    assert spring_dampers(m, laws, rk4=True) is not None
    nothing = FunctionLaw("slide", lambda t, plant: 0.0)
    called = trace(m, scene(*laws, nothing), settings, 10)
    taken = trace(m, scene(*laws), settings, 10)
    again = trace(m, scene(*laws), settings, 10)
    np.testing.assert_allclose(taken.q, called.q, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(taken.v, called.v, rtol=0.0, atol=1e-11)
    np.testing.assert_array_equal(taken.q, again.q)


@pytest.mark.parametrize("least", [1, 1000])
def test_a_recorded_run_tells_forces_and_work_of_springs_in_the_model(least: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a law that needs a call the forces are those of the laws at every stage; least: more numbers than may be kept, or fewer."""
    m, settings = machine(), Settings(timestep=1e-3)
    called = run(m, scene(*LAWS, FunctionLaw("slide", lambda t, plant: 0.0)), settings)
    if least == 1:
        monkeypatch.setattr(drive, "MOST_NUMBERS", least)
    taken = run(m, scene(*LAWS), settings)
    for name, values in taken.channels.items():
        size = max(1.0, float(np.max(np.abs(values))))
        np.testing.assert_allclose(values, called.channels[name], rtol=0.0, atol=1e-10 * size, err_msg=name)
    # the work of the laws explains the energy as well as theirs at every stage: RK4 leaves errors of order (100 / s x 1 ms)^4 / 100
    assert taken.health.finding("energy_balance").value < 2.0 * called.health.finding("energy_balance").value + 1e-9
    np.testing.assert_array_equal(run(m, scene(*LAWS), settings).q, taken.q)


def test_one_model_for_each_set_of_laws() -> None:
    """Runs share the model of the same laws, not of others."""
    m, settings = machine(), Settings(timestep=1e-3)
    first = trace(m, scene(Viscous("hip", 0.5)), settings, 5)
    other = trace(m, scene(Viscous("hip", 1.5)), settings, 5)
    assert abs(first.q[-1, 0] - other.q[-1, 0]) > 1e-3
    np.testing.assert_array_equal(trace(m, scene(Viscous("hip", 0.5)), settings, 5).q, first.q)


def test_a_loop_and_a_servo_that_holds() -> None:
    design = ml.load("delta6").for_scene("gravity-hold")
    m, made = design.mechanism("minimal"), replace(design.scene("gravity-hold", "minimal"), duration=0.1)
    assert spring_dampers(m, made.laws, rk4=True) is not None
    nothing = FunctionLaw("alpha", lambda t, plant: 0.0)
    called = trace(m, replace(made, laws=(*made.laws, nothing)), made.settings, 10)
    # the servos are 2e5 N/m stiff, and the engine's solver ends by a tolerance: a force that changes by 1e-15 of itself does as much
    np.testing.assert_allclose(trace(m, made, made.settings, 10).q, called.q, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize(
    "law",
    [
        Servo("hip", Ramp(0.0, 1.0), 3.0, 0.0), Servo("hip", Hold(0.0), 3.0, 0.0, limit=1.0), Servo("hip", Hold(0.0), -3.0, 0.0),
        Viscous("hip", -1.0), Harmonic("hip", 1.0, 2.0), ViscousBetween("hip", "slide", 1.0), DcMotor("hip", 1.0, 0.1, 1.0, 0.01),
        Constant("hip", math.nan), FunctionLaw("hip", lambda t, plant: 1.0),
    ],
    ids=lambda x: x.kind,
)  # fmt: skip
def test_what_is_no_spring(law: Law) -> None:
    assert spring_dampers(machine(), (law,), rk4=True) is None


def test_other_methods_take_damping_implicitly() -> None:
    assert spring_dampers(machine(), (Viscous("hip", 1.0),), rk4=False) is None
    assert spring_dampers(machine(), (Constant("hip", 1.0),), rk4=False) is not None
