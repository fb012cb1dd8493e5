"""Forces of the actuators of a file: on joints and shafts of the mechanism, or by the actuator's own name."""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.engines.mujoco.as_is.controls import actuator_name
from mechlab.engines.mujoco.model_file.compiled import OBJECT, key
from mechlab.experiment.model_file import ModelFile
from mechlab.mechanism.geometry import Array


class ActuatorForces:
    """The force of every actuator at the samples.

    An actuator on a hinge or slide gives gear x force on that joint. Any other (of tendons, sites, bodies) is recorded as
    ACTUATOR_force, the force at its own transmission.
    """

    def __init__(self, file: ModelFile, model: mujoco.MjModel) -> None:
        self._joints: dict[str, list[tuple[int, float]]] = {}
        self._own: list[tuple[str, int]] = []
        taken = set(file.mechanism.scalar_names)
        on_joint = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
        for k in range(model.nu):
            joint = int(model.actuator_trnid[k, 0])
            names = (
                file.joints.get(key(model, OBJECT.mjOBJ_JOINT, joint), ())
                if int(model.actuator_trntype[k]) in on_joint
                else ()
            )
            if len(names) == 1 and names[0] in taken:
                self._joints.setdefault(names[0], []).append((k, float(model.actuator_gear[k, 0])))
            else:
                name = actuator_name(model, k)
                self._own.append((f"{name}_actuator" if name in taken else name, k))
        self._forces: list[Array] = []

    def take(self, data: mujoco.MjData) -> None:
        """One sample."""
        self._forces.append(data.actuator_force.copy())

    def on_coordinates(self) -> dict[str, Array]:
        """Joint -> (n,) force or torque of its actuators."""
        force = np.array(self._forces)
        return {name: sum(gear * force[:, k] for k, gear in parts) for name, parts in self._joints.items()}  # type: ignore[misc]

    def channels(self) -> tuple[dict[str, Array], dict[str, str]]:
        """The other actuators' forces, in the unit of their transmission."""
        force = np.array(self._forces)
        out = {f"{name}_force": force[:, k] for name, k in self._own}
        return out, dict.fromkeys(out, "N")
