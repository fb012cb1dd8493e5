"""Every trap of the specifications and measurements, and what catches it. Engines: MuJoCo 4.0.0, Pinocchio 4.1.0.

E engines.md (P: 1.1, others by section) · B benchmarks.md, section 4 · D closed_differential 3.4 · X delta6, section 6
I impulse_and_gear_linkage, part D · L linkages_and_leg (T: "traps measured", A: section 4). "here": a test of this file, and
"runs": one of test_trapped_runs.py, that seeds the trap and looks for the refusal, finding or warning by its name. Others stand
beside what they guard.

trap                                                          listed     what catches it
bodies not depth-first: mass matrix silently wrong            P1 D2      here: refused
redundant rows and mu = 0 give NaN                            P2 L-T4    here: own equations stay finite and right
proximal residual is no measure; PGS says True and is wrong   P3 P5 A    engines/pinocchio/test_dynamics: accelerations_meet_the_equations
derivatives of constrained dynamics wrong; bias stays zero    P4 P6 P7   not used; mechanism/test_constraints: jacobian_and_bias...
mimic joints raise or drop                                    P8         formats/test_urdf: relations_of_three_joints...
continuous joints have two coordinates                        P9         formats/test_urdf: poses_in_pinocchio
free joints are placed differently                            P10        engines/pinocchio/test_kinematics: poses_jacobians_velocities_bias
no Jdot v in joint and tendon equalities                      L-T1       runs: finding distance_loops
sparse factorization wrong (issue 3767)                       E2.1       here: refused; formats/test_mjcf_tree: options_and_names
default softness does not converge                            E2.2 B1    runs: findings settings, loop_open
default softness loses energy                                 L-T2       runs: finding energy_balance
first order closes the loop and loses the motion              E2.2 B3    runs: finding step_error
largest usable step                                           B11        runs: findings loop_open, step_error
RK4 with a stiff stop or spring diverges                      E2.2 E4    runs: finding blow_up
discrete: accelerations are differences                       E2.2       runs: finding accelerations
impedance below .9999 softens                                 E2.2       runs: finding step_error
6 digits of the engine's own writer                           E2.4       formats/test_mjcf_read: our_files_read_back (1e-15)
pose of reference not assembled                               E2.4 L-T6  here: refused
degrees by default                                            E2.4       formats/test_mjcf_tree: options_and_names
moving body without inertia                                   E2.4 L1    here: refused
inertia that breaks the triangle inequality                   B12 L1     here: refused
a joint twice in a tendon                                     E2.4       here: refused
Pinocchio's MJCF reader keeps the first child, drops gears    E3 X1 X2   here: one base body holds all; gears are own rows
inconsistent redundancy locks the train                       E4         here: refused
load sharing decided by regularization                        E4         engines/mujoco/test_reactions: loads_of_redundant_meshes...
stiff damped tendon across branches under implicitfast        B4         runs: findings energy_balance, step_error
singular position of the n-four-bar                           B5         runs: findings loop_gap, step_error
redundant loop of the Bricard                                 B6         here: redundancy named, run agrees with the reference
step does not divide the output distance                      B12        engines/mujoco/test_run: samples_stand_at_or_around...
autoreset goes on from the reference pose                     B9 D7 I5   runs: findings blow_up, restart
light loaded parts, mass ratio                                B10 D5     runs: finding predicted_lag
shaft inertia or damping across branches                      D1 D3      here: refused
implicitfast with a stiff velocity servo                      D4         runs: findings blow_up or step_error
frictionloss creeps, stops late                               D6         runs: findings friction, order
one-way clutch is no joint limit                              D9         experiment/test_held_rates: one_way_stop...
capture time of held rates below the timestep                 D9         runs: finding capture
distance equality does not exist                              X3         formats/test_mjcf_loops: rows_span_the_same_space
poses lag by one step                                         X4         engines/mujoco/test_run: every_sample_is_of_its_own_state
quaternion order, full mass matrix, joint order               X5 D8      engines/mujoco/test_model: plant_terms_are_those...
gear on a moving axis                                         X6         mechanism/test_gears: a_bevel_planet_keeps...
explicit servo on bare gear inertia                           X7         runs: finding blow_up
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
energy of shafts                                              I7         runs: finding energy_balance stays ok
servo lag: compare at the actual angle                        I8         runs: finding saturation tells a drive that lags
undamped loops are no attractors; mean speed decays           I9 I10     analytic/test_impulse: orbit_closes_and_has_neutral...
RK4 with a state of an actuator is first order                I (weak)   lab/test_order: a_motor_with_a_state...
motor faster than the timestep                                I          catalog/test_impulse_transmission: a_motor_that_is...
tilted axis locks a planar loop                               L-T3       mechanism/test_tilt: a_tilt_is_refused_and_named
Baumgarte gains of zero drift                                 L-T5       runs: finding closure_correction
modes switch silently in a run                                A          runs: finding assembly_mode
marching over a gap or change point                           A          analytic/test_assur_modes: a_gap_is_never_crossed
a servo tears the loop open in the fold                       A          catalog/test_linkages: into_the_fold_never...
gear rows swing beyond what loads explain                     E4         runs: finding relation_softness
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
from mechlab.engines.mujoco.model import to_mujoco
from mechlab.engines.mujoco.runner import run
from mechlab.errors import MechlabError
from mechlab.experiment.held_rates import ViscousBetween
from mechlab.experiment.scene import Scene, Settings, preset
from mechlab.mechanism import Body, Builder, Inertia, Mechanism, Shaft, revolute
from mechlab.mechanism.structure import structure
from tests.mechanism.samples import fourbar, planetary
from tests.mechanism.trains import disc

FAST = Scene("free", "full", 0.5, (), {}, {"crank": 8.0})


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
