"""Many step loops of one model side by side, stepped inside the engine by all cores (mujoco.batch).

Each simulation has its own state, and moves as a single session under the same commands, of a mechanism or of a file as it is. Nothing
calls Python between the steps, so the laws of the scene must be constant loads. A simulation is `broken` when its state is not
finite, a rate is beyond RATE_LIMIT or a hard loop has opened; it must be reset before it goes on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError
from numpy.typing import ArrayLike, NDArray

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.curve_rows import NO_ROLLOUT
from mechlab.engines.mujoco.engine_warnings import words_of
from mechlab.engines.mujoco.step_loop import StepLoop
from mechlab.engines.mujoco.step_watch import BLOCK
from mechlab.engines.state import RATE_LIMIT
from mechlab.errors import MechlabError
from mechlab.mechanism.geometry import Array


class Fleet:
    """`count` simulations of a session, on `threads` threads (0: all cores)."""

    def __init__(self, session: StepLoop, count: int, threads: int = 0) -> None:
        s = self.session = session
        if count < 1:
            raise MechlabError(f"{s.mechanism.name}: count: expected at least 1 simulation, got {count!r}.")
        if threads < 0:
            raise MechlabError(f"{s.mechanism.name}: threads: expected 0 (all cores) or more, got {threads!r}.")
        if s.mechanism.curves:
            raise MechlabError(f"{s.mechanism.name}: no simulations side by side: {NO_ROLLOUT}. Take single sessions.")
        moving = [law for law in s.scene.laws if law.kind != "constant"]
        if moving:
            raise MechlabError(
                f"{s.mechanism.name}: simulations side by side take constant loads only; the scene {s.scene.name!r} has "
                f"{moving[0].kind} on {', '.join(moving[0].targets())}. Take a single session, or another scene."
            )
        self.count = count
        self._batch = Batch(s.model, nsim=count, nthread=threads, persistent=True)
        bound = ("time", "qpos", "qvel", "ctrl", "qfrc_applied", "site_xpos", "sensordata")
        self._time, self._qpos, self._qvel, self._ctrl, self._load, self._sites, self._sensed = map(
            self._batch.bind, bound
        )
        self._begin = {name: self._batch.bind(name) for name, value in s.at_start(s.scene).items() if np.size(value)}
        self._rows = np.zeros((count, s.rows.shape[1]))
        self._steps = 0
        self.broken: NDArray[np.bool_] = np.zeros(count, dtype=bool)

    @property
    def time(self) -> Array:
        """(count,) time of each simulation since its reset [s]."""
        return np.array(self._time).reshape(self.count)

    def reset(
        self, which: Sequence[int], rngs: Sequence[np.random.Generator], initial: Mapping[str, float] | None = None
    ) -> None:
        """Begin anew in some simulations, each with its own generator."""
        if not len(which):
            return
        s = self.session
        with engine():
            self._batch.reset(np.asarray(which), stage=int(mujoco.mjtStage.mjSTAGE_NONE))
        for k, rng in zip(which, rngs, strict=True):
            begin = s.at_start(s.beginning_scene(rng, initial))
            for name, bound in self._begin.items():
                bound[k] = begin[name]
        if s.seen.frames:
            with engine():
                self._batch.forward(np.asarray(which), stage=int(mujoco.mjtStage.mjSTAGE_POS))
        self._load[which] = s.data.qfrc_applied
        self.broken[which] = False

    def actions(self, given: ArrayLike) -> Array:
        """(count, drives) commands as numbers. Raises MechlabError that says what was expected for anything else."""
        s = self.session
        shape = (self.count, len(s.action_names))
        try:
            actions = np.asarray(given, dtype=float)
        except (TypeError, ValueError):
            raise MechlabError(f"{s.mechanism.name}: actions: expected numbers of the shape {shape}, got {given!r}.") from None
        if actions.shape != shape:
            raise MechlabError(
                f"{s.mechanism.name}: actions: expected the shape {shape}, for each of {shape[0]} simulations a row of "
                f"{', '.join(s.action_names)}; got the shape {actions.shape}."
            )
        return actions

    def step(self, actions: Array) -> None:
        """Hold the commands (count, drives) for the time of an action. Raises MechlabError for one that is not finite."""
        s = self.session
        bad = np.argwhere(~np.isfinite(actions))
        if len(bad):
            i, k = bad[0]
            raise MechlabError(
                f"{s.mechanism.name}: action of {s.action_names[k]!r} in simulation {i}: "
                f"expected a finite number, got {float(actions[i, k])!r}."
            )
        self._ctrl[:] = s.drives.control(actions)
        stage = mujoco.mjtStage.mjSTAGE_POS if s.seen.frames else mujoco.mjtStage.mjSTAGE_NONE
        try:
            with engine():
                self._batch.step(nstep=s.substeps, stage=int(stage))
        except SimulationError as error:
            raise MechlabError(f"{s.mechanism.name}: {words_of(error)}.") from None
        self._steps += 1
        fastest = np.abs(self._qvel).max(axis=1, initial=0.0)
        self.broken |= ~((fastest < RATE_LIMIT) & np.isfinite(self._qpos).all(axis=1))
        if self._steps % BLOCK == 0:
            for start in s.gap_sensors:
                self.broken |= ~(np.linalg.norm(self._sensed[:, start : start + 3], axis=1) <= s.gap_limit)

    def observations(self) -> Array:
        """(count, n) observations of all simulations, as of a session."""
        s, rows, nq = self.session, self._rows, self._qpos.shape[1]
        rows[:, 1 : 1 + nq], rows[:, 1 + nq : 1 + nq + self._qvel.shape[1]] = self._qpos, self._qvel
        out = s.observed_rows(rows)
        return np.concatenate([out, s.points_at(self._qpos, self._sites)], axis=1) if s.seen.frames else out

    def state(self, k: int) -> tuple[Array, Array]:
        """Coordinates q (nq,) and rates v (nv,) of the Mechanism in simulation k."""
        return self.session.state_at(self._qpos[k], self._qvel[k])
