"""Stepping a MuJoCo model over a grid of whole steps, sampling, and stopping at a blow-up."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Protocol

import mujoco
import numpy as np

from mechlab.engines.mujoco.sparse import sparse_steps
from mechlab.engines.state import RATE_LIMIT
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

MAX_SAMPLES = 1000
INTEGRATION_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
"""All that the next step depends on."""
INTEGRATE: dict[int, Callable[[mujoco.MjModel, mujoco.MjData], None]] = {
    int(mujoco.mjtIntegrator.mjINT_RK4): lambda model, data: mujoco.mj_RungeKutta(model, data, 4),
    int(mujoco.mjtIntegrator.mjINT_EULER): mujoco.mj_Euler,
    int(mujoco.mjtIntegrator.mjINT_IMPLICIT): mujoco.mj_implicit,
    int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST): mujoco.mj_implicit,
}
"""What mj_step does after mj_forward."""
CHECKED = 1e9
"""The engine looks at states and accelerations before a step, for numbers beyond 1e10; below this length of all together there are none."""
UNSOLVED = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
"""Warnings of the engine that say that a run has blown up."""


class Coordinates(Protocol):
    """What says, after a blow-up, which rate of the mechanism ran away."""

    mechanism: Mechanism

    def rates(self, qvel: Array) -> Array:
        """Rates of the mechanism at those of the engine."""
        ...


@dataclass(frozen=True)
class SteppingEnd:
    """When and how a run failed."""

    t: float
    reason: str


@dataclass(frozen=True)
class Grid:
    """Steps 0 .. count of length h, the last one shorter where h does not divide the duration; `samples`: steps."""

    duration: float
    timestep: float
    count: int
    samples: tuple[int, ...]

    def t(self, step: int) -> float:
        """Time of a step number."""
        return self.duration if step == self.count else step * self.timestep

    @property
    def whole(self) -> int:
        """Number of steps of the length h."""
        short = self.duration - (self.count - 1) * self.timestep < self.timestep * (1.0 - 1e-9)
        return self.count - 1 if short else self.count


Step = Callable[[mujoco.MjModel, mujoco.MjData, Grid, int, int], None]
"""Takes the steps of a grid from one step number to another."""


def grid(
    duration: float, timestep: float, times: Sequence[float] | None = None, least: int = MAX_SAMPLES, share: float = 1.0
) -> Grid:
    """The steps of a run, and which of them are recorded: at most about MAX_SAMPLES, evenly, and those around `times`. Of a run of
    more than `least` steps no more than a `share` of the steps, but `least`, are recorded.

    A time on a step is recorded there; around any other two steps on each side, so that a cubic through them
    (`Recording.at`) is as good as the run. Raises MechlabError for a bad duration or a time outside it.
    """
    if not np.isfinite(duration) or duration <= 0:
        raise MechlabError(f"duration: expected a number > 0 s, got {duration!r}.")
    count = max(1, int(np.ceil(duration / timestep - 1e-9)))
    most = min(MAX_SAMPLES, max(least, int(share * count)))
    samples = set(range(0, count, -(-count // most))) | {count}
    for t in () if times is None else times:
        if not 0.0 <= t <= duration * (1.0 + 1e-12):
            raise MechlabError(f"sample times: expected times from 0 to {duration:g} s, got {t!r}.")
        near = min(count, round(t / timestep))
        if abs(t - near * timestep) <= 1e-9 * timestep or t >= duration:
            samples.add(near if t < duration else count)
        else:
            k = int(t / timestep)
            samples |= {i for i in range(k - 1, k + 3) if 0 <= i <= count}
    return Grid(duration, timestep, count, tuple(sorted(samples)))


def advance(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    map_: Coordinates,
    steps: Grid,
    sample: Callable[[float], bool],
    step: Step | None = None,
    evaluate: Callable[[bool], None] | None = None,
) -> tuple[SteppingEnd | None, float, int]:
    """Step through the grid and call `sample(t)` at every recorded step, the first included; end there when it
    answers True. `step(model, data, grid, start, end)` takes the steps instead of the engine alone (`take_steps`).

    `data` is at t = 0. Between samples the engine steps on its own. `sample` may evaluate `data` (mj_forward): what the
    solver remembers is put back, so that sampling does not change the motion by a bit. `evaluate(leads)` does that ahead of `sample`,
    which then only reads, and only where accelerations are finite; where it `leads` the next step goes on from there, as mj_step
    would after evaluating the same state again.
    Returns what went wrong, the CPU seconds of stepping, and the number of steps.
    """
    stepping, done, take, clock, whole = 0.0, 0, step or take_steps, time.perf_counter, steps.whole
    cpu, began = time.thread_time, clock()
    cpu_before = cpu()

    def cpu_of_steps() -> float:
        # the clock of the CPU is slow to read: it is read at both ends, and shared out as the time on the wall is
        return (cpu() - cpu_before) * stepping / max(clock() - began, 1e-12)

    places, rates, accelerations, memory = data.qpos, data.qvel, data.qacc, data.qacc_warmstart
    integrate = None if evaluate is None else INTEGRATE.get(int(model.opt.integrator))
    state, leads = np.empty(mujoco.mj_stateSize(model, INTEGRATION_STATE)), False
    kept, before, far = memory.copy(), rates.copy(), 0.0
    warnings = [data.warning[k] for k in UNSOLVED]
    for here in steps.samples:
        start = clock()
        if here > done:
            single, stepped = here == done + 1, done
            if single:
                before[:] = rates
            else:
                mujoco.mj_getState(model, data, state, INTEGRATION_STATE)
            if leads and integrate is not None:
                integrate(model, data)
                stepped += 1
            if here > stepped:
                take(model, data, steps, stepped, here)
            far = math.hypot(*places.tolist(), *rates.tolist())
            sane = far <= RATE_LIMIT or (length(places) < math.inf and length(rates) <= RATE_LIMIT)  # mostly the length tells
            if (not sane and beyond(data)) or (here > stepped and warned(warnings)):
                if single:
                    end = SteppingEnd(steps.t(here), end_reason(data, map_, before))
                else:
                    end = _locate(model, data, map_, steps, state, done, here, take)
                stepping += clock() - start
                return end, cpu_of_steps(), here
            done = here
        data.time = now = steps.t(here)
        leads = integrate is not None and done < whole and far < CHECKED
        if not leads:
            kept[:] = memory
        if evaluate is not None:
            evaluate(leads)
        stepping += clock() - start
        stop = evaluate is None and sample(now)
        size = length(accelerations)
        if not (size < CHECKED or finite(accelerations)):  # of the state, only the accelerations are new
            return SteppingEnd(now, end_reason(data, map_, rates)), cpu_of_steps(), done
        stop = stop if evaluate is None else sample(now)
        if not leads:
            memory[:] = kept
        leads = leads and size < CHECKED
        if stop:
            break
    return None, cpu_of_steps(), done


def take_steps(model: mujoco.MjModel, data: mujoco.MjData, steps: Grid, start: int, end: int) -> None:
    """From step number `start` to `end`; the last step of the grid may be shorter."""
    short = end == steps.count and steps.duration - (end - 1) * steps.timestep < steps.timestep * (1.0 - 1e-9)
    whole = end - start - (1 if short else 0)
    if whole:
        mujoco.mj_step(model, data, nstep=whole)
    if short:
        model.opt.timestep = steps.duration - (end - 1) * steps.timestep
        try:
            mujoco.mj_step(model, data)
        finally:
            model.opt.timestep = steps.timestep


def sparsely(step: Step | None = None) -> Step:
    """`take_steps`, or another step, with the sparse Jacobian; the samples between see what the model says."""
    take = step or take_steps

    def stepped(model: mujoco.MjModel, data: mujoco.MjData, steps: Grid, start: int, end: int) -> None:
        with sparse_steps(model):
            take(model, data, steps, start, end)

    return stepped


def length(values: Array) -> float:
    """Euclidean length of (n,), no less than the largest of them; NaN stays. For some ten numbers it takes half of numpy's time."""
    return math.hypot(*values.tolist())


