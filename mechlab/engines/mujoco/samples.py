"""What is recorded of a run on MuJoCo: evaluated states one by one, numbers for all of them at once."""

from __future__ import annotations

from functools import cached_property
from typing import Protocol, cast

import mujoco
import numpy as np

from mechlab.engines.mujoco.after_run import AfterRun
from mechlab.engines.mujoco.findings import FrictionWatch, LoopWatch
from mechlab.engines.mujoco.model import MujocoMap
from mechlab.engines.mujoco.reactions import Reactions
from mechlab.engines.mujoco.stepping import finite
from mechlab.experiment.assembly_modes import WATCHED, ModeWatch
from mechlab.experiment.recording import run_channels
from mechlab.mechanism.geometry import Array


class ForceSource(Protocol):
    """What samples ask of a Driver."""

    sampling: bool
    leads: bool
    targets: tuple[str, ...]

    @property
    def work(self) -> float:
        """Work of the forces since the start [J]."""
        ...

    def now(self) -> list[float]:
        """Forces in the order of `targets`."""
        ...


class RunSamples:
    """See the module. after: what tells forces and work once all samples are taken, else the driver does at each of them. judged:
    whether a health record will be made of them.
    `more_work` (n,) [J] and `allowance` [J] add to what the samples tell of work and of energy in soft rows."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, map_: MujocoMap, driver: ForceSource, watch: ModeWatch,
        after: AfterRun | None = None, judged: bool = True,
    ) -> None:  # fmt: skip
        self.model, self.data, self.map, self.driver = model, data, map_, driver
        self.reactions = Reactions(map_, judged)
        self.watch, self.after = watch, after
        self._motion = data.qpos, data.qvel, data.qacc
        self.loops = LoopWatch(map_)
        self.friction = FrictionWatch(map_)
        self.t: list[float] = []
        self._states: list[tuple[Array, Array]] = []
        self._force: list[list[float]] = []
        self._work: list[float] = []
        self._looked_at, self._last = 0, cast("int | None", None)
        self.more_work: Array | float = 0.0
        self.allowance = 0.0

    def take(self, t: float) -> bool:
        """`evaluate` the present state and `keep` it; one whose accelerations are not finite is left out."""
        self.evaluate()
        return finite(self._motion[2]) and self.keep(t)

    def evaluate(self, leads: bool = False) -> None:
        """Evaluate the present state; leads: the next step goes on from there."""
        driver = self.driver
        driver.sampling, driver.leads = True, leads
        mujoco.mj_forward(self.model, self.data)
        driver.sampling = False

    def keep(self, t: float) -> bool:
        """Record the state that was evaluated. True: end the run here, a loop has opened, or the assembly mode, which is looked at
        once in WATCHED samples, is not the one to keep: `cut` says where."""
        data, (qpos, qvel, _) = self.data, self._motion
        self.t.append(t)
        self._states.append((qpos.copy(), qvel.copy()))
        self.reactions.keep(data)
        if self.after is None:
            self._force.append(self.driver.now())
            self._work.append(self.driver.work)
        self.friction.take(data)
        return self.loops.opened(t, data) or (self.watch.watches and self._mode_lost(WATCHED))

    def _mode_lost(self, least: int) -> bool:
        """Whether the assembly mode changed in the samples that were not looked at yet; they are looked at from `least` on."""
        if len(self._states) - self._looked_at < least:
            return False
        qpos = np.array([x for x, _ in self._states[self._looked_at :]]).reshape(-1, self.model.nq)
        change = self.watch.first_change(self.map.coordinates(qpos))
        self._last = None if change is None else self._looked_at + change
        self._looked_at = len(self._states)
        return change is not None

    def cut(self) -> bool:
        """Drop the samples after the first in another assembly mode than the one to keep; whether there is such a sample."""
        if self._last is None and not self._mode_lost(0):
            return False
        assert self._last is not None
        count = self._last + 1
        for kept in (self.t, self._states, self._force, self._work):
            del kept[count:]
        self.reactions.cut(count)
        self.friction.cut(count)
        self.loops.cut(self.t[-1])
        return True

    @cached_property
    def _motions(self) -> tuple[Array, Array]:
        """The engine's coordinates (n, nq) and rates (n, nv), once all samples are taken."""
        qpos, qvel = zip(*self._states, strict=True)
        return np.array(qpos), np.array(qvel)

    @cached_property
    def states(self) -> tuple[Array, Array]:
        """Coordinates (n, nq) and rates (n, nv) of the mechanism, once all samples are taken."""
        qpos, qvel = self._motions
        return self.map.coordinates(qpos), self.map.rates(qvel)

    def channels(self) -> tuple[dict[str, Array], dict[str, str]]:
        """All channels of the run, with units."""
        channels, units = run_channels(self.map.mechanism, *self.states, self.reactions.accelerations(), self.forces)
        load = self.reactions.loads()
        return channels | {name: load[:, k] for k, name in enumerate(self.reactions.names)}, units | self.reactions.units

    @property
    def forces(self) -> dict[str, Array]:
        """Joint or shaft -> (n,) force of the laws on it."""
        if self.after is not None:
            return self.after.forces(*self._motions)
        values = np.array(self._force).reshape(len(self.t), len(self.driver.targets))
        return {name: values[:, k] for k, name in enumerate(self.driver.targets)}

    @property
    def work(self) -> Array:
        """(n,) work of the laws since the start [J]."""
        if self.after is not None:
            return self.after.work(*self._motions, self.reactions.engine_accelerations()) + self.more_work
        return np.array(self._work) + self.more_work

    @property
    def slip(self) -> tuple[float, float, float]:
        """Largest residual of the relations over all samples, measured and predicted, and the work in their soft rows."""
        measured, predicted, taken = self.reactions.slip()
        return measured, predicted, taken + self.allowance
