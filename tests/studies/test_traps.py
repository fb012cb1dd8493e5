"""Every trap of the specifications and measurements, and what catches it. Engines: MuJoCo 4.0.0, Pinocchio 4.1.0.

E engines.md (P: 1.1, others by section) · B benchmarks.md, section 4 · D closed_differential 3.4 · X delta6, section 6
I impulse_and_gear_linkage, part D · L linkages_and_leg (T: "traps measured", A: section 4). "here": a test of this file, that
seeds the trap and looks for the finding, warning or refusal by its name. Others stand beside what they guard.

trap                                                          listed     what catches it
bodies not depth-first: mass matrix silently wrong            P1 D2      here: refused
redundant rows and mu = 0 give NaN                            P2 L-T4    here: own equations stay finite and right
proximal residual is no measure; PGS says True and is wrong   P3 P5 A    solve/test_dynamics: accelerations_meet_the_equations
derivatives of constrained dynamics wrong; bias stays zero    P4 P6 P7   not used; mechanism/test_constraints: jacobian_and_bias...
mimic joints raise or drop                                    P8         formats/test_urdf: relations_of_three_joints...
continuous joints have two coordinates                        P9         formats/test_urdf: poses_in_pinocchio
free joints are placed differently                            P10        solve/test_kinematics: poses_jacobians_velocities_bias
no Jdot v in joint and tendon equalities                      L-T1       here: finding distance_loops
sparse factorisation wrong (issue 3767)                       E2.1       here: refused; formats/test_mjcf_tree: options_and_names
default softness does not converge                            E2.2 B1    here: findings settings, loop_open
default softness loses energy                                 L-T2       here: finding energy_balance
first order closes the loop and loses the motion              E2.2 B3    here: finding step_error
largest usable step                                           B11        here: findings loop_open, step_error
RK4 with a stiff stop or spring diverges                      E2.2 E4    here: finding blow_up
discrete: accelerations are differences                       E2.2       here: finding accelerations
impedance below .9999 softens                                 E2.2       here: finding step_error
6 digits of the engine's own writer                           E2.4       formats/test_mjcf_read: our_files_read_back (1e-15)
pose of reference not assembled                               E2.4 L-T6  here: refused
degrees by default                                            E2.4       formats/test_mjcf_tree: options_and_names
moving body without inertia                                   E2.4 L1    here: refused
inertia that breaks the triangle inequality                   B12 L1     here: refused
a joint twice in a tendon                                     E2.4       here: refused
Pinocchio's MJCF reader keeps the first child, drops gears    E3 X1 X2   here: one base body holds all; gears are own rows
inconsistent redundancy locks the train                       E4         here: refused
load sharing decided by regularisation                        E4         simulate/test_reactions: loads_of_redundant_meshes...
stiff damped tendon across branches under implicitfast        B4         here: findings energy_balance, step_error
singular position of the n-four-bar                           B5         here: findings loop_gap, step_error
redundant loop of the Bricard                                 B6         here: redundancy named, run agrees with the reference
step does not divide the output distance                      B12        simulate/test_run: samples_stand_at_or_around...
autoreset goes on from the reference pose                     B9 D7 I5   here: findings blow_up, restart
light loaded parts, mass ratio                                B10 D5     here: finding predicted_lag
shaft inertia or damping across branches                      D1 D3      here: refused
implicitfast with a stiff velocity servo                      D4         here: findings blow_up or step_error
frictionloss creeps, stops late                               D6         here: findings friction, order
one-way clutch is no joint limit                              D9         experiment/test_held_rates: one_way_stop...
capture time of held rates below the timestep                 D9         here: finding capture
distance equality does not exist                              X3         formats/test_mjcf_loops: rows_span_the_same_space
poses lag by one step                                         X4         simulate/test_run: every_sample_is_of_its_own_state
quaternion order, full mass matrix, joint order               X5 D8      simulate/test_model: plant_terms_are_those...
gear on a moving axis                                         X6         mechanism/test_gears: a_bevel_planet_keeps...
explicit servo on bare gear inertia                           X7         here: finding blow_up
rod inertia, lost mass                                        X8 X11     mechanism/test_reduction: mass_matrix_is_that_of_the_train
drive angles jump by a turn                                   X9 I6      analytic/test_delta6_cardan: joints_are_continuous...
out of reach gives NaN                                        X10        analytic/test_delta6_pose: out_of_reach_is_never_silent
idle rod spin counted as mobility                             X12        mechanism/test_structure: delta_counts
last node of a grid                                           X13        analytic/test_delta6_head: workspace_counts
loss factors of approach and recess                           X14        analytic/test_delta6_head: loss_factors
moment about the geometric centre                             I1         analytic/test_impulse: offset_counts...; refused too
the input that may be the carrier                             I2         analytic/test_impulse: input_may_be_the_carrier
sign(0), restart with the right sign                          I3         integrate/test_hybrid: strong_shaking_sticks...
solve_ivp and empty events                                    I4         integrate/test_hybrid: what_cannot_go_on_says_why
energy of shafts                                              I7         here: finding energy_balance stays ok
servo lag: compare at the actual angle                        I8         here: finding saturation tells a drive that lags
undamped loops are no attractors; mean speed decays           I9 I10     analytic/test_impulse: orbit_closes_and_has_neutral...
RK4 with a state of an actuator is first order                I (weak)   study/test_order: a_motor_with_a_state...
motor faster than the timestep                                I          catalog/test_impulse_transmission: a_motor_that_is...
tilted axis locks a planar loop                               L-T3       mechanism/test_tilt: a_tilt_is_refused_and_named
Baumgarte gains of zero drift                                 L-T5       here: finding closure_correction
modes switch silently in a run                                A          here: finding assembly_mode
marching over a gap or change point                           A          analytic/test_assur_modes: a_gap_is_never_crossed
a servo tears the loop open in the fold                       A          catalog/test_linkages: into_the_fold_never...
gear rows swing beyond what loads explain                     E4         here: finding relation_softness
Simpson at a cusp; R-functions cancel                         D5 D6      analytic, with the curves and regions
"""

