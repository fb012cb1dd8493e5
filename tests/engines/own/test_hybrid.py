"""The engine `hybrid` on Pinocchio: friction on joints and shafts, with gears and motors. Pinocchio 4.1.0."""

import math

import numpy as np
import pytest

from mechlab.engines.own.hybrid import run
from mechlab.engines.pinocchio.runner import run as run_smooth
from mechlab.experiment.energy import energy
from mechlab.experiment.laws import Constant, DcMotor, Harmonic
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism import Builder, Inertia, prismatic, revolute

DISC = Inertia.axial(1.0, 1.0, 0.5)


def wheel(friction=0.5, stiffness=0.0):
    b = Builder("wheel", gravity=(0.0, 0.0, 0.0))
    b.body("wheel", revolute("turn", friction=friction, stiffness=stiffness), inertia=DISC)
    return b.build()


def geared(friction):
    """Two unit discs, ratio 2, friction on the second."""
    b = Builder("geared", gravity=(0.0, 0.0, 0.0))
    b.body("one", revolute("one"), inertia=DISC)
    b.body("two", revolute("two", friction=friction), at=(0.3, 0.0, 0.0), inertia=DISC)
    b.gears("mesh", "one", "two", (20, 10))
    return b.build()


def test_a_wheel_runs_out_in_the_time_of_its_momentum() -> None:
    done = run(wheel(), Scene("run-out", "full", 3.0, initial_rates={"turn": 1.0}))
    assert done.health.trusted
    assert math.isclose(done.channel("turn")[-1], 1.0, abs_tol=1e-10)  # w^2 / (2 F / J)
    assert done.channel("turn_rate")[-1] == 0.0
    assert "1 s" in done.health.finding("friction").sentence


def test_gears_carry_friction_to_the_driven_wheel() -> None:
    # Seen from wheel one: inertia 1 + 4, friction 2 F; torque 3 against 2 x 0.5.
    done = run(geared(0.5), Scene("pull", "full", 1.0, (Constant("one", 3.0),)))
    assert math.isclose(done.channel("one_rate")[-1], (3.0 - 1.0) / 5.0, rel_tol=1e-9)
    assert math.isclose(done.channel("two_rate")[-1], -2.0 * (3.0 - 1.0) / 5.0, rel_tol=1e-9)
    held = run(geared(2.0), Scene("hold", "full", 1.0, (Constant("one", 3.0),)))
    assert np.all(held.channel("one_rate") == 0.0) or np.abs(held.channel("one_rate")).max() < 1e-12
    # The mesh carries all of the torque: the wheel stands.
    assert math.isclose(abs(held.channel("mesh_load")[-1]), 3.0, rel_tol=1e-9)


def test_shaking_sticks_where_smoothing_creeps() -> None:
    scene = Scene("shake", "full", 2.0, (Harmonic("turn", 0.2, 3.0, offset=0.25),))
    exact = run(wheel(), scene)
    assert np.all(exact.channel("turn") == 0.0)
    creeping = run_smooth(wheel(), scene, Settings(engine="pinocchio"))
    assert abs(creeping.channel("turn")[-1]) > 1e-6


def test_motor_law_has_its_current_in_every_engine() -> None:
    from mechlab.engines.mujoco.runner import run as run_mujoco

    m = wheel(friction=0.0)
    motor = DcMotor("turn", 2.0, 0.5, 1.0, 0.2, 0.3)
    scene = Scene("start", "full", 1.0, (motor,))
    # J w' = K i, L i' = V - R i - K w: a linear system, solved by its matrix exponential.
    A = np.array([[0.0, 0.5], [-0.5 / 0.2, -1.0 / 0.2]])
    values, vectors = np.linalg.eig(A)
    rest = -np.linalg.solve(A, [0.0, 2.0 / 0.2])
    exact = rest + (vectors @ np.diag(np.exp(values)) @ np.linalg.inv(vectors) @ (np.array([0.0, 0.3]) - rest)).real
    step = 0.97e-3
    for done, tolerance in (
        (run(m, scene), 1e-9),
        (run_smooth(m, scene, Settings(engine="pinocchio", timestep=step)), 1e-9),
        (run_mujoco(m, scene, Settings(timestep=step)), 1e-9),
        (run_mujoco(m, scene, Settings(integrator="implicitfast", timestep=step)), 2e-3),
    ):
        assert math.isclose(done.channel("turn_rate")[-1], exact[0], abs_tol=tolerance), done.settings.engine
        assert math.isclose(done.channel("turn_force")[-1], 0.5 * exact[1], abs_tol=tolerance)


def test_a_motor_without_inductance_is_a_straight_line() -> None:
    done = run(wheel(friction=0.0), Scene("start", "full", 1.0, (DcMotor("turn", 2.0, 0.5, 1.0),)))
    assert math.isclose(done.channel("turn_rate")[-1], 4.0 * (1.0 - math.exp(-0.25)), rel_tol=1e-9)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8, 1e-10])
def test_a_slide_with_friction_passes_its_dead_centres(tolerance: float) -> None:
    """No force on the slide stops the crank there. What is lost is the friction times the way of the slide."""
    b = Builder("slider", gravity=(0.0, -9.81, 0.0))
    b.bar("crank", revolute("crank_angle"), 0.1)
    b.bar("rod", revolute("rod_joint"), 0.3, parent="crank", at=(0.1, 0.0, 0.0))
    b.body("block", prismatic("slide", axis=(1, 0, 0), friction=0.5), inertia=Inertia.box(0.5, 0.05, 0.05, 0.05))
    b.loop("pin", "rod", "block", at_a=(0.3, 0.0, 0.0))
    m = b.assemble({"crank_angle": 0.6, "rod_joint": -0.8, "slide": 0.37}, hold=["crank_angle"])
    times = np.linspace(0.0, 1.0, 2001)
    settings = Settings("hybrid", "DOP853", 1e-3, tolerance=tolerance)
    done = run(m, Scene("coast", "full", 1.0, initial_rates={"crank_angle": 20.0}), settings, times)
    assert done.health.trusted and np.ptp(done.channels["crank_angle"]) > 4.0 * math.pi
    way = np.cumsum(np.abs(np.diff(done.channels["slide"], prepend=done.channels["slide"][0])))
    lost = energy(m, done.q[:1], done.v[:1]) - energy(m, done.q, done.v)
    # the samples miss the turning points by 40 m/s2 (.25 ms)^2 / 2 of the way each, 1e-6 J in all
    assert np.allclose(lost, 0.5 * way, atol=1e-5)
