"""Motions stepped together: the bits of single runs, and faults injected into one of many are found in that one alone."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.mujoco.batch import Batch, Motions, roll, steps_of_engine, why_not_together
from mechlab.engines.mujoco.runner import run
from mechlab.engines.mujoco.stepping import grid
from mechlab.errors import MechlabError
from mechlab.experiment.acting import acting
from mechlab.experiment.assembly_modes import mode_signs
from mechlab.experiment.findings import OPEN_LOOP
from mechlab.experiment.laws import Constant, FunctionLaw, Harmonic, Motor, Servo, Viscous
from mechlab.experiment.motion import Hold
from mechlab.experiment.scene import Scene, Settings, initial_state
from mechlab.mechanism import Builder, ConstraintSet, Inertia, Mechanism, TreeKinematics, mode_sign, revolute
from mechlab.mechanism.batch_tree import BatchRows, BatchTree
from tests.mechanism.samples import fourbar, planetary

FOUND = ("loop_gap", "loop_angle", "relation_residual")


def motions(m: Mechanism, scene: Scene, settings: Settings, rates: dict[str, list[float]], loads=None) -> Motions:
    """Motions of a scene that begin with the given rates."""
    count = len(next(iter(rates.values())))
    starts = [{n: x[k] for n, x in rates.items()} for k in range(count)]
    q, v = zip(*(initial_state(m, replace(scene, initial_rates=scene.initial_rates | s)) for s in starts), strict=True)
    return Motions(m, scene, settings, np.array(q), np.array(v), loads or {})


def is_that_of_single_runs(batch: Batch, asked: Motions, rates: dict[str, list[float]]) -> None:
    """The same bits of motion; residuals by the same kinematics in other sums."""
    for k in range(len(asked.q)):
        laws = tuple(Constant(name, float(x[k])) for name, x in asked.loads.items())
        start = {name: x[k] for name, x in rates.items()}
        one = run(asked.mechanism, replace(asked.scene, laws=asked.scene.laws + laws, initial_rates=start), asked.settings)
        assert np.array_equal(batch.t, one.t) and np.array_equal(batch.q[k], one.q) and np.array_equal(batch.v[k], one.v)
        assert (batch.reasons[k] == "") == one.health.trusted
        for name in FOUND:
            if name in batch.findings:
                assert batch.findings[name][k] == pytest.approx(one.health.finding(name).value, rel=1e-6, abs=1e-14)


@pytest.mark.parametrize("kind", ["spherical", "revolute", "cylindrical", "universal"])
def test_a_loop_of_every_kind_moves_as_in_single_runs_whatever_the_threads(lab, kind) -> None:
    m, scene, settings = lab.fourbar(kind), Scene("free", duration=0.2, drives="free"), Settings()
    rates = {"crank_angle": [0.0, 2.0, 4.0]}
    asked = motions(m, scene, settings, rates, {"rocker_angle": np.array([0.0, 0.3, -0.2])})
    steps = grid(0.2, settings.timestep)
    one, two = (roll([asked], steps, threads=n)[0] for n in (1, 2))
    is_that_of_single_runs(one, asked, rates)
    assert np.array_equal(one.q, two.q) and np.array_equal(one.v, two.v)


@pytest.mark.parametrize("settings", [Settings(), Settings(integrator="discrete", timestep=5e-4, preset="stiff")], ids=lambda s: s.preset)
def test_drives_that_hold_and_gears_move_as_in_single_runs(lab, settings) -> None:
    for m, rates in ((lab.fourbar(), {"crank_angle": [0.0, 3.0]}), (planetary(), {"sun": [1.0, 20.0], "ring": [0.0, 3.0]})):
        scene = acting(m, Scene("held", duration=0.1))
        asked = motions(m, scene, settings, rates)
        # the damper stops the crank of the second within a step or two: "discrete" takes energy of its own there, and both say so
        is_that_of_single_runs(roll([asked], grid(0.1, settings.timestep))[0], asked, rates)


def test_servos_that_hold_and_viscous_loads_move_as_in_single_runs_to_rounding(lab) -> None:
    m, settings = lab.fourbar(stiffness=3.0, damping=0.02), Settings(timestep=5e-4)
    geared = planetary()
    laws = (Servo("crank_angle", Hold(0.3), 20.0, 0.1, feedforward=0.4), Viscous("rocker_angle", 0.05), Constant("crank_angle", 0.2))
    for mechanism, its_laws, rates in (
        (m, laws, {"crank_angle": [0.0, 3.0]}),
        (
            geared, (Viscous("carrier", 2e-3), Servo("ring", Hold(0.1), 1.0, 0.01), Motor("sun", 0.01, 30.0)),
            {"sun": [1.0, 9.0], "ring": [0.0, 1.0]},
        ),
    ):  # fmt: skip
        # with a law that needs a call the single runs evaluate all of them at every stage
        called = (*its_laws, FunctionLaw(next(iter(rates)), lambda t, plant: 0.0))
        scene = Scene("held", duration=0.2, laws=its_laws, drives="free")
        asked = motions(mechanism, scene, settings, rates)
        found = roll([asked], grid(0.2, settings.timestep))[0]
        for k in range(2):
            start = {name: x[k] for name, x in rates.items()}
            one = run(mechanism, replace(scene, laws=called, initial_rates=start), settings)
            # the servo starts with 7,500 rad/s2, whose rounding hard rows pass on to the rates
            assert np.abs(found.q[k] - one.q).max() < 2e-12 and np.abs(found.v[k] - one.v).max() < 1e-9
            assert found.reasons[k] == "" and one.health.trusted
            # each with its own rule for the work of dampers, far below the limit of 1e-2
            assert found.findings["energy_balance"][k] == pytest.approx(one.health.finding("energy_balance").value, abs=1e-4)
    stiff = replace(settings, integrator="discrete", preset="stiff")
    assert "servo" in why_not_together(m, Scene("held", duration=0.2, laws=laws), stiff)


def test_spherical_joints_and_damped_springs_move_as_in_single_runs() -> None:
    for name, fidelity, rates in (("delta6", "full", {"q1": [0.0, 0.3]}), ("flyball", "full", {"axis": [1.0, 2.0]})):
        design = ml.load(name)
        m = design.mechanism(fidelity if fidelity in design.entry.fidelities else None)
        rates = rates if next(iter(rates)) in m.scalar_names else {m.scalar_names[0]: [1.0, 2.0]}
        scene, settings = acting(m, Scene("held", duration=0.03)), Settings(timestep=2.5e-4)
        asked = motions(m, scene, settings, rates)
        found = roll([asked], grid(0.03, settings.timestep))[0]
        is_that_of_single_runs(found, asked, rates)
        for k in range(2):
            one = run(m, replace(scene, initial_rates={n: x[k] for n, x in rates.items()}), settings)
            # fast dampers of the drives: the work that RK4 takes at its stages is another sum than that of the states
            assert found.findings["energy_balance"][k] == pytest.approx(one.health.finding("energy_balance").value, abs=1e-3)


def test_the_work_of_a_damper_faster_than_a_step_is_known_from_where_it_got() -> None:
    """x'' = -x' / T from rate 1, h / T = 0.1, 0.5, 1. RK4 itself is off by (h / T)^5 / 120 in a step; the trapezoidal rule takes
    (h / T)^2 / 6 of the energy too much."""
    b = Builder("damped")
    b.body("bob", revolute("angle", damping=0.5), inertia=Inertia.point(1.0, (0.5, 0.0, 0.0)))
    m = b.build()
    for share, error in ((0.1, 1e-6), (0.5, 1e-3), (1.0, 2e-2)):
        settings = Settings(timestep=share * 0.5)
        scene = Scene("free", duration=10 * settings.timestep)
        found = roll([motions(m, scene, settings, {"angle": [1.0]})], grid(scene.duration, settings.timestep))[0]
        assert found.findings["energy_balance"][0] < error


def test_models_of_other_lengths_go_together_and_each_moves_as_alone() -> None:
    scene, settings = Scene("free", duration=0.1, drives="free"), Settings()
    steps = grid(0.1, settings.timestep)
    rates = [{"crank": [1.0, 5.0]}, {"hinge": [2.0]}, *[{"crank": [1.0, 5.0]}] * 2]
    asked = [motions(fourbar(crank=x, coupler=0.3 + 0.1 * x), scene, settings, rates[0]) for x in (0.08, 0.1, 0.12)]
    pendulum = Builder("swing", gravity=(0, -9.81, 0)).bar("bar", revolute("hinge"), 0.4).build()
    asked.insert(1, motions(pendulum, scene, settings, rates[1]))
    for batch, one, start in zip(roll(asked, steps), asked, rates, strict=True):
        is_that_of_single_runs(batch, one, start)
    few = roll(asked, steps, whole=False)
    assert all(np.array_equal(a.q[:, -1], b.q[:, -1]) for a, b in zip(few, roll(asked, steps), strict=True))


# -- faults ----------------------------------------------------------------------------------------------------------------


def test_a_motion_that_blows_up_is_named_and_leaves_the_others_alone() -> None:
    m, scene, settings = fourbar(), Scene("free", duration=0.2, drives="free"), Settings()
    steps = grid(0.2, settings.timestep)
    asked = motions(m, scene, settings, {"crank": [1.0, 3e3, 5.0]})  # 3 rad a step: no integrator follows that
    found, alone = roll([asked], steps)[0], roll([replace(asked, q=asked.q[::2], v=asked.v[::2])], steps)[0]
    assert found.reasons[0] == found.reasons[2] == "" and found.reasons[1] != ""
    assert not run(m, replace(scene, initial_rates={"crank": 3e3}), settings).health.trusted
    assert np.array_equal(found.q[::2], alone.q)


def test_a_loop_whose_constraint_is_gone_is_torn_open_when_it_is() -> None:
    m, scene, settings = fourbar(), Scene("free", duration=0.3, drives="free"), Settings()
    asked = motions(m, scene, settings, {"crank": [2.0, 2.0, 2.0]})

    def broken(models, start, push, count):
        cut = copy.copy(models[1])
        cut.eq_active0[:] = 0
        states, sensed = steps_of_engine(1)(models, start, push, count)
        states[1:2], sensed[1:2] = steps_of_engine(1)([cut], start[1:2], push[1:2], count)
        return states, sensed

    found = roll([asked], grid(0.3, settings.timestep), take=broken)[0]
    assert [r == "" for r in found.reasons] == [True, False, True] and "pin is torn open" in found.reasons[1]
    tree, rows = TreeKinematics(m), ConstraintSet(m)
    gaps = np.array([np.linalg.norm(rows.residual(tree.set(q))[:3]) for q in found.q[1]])
    first = found.t[np.argmax(gaps > OPEN_LOOP * 0.1)]  # of the shortest link, the crank
    assert f"at t = {first:.6g} s" in found.reasons[1] and found.findings["loop_gap"][1] == pytest.approx(gaps.max(), rel=0.5)


def test_a_state_that_left_the_constraints_is_found_by_the_kinematics() -> None:
    """The engine's sensors say nothing here: the states are changed behind its back."""
    m, scene, settings = planetary(), Scene("free", duration=0.05), Settings()
    asked = motions(m, scene, settings, {"sun": [1.0, 2.0], "ring": [0.0, 1.0]})

    def slipped(models, start, push, count):
        states, sensed = steps_of_engine(1)(models, start, push, count)
        states[0, 30:, 1] += 1e-3
        return states, sensed

    found = roll([asked], grid(0.05, settings.timestep), take=slipped)[0]
    assert "slip by up to" in found.reasons[0] and found.reasons[1] == ""


