"""What every step loop on MuJoCo does, whichever model it steps: take an action, step, observe, refuse to go on, close.

    with loop as s:
        observation = s.step(action)      # the action is held for `hold` seconds, some whole timesteps of the engine

Between two actions nothing but the step, one copy of the state and a test for finite numbers is done; rates, loops and warnings of
the engine are looked at once in BLOCK actions, and the whole health record is made from what was kept when it is asked for.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.mujoco.control import begin_step, controlled, end_step, silence
from mechlab.engines.mujoco.sparse import sparse_is_right, sparse_steps
from mechlab.engines.mujoco.step_watch import KEPT, WatchedLoop
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.observed import Observed
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.tables import counted

ROW = int(mujoco.mjtState.mjSTATE_FULLPHYSICS | mujoco.mjtState.mjSTATE_CTRL)
"""What is kept after each action: time, qpos, qvel, activations, controls."""

Start = Callable[[np.random.Generator], Mapping[str, float]]
"""Initial values of joints or shafts, X_0 and X_rate_0, for a random generator."""


class Commands(Protocol):
    """What an action commands: names, units, useful range and command at rest (drives,); the control of the engine is
    control(command), command + shift where it is `plain`."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    low: Array
    high: Array
    rest: Array
    shift: Array

    @property
    def plain(self) -> bool:
        """Whether controls are commands plus `shift`."""
        ...

    def control(self, command: Array) -> Array:
        """(..., drives) controls of the engine for commands."""
        ...

    def command(self, control: Array) -> Array:
        """(..., drives) commands for controls of the engine."""
        ...


