"""Forces and work of laws that the engine applies by itself, from the states of a run: no Python is called while it steps.

Such laws are constant loads, whose work is force x displacement, or springs and dampers: drives that hold, which have actuators, and
laws that are put into the model (`mechlab.engines.mujoco.springs`). With their forces f = c + A_q q + A_v v, the rates u = B v of
their targets and the power p = f . u a step from state 0 to 1 has the work

    W = h (p0 + p1) / 2 + h^2 (p0' - p1') / 12,       p' = (A_q v + A_v a) . u + f . B a

with RK4, of its order; with methods of one evaluation a step that of the trapezoidal rule.
"""

from __future__ import annotations

from typing import Protocol

import mujoco
import numpy as np

from mechlab.engines.mujoco.model import MujocoMap
from mechlab.engines.mujoco.stepping import INTEGRATE, Grid
from mechlab.experiment.laws.compiled import CompiledLaws
from mechlab.mechanism.geometry import Array

MOST_NUMBERS = 4_000_000
"""Most numbers that are kept of the steps between samples."""


class StepsBetween:
    """Takes the steps between samples one by one, and keeps the state and acceleration before each of them."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._integrate = INTEGRATE.get(int(model.opt.integrator))
        self._motion = data.qpos, data.qvel, data.qacc
        self.numbers: list[int] = []
        self.states: list[tuple[Array, Array, Array]] = []

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData, steps: Grid, start: int, end: int) -> None:
        """As `take_steps`."""
        (q, v, a), integrate = self._motion, self._integrate
        try:
            for k in range(start, end):
                if k >= steps.whole:
                    model.opt.timestep = steps.duration - k * steps.timestep
                if integrate is not None:
                    mujoco.mj_forward(model, data)
                self.numbers.append(k)
                self.states.append((q.copy(), v.copy(), a.copy()))
                if integrate is None:
                    mujoco.mj_step(model, data)
                else:
                    integrate(model, data)
        finally:
            model.opt.timestep = steps.timestep


class AfterRun(Protocol):
    """Forces and work of laws, told from the engine's states q (n, nq), v (n, nv) at the samples of a run."""

    def forces(self, q: Array, v: Array) -> dict[str, Array]:
        """Joint or shaft -> (n,) force."""
        ...

    def work(self, q: Array, v: Array, a: Array) -> Array:
        """(n,) work [J] since the first sample; a (n, nv): accelerations."""
        ...


class ConstantLoads:
    """Constant forces on joints and shafts."""

    def __init__(self, map_: MujocoMap, values: dict[str, float]) -> None:
        self.map, self.values = map_, values

    def forces(self, q: Array, v: Array) -> dict[str, Array]:
        """See `AfterRun`."""
        return {name: np.full(len(q), f) for name, f in self.values.items()}

    def work(self, q: Array, v: Array, a: Array) -> Array:
        """See `AfterRun`."""
        out, mine = np.zeros(len(q)), self.map.coordinates(q)
        for name, f in self.values.items():
            value = self.map.mechanism.value(name, mine)
            out += f * (value - value[0])
        return out


class HeldDrives:
    """Springs, dampers and constant forces, as affine laws that do not change with time, in a run over the `steps`; `between`: the steps
    that are not samples, None where nobody asks for the work."""

    def __init__(self, laws: CompiledLaws, steps: Grid, fourth_order: bool, between: StepsBetween | None) -> None:
        self.laws, self.steps, self.fourth_order, self.between = laws, steps, fourth_order, between
        self.constant, self.on_q, self.on_v, self.targets = laws.affine_rows()

    def forces(self, q: Array, v: Array) -> dict[str, Array]:
        """See `AfterRun`."""
        return dict(zip(self.laws.targets, self._forces(q, v).T, strict=True))

    def _forces(self, q: Array, v: Array) -> Array:
        return np.asarray(self.constant + q @ self.on_q.T + v @ self.on_v.T)

    def work(self, q: Array, v: Array, a: Array) -> Array:
        """See `AfterRun`."""
        sampled = np.array(self.steps.samples[: len(q)])
        if self.between is None:
            return np.zeros(len(q))
        numbers = np.append(sampled, np.array(self.between.numbers, dtype=int))
        if self.between.states:
            more = (np.array(x) for x in zip(*self.between.states, strict=True))
            q, v, a = (np.concatenate(both) for both in zip((q, v, a), more, strict=True))
        numbers, order = np.unique(numbers, return_index=True)
        q, v, a = q[order], v[order], a[order]
        f, u, h = self._forces(q, v), v @ self.targets.T, np.diff([self.steps.t(int(k)) for k in numbers])
        power = (f * u).sum(axis=1)
        parts = 0.5 * h * (power[1:] + power[:-1])
        if self.fourth_order:
            change = ((self.laws.slopes(v) + a @ self.on_v.T) * u + f * (a @ self.targets.T)).sum(axis=1)
            parts += h * h * (change[:-1] - change[1:]) / 12.0
        return np.concatenate([[0.0], np.cumsum(parts)])[np.searchsorted(numbers, sampled)]
