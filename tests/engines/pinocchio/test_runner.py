"""The runner: order, energy, agreement of integrators, reactions, friction, and runs that must not be trusted."""

from dataclasses import replace

import numpy as np
import pytest
from random_mechanisms import random_mechanism
from samples import fourbar, planetary, scara

from mechlab.engines.mujoco.runner import run as run_on_mujoco
from mechlab.engines.pinocchio.runner import run
from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.laws import ComputedTorque, Constant, Harmonic, Servo, TableLaw
from mechlab.experiment.laws.user import FunctionLaw
from mechlab.experiment.motion import Hold, Sine
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism import Builder, Inertia, Mechanism, floating, revolute


def settings(integrator="RK4", h=1e-3, tolerance=1e-9):
    return Settings(engine="pinocchio", integrator=integrator, timestep=h, tolerance=tolerance)


FREE = Scene("free", "full", 0.5, initial_rates={"crank_angle": 6.0})


@pytest.fixture(scope="module")
def truth():
    return run(fourbar(), FREE, settings("DOP853", tolerance=1e-12))


def test_order_of_rk4_and_of_the_first_order_method(truth):
    m = fourbar()

    def error(integrator, h):
        return abs(run(m, FREE, settings(integrator, h)).final()["crank_angle"] - truth.final()["crank_angle"])

    coarse, fine = error("RK4", 4e-3), error("RK4", 2e-3)
    assert 12 < coarse / fine < 45 and fine < 1e-5
    coarse, fine = error("semi_implicit_Euler", 1e-3), error("semi_implicit_Euler", 5e-4)
    assert 1.6 < coarse / fine < 2.5


def test_free_fourbar_keeps_its_energy_and_closure(truth):
    found = run(fourbar(), FREE, settings())
    assert found.health.trusted
    assert found.health.finding("loop_gap").value < 1e-12
    assert found.health.finding("energy_balance").value < 1e-7
    assert found.health.finding("assembly_mode").severity == "ok"
    assert found.cost.steps == 500 and found.cost.evaluations > 2000 and found.cost.cpu_s > 0
    assert found.versions["pinocchio"] and found.t[-1] == 0.5
    for name in ("crank_angle", "rocker_angle_rate", "coupler_rel_accel", "pin_fx", "point_y"):
        assert np.allclose(found.channel(name), truth.channel(name), atol=1e-5 * max(1, abs(truth.channel(name)).max()))
    assert found.units["crank_angle_accel"] == "rad/s2" and found.units["pin_fx"] == "N"


def test_accelerations_are_the_derivatives_of_the_rates(truth):
    t, rate, accel = truth.t, truth.channel("rocker_angle_rate"), truth.channel("rocker_angle_accel")
    middle = (rate[2:] - rate[:-2]) / (t[2:] - t[:-2])
    assert np.abs(middle - accel[1:-1]).max() < 4e-3 * np.abs(accel).max()


def test_samples_are_exact_times_whatever_the_step():
    times = [0.0123, 0.1, 0.3337]
    found = run(fourbar(), FREE, settings(h=2e-3), times)
    assert np.array_equal(found.t, [0.0, *times, 0.5])
    other = run(fourbar(), FREE, settings("DOP853", tolerance=1e-11), times)
    assert np.allclose(found.q, other.q, atol=1e-5)


def test_driven_work_is_balanced_and_forces_are_recorded():
    scene = Scene("driven", "full", 0.5, (Harmonic("crank_angle", 0.05, 9.0), Constant("rocker_angle", -0.02)))
    found = run(fourbar(), scene, settings())
    assert found.health.finding("energy_balance").value < 1e-6
    assert np.allclose(found.channel("crank_angle_force"), 0.05 * np.sin(9.0 * found.t))
    assert np.all(found.channel("rocker_angle_force") == -0.02)


def test_dampers_and_springs_are_in_the_balance():
    m = scara()
    bodies = tuple(
        replace(b, joints=tuple(replace(j, damping=0.02, stiffness=0.5, spring_rest=0.2) for j in b.joints))
        for b in m.bodies
    )
    found = run(replace(m, bodies=bodies), Scene("swing", "full", 1.0, initial_rates={"elbow": 3.0}), settings())
    assert found.health.finding("energy_balance").value < 1e-8
    assert abs(found.v[-1]).max() > 0


def test_planetary_loads_and_reduced_motion():
    m = planetary()
    scene = Scene("start", "parts", 0.2, (Constant("sun", 0.5), Constant("carrier", -0.2)))
    found = run(m, scene, settings("DOP853"))
    from mechlab.engines.pinocchio.dynamics import PinPlant
    from mechlab.mechanism import ConstraintSet, TreeKinematics
    from mechlab.mechanism.structure import null_space

    k = null_space(ConstraintSet(m).jacobian(TreeKinematics(m)))
    force = 0.5 * m.row("sun") - 0.2 * m.row("carrier")
    plant = PinPlant(m)
    accel = k @ np.linalg.solve(k.T @ plant.mass_matrix() @ k, k.T @ force)
    assert found.final()["sun_rate"] == pytest.approx(0.2 * m.row("sun") @ accel, rel=1e-8)
    assert found.health.finding("relation_residual").value < 1e-10
    assert found.units["sun_planet_0_load"] == "N m"
    loads = [found.channel(f"sun_planet_{i}_load") for i in range(3)]
    assert np.allclose(loads[0], loads[1], rtol=1e-6) and np.abs(loads[0]).min() > 0


def free_top():
    b = Builder("top", gravity=(0.0, 0.0, 0.0))
    b.body("top", *floating("top"), inertia=Inertia.box(1.0, 0.3, 0.2, 0.1))
    b.body("wheel", revolute("wheel"), parent="top", inertia=Inertia.cylinder(0.2, 0.05, 0.01))
    return b.build()


