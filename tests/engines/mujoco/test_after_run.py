"""Held drives whose forces and work are told after the run, against the formula of the drive and conservation of energy."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.mujoco.after_run import HeldDrives
from mechlab.engines.mujoco.drive import Driver, put_start, run_model
from mechlab.engines.mujoco.plant import MujocoPlant
from mechlab.engines.mujoco.runner import run
from mechlab.engines.mujoco.stepping import advance, grid
from mechlab.experiment.energy import energy
from mechlab.experiment.laws import Servo
from mechlab.experiment.motion import Hold
from mechlab.experiment.scene import Scene, Settings, initial_state

STIFFNESS, DAMPING = 20.0, 0.3


def held() -> tuple[ml.Mechanism, Scene]:
    """The pendulum of the catalog, held .4 rad away from its start by a declared drive."""
    b = ml.edit(ml.load("pendulum").mechanism(None))
    joint = b.assemble().joints[0].name
    b.drive(joint, stiffness=STIFFNESS, damping=DAMPING)
    m = b.assemble()
    law = Servo(joint, Hold(m.zero(joint)), STIFFNESS, DAMPING, drive=m.drives[0].name)
    return m, Scene("held", "", 0.5, (law,), initial={joint: m.zero(joint) + 0.4})


@pytest.mark.parametrize("duration", [0.5, 1.7995])
def test_forces_and_work_of_a_held_drive(duration: float) -> None:
    m, scene = held()
    scene = replace(scene, duration=duration)
    name = m.joints[0].name
    found = run(m, scene, Settings())
    force = -STIFFNESS * (found.channels[name] - m.zero(name)) - DAMPING * found.channels[f"{name}_rate"]
    assert found.channels[f"{name}_force"] == pytest.approx(force, abs=1e-12)

    model, data, map_ = run_model(m, Settings(), scene.laws)
    put_start(data, map_, *initial_state(m, scene))
    steps = grid(duration, 1e-3)
    after = Driver(m, scene.laws, MujocoPlant(m, model, data, map_)).afterwards(steps, judged=True)
    assert isinstance(after, HeldDrives)
    rows: list[tuple[np.ndarray, ...]] = []

    def keep(t: float) -> bool:
        rows.append((data.qpos.copy(), data.qvel.copy(), data.qacc.copy()))
        return False

    advance(model, data, map_, steps, keep, after.between, lambda leads: mujoco.mj_forward(model, data))
    q, v, a = (np.array(x) for x in zip(*rows, strict=True))
    gained = energy(m, map_.coordinates(q), map_.rates(v))
    # RK4 and the rule are of order 4; the fastest rate is about 100 1/s here: (.1)^4 / 100 of some J
    assert after.work(q, v, a) == pytest.approx(gained - gained[0], abs=1e-5 * np.ptp(gained))
