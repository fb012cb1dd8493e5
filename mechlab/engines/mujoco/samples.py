"""What is recorded of a run on MuJoCo: evaluated states one by one, numbers for all of them at once."""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import mujoco
import numpy as np

from mechlab.engines.mujoco.findings import FrictionWatch, LoopWatch
from mechlab.engines.mujoco.model import MujocoMap
from mechlab.engines.mujoco.reactions import Reactions
from mechlab.engines.mujoco.stepping import finite
from mechlab.errors import MechlabError
from mechlab.experiment.findings import ModeWatch
from mechlab.experiment.recording import run_channels
from mechlab.mechanism.geometry import Array


class ForceSource(Protocol):
    """What samples ask of a Driver."""

    sampling: bool
    targets: tuple[str, ...]

    @property
    def work(self) -> float:
        """Work of the forces since the start [J]."""
        ...

    def now(self) -> list[float]:
        """Forces in the order of `targets`."""
        ...


class RunSamples:
    """See the module. `more_work` (n,) [J] and `allowance` [J] add to what the samples tell of work and of energy in soft rows."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, map_: MujocoMap, driver: ForceSource, watch: ModeWatch
    ) -> None:
        self.model, self.data, self.map, self.driver = model, data, map_, driver
        self.reactions = Reactions(map_)
        self.watch = watch
        self.loops = LoopWatch(map_)
        self.friction = FrictionWatch(map_)
        self.t: list[float] = []
        self._states: list[tuple[Array, Array]] = []
        self._force: list[list[float]] = []
        self._work: list[float] = []
        self.more_work: Array | float = 0.0
        self.allowance = 0.0

    def take(self, t: float) -> bool:
        """Evaluate the present state and record it; a state that is not finite is left out. True: end the run here,
        a loop has opened or the assembly mode is not the one to keep."""
        data = self.data
        self.driver.sampling = True
        mujoco.mj_forward(self.model, data)
        self.driver.sampling = False
        if not finite(data.qacc):
            if not self.t:
                raise MechlabError(f"{self.map.mechanism.name}: MuJoCo's accelerations at t = 0 are not finite.")
            return False
        self.t.append(t)
        self._states.append((data.qpos.copy(), data.qvel.copy()))
        self.reactions.keep(data)
        self._force.append(self.driver.now())
        self._work.append(self.driver.work)
        self.friction.take(data)
        return self.loops.opened(t, data) or (self.watch.watches and self.watch.changed(self.map.coordinates(data.qpos)))

    @cached_property
    def states(self) -> tuple[Array, Array]:
        """Coordinates (n, nq) and rates (n, nv) of the mechanism, once all samples are taken."""
        qpos, qvel = zip(*self._states, strict=True)
        return self.map.coordinates(np.array(qpos)), self.map.rates(np.array(qvel))

    def channels(self) -> tuple[dict[str, Array], dict[str, str]]:
        """All channels of the run, with units."""
        channels, units = run_channels(self.map.mechanism, *self.states, self.reactions.accelerations(), self.forces)
        load = self.reactions.loads()
        return channels | {name: load[:, k] for k, name in enumerate(self.reactions.names)}, units | self.reactions.units

    @property
    def forces(self) -> dict[str, Array]:
        """Joint or shaft -> (n,) force of the laws on it."""
        values = np.array(self._force).reshape(len(self.t), len(self.driver.targets))
        return {name: values[:, k] for k, name in enumerate(self.driver.targets)}

    @property
    def work(self) -> Array:
        """(n,) work of the laws since the start [J]."""
        return np.array(self._work) + self.more_work

    @property
    def slip(self) -> tuple[float, float, float]:
        """Largest residual of the relations over all samples, measured and predicted, and the work in their soft rows."""
        measured, predicted, taken = self.reactions.slip()
        return measured, predicted, taken + self.allowance
