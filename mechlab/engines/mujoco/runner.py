"""A scene run by MuJoCo: Mechanism + Scene + Settings -> Recording with channels, health and cost."""

from __future__ import annotations

import platform
from collections.abc import Sequence

import mujoco
import numpy as np
import scipy

from mechlab.clock import costed, spent_on
from mechlab.engines.mujoco.control import controlled, engine
from mechlab.engines.mujoco.drive import Driver, put_start, run_model
from mechlab.engines.mujoco.findings import FrictionWatch, LoopWatch, health, masses_finding
from mechlab.engines.mujoco.model import MujocoMap
from mechlab.engines.mujoco.plant import MujocoPlant
from mechlab.engines.mujoco.reactions import Reactions
from mechlab.engines.mujoco.sparse import sparse_is_right
from mechlab.engines.mujoco.stepping import advance, grid, sparsely
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.findings import ModeWatch
from mechlab.experiment.recording import Cost, Health, Recording, run_channels
from mechlab.experiment.scene import MUJOCO_INTEGRATORS, Scene, Settings, initial_state
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism


@costed
def run(
    mechanism: Mechanism,
    scene: Scene,
    settings: Settings | None = None,
    sample_times: Sequence[float] | None = None,
) -> Recording:
    """Run a scene with MuJoCo; `settings` default to those the scene recommends.

    The laws of the scene are the only forces besides gravity, springs and dampers: they are evaluated at every stage of
    a step, with the time and state of that stage. A declared drive acts through a law of the scene alone (scenes of a
    design have one: see `mechlab.experiment.acting`). The engine's own actuators apply these laws, so that the motion
    is that of the MJCF file with all controls at 0, and methods that are implicit in actuators are so here too.

    Channels: those of `basic_channels`; NAME_accel of joints and shafts; NAME_force of whatever a law acts on;
    reactions (see `Reactions`). Each sample is evaluated at its own state (mj_forward), none lags behind.

    A run that blows up ends there: the recording holds the samples before, and its health the time and the reason.
    Raises MechlabError for bad input, and whatever a law raises. Runs may be made in several threads at once.
    """
    chosen = settings or scene.settings
    if chosen.engine != "mujoco":
        raise MechlabError(f"settings are for the engine {chosen.engine!r}, this is the runner of 'mujoco'.")
    if chosen.integrator not in MUJOCO_INTEGRATORS:
        raise unknown("integrator of mujoco", chosen.integrator, MUJOCO_INTEGRATORS)
    steps = grid(scene.duration, chosen.timestep, sample_times)
    q, v = initial_state(mechanism, scene)
    model, data, map_ = run_model(mechanism, chosen, scene.laws)
    put_start(data, map_, q, v)
    driver = Driver(mechanism, scene.laws, MujocoPlant(mechanism, model, data, map_))
    samples = _Samples(mechanism, model, data, map_, driver, ModeWatch(mechanism, scene.keep_mode))
    with controlled(data, driver) if driver.called else engine(), spent_on("record"):
        # laws in Python read the dense rows in the middle of a step
        sparse = not driver.called and sparse_is_right(model, data)
        blow_up, cpu, done = advance(model, data, map_, steps, samples.take, sparsely if sparse else None)
    t, states = np.array(samples.t), (np.array(samples.q), np.array(samples.v))
    with spent_on("record"):
        channels, units = samples.channels(mechanism, *states)
    with spent_on("check"):
        findings = health(mechanism, scene, chosen, data, blow_up, samples, states)
        ahead = [f for f in (samples.loops.finding(scene.duration), masses_finding(map_, q)) if f is not None]
        findings = Health(tuple(ahead)) + findings
    per_step = 4 if chosen.integrator == "RK4" else 1
    return Recording(
        mechanism=mechanism, t=t, q=states[0], v=states[1], channels=channels, units=units, health=findings,
        cost=Cost(cpu, done, per_step * done), settings=chosen, scene=scene.name, name=mechanism.name,
        fidelity=scene.fidelity, versions=versions(),
    )  # fmt: skip


def versions() -> dict[str, str]:
    """Versions of what a run depends on."""
    return {
        "mujoco": mujoco.__version__,
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "python": platform.python_version(),
    }


class _Samples:
    """What is recorded of a run, sample by sample."""

    def __init__(
        self,
        mechanism: Mechanism,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        map_: MujocoMap,
        driver: Driver,
        watch: ModeWatch,
    ) -> None:
        self.model, self.data, self.map, self.driver = model, data, map_, driver
        self.reactions = Reactions(map_)
        self.watch = watch
        self.loops = LoopWatch(map_)
        self.friction = FrictionWatch(map_)
        self.t: list[float] = []
        self.q: list[Array] = []
        self.v: list[Array] = []
        self._a: list[Array] = []
        self._force: list[list[float]] = []
        self._load: list[Array] = []
        self._work: list[float] = []
        self._slip: list[tuple[float, float, float]] = []

    def take(self, t: float) -> bool:
        """Evaluate the present state and record it; a state that is not finite is left out. True: end the run here,
        a loop has opened or the assembly mode is not the one to keep."""
        data = self.data
        self.driver.sampling = True
        mujoco.mj_forward(self.model, data)
        self.driver.sampling = False
        if not np.all(np.isfinite(data.qacc)):
            if not self.t:
                raise MechlabError(f"{self.map.mechanism.name}: MuJoCo's accelerations at t = 0 are not finite.")
            return False
        self.t.append(t)
        self.q.append(self.map.coordinates(data.qpos))
        self.v.append(self.map.rates(data.qvel))
        acceleration, load = self.reactions.read(data)
        self._a.append(acceleration)
        self._load.append(load)
        self._force.append(self.driver.now())
        self._work.append(self.driver.work)
        self._slip.append(self.reactions.slip(data))
        self.friction.take(data)
        return self.loops.opened(t, data) or self.watch.changed(self.q[-1])

    def channels(self, mechanism: Mechanism, q: Array, v: Array) -> tuple[dict[str, Array], dict[str, str]]:
        """All channels of the run, with units."""
        channels, units = run_channels(mechanism, q, v, np.array(self._a), self.forces)
        if self.reactions.names:
            load = np.array(self._load)
            channels |= {name: load[:, k] for k, name in enumerate(self.reactions.names)}
            units |= self.reactions.units
        return channels, units

    @property
    def forces(self) -> dict[str, Array]:
        """Joint or shaft -> (n,) force of the laws on it."""
        values = np.array(self._force).reshape(len(self.t), len(self.driver.targets))
        return {name: values[:, k] for k, name in enumerate(self.driver.targets)}

    @property
    def work(self) -> Array:
        """(n,) work of the laws since the start [J]."""
        return np.array(self._work)

    @property
    def slip(self) -> tuple[float, float, float]:
        """Largest residual of the relations over all samples, measured and predicted, and the work in their soft rows."""
        worst = np.max(self._slip, axis=0)
        return float(worst[0]), float(worst[1]), float(worst[2])