class StepLoop(WatchedLoop):
    """See the module.

    model, data: the engine's, for reading; `mechanism`, `scene`, `settings` of the motion; `hold` [s], the time of an action, and
    `substeps`, its timesteps; `rng`, the random generator of the seed. gap_sensors, gap_limit [m]: where the gaps of hard
    loops stand among the sensor data, and from when one is open.
    """

    gap_sensors: tuple[int, ...] = ()
    gap_limit = math.inf

    def __init__(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, model: mujoco.MjModel, drives: Commands, substeps: int,
        start: Start | None, seed: int | None,
    ) -> None:  # fmt: skip
        self.mechanism, self.scene, self.settings = mechanism, scene, settings
        self.substeps, self.hold = substeps, substeps * settings.timestep
        self.rng = np.random.default_rng(seed)
        self.model, self.data, self.drives = model, mujoco.MjData(model), drives
        rates = slice(1 + model.nq, 1 + model.nq + model.nv)
        super().__init__(np.empty((KEPT + 1, mujoco.mj_stateSize(model, ROW))), rates)
        self._start = start
        self._ctrl, self._shift, self._plain = self.data.ctrl, drives.shift, drives.plain
        self._shape = drives.shift.shape
        self._act: Callable[[], None] | None = None
        self._sparse: bool | None = None

    # -- names ---------------------------------------------------------------------------------------------------------

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of the drives, in the order of an action."""
        return self.drives.names

    @property
    def action_units(self) -> tuple[str, ...]:
        """Units of an action: rad or m for a servo, rad/s or m/s with damping alone, N m or N for a motor, V for a winding."""
        return self.drives.units

    @property
    def action_low(self) -> Array:
        """(drives,) least useful command: range of the joint, force limit, or the range of the slider in the model file."""
        return self.drives.low

    @property
    def action_high(self) -> Array:
        """(drives,) largest useful command; commands beyond are not clipped."""
        return self.drives.high

    @property
    def rest_action(self) -> Array:
        """(drives,) the command by which the drives hold their declared targets: also that after a reset."""
        return self.drives.rest.copy()

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the numbers of an observation."""
        return self.seen.names

    @property
    def observation_units(self) -> tuple[str, ...]:
        """Units of the numbers of an observation; "" for a quaternion."""
        return self.seen.units

    def _observe(self, seen: Observed, states: Array, offset: Array) -> None:
        """Prepare the way from a kept row to an observation, where (q, v) = states @ row + offset: one selection, or a product where
        shafts and quaternions are observed."""
        self.seen = seen
        self._matrix, moved = seen.selection @ states, seen.selection @ offset + seen.offset
        single = (np.count_nonzero(self._matrix, axis=1) == 1) & (self._matrix.sum(axis=1) == 1.0)
        self._take = np.argmax(self._matrix, axis=1) if single.all() else None
        self._offset = moved if np.any(moved) else None
        self._framed = bool(seen.frames)

    # -- the loop ------------------------------------------------------------------------------------------------------

    def step(self, action: ArrayLike | Mapping[str, float] | None = None) -> Array:
        """Hold an action for `hold` seconds; returns the observation after it.

        action: (drives,) numbers, or drive -> number, where drives that are not named keep their command; None: all keep
        theirs. Raises MechlabError, naming the drive, for a number that is not finite; Untrustworthy when the motion blew up or
        a loop opened, and from then on until `reset`.
        """
        if action is not None:
            self._command(action)
        if self._stopped:
            self._refuse()
        model, data, act = self.model, self.data, self._act
        if act is None:
            begin_step()
            try:
                if self._sparse:
                    with sparse_steps(model):
                        mujoco.mj_step(model, data, self.substeps)
                else:
                    mujoco.mj_step(model, data, self.substeps)
            finally:
                end_step()
        else:
            with controlled(data, act):
                mujoco.mj_step(model, data, self.substeps)
        self.count = count = self.count + 1
        row = self.rows[count]
        mujoco.mj_getState(model, data, row, ROW)
        if act is not None:
            self._acted()
        if count >= self._next_look or not math.isfinite(sum(row.tolist())):
            self.look()
        return self._observation(row)

    def _command(self, action: ArrayLike | Mapping[str, float]) -> None:
        """Put an action into the controls of the engine."""
        if type(action) is not np.ndarray and isinstance(action, Mapping):
            action = self._by_name(action)
        try:
            numbers = np.asarray(action, dtype=float)
        except (TypeError, ValueError):
            raise MechlabError(f"{self._expected}, got {action!r}.") from None
        if numbers.shape != self._shape:
            raise MechlabError(f"{self._expected}, got the shape {numbers.shape}.")
        if not math.isfinite(sum(each := numbers.tolist())):
            for name, x in zip(self.action_names, each, strict=True):
                if not math.isfinite(x):
                    raise MechlabError(
                        f"{self.mechanism.name}: action of {name!r}: expected a finite number, got {x!r}."
                    )
        if self._plain:
            np.add(numbers, self._shift, self._ctrl)
        else:
            self._ctrl[:] = self.drives.control(numbers)

    @property
    def _expected(self) -> str:
        names = self.action_names
        return f"{self.mechanism.name}: an action has {len(names)} numbers ({', '.join(names) or 'no drives'})"

    def _by_name(self, action: Mapping[str, float]) -> Array:
        numbers = self.action
        for name, x in action.items():
            if name not in self.action_names:
                raise unknown(f"{self.mechanism.name}: drive", name, self.action_names)
            numbers[self.action_names.index(name)] = x
        return numbers

    def _observation(self, row: Array) -> Array:
        take, offset = self._take, self._offset
        out: Array = self._matrix.dot(row) if take is None else row[take]
        if offset is not None:
            np.add(out, offset, out)
        return out if not self._framed else np.concatenate([out, self._points()])

    def observed_rows(self, rows: Array) -> Array:
        """(n, numbers) observations of many kept rows, without the points of frames."""
        take, offset = self._take, self._offset
        out: Array = np.stack([self._matrix.dot(row) for row in rows]) if take is None else rows[:, take]
        return out if offset is None else out + offset

    @abstractmethod
    def _points(self) -> Array:
        """(3 frames,) the points of the observed frames, now [m]."""

    @abstractmethod
    def points_at(self, qpos: Array, sites: Array) -> Array:
        """(n, 3 frames) those points at n states of the engine: qpos (n, nq), site_xpos (n, sites, 3)."""

    def _acted(self) -> None:
        """After a step under laws that are called."""

    @property
    def observation(self) -> Array:
        """(n,) the observation of the present state."""
        return self._observation(self.rows[self.count])

    @property
    def action(self) -> Array:
        """(drives,) the command that is held now."""
        return self.drives.command(self._ctrl)

    @property
    def state(self) -> tuple[Array, Array]:
        """Coordinates q (nq,) and rates v (nv,) of the Mechanism, now."""
        return self.state_at(self.data.qpos, self.data.qvel)

    @abstractmethod
    def state_at(self, qpos: Array, qvel: Array) -> tuple[Array, Array]:
        """Coordinates and rates of the Mechanism at the engine's."""

    @abstractmethod
    def at_start(self, scene: Scene) -> Mapping[str, Array]:
        """The fields of the engine's state at the start of a scene that are not its defaults, with all drives at rest."""

    def reset(self, seed: int | None = None, initial: Mapping[str, float] | None = None) -> Array:
        """Back to the start of the scene, with all drives at rest; returns the observation.

        seed: a new seed of `rng`; without one the generator goes on. initial: X_0 and X_rate_0 of joints and shafts, in place
        of those of the scene. Raises MechlabError for unknown names, NoSolution for a start that does not close.
        """
        if seed is not None:
            self.rng = np.random.default_rng(seed)
        self._act = self._begin(self.beginning_scene(self.rng, initial))
        if self._sparse is None:  # laws that are called read the dense rows
            self._sparse = self._act is None and sparse_is_right(self.model, self.data)
        silence(self.data)
        self._watch_anew()
        mujoco.mj_getState(self.model, self.data, self.rows[0], ROW)
        return self.observation

    def beginning_scene(self, rng: np.random.Generator, initial: Mapping[str, float] | None = None) -> Scene:
        """The scene with the initial values of a reset; see `reset`."""
        values = dict(self._start(rng)) if self._start is not None else {}
        return started(self.scene, {**values, **(initial or {})}, self.mechanism)

    def _put(self, scene: Scene) -> None:
        """Put the data to the start of a scene."""
        begin = self.at_start(scene)
        mujoco.mj_resetData(self.model, self.data)
        for name, value in begin.items():
            getattr(self.data, name)[:] = value

    @abstractmethod
    def _begin(self, scene: Scene) -> Callable[[], None] | None:
        """Put the data to the start of a scene, with all drives at rest; returns what the engine must call while it steps."""

    def __repr__(self) -> str:
        drives, seen = counted(len(self.action_names), "drive"), counted(len(self.seen.names), "observation")
        where = f"Session of {self.mechanism.name}, scene {self.scene.name}, t = {self.time:.6g} s"
        return f"{where}, {drives}, {seen}, {1e3 * self.hold:.6g} ms an action"


def started(scene: Scene, values: Mapping[str, float], mechanism: Mechanism) -> Scene:
    """The scene with initial values X_0 and rates X_rate_0; raises MechlabError for other keys."""
    if not values:
        return scene
    initial, rates, names = dict(scene.initial), dict(scene.initial_rates), mechanism.scalar_names
    for key, value in values.items():
        if key.endswith("_rate_0") and key.removesuffix("_rate_0") in names:
            rates[key.removesuffix("_rate_0")] = float(value)
        elif key.endswith("_0") and key.removesuffix("_0") in names:
            initial[key.removesuffix("_0")] = float(value)
        else:
            raise unknown(
                f"{mechanism.name}: initial value", key, [f"{n}{s}" for n in names for s in ("_0", "_rate_0")]
            )
    return replace(scene, initial=initial, initial_rates=rates)
