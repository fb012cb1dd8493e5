"""A step loop on a file that is somebody's own, as it is: its contacts, softness, timestep and actuators, in the units of its controls.

The motion is that of `mj_step` on the compiled file under `data.ctrl`. Its Recording is a run of the engine `file` from the same start
under the same controls, step by step the same motion; it takes the time of the session once more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.mujoco.as_is.controls import actuator_name
from mechlab.engines.mujoco.as_is.findings import gave_up
from mechlab.engines.mujoco.as_is.model import run_model, start
from mechlab.engines.mujoco.control import engine as quiet
from mechlab.engines.mujoco.model_file.coordinates import FileCoordinates
from mechlab.engines.mujoco.step_loop import ROW, Start, StepLoop
from mechlab.engines.mujoco.step_watch import BLOCK
from mechlab.errors import MechlabError
from mechlab.experiment.model_file import ModelFile
from mechlab.experiment.motion import Function
from mechlab.experiment.observed import Observed
from mechlab.experiment.recording import Finding, Health, Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_poses import ManyPoses

Run = Callable[[Scene, Settings], Recording]
"""The engine's run of a scene."""
FIELDS = ("qpos", "qvel", "ctrl", "act", "mocap_pos", "mocap_quat")
"""What a start of a file sets."""


class FileCommands:
    """The actuators of a file by name; a command is `data.ctrl`, which MuJoCo clamps to ctrlrange where the file asks for it."""

    plain = True

    def __init__(self, model: mujoco.MjModel) -> None:
        self.names = tuple(actuator_name(model, k) for k in range(model.nu))
        self.units = ("control",) * model.nu
        limited = model.actuator_ctrllimited.astype(bool)
        self.low = np.where(limited, model.actuator_ctrlrange[:, 0], -np.inf)
        self.high = np.where(limited, model.actuator_ctrlrange[:, 1], np.inf)
        self.rest = model.key_ctrl[0].copy() if model.nkey else np.zeros(model.nu)
        self.shift = np.zeros(model.nu)

    def control(self, command: Array) -> Array:
        """(..., actuators) the command itself."""
        return command

    def command(self, control: Array) -> Array:
        """(..., actuators) the control itself."""
        return np.array(control)


class FileSession(StepLoop):
    """See the module; made by `mechlab.session` of a file."""

    def __init__(
        self,
        file: ModelFile,
        scene: Scene,
        settings: Settings,
        run: Run,
        seen: Observed,
        substeps: int = 1,
        start: Start | None = None,
        seed: int | None = None,
    ) -> None:
        if scene.laws or scene.controls:
            raise MechlabError(
                f"{file.name}: a session of the file as it is takes neither laws nor loads, its actions are the file's controls; for "
                'them take our model of it, engine="mujoco".'
            )
        model = run_model(file, settings)
        self.states, self._run = FileCoordinates(file, model), run
        super().__init__(file.mechanism, scene, settings, model, FileCommands(model), substeps, start, seed)
        self._observe(seen, *self._affine())
        frames = [f.name for f in file.mechanism.frames]
        self._poses, self._frames = ManyPoses(file.mechanism), [frames.index(n) for n in seen.frames]
        self._held: list[Array] = []
        self.reset()

    def _affine(self) -> tuple[Array, Array]:
        """(nq + nv, size) and (nq + nv,): the state of the mechanism as an affine function of a kept row."""
        model, states = self.model, self.states
        zero = states.coordinates(np.zeros(model.nq))
        turned = (states.coordinates(np.eye(model.nq)) - zero).T
        out = np.zeros((len(zero) + len(states.dof), mujoco.mj_stateSize(model, ROW)))
        out[: len(zero), 1 : 1 + model.nq] = turned
        out[len(zero) + np.arange(len(states.dof)), 1 + model.nq + states.dof] = 1.0
        return out, np.concatenate([zero, np.zeros(len(states.dof))])

    @property
    def _coordinates(self) -> FileCoordinates:
        return self.states

    def _points(self) -> Array:
        return self.points_at(self.data.qpos[None], np.zeros(0))[0]

    def points_at(self, qpos: Array, sites: Array) -> Array:
        """See `StepLoop.points_at`; frames of the mechanism are not always sites of the file."""
        points = self._poses.set(self.states.coordinates(qpos)).frame_positions()
        return np.asarray(points[:, self._frames].reshape(len(qpos), -1))

    def state_at(self, qpos: Array, qvel: Array) -> tuple[Array, Array]:
        """See `StepLoop.state_at`; of the mechanism that was read from the file."""
        return self.states.to_mechanism(qpos, qvel)

    def at_start(self, scene: Scene) -> Mapping[str, Array]:
        """See `StepLoop.at_start`."""
        with quiet():
            begin = start(self.model, self.states, scene).data
        return {name: getattr(begin, name) for name in FIELDS}

    def step(self, action: ArrayLike | Mapping[str, float] | None = None) -> Array:
        """As `StepLoop.step`. Raises MechlabError where MuJoCo gives up."""
        try:
            return super().step(action)
        except mujoco.FatalError as error:
            raise MechlabError(f"{self.mechanism.name}: {gave_up(error, self.time)}") from None

    def _begin(self, scene: Scene) -> None:
        self._put(scene)
        self._begun, self._held = scene, []

    def _make_room(self) -> None:
        """Keep the controls alone: they give the motion anew."""
        self._held.append(self._controls(self.count))
        self.rows[0] = self.rows[self.count]
        self.count, self._next_look = 0, BLOCK

    def _controls(self, count: int) -> Array:
        """(count, actuators) controls of the last kept actions."""
        return self.rows[1 : count + 1, self.rows.shape[1] - self.model.nu :].copy()

    def _recorded(self) -> Recording:
        actions = max(1, round(self.time / self.hold))
        held = np.concatenate([*self._held, self._controls(actions - sum(len(x) for x in self._held))])

        def command(k: int) -> Function:
            return Function(lambda t: float(held[min(int(t / self.hold + 1e-6), len(held) - 1), k]))

        controls = {name: command(k) for k, name in enumerate(self.drives.names)}
        made = self._run(replace(self._begun, duration=actions * self.hold, controls=controls), self.settings)
        if self.end is not None and made.health.trusted:
            ended = Finding("blow_up", self.end.t, self.time, "s", "error", f"the session ended: {self.end.reason}")
            made = replace(made, health=Health((ended,)) + made.health)
        return made
