"""Laws of controllers: a servo on one joint or shaft, and computed torque on many."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.laws.formula import Affine, Formula, within
from mechlab.experiment.laws.protocol import OnOne, Plant, register
from mechlab.experiment.motion import PrescribedMotion
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

if TYPE_CHECKING:
    from mechlab.experiment.laws.inverse import InverseDynamics


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

    def formulas(self) -> tuple[Formula, ...]:
        """See `mechlab.experiment.laws.formula`."""
        k, d = self.stiffness, self.damping
        raw = Affine(self.feedforward, ((self.motion, (k, d, 0.0)),), ((self.on, -k),), ((self.on, -d),))
        return (Formula(self.on, (raw,), within(self.limit) if math.isfinite(self.limit) else None),)


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

    def commanded(self) -> tuple[Affine, ...]:
        """The commanded accelerations as affine functions: see `mechlab.experiment.laws.formula`."""
        pairs = zip(self.commands, self.gains, strict=True)
        return tuple(
            Affine(motions=((motion, (kp, kv, 1.0)),), values=((name, -kp),), rates=((name, -kv),))
            for (name, motion), (kp, kv) in pairs
        )

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """Forces of the drives from inverse dynamics."""
        forces = self.inverse(plant.mechanism)(plant, self.accelerations(t, plant))
        return dict(zip(self.drives, forces.tolist(), strict=True))

    def inverse(self, mechanism: Mechanism) -> InverseDynamics:
        """The inverse dynamics of the commands by the drives, for one run: it keeps its choice of rows, which moves the last digits."""
        return _inverse(mechanism, np.array([mechanism.row(name) for name, _ in self.commands]), self.drives)


def drive_forces(plant: Plant, rows: Array, accelerations: Array, drives: tuple[str, ...]) -> Array:
    """(drives,) forces that give `rows @ a = accelerations` (k, nv), (k,) under the constraints: see
    `mechlab.experiment.laws.inverse`."""
    return _inverse(plant.mechanism, rows, drives)(plant, accelerations)


def _inverse(mechanism: Mechanism, rows: Array, drives: tuple[str, ...]) -> InverseDynamics:
    from mechlab.experiment.laws.inverse import InverseDynamics  # loads scipy.linalg, which other laws do not need

    return InverseDynamics(mechanism, rows, drives)
