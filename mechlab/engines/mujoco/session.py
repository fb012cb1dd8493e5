"""A step loop on MuJoCo: a controller or a learner commands the drives of a mechanism, and the health record is kept.

    with session as s:
        observation = s.step(action)      # the action is held for `hold` seconds, some whole timesteps of the engine

The action is an array over the declared drives in their order, each in the unit of its control: the target of a servo [rad or m],
the target rate of a drive with damping alone, the force of a motor [N m or N], the voltage of a winding [V], the control of the file that
a drive was read from. The engine's own actuators apply it; the other laws of the scene act as in a run.
"""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from mechlab.engines.mujoco.drive import Driver
from mechlab.engines.mujoco.findings import GAP_KINDS, LoopWatch
from mechlab.engines.mujoco.model import MujocoMap, to_mujoco
from mechlab.engines.mujoco.plant import MujocoPlant
from mechlab.engines.mujoco.session_drives import SessionDrives
from mechlab.engines.mujoco.session_energy import energy_fed
from mechlab.engines.mujoco.session_record import recording_of
from mechlab.engines.mujoco.step_loop import ROW, Start, StepLoop
from mechlab.engines.mujoco.step_watch import BLOCK, KEPT
from mechlab.engines.mujoco.stepping import SteppingEnd
from mechlab.errors import MechlabError
from mechlab.experiment.laws import LawStates
from mechlab.experiment.observed import Observed
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings, initial_state
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism


class Session(StepLoop):
    """A step loop on the model of a mechanism; made by `mechlab.session`. Of long motions every second, fourth, ... action is kept, and
    at most 1000 of them carry channels."""

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
        if len(LawStates(scene.laws)):
            raise MechlabError(
                f"{mechanism.name}: a law of the scene {scene.name!r} has a state of its own, which a session does not keep. "
                "Declare a drive with a winding instead."
            )
        model, _ = to_mujoco(mechanism, settings)
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self.map = MujocoMap(mechanism, model)
        self.drives: SessionDrives
        super().__init__(mechanism, scene, settings, model, SessionDrives(self.map), substeps, start, seed)
        columns = np.concatenate([1 + self.map.qpos, 1 + model.nq + self.map.dof])
        self._observe(seen, np.eye(mujoco.mj_stateSize(model, ROW))[columns], np.zeros(len(columns)))
        self._sites = np.array([self.map.site(name) for name in seen.frames], dtype=int)
        self.loops = LoopWatch(self.map)
        self.gap_sensors = tuple(_sensor(model, x.name) for x in mechanism.loops if x.kind in GAP_KINDS)
        self.gap_limit = self.loops.limit
        self.reset()

    @property
    def _coordinates(self) -> MujocoMap:
        return self.map

    def _points(self) -> Array:
        mujoco.mj_kinematics(self.model, self.data)  # mj_step leaves the points of the state before
        return np.asarray(self.data.site_xpos[self._sites].ravel())

    def points_at(self, qpos: Array, sites: Array) -> Array:
        """See `StepLoop.points_at`."""
        return np.asarray(sites[:, self._sites].reshape(len(sites), -1))

    def state_at(self, qpos: Array, qvel: Array) -> tuple[Array, Array]:
        """See `StepLoop.state_at`."""
        return self.map.coordinates(qpos), self.map.rates(qvel)

    def _begin(self, scene: Scene) -> Driver | None:
        self._put(scene)
        self.loops.worst = None
        self.fed, self.called = np.zeros(KEPT + 1), np.zeros(KEPT + 1)
        self._worked, self.allowance = 0, 0.0
        self._driver = Driver(self.mechanism, scene.laws, MujocoPlant(self.mechanism, self.model, self.data, self.map))
        return self._driver if self._driver.called else None

    def at_start(self, scene: Scene) -> Mapping[str, Array]:
        """See `StepLoop.at_start`."""
        q, v = initial_state(self.mechanism, scene)
        qpos = self.map.engine_coordinates(q)
        return {"qpos": qpos, "qvel": self.map.engine_rates(qpos, v), "ctrl": self.drives.control(self.drives.rest)}

    def _acted(self) -> None:
        self.called[self.count] = self._driver.work

    def _opened(self) -> SteppingEnd | None:
        if not self.loops.opened(self.time, self.data):
            return None
        assert self.loops.worst is not None
        t, gap, name = self.loops.worst
        return SteppingEnd(t, f"loop {name!r} is open by {gap:.3g} m")

    def _make_room(self) -> None:
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

    def _recorded(self) -> Recording:
        self._integrate(again=True)
        return recording_of(self)


def _sensor(model: mujoco.MjModel, loop: str) -> int:
    """Where the gap of a loop stands among the sensor data."""
    return int(model.sensor_adr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, f"gap:{loop}")])
