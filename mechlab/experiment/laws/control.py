"""Laws of controllers: a servo on one joint or shaft, and computed torque on many."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.laws.protocol import OnOne, Plant, register
from mechlab.experiment.motion import PrescribedMotion
from mechlab.mechanism.geometry import Array


@register("servo")
@dataclass(frozen=True)
class Servo(OnOne):
    """A servo: stiffness (target - value) + damping (target rate - rate) + feedforward, limited to +-limit.

    drive: name of the declared drive that this law is, or "" for a law of the scene.
    """

    on: str
    motion: PrescribedMotion
    stiffness: float
    damping: float
    feedforward: float = 0.0
    limit: float = math.inf
    drive: str = ""
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The servo force."""
        x, dx, _ = self.motion.at(t)
        f = self.stiffness * (x - plant.value(self.on)) + self.damping * (dx - plant.rate(self.on)) + self.feedforward
        return {self.on: min(max(f, -self.limit), self.limit)}


@register("computed_torque")
@dataclass(frozen=True)
class ComputedTorque:
    """Inverse dynamics with feedback: each commanded coordinate gets the acceleration

        acc = target acc + velocity_gain (target rate - rate) + position_gain (target - value)

    and inverse dynamics under the constraints gives the forces of the drives. `commands`: pairs of a joint or shaft and
    its motion, as many as drives; `gains`: pairs (position_gain [1/s2], velocity_gain [1/s]).
    """

    drives: tuple[str, ...]
    commands: tuple[tuple[str, PrescribedMotion], ...]
    gains: tuple[tuple[float, float], ...]
    kind: ClassVar[str]

    def __post_init__(self) -> None:
        if not len(self.drives) == len(self.commands) == len(self.gains):
            raise MechlabError(
                f"computed_torque: {len(self.drives)} drives, {len(self.commands)} commands, {len(self.gains)} gains; "
                "there must be as many of each."
            )

    def targets(self) -> tuple[str, ...]:
        """The drives."""
        return self.drives

    def accelerations(self, t: float, plant: Plant) -> Array:
        """(commands,) commanded accelerations."""
        out = []
        for (name, motion), (kp, kv) in zip(self.commands, self.gains, strict=True):
            x, dx, ddx = motion.at(t)
            out.append(ddx + kv * (dx - plant.rate(name)) + kp * (x - plant.value(name)))
        return np.array(out)

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """Forces of the drives from inverse dynamics."""
        m = plant.mechanism
        rows = np.array([m.row(name) for name, _ in self.commands])
        forces = drive_forces(plant, rows, self.accelerations(t, plant), self.drives)
        return dict(zip(self.drives, forces.tolist(), strict=True))


def drive_forces(plant: Plant, rows: Array, accelerations: Array, drives: tuple[str, ...]) -> Array:
    """(drives,) forces that give `rows @ a = accelerations` (k, nv), (k,) under the constraints.

    Solves M a + h = B^T f + J^T r together with J a + b = 0; redundant rows are met in the least-squares sense. For a
    state that is not finite the forces are NaN, which ends the run as blown up.
    """
    m = plant.mechanism
    jacobian, bias = plant.jacobian(), plant.constraint_bias()
    if not (np.isfinite(accelerations).all() and np.isfinite(jacobian).all() and np.isfinite(bias).all()):
        return np.full(len(drives), np.nan)
    a = np.linalg.lstsq(np.vstack([jacobian, rows]), np.concatenate([-bias, accelerations]), rcond=1e-11)[0]
    needed = plant.mass_matrix() @ a + plant.bias()
    if not np.isfinite(needed).all():
        return np.full(len(drives), np.nan)
    actuation = np.array([m.row(name) for name in drives])
    solution = np.linalg.lstsq(np.vstack([actuation, jacobian]).T, needed, rcond=1e-11)[0]
    return np.asarray(solution[: len(drives)])