import math
from dataclasses import replace
from fractions import Fraction

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.mujoco.closure import equality_jacobian
from mechlab.engines.mujoco.findings import _slip
from mechlab.engines.mujoco.model import to_mujoco
from mechlab.engines.mujoco.runner import run
from mechlab.errors import MechlabError
from mechlab.experiment.findings import restart_finding
from mechlab.experiment.held_rates import HeldRates, RateHold, ViscousBetween, capture_finding
from mechlab.experiment.laws import Constant, OneSidedStop, Servo
from mechlab.experiment.motion import Hold, Ramp
from mechlab.experiment.recording import Finding, Health
from mechlab.experiment.scene import PRESETS, Scene, Settings, preset
from mechlab.lab.step_error import with_step_error
from mechlab.mechanism import Body, Builder, Inertia, Mechanism, Shaft, revolute
from mechlab.mechanism.structure import structure
from tests.mechanism.samples import fourbar, planetary
from tests.mechanism.trains import disc

FAST = Scene("free", "full", 0.5, (), {}, {"crank": 8.0})


def severities(health: Health) -> dict[str, str]:
    """Name -> severity of all findings that are not ok."""
    return {f.name: f.severity for f in health.findings if f.severity != "ok"}


def looked_at(mechanism: Mechanism, scene: Scene, settings: Settings) -> dict[str, str]:
    """What a run of a scene is warned of, the estimate of its step error included."""
    return severities(with_step_error(run(mechanism, scene, settings), scene).health)


def two_discs(first: float = 0.5, second: float = 0.5) -> Mechanism:
    b = Builder("discs", gravity=(0, 0, 0))
    b.body("a", revolute("a"), inertia=disc(first)).body("b", revolute("b"), inertia=disc(second))
    return b.build()


# -- models that an engine would take and get wrong: refused --------------------------------------------------------------


def test_bodies_that_are_not_depth_first_are_refused() -> None:
    body = Body("a", "ground", joints=(revolute("a"),), inertia=disc(1.0))
    b, a1 = (replace(body, name=n, joints=(revolute(n),), parent=p) for n, p in (("b", "ground"), ("a1", "a")))
    with pytest.raises(MechlabError, match="does not follow its parent 'a' depth-first"):
        Mechanism("m", (body, b, a1))
    assert Mechanism("m", (body, a1, b)).nv == 3


