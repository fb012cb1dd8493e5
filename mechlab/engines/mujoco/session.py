"""A step loop on MuJoCo: a controller or a learner commands the drives, the engine steps, and the health record is kept.

    with session as s:
        observation = s.step(action)      # the action is held for `hold` seconds, some whole timesteps of the engine

The action is an array over the declared drives in their order, each in the unit of its control: the target of a servo [rad or m],
the target rate of a drive with damping alone, the force of a motor [N m or N], the voltage of a winding [V], the control of the file that
a drive was read from. The engine's own actuators apply it; the other laws of the scene act as in a run.

Between two actions nothing but the step, one copy of the state and a test for finite numbers is done; loops, rates and warnings of
the engine are looked at once in BLOCK actions, and the whole health record is made from the kept states when it is asked for.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import TracebackType

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.mujoco.control import begin_step, controlled, end_step, silence
from mechlab.engines.mujoco.drive import Driver
from mechlab.engines.mujoco.findings import LoopWatch
from mechlab.engines.mujoco.model import MujocoMap, to_mujoco
from mechlab.engines.mujoco.plant import MujocoPlant
from mechlab.engines.mujoco.session_drives import SessionDrives
from mechlab.engines.mujoco.session_energy import energy_fed
from mechlab.engines.mujoco.session_record import recording_of
from mechlab.engines.mujoco.stepping import SteppingEnd, _reason
from mechlab.engines.state import RATE_LIMIT
from mechlab.errors import MechlabError, Untrustworthy, unknown
from mechlab.experiment.laws import LawStates
from mechlab.experiment.observed import Observed
from mechlab.experiment.recording import Health, Recording
from mechlab.experiment.scene import Scene, Settings, initial_state
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

BLOCK = 128
"""Actions between two looks at loops, rates and warnings."""
KEPT = 16_384
"""Most states that are kept; then every other one is dropped."""
ROW = mujoco.mjtState.mjSTATE_FULLPHYSICS | mujoco.mjtState.mjSTATE_CTRL
"""What is kept after each action: time, qpos, qvel, activations, controls."""

Start = Callable[[np.random.Generator], Mapping[str, float]]
"""Initial values of joints or shafts, X_0 and X_rate_0, for a random generator."""


class UntrustedSession(UserWarning):
    """A session was closed, or reset, after a motion that must not be trusted."""


class Session:
    """See the module. Made by `mechlab.session`.

    model, data: the engine's, for reading; `mechanism`, `scene`, `settings` of the motion; `hold` [s], the time of an action, and
    `substeps`, its timesteps; `rng`, the random generator of the seed.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        scene: Scene,
        settings: Settings,
        seen: Observed,
        substeps: int = 1,
        start: Start | None = None,
        seed: int | None = None,
    ) -> None:
        self.mechanism, self.scene, self.settings = mechanism, scene, settings
        self.substeps, self.hold = substeps, substeps * settings.timestep
        self.rng = np.random.default_rng(seed)
        self.complete: Callable[[Recording], Recording] = lambda made: made
        self._start = start
        if len(LawStates(scene.laws)):
            raise MechlabError(
                f"{mechanism.name}: a law of the scene {scene.name!r} has a state of its own, which a session does not keep. "
                "Declare a drive with a winding instead."
            )
        self.model, self.data = to_mujoco(mechanism, settings)
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self.map = MujocoMap(mechanism, self.model)
        self.drives = SessionDrives(self.map)
        self._observe(seen)
        self._ctrl, self._shift, self._plain = self.data.ctrl, self.drives.shift, self.drives.plain
        self._many = len(self._shift)
        size = mujoco.mj_stateSize(self.model, ROW)
        self._zeros = np.zeros(size)
        self.rows = np.empty((KEPT + 1, size))
        self.loops = LoopWatch(self.map)
        self._rates = slice(1 + self.model.nq, 1 + self.model.nq + self.model.nv)
        self._broken: list[str] = []
        self._closed = False
        self.reset()

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

    def _observe(self, seen: Observed) -> None:
        """Prepare the way from a kept row to an observation: one selection, or a product where shafts are observed."""
        self.seen = seen
        m, size = self.mechanism, mujoco.mj_stateSize(self.model, ROW)
        columns = np.concatenate([1 + self.map.qpos, 1 + self.model.nq + self.map.dof])
        matrix = np.zeros((len(seen.offset), size))
        matrix[:, columns] = seen.selection
        assert seen.selection.shape[1] == m.nq + m.nv
        single = (np.count_nonzero(matrix, axis=1) == 1) & (matrix.sum(axis=1) == 1.0)
        self._take = np.argmax(matrix, axis=1) if single.all() else None
        self._matrix = matrix
        self._offset = seen.offset if np.any(seen.offset) else None
        self._sites = np.array([self.map.site(name) for name in seen.frames], dtype=int)

    # -- the loop ------------------------------------------------------------------------------------------------------

    def step(self, action: ArrayLike | Mapping[str, float] | None = None) -> Array:
        """Hold an action for `hold` seconds; returns the observation after it.

        action: (drives,) numbers, or drive -> number, where drives that are not named keep their command; None: all keep
        theirs. Raises MechlabError, naming the drive, for a number that is not finite; Untrustworthy when the motion blew up or
        a loop opened, and from then on until `reset`.
        """
        if action is not None:
            self._command(action)
        if self.end is not None or self._closed:
            self._refuse()
        driver = self._driver
        if driver is None:
            begin_step()
            try:
                mujoco.mj_step(self.model, self.data, nstep=self.substeps)
            finally:
                end_step()
        else:
            with controlled(self.data, driver):
                mujoco.mj_step(self.model, self.data, nstep=self.substeps)
        self.count += 1
        row = self.rows[self.count]
        mujoco.mj_getState(self.model, self.data, row, ROW)
        if row.dot(self._zeros) != 0.0:
            self.look()
        if driver is not None:
            self.called[self.count] = driver.work
        if self.count >= self._next_look:
            self.look()
        return self._observation(row)

    def _command(self, action: ArrayLike | Mapping[str, float]) -> None:
        """Put an action into the controls of the engine."""
        if type(action) is not np.ndarray and isinstance(action, Mapping):
            action = self._by_name(action)
        numbers = np.asarray(action, dtype=float)
        if numbers.shape != self._shift.shape:
            raise MechlabError(
                f"{self.mechanism.name}: an action has {self._many} numbers ({', '.join(self.action_names) or 'no drives'}), "
                f"got the shape {numbers.shape}."
            )
        if not math.isfinite(sum(numbers.tolist())):
            for name, x in zip(self.action_names, numbers.tolist(), strict=True):
                if not math.isfinite(x):
                    raise MechlabError(
                        f"{self.mechanism.name}: action of {name!r}: expected a finite number, got {x!r}."
                    )
        if self._plain:
            np.add(numbers, self._shift, out=self._ctrl)
        else:
            self._ctrl[:] = self.drives.control(numbers)

    def _by_name(self, action: Mapping[str, float]) -> Array:
        numbers = self.action
        for name, x in action.items():
            if name not in self.action_names:
                raise unknown(f"{self.mechanism.name}: drive", name, self.action_names)
            numbers[self.action_names.index(name)] = x
        return numbers

    def _observation(self, row: Array) -> Array:
        out: Array = row[self._take] if self._take is not None else self._matrix @ row
        if self._offset is not None:
            out += self._offset
        if len(self._sites):
            mujoco.mj_kinematics(self.model, self.data)  # mj_step leaves the points of the state before
            out = np.concatenate([out, self.data.site_xpos[self._sites].ravel()])
        return out

    @property
    def observation(self) -> Array:
        """(n,) the observation of the present state."""
        return self._observation(self.rows[self.count])

    @property
    def action(self) -> Array:
        """(drives,) the command that is held now."""
        return self.drives.command(self._ctrl)

    @property
    def time(self) -> float:
        """Time since the reset [s]."""
        return float(self.data.time)

    @property
    def state(self) -> tuple[Array, Array]:
        """Coordinates q (nq,) and rates v (nv,) of the Mechanism, now."""
        return self.map.coordinates(self.data.qpos), self.map.rates(self.data.qvel)

    def reset(self, seed: int | None = None, initial: Mapping[str, float] | None = None) -> Array:
        """Back to the start of the scene, with all drives at rest; returns the observation.

        seed: a new seed of `rng`; without one the generator goes on. initial: X_0 and X_rate_0 of joints and shafts, in place
        of those of the scene. Raises MechlabError for unknown names, NoSolution for a start that does not close.
        """
        if seed is not None:
            self.rng = np.random.default_rng(seed)
        if hasattr(self, "count"):
            self._leave()
        scene, qpos, qvel = self.beginning(self.rng, initial)
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:], data.ctrl[:] = qpos, qvel, self.drives.control(self.drives.rest)
        silence(data)
        self.end: SteppingEnd | None = None
        self._driver = self._laws(scene)
        self.count = 0
        self._next_look = BLOCK
        self.loops.worst = None
        self.fed, self.called = np.zeros(KEPT + 1), np.zeros(KEPT + 1)
        self._worked, self.allowance = 0, 0.0
        self._made: tuple[int, Recording] | None = None
        mujoco.mj_getState(model, data, self.rows[0], ROW)
        return self.observation

    def beginning(
        self, rng: np.random.Generator, initial: Mapping[str, float] | None = None
    ) -> tuple[Scene, Array, Array]:
        """The scene with the initial values of a reset, and the engine's qpos and qvel there; see `reset`."""
        values = dict(self._start(rng)) if self._start is not None else {}
        scene = started(self.scene, {**values, **(initial or {})}, self.mechanism)
        q, v = initial_state(self.mechanism, scene)
        qpos = self.map.engine_coordinates(q)
        return scene, qpos, self.map.engine_rates(qpos, v)

    def _laws(self, scene: Scene) -> Driver | None:
        """The laws of the scene, put into the engine; None where they need no call: there are none, or all are constant."""
        if not scene.laws:
            return None
        driver = Driver(self.mechanism, scene.laws, MujocoPlant(self.mechanism, self.model, self.data, self.map))
        return None if driver.at_once else driver

    # -- health --------------------------------------------------------------------------------------------------------

    def look(self) -> None:
        """Look at the states since the last look, as `step` does once in BLOCK actions. Raises Untrustworthy where a rate is beyond
        1e6 or a loop has opened; the motion ends there."""
        k = self.count
        self._next_look = min(k + BLOCK, KEPT)
        new = self.rows[max(0, k - BLOCK) : k + 1]
        fastest = np.abs(new[:, self._rates])
        if not (fastest.max(initial=0.0) < RATE_LIMIT and math.isfinite(new[-1].dot(self._zeros))):
            good = np.isfinite(new).all(axis=1) & (fastest.max(axis=1, initial=0.0) < RATE_LIMIT)
            first = int(np.argmin(good))
            self.data.qvel[:] = new[first, self._rates]
            reason = _reason(self.data, self.map, new[max(0, first - 1), self._rates])
            self.count = max(0, k - len(new) + first)
            self.end = SteppingEnd(float(new[max(0, first - 1), 0]) + self.hold, reason)
            self._refuse()
        if self.loops.opened(self.time, self.data):
            assert self.loops.worst is not None
            t, gap, name = self.loops.worst
            self.end = SteppingEnd(t, f"loop {name!r} is open by {gap:.3g} m")
            self._refuse()
        if k >= KEPT:
            self._thin()

    def _thin(self) -> None:
        """Drop every other state; what the drives did between those that stay is kept as their work."""
        self._integrate(again=False)
        half = self.count // 2
        for kept in (self.rows, self.fed, self.called):
            kept[: half + 1] = kept[0 : 2 * half + 1 : 2].copy()
        self.count = self._worked = half
        self._next_look = half + BLOCK

    def _integrate(self, again: bool) -> None:
        """Energy that drives and dampers have fed up to the present, from the states that were not integrated yet."""
        a, b = self._worked, self.count
        if b > a:
            fed, allowance = energy_fed(self, a, b, again)
            self.fed[a + 1 : b + 1] = self.fed[a] + fed
            self.allowance += allowance
            self._worked = b

    def recording(self) -> Recording:
        """The motion since the reset: states, forces, commands, and the health record of a run. Every action is a sample, of
        long motions every second, fourth, ... one; at most 1000 of them carry channels."""
        if self._made is None or self._made[0] != self.count or self.end is not None:
            self._integrate(again=True)
            self._made = (self.count, self.complete(recording_of(self)))
        return self._made[1]

    @property
    def health(self) -> Health:
        """The health record of the motion since the reset."""
        return self.recording().health

    @property
    def trusted(self) -> bool:
        """Whether nothing in the health record says otherwise; True before the first step."""
        return self.count == 0 or self.health.trusted

    def _refuse(self) -> None:
        if self._closed:
            raise MechlabError(f"{self.mechanism.name}: this session is closed; its recording can still be read.")
        assert self.end is not None
        raise Untrustworthy(
            f"{self.mechanism.name}: the motion of this session ended at t = {self.end.t:.6g} s: {self.end.reason}. "
            "Its health says more; reset() begins anew."
        )

    def _leave(self) -> None:
        """Remember in words what ended a motion, before the next one begins."""
        if self.end is not None:
            self._broken.append(f"t = {self.end.t:.4g} s: {self.end.reason}")

    def close(self) -> None:
        """End the session. Warns (UntrustedSession) when the motion, or one before a reset, must not be trusted; the recording
        and its health stay."""
        if self._closed:
            return
        self._closed = True
        texts = (
            [f"{len(self._broken)} motions before were stopped, the first at {self._broken[0]}"] if self._broken else []
        )
        if self.count and not self.health.trusted:
            texts.append(self.recording().message)
        if texts:
            what = f"{self.mechanism.name}: do not trust this session: {'; '.join(texts)}"
            warnings.warn(what, UntrustedSession, stacklevel=2)

    def __enter__(self) -> Session:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:  # the error under way says more than a warning
            self._closed = True
        self.close()

    def __repr__(self) -> str:
        return (
            f"Session of {self.mechanism.name}, scene {self.scene.name}, t = {self.time:.6g} s, {self._many} drives, "
            f"{len(self.seen.names)} observations, {1e3 * self.hold:.6g} ms an action"
        )


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
