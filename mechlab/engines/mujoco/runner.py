"""A scene run by MuJoCo: Mechanism + Scene + Settings -> Recording with channels, health and cost."""

from __future__ import annotations

import platform
from collections.abc import Sequence

import mujoco
import numpy as np

from mechlab.clock import costed, move_cost, spent_on
from mechlab.engines.mujoco.after_run import HeldDrives
from mechlab.engines.mujoco.control import controlled, engine
from mechlab.engines.mujoco.drive import Driver, RunModel, engaged, lent_model, put_start, springs_of
from mechlab.engines.mujoco.findings import health, masses_finding
from mechlab.engines.mujoco.plant import MujocoPlant
from mechlab.engines.mujoco.samples import RunSamples
from mechlab.engines.mujoco.sparse import sparse_is_right, sparse_steps
from mechlab.engines.mujoco.stepping import Grid, advance, grid, sparsely
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.assembly_modes import ModeWatch
from mechlab.experiment.recording import Cost, Health, Recording
from mechlab.experiment.scene import MUJOCO_INTEGRATORS, Scene, Settings, initial_state
from mechlab.mechanism.model import Mechanism


def run(
    mechanism: Mechanism,
    scene: Scene,
    settings: Settings | None = None,
    sample_times: Sequence[float] | None = None,
) -> Recording:
    """Run a scene with MuJoCo; `settings` default to those the scene recommends.

    The laws of the scene are the only forces besides gravity, springs and dampers: they are evaluated at every stage of
    a step, with the time and state of that stage; where all are springs and dampers to RK4 they are parts of the model
    (`mechlab.engines.mujoco.springs`). A declared drive acts through a law of the scene alone (scenes of a
    design have one: see `mechlab.experiment.acting`). The engine's own actuators apply these laws, so that the motion
    is that of the MJCF file with all controls at 0, and methods that are implicit in actuators are so here too.

    Channels: those of `basic_channels`; NAME_accel of joints and shafts; NAME_force of whatever a law acts on;
    reactions (see `Reactions`). Each sample is evaluated at its own state (mj_forward), none lags behind.

    A run that blows up ends there: the recording holds the samples before, and its health the time and the reason.
    Raises MechlabError for bad input, and whatever a law raises. Runs may be made in several threads at once.
    """
    chosen = settings or scene.settings
    return _run(mechanism, scene, chosen, grid(scene.duration, chosen.timestep, sample_times), judged=True)


def run_at(mechanism: Mechanism, scene: Scene, settings: Settings, times: Sequence[float]) -> Recording:
    """The same motion, recorded at its ends and at or around `times` alone, without findings: for a comparison with another run. It is
    looked at for open loops and lost modes at these times only."""
    return _run(mechanism, scene, settings, grid(scene.duration, settings.timestep, times, 1, 0.0), judged=False)


@costed
def _run(mechanism: Mechanism, scene: Scene, chosen: Settings, steps: Grid, judged: bool) -> Recording:
    if chosen.engine != "mujoco":
        raise MechlabError(f"settings are for the engine {chosen.engine!r}, this is the runner of 'mujoco'.")
    if chosen.integrator not in MUJOCO_INTEGRATORS:
        raise unknown("integrator of mujoco", chosen.integrator, MUJOCO_INTEGRATORS)
    springs = springs_of(mechanism, scene.laws, chosen) or ()
    if not (engaged(scene.laws) or any(x.stiffness or x.damping for x in springs)):
        springs = ()  # constant loads alone are put there once by the driver
    with lent_model(mechanism, chosen, scene.laws, springs) as lent:
        return _recorded(mechanism, scene, chosen, steps, judged, lent, bool(springs))


def _recorded(
    mechanism: Mechanism, scene: Scene, chosen: Settings, steps: Grid, judged: bool, lent: RunModel, in_model: bool
) -> Recording:
    """The run, on a model with the settings; in_model: all laws are springs and dampers of it."""
    model, data, map_ = lent
    q, v = initial_state(mechanism, scene)
    put_start(data, map_, q, v)
    driver = Driver(mechanism, scene.laws, MujocoPlant(mechanism, model, data, map_), in_model)
    after = driver.afterwards(steps, judged)
    samples = RunSamples(model, data, map_, driver, ModeWatch(mechanism, scene.keep_mode), after, judged)
    act = driver if judged else driver.unaccounted
    with controlled(data, act) if after is None else engine(), spent_on("record"):
        # laws in Python read the dense rows in the middle of a step, reactions of distance loops at the samples
        sparse = (after is not None or not driver.reads_rows) and sparse_is_right(model, data)
        step = after.between if isinstance(after, HeldDrives) else None
        with sparse_steps(model, sparse and not samples.reactions.distances):
            # of distance loops samples are made in the same data, and sparse steps evaluate by another way
            evaluate = None if sparse or samples.reactions.distances else samples.evaluate
            take = samples.keep if evaluate else samples.take
            blow_up, cpu, done = advance(model, data, map_, steps, take, sparsely(step) if sparse else step, evaluate)
    move_cost("record", "integrate", cpu)
    if not samples.t:
        raise MechlabError(f"{mechanism.name}: MuJoCo's accelerations at t = 0 are not finite.")
    with spent_on("record"):
        if samples.cut():  # the run ends there, whatever came after
            blow_up, done = None, steps.samples[len(samples.t) - 1]
        channels, units = samples.channels()
    found = Health()
    with spent_on("check"):
        if judged:
            ahead = [f for f in (samples.loops.finding(scene.duration), masses_finding(map_, q, data)) if f is not None]
            found = Health(tuple(ahead)) + health(mechanism, scene, chosen, data, blow_up, samples)
    per_step = 4 if chosen.integrator == "RK4" else 1
    return Recording(
        mechanism=mechanism, t=np.array(samples.t), q=samples.states[0], v=samples.states[1], channels=channels, units=units,
        health=found, cost=Cost(cpu, done, per_step * done), settings=chosen, scene=scene.name, name=mechanism.name,
        fidelity=scene.fidelity, versions=versions(),
    )  # fmt: skip


def versions() -> dict[str, str]:
    """Versions of what a run depends on."""
    import scipy  # answers of a single pose do without

    return {
        "mujoco": mujoco.__version__,
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "python": platform.python_version(),
    }