def finite(values: Array) -> bool:
    """Whether all of (n,) are finite; their length mostly says so at once."""
    return math.isfinite(length(values)) or bool(np.all(np.isfinite(values)))


def beyond(data: mujoco.MjData) -> bool:
    """Whether a coordinate or a rate is not finite, or a rate beyond RATE_LIMIT; accelerations that are not finite have made such rates."""
    q, v = data.qpos, data.qvel
    return not (finite(q) and finite(v)) or bool(np.max(np.abs(v), initial=0.0) > RATE_LIMIT)


def warned(warnings: Sequence[mujoco.MjWarningStat]) -> bool:
    """Whether `mj_step` has warned of a blow-up, by the UNSOLVED; the stages of a step alone do not look."""
    position, rate, acceleration = warnings
    return bool(position.number or rate.number or acceleration.number)


def _locate(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    map_: Coordinates,
    steps: Grid,
    state: Array,
    start: int,
    end: int,
    step: Step,
) -> SteppingEnd:
    """Repeat the steps one by one from the last good state, to say when it happened."""
    mujoco.mj_setState(model, data, state, INTEGRATION_STATE)
    for k in UNSOLVED:
        data.warning[k].number = 0
    before, warnings = data.qvel.copy(), [data.warning[k] for k in UNSOLVED]
    for k in range(start, end):
        before[:] = data.qvel
        step(model, data, steps, k, k + 1)
        if beyond(data) or warned(warnings):
            return SteppingEnd(steps.t(k + 1), end_reason(data, map_, before))
    return SteppingEnd(steps.t(end), end_reason(data, map_, before))


def end_reason(data: mujoco.MjData, map_: Coordinates, before: Array) -> str:
    """Which rate ran away, from the state after (or, where that is not finite, before) the failing step."""
    names = map_.mechanism.rate_names
    after = map_.rates(data.qvel)
    if not len(names):
        return "the state is not finite"
    lost = np.flatnonzero(~np.isfinite(after))
    last = map_.rates(before)
    k = int(np.argmax(np.abs(last if len(lost) else after)))
    unit = "m/s" if names[k] in map_.mechanism.slides else "rad/s"
    if len(lost):
        some = ", ".join(names[i] for i in lost[:3]) + (" ..." if len(lost) > 3 else "")
        return f"the rate of {some} is not finite; a step before, the fastest was {names[k]} with {last[k]:.3g} {unit}"
    if abs(after[k]) > RATE_LIMIT:
        return f"the rate of {names[k]} reached {after[k]:.3g} {unit}"
    return f"an acceleration is not finite or beyond 1e10; the fastest is {names[k]} with {after[k]:.3g} {unit}"