def test_a_mode_that_the_scene_keeps_and_a_motion_changes() -> None:
    m, settings = fourbar(), Settings()
    free = Scene("free", duration=0.25, drives="free", keep_mode=("rocker",))
    asked = motions(m, free, settings, {"crank": [6.0, 25.0]})  # a whole turn passes both dead points of the crank seen from the rocker
    found = roll([asked], grid(0.25, settings.timestep))[0]
    folded = np.sign(np.sin(found.q[:, :, m.q_slice["coupler"].start] + m.zero("coupler")))
    changes = [np.count_nonzero(np.diff(x)) for x in folded]
    assert changes[0] == 0 < changes[1] and found.findings["assembly_mode"].tolist() == changes
    assert found.reasons[0] == "" and "assembly mode changed" in found.reasons[1]


def test_the_end_of_a_range_takes_energy_and_that_is_no_fault() -> None:
    b = Builder("bell", gravity=(0.0, -9.81, 0.0))
    b.body("bob", revolute("angle", range=(-0.5, 0.5)), inertia=Inertia.point(1.0, (0.5, 0.0, 0.0)))
    m, scene, settings = b.build(), Scene("free", duration=0.6), Settings()
    asked = motions(m, scene, settings, {"angle": [0.0, 1.0]})
    found = roll([asked], grid(0.6, settings.timestep))[0]
    assert run(m, scene, settings).health.trusted and found.reasons == ("", "")
    assert abs(found.q[0, :, 0]).max() > 0.4999  # it was there


