"""Commands of a file's actuators, in the units of the file's control.

They are what a plain loop does that sets `data.ctrl` before each `mj_step`: the command at the time of a step's start, held over the
step, also by RK4, whose stages read the same control. MuJoCo clamps them to `ctrlrange` where the file asks for it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import mujoco

from mechlab.engines.mujoco.model_file.compiled import OBJECT, key
from mechlab.engines.mujoco.stepping import Grid, take_steps
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.model_file import ModelFile
from mechlab.experiment.motion import Function, PrescribedMotion


def actuator_name(model: mujoco.MjModel, number: int) -> str:
    """Name of an actuator; of one without a name "actuator_K", K its number in the file, from 0."""
    return key(model, OBJECT.mjOBJ_ACTUATOR, number).replace("#", "actuator_")


class FileControls:
    """The commands of a scene. They are named by the actuators of the file, or by the drives that were read from them.

    Raises MechlabError for a name that the file does not have, and for an actuator that is named twice.
    """

    def __init__(self, file: ModelFile, model: mujoco.MjModel, controls: Mapping[str, PrescribedMotion]) -> None:
        self.name = file.mechanism.name
        actuators = {actuator_name(model, k): k for k in range(model.nu)}
        drives = {file.drives.get(key(model, OBJECT.mjOBJ_ACTUATOR, k), ""): k for k in range(model.nu)}
        known = {name: k for name, k in drives.items() if name} | actuators
        self.commands: dict[int, tuple[str, PrescribedMotion]] = {}
        for name, motion in controls.items():
            if name not in known:
                raise unknown(f"{self.name}: drives: actuator of the file", name, actuators)
            if known[name] in self.commands:
                both = f"{self.commands[known[name]][0]!r} and {name!r}"
                raise MechlabError(f"{self.name}: drives: {both} are the same actuator; command it once.")
            self.commands[known[name]] = (name, motion)

    def __bool__(self) -> bool:
        return bool(self.commands)

    def put(self, data: mujoco.MjData, t: float) -> None:
        """Set the controls of time t [s]. Raises MechlabError for a command that is not finite."""
        for k, (name, motion) in self.commands.items():
            value = motion.value(t) if isinstance(motion, Function) else motion.at(t)[0]
            if not math.isfinite(value):
                raise MechlabError(f"{self.name}: command of actuator {name!r} at t = {t:g} s: expected a finite number, got {value!r}.")
            data.ctrl[k] = value

    def step(self, model: mujoco.MjModel, data: mujoco.MjData, steps: Grid, start: int, end: int) -> None:
        """Take the steps of a grid one by one, each under the controls of its start."""
        for k in range(start, end):
            self.put(data, steps.t(k))
            take_steps(model, data, steps, k, k + 1)