def test_shafts_with_inertia_or_damping_across_branches_are_refused() -> None:
    m = two_discs()
    coefficients = (("a", Fraction(1)), ("b", Fraction(-1)))
    for shaft in (Shaft("s", coefficients, inertia=0.1), Shaft("s", coefficients, damping=0.1)):
        with pytest.raises(MechlabError, match="'a' and 'b' do not lie on one path"):
            replace(m, shafts=(shaft,))
    # The drag between them is a law instead, and keeps the angular momentum in the integrator that loses it (D3).
    scene = Scene("rub", "full", 0.2, (ViscousBetween("a", "b", 2.0),), {}, {"a": 3.0})
    end = run(m, scene, preset("draft")).v[-1]
    assert end.sum() == pytest.approx(3.0, abs=1e-12) and end[0] < 2.5


def test_inertias_that_no_body_has_are_refused() -> None:
    with pytest.raises(MechlabError, match="moves but has no mass"):
        Builder("m").body("a", revolute("a"), inertia=Inertia(0.0)).build()
    with pytest.raises(MechlabError, match="triangle"):
        Inertia(1.0, (0, 0, 0), (0.1, 0.1, 0.3, 0, 0, 0))


def test_open_reference_poses_and_double_joints_are_refused() -> None:
    b = Builder("open", gravity=(0, -9.81, 0))
    b.bar("crank", revolute("crank"), 0.1).bar("coupler", revolute("coupler"), 0.3, parent="crank", at=(0.1, 0, 0))
    b.bar("rocker", revolute("rocker"), 0.25, at=(0.3, 0, 0)).loop(
        "pin", "coupler", "rocker", (0.3, 0, 0), (0.25, 0, 0)
    )
    with pytest.raises(MechlabError, match="not assembled: pin.* is open by"):
        b.build()
    twice = (("a", Fraction(1)), ("a", Fraction(2)))
    with pytest.raises(MechlabError, match="names joint 'a' 2 times"):
        replace(two_discs(), shafts=(Shaft("s", twice),))


def test_inconsistent_redundant_gears_are_refused() -> None:
    m = planetary()
    wrong = tuple((n, c * Fraction(1001, 1000) if n == "sun" else c) for n, c in m.relations[0].coefficients)
    with pytest.raises(MechlabError, match="lock joint"):
        replace(m, relations=(replace(m.relations[0], coefficients=wrong), *m.relations[1:]))
    assert len(m.relations) == 6 and len(structure(m).redundant) == 2


def test_a_sparse_jacobian_is_refused_and_never_written() -> None:
    model, data = to_mujoco(planetary())
    assert not mujoco.mj_isSparse(model) and len(equality_jacobian(model, data)) == 6
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    with pytest.raises(MechlabError, match="sparse Jacobian"):
        equality_jacobian(model, mujoco.MjData(model))


# -- what the readers and solvers of an engine drop ------------------------------------------------------------------------


def test_other_readers_keep_all_bodies_and_gears_are_own_rows() -> None:
    """Pinocchio's MJCF reader takes one child of the world only, and no gears: our files have one, and gears go as our own
    rows, never through the reader."""
    import xml.etree.ElementTree as ET

    from mechlab.formats.mjcf.write import to_mjcf

    m = planetary()
    world = ET.fromstring(to_mjcf(m)).find("worldbody")
    assert world is not None and [x.get("name") for x in world.findall("body")] == ["base"]
    model, rows = ml.load(m).to_pinocchio()
    assert model.nv == m.nv == 6 and len(rows) == 6


def test_redundant_rows_give_finite_and_right_accelerations() -> None:
    """A planar four-bar in space has void rows, on which the proximal solver of Pinocchio returns NaN for mu = 0."""
    from mechlab.engines.pinocchio.runner import run as run_pinocchio

    m = fourbar()
    assert structure(m).redundant
    one, two = (r(m, replace(FAST, duration=0.02), s).channel("crank_accel")[0] for r, s in (
        (run, Settings()), (run_pinocchio, Settings(engine="pinocchio"))))  # fmt: skip
    # MuJoCo's rows have impedance .9999: 1.4e-5 was measured on another four-bar.
    assert math.isfinite(two) and one == pytest.approx(two, rel=2e-3)


def test_bricard_is_redundant_by_name_and_runs_right() -> None:
    d = ml.load("bricard")
    assert structure(d.mechanism()).redundant
    done = ml.simulate(d, duration=1.0)
    # Reference of the benchmark collection at t = 1 s (three digits more than the run is asked for).
    x = [done.at(n, 1.0) for n in d.scene().channels]
    np.testing.assert_allclose(x, [0.274481319265, -0.886707938735, -0.462330002687], atol=1e-6)


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