def test_what_python_evaluates_is_refused_by_name() -> None:
    m, settings = fourbar(), Settings()
    scene = Scene("drag", duration=0.1, laws=(Harmonic("crank", 0.1, 3.0),))
    assert "harmonic" in why_not_together(m, scene, settings)
    with pytest.raises(MechlabError, match="harmonic"):
        roll([motions(m, scene, settings, {"crank": [1.0]})], grid(0.1, settings.timestep))


# -- kinematics of many poses ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["spherical", "revolute", "cylindrical", "universal"])
def test_residuals_of_many_poses_are_those_of_one_row_by_row(lab, kind) -> None:
    m = lab.fourbar(kind)
    rows, constraints, tree = BatchRows(BatchTree(m)), ConstraintSet(m), TreeKinematics(m)
    q = np.random.default_rng(3).uniform(-1.0, 1.0, (7, m.nq))
    order = [constraints.rows.index(name) for name in rows.names]
    truth = np.array([constraints.residual(tree.set(x))[order] for x in q])
    assert np.allclose(rows.residual(q), truth, rtol=0, atol=1e-15 * 10)
    assert np.allclose(rows.system(q)[:, :, -1], truth, rtol=0, atol=1e-15 * 10)


def test_the_mode_of_many_poses_is_that_of_one() -> None:
    m = fourbar()
    q = np.random.default_rng(5).uniform(-2.0, 2.0, (40, m.nq))
    signs = mode_signs(m, q, ["rocker"])
    assert set(signs.tolist()) == {-1.0, 1.0}
    assert signs.tolist() == [mode_sign(m, x, ["rocker"]) for x in q]