def test_a_tumbling_body_keeps_energy_and_unit_quaternions():
    m = free_top()
    scene = Scene("tumble", "full", 1.0, initial_rates={"wheel": 20.0})
    found = run(m, scene, settings())
    assert np.allclose(np.linalg.norm(found.q[:, 3:7], axis=1), 1.0, atol=1e-14)
    assert found.health.finding("energy_balance").value < 1e-10
    other = run(m, scene, settings("DOP853"))
    assert np.allclose(found.q[-1], other.q[-1], atol=1e-7)


@pytest.mark.parametrize("seed", range(4))
def test_random_trees_balance_their_energy(seed):
    m = random_mechanism(seed, bodies=5, loops=False)
    found = run(m, Scene("fall", "full", 0.1, initial_rates={m.scalar_names[0]: 1.0}), settings(h=1e-3))
    assert found.health.finding("energy_balance").value < 1e-7


def test_computed_torque_follows_its_command():
    m = scara()
    motions = (("shoulder", Sine(0.3, 4.0, offset=0.4)), ("elbow", Hold(0.9)))
    law = ComputedTorque(("shoulder", "elbow"), motions, ((400.0, 40.0),) * 2)
    scene = Scene("track", "full", 0.5, (law,), initial_rates={"shoulder": 1.2})
    found = run(m, scene, settings())
    assert np.abs(found.channel("shoulder") - 0.4 - 0.3 * np.sin(4 * found.t)).max() < 1e-7
    assert np.abs(found.channel("elbow") - 0.9).max() < 1e-7


def test_saturation_is_told():
    scene = Scene("limited", "full", 0.2, (Servo("crank_angle", Hold(3.0), 50.0, 1.0, limit=0.01),))
    found = run(fourbar(), scene, settings(h=2e-3))
    assert found.health.finding("saturation").severity == "warning"


def test_dry_friction_brakes_and_its_smoothing_is_told():
    b = Builder("wheel", gravity=(0, 0, 0))
    b.body("wheel", revolute("wheel", friction=0.01), inertia=Inertia.cylinder(1, 0.1, 0.02))
    found = run(b.build(), Scene("brake", "full", 1.0, initial_rates={"wheel": 1.0}), settings())
    inertia = 0.5 * 0.1**2
    assert found.at("wheel_rate", 0.25) == pytest.approx(1.0 - 0.01 / inertia * 0.25, abs=1e-6)
    assert abs(found.final()["wheel_rate"]) < 1e-3
    assert found.health.finding("friction").severity == "warning"
    assert found.health.finding("energy_balance").value < 1e-3


def test_a_blow_up_ends_the_run_and_says_when_and_why():
    """A servo far too stiff for the step: the run stops, keeps what was good, and is not to be trusted."""
    scene = Scene("stiff", "full", 1.0, (Servo("shoulder", Hold(1.0), 1e7, 0.0),))
    found = run(scara(), scene, settings(h=1e-2))
    blow_up = found.health.finding("blow_up")
    assert not found.health.trusted and found.health.exit_code == 3
    assert found.t[-1] < 1.0 and f"t = {blow_up.value:.6g}" in blow_up.sentence
    assert np.all(np.isfinite(found.q)) and np.all(np.isfinite(found.v))


def test_a_law_that_is_not_finite_is_bad_input():
    """As on MuJoCo: it is named with its time, which lies in the table's last interval with a number."""
    law = TableLaw("crank_angle", (0.0, 0.1, 0.1001, 1.0), (0.0, 0.0, np.nan, np.nan))
    for integrator in ("RK4", "DOP853", "semi_implicit_Euler"):
        with pytest.raises(MechlabError, match=r"the laws give 'crank_angle' the force nan at t = 0\.1"):
            run(fourbar(), Scene("nan", "full", 0.5, (law,)), settings(integrator))
    always = TableLaw("crank_angle", (0.0, 1.0), (np.nan, np.nan))
    for engine in (run, run_on_mujoco):
        with pytest.raises(MechlabError, match="the force nan at t = 0 s"):
            engine(fourbar(), Scene("nan", "full", 0.5, (always,)), settings() if engine is run else None)


def test_errors_of_laws_surface():
    """As on MuJoCo: what a user's function raises is neither a blow-up nor lost."""

    def broken(t, plant):
        raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        run(fourbar(), Scene("bad", "full", 0.1, (FunctionLaw("crank_angle", broken),)), settings())
    with pytest.raises(MechlabError, match="must return one number"):
        run(fourbar(), Scene("bad", "full", 0.1, (FunctionLaw("crank_angle", lambda t, plant: None),)), settings())


def test_wrong_input():
    m: Mechanism = fourbar()
    with pytest.raises(MechlabError, match="integrator of pinocchio 'implicitfast'"):
        run(m, FREE, Settings(engine="mujoco", integrator="implicitfast"))
    with pytest.raises(MechlabError, match="joint or shaft 'crank' does not exist.*crank_angle"):
        run(m, Scene("wrong", "full", 1.0, (Constant("crank", 1.0),)), settings())
    with pytest.raises(NoSolution, match="initial pose does not close"):
        run(m, replace(FREE, initial={"rocker_angle": 3.1}), settings())
    with pytest.raises(NoSolution, match="contradict the constraints"):
        run(m, replace(FREE, initial_rates={"crank_angle": 1.0, "rocker_angle": 9.0}), settings())
    with pytest.raises(MechlabError, match="duration"):
        run(m, replace(FREE, duration=0.0), settings())
    with pytest.raises(MechlabError, match="sample times"):
        run(m, FREE, settings(), [2.0])
