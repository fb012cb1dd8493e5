"""Gymnasium environments on a session: one mechanism, or many side by side inside the engine.

    reward(observation, action, session) -> float          after every action
    terminated(observation, session) -> bool               whether the task is over, well or badly

`session` is the Session, or of many environments a `Place`: both have time, mechanism, state, observation_names, rest_action.
An episode is truncated after its time, and where the motion blew up or a loop opened: then the reward is 0, the observation is the
last that was finite, and info["untrusted"] says why.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from mechlab.engines.state import RATE_LIMIT
from mechlab.errors import MechlabError, Untrustworthy
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

if TYPE_CHECKING:
    from mechlab.engines.mujoco.fleet import Fleet
    from mechlab.engines.mujoco.step_loop import StepLoop

BEYOND = 0.1
"""Share of its range by which a joint may push into its soft stops: bounds of the observation space."""

Reward = Callable[[Array, Array, Any], float]
Terminated = Callable[[Array, Any], bool]


def observation_space(session: StepLoop) -> gymnasium.spaces.Box:
    """Ranges of joints, widened by BEYOND; RATE_LIMIT for rates; no bounds for what has none."""
    seen = session.seen
    wide = np.where(np.isfinite(seen.high - seen.low), BEYOND * (seen.high - seen.low), 0.0)
    low, high = seen.low - wide, seen.high + wide
    rates = np.array([u.endswith("/s") for u in seen.units], dtype=bool)
    return gymnasium.spaces.Box(np.where(rates, -RATE_LIMIT, low), np.where(rates, RATE_LIMIT, high), dtype=np.float64)


def action_space(session: StepLoop) -> gymnasium.spaces.Box:
    """Useful commands of the drives. Raises MechlabError where there are no drives."""
    if not session.action_names:
        raise MechlabError(
            f"{session.mechanism.name}: an environment needs drives to command; declare one with Builder.drive (ml.edit adds it)."
        )
    return gymnasium.spaces.Box(session.action_low, session.action_high, dtype=np.float64)


class Environment(gymnasium.Env[Array, Array]):
    """A mechanism as a gymnasium.Env; made by `mechlab.environment`. `session`: the Session behind it."""

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(self, session: StepLoop, reward: Reward, terminated: Terminated | None, seconds: float) -> None:
        self.session = session
        self._reward, self._terminated, self.seconds = reward, terminated, seconds
        self.observation_space: Any = observation_space(session)
        self.action_space: Any = action_space(session)
        self._last = session.observation

    def __repr__(self) -> str:
        return f"Environment of {self.session!r}, {self.seconds:g} s an episode"

    __str__ = __repr__

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """As gymnasium.Env.reset; options={"initial": {"X_0": ..., "X_rate_0": ...}} gives initial values."""
        super().reset(seed=seed)
        self.session.rng = self.np_random
        self._last = self.session.reset(initial=(options or {}).get("initial"))
        return self._last.copy(), {}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """As gymnasium.Env.step. Raises MechlabError for an action that is not finite."""
        s = self.session
        try:
            seen = s.step(np.asarray(action, dtype=float))
            if not np.abs(s.data.qvel).max(initial=0.0) < RATE_LIMIT:
                s.look()
        except Untrustworthy as end:
            return self._last.copy(), 0.0, False, True, {"untrusted": str(end)}
        self._last = seen
        over = bool(self._terminated(seen, s)) if self._terminated is not None else False
        late = s.time >= self.seconds - 0.5 * s.settings.timestep
        return seen.copy(), float(self._reward(seen, action, s)), over, late, {}

    def close(self) -> None:
        """Close the session; it warns when its last motion must not be trusted."""
        self.session.close()


class Place:
    """One of many environments, as rewards see it."""

    def __init__(self, fleet: Fleet, number: int) -> None:
        self._fleet, self.number = fleet, number
        self.mechanism: Mechanism = fleet.session.mechanism
        self.observation_names = fleet.session.observation_names
        self.action_names, self.rest_action = fleet.session.action_names, fleet.session.rest_action

    @property
    def time(self) -> float:
        """Time since the reset [s]."""
        return float(self._fleet.time[self.number])

    @property
    def state(self) -> tuple[Array, Array]:
        """Coordinates q (nq,) and rates v (nv,) of the Mechanism."""
        return self._fleet.state(self.number)


class Environments(VectorEnv[Array, Array, Any]):
    """Many environments of one mechanism as a gymnasium.vector.VectorEnv; made by `mechlab.environments`.

    An environment that ended is reset by the next step, whose action it does not take (AutoresetMode.NEXT_STEP).
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(self, fleet: Fleet, reward: Reward, terminated: Terminated | None, seconds: float) -> None:
        self.fleet, self.num_envs = fleet, fleet.count
        self._reward, self._terminated, self.seconds = reward, terminated, seconds
        self.single_observation_space, self.single_action_space = (
            observation_space(fleet.session),
            action_space(fleet.session),
        )
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._places = [Place(fleet, k) for k in range(self.num_envs)]
        self._rngs = [np.random.default_rng() for _ in self._places]
        self._ended = np.zeros(self.num_envs, dtype=bool)
        self._last = np.zeros((self.num_envs, len(fleet.session.observation_names)))

    def __repr__(self) -> str:
        return f"{self.num_envs} environments of {self.fleet.session!r}, {self.seconds:g} s an episode"

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """As gymnasium.vector.VectorEnv.reset; a number seeds environment k with seed + k. options as of `Environment.reset`."""
        seeds = (
            [seed + k for k in range(self.num_envs)] if isinstance(seed, int) else list(seed or [None] * self.num_envs)
        )
        for k, one in enumerate(seeds):
            if one is not None:
                self._rngs[k] = gymnasium.utils.seeding.np_random(one)[0]
        self.fleet.reset(range(self.num_envs), self._rngs, (options or {}).get("initial"))
        self._ended[:] = False
        self._last = self.fleet.observations()
        return self._last.copy(), {}

    def step(self, actions: Array) -> tuple[Array, Any, Any, Any, dict[str, Any]]:
        """As gymnasium.vector.VectorEnv.step. Raises MechlabError for an action that is not finite."""
        actions = self.fleet.actions(actions)
        anew = np.flatnonzero(self._ended)
        self.fleet.step(np.where(self._ended[:, None], self.fleet.session.rest_action, actions))
        self.fleet.reset(anew.tolist(), [self._rngs[k] for k in anew])
        seen = self.fleet.observations()
        broken = self.fleet.broken.copy()
        seen[broken] = self._last[broken]
        self._last = seen
        rewards, over = np.zeros(self.num_envs), np.zeros(self.num_envs, dtype=bool)
        for k in np.flatnonzero(~(self._ended | broken)):
            rewards[k] = self._reward(seen[k], actions[k], self._places[k])
            over[k] = self._terminated is not None and self._terminated(seen[k], self._places[k])
        late = self.fleet.time >= self.seconds - 0.5 * self.fleet.session.settings.timestep
        late = (late | broken) & ~self._ended
        self._ended = over | late
        return seen.copy(), rewards, over, late, {"untrusted": broken} if broken.any() else {}

    def close_extras(self, **kwargs: Any) -> None:
        """Nothing is open beside the memory of the simulations."""
