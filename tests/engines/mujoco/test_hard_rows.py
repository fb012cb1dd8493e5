"""Accelerations and reactions that a run on MuJoCo records are those of rigid rows, whatever the softness of the engine's."""

import dataclasses

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.mujoco.closure import ExactDynamics
from mechlab.engines.mujoco.hard_rows import HardRows
from mechlab.engines.mujoco.model import MujocoMap, to_mujoco
from mechlab.engines.mujoco.runner import run_at
from mechlab.engines.protocol import engine
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import PRESETS, Settings, initial_state
from mechlab.lab.single_run import complete

SHARP = Settings("pinocchio", "DOP853", tolerance=1e-11, preset="sharp")
"""Rigid rows by equations of their own; positions to 1e-9."""
CASES = [
    ("fourbar", "constant-torque", "minimal"), ("evans", "free-run", "minimal"), ("hart", "free-run", "minimal"),
    ("slider_crank", "free-run", "full"), ("delta6", "gravity-hold", "minimal"), ("wolfrom", "constant-torques", "parts"),
    ("v_engine", "driven-crank", "minimal"),
]  # fmt: skip


def scene_of(name: str, scene: str, fidelity: str) -> tuple[ml.Design, ml.Scene]:
    design = ml.load(name).for_scene(scene)
    plan = design.scene(scene, fidelity)
    return design, dataclasses.replace(plan, duration=min(plan.duration, 0.3))


def differences(run: Recording, design: ml.Design, plan: ml.Scene) -> dict[str, tuple[float, float]]:
    """Channel -> its largest difference from Pinocchio at some samples, and its largest value."""
    m = design.mechanism(plan.fidelity)
    times = np.union1d(run.t[:4], run.t[::10])
    truth = complete(design, engine("pinocchio").run(m, plan, SHARP, times.tolist()), plan)
    mine, theirs = (np.clip(np.searchsorted(r.t, times * (1.0 - 1e-12)), 0, len(r.t) - 1) for r in (run, truth))
    both = [(n, run.channels[n][mine], truth.channels[n][theirs]) for n in run.channels if n in truth.channels]
    return {n: (float(np.max(np.abs(a - b))), float(np.max(np.abs(b)))) for n, a, b in both}


@pytest.mark.parametrize(("name", "scene", "fidelity"), CASES)
def test_stated_errors_hold_in_all_channels(name: str, scene: str, fidelity: str) -> None:
    design, plan = scene_of(name, scene, fidelity)
    run = ml.simulate(design, scene=scene, fidelity=fidelity, duration=plan.duration)
    found = differences(run, design, plan)
    assert len(found) > 10
    # Pinocchio's own states are known to 1e-9, its accelerations to 1e-7 of their size
    low = {n: (off, run.errors[n]) for n, (off, size) in found.items() if off - 1e-7 * max(1.0, size) > run.errors[n]}
    assert not low


@pytest.mark.parametrize(("name", "scene", "fidelity"), CASES[:3])
def test_accelerations_converge_with_the_step(name: str, scene: str, fidelity: str) -> None:
    """Rates of soft rows are off in proportion to h, and so are accelerations and forces; those of the soft rows stay off by some 1e-3."""
    design, plan = scene_of(name, scene, fidelity)
    m, off = design.mechanism(plan.fidelity), []
    for step in (5e-4, 1.25e-4):
        run = engine("mujoco").run(m, plan, dataclasses.replace(PRESETS["accurate"], timestep=step))
        found = differences(run, design, plan)
        off.append(max(gap / size for n, (gap, size) in found.items() if run.units[n] in ("rad/s2", "N", "N m") and size > 1e-3))
    assert off[1] < 0.4 * off[0]  # a quarter by the order
    assert off[1] < 1e-4


@pytest.mark.parametrize("name", ["evans", "delta6", "bricard"])
def test_accelerations_of_rigid_rows_by_linear_algebra(name: str) -> None:
    design = ml.load(name).for_scene(None)
    scene = design.scene()
    m = design.mechanism(scene.fidelity)
    model, data = to_mujoco(m, dataclasses.replace(PRESETS["accurate"], integrator="implicitfast"))
    map_, (q, v) = MujocoMap(m, model), initial_state(m, scene)
    data.qpos[:] = map_.engine_coordinates(q)
    data.qvel[:] = map_.engine_rates(data.qpos, v)
    data.qfrc_applied[0] = 1.0
    mujoco.mj_forward(model, data)
    soft, force = data.qacc.copy(), data.qfrc_constraint.copy()
    exact, _ = ExactDynamics(model).solve(data)
    rows = HardRows(map_)
    rows.solve(data)
    size = np.linalg.norm(exact)
    assert np.linalg.norm(data.qacc - exact) < 1e-5 * size  # SMALL is 1e-6, of the rows
    assert np.linalg.norm(soft - exact) > 1e-5 * size
    rows.put_back(data)
    np.testing.assert_array_equal(data.qacc, soft)
    np.testing.assert_array_equal(data.qfrc_constraint, force)


@pytest.mark.parametrize("integrator", ["RK4", "Euler", "implicit", "implicitfast", "discrete"])
def test_sampling_does_not_change_the_motion(integrator: str) -> None:
    design, plan = scene_of(*CASES[1])
    m, settings = design.mechanism(plan.fidelity), dataclasses.replace(PRESETS["accurate"], integrator=integrator)
    often = engine("mujoco").run(m, plan, settings)
    seldom = run_at(m, plan, settings, [plan.duration])
    assert len(often.t) > 10 * len(seldom.t)
    np.testing.assert_array_equal(often.q[-1], seldom.q[-1])
    np.testing.assert_array_equal(often.v[-1], seldom.v[-1])
