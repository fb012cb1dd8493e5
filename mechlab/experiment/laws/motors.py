"""Laws of motors: a linear torque-speed characteristic, and a direct-current motor with its current as a state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.laws.formula import Affine, Formula
from mechlab.experiment.laws.protocol import OnOne, Plant, register
from mechlab.experiment.motion import PrescribedMotion
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array


@register("motor")
@dataclass(frozen=True)
class Motor(OnOne):
    """A motor with a linear characteristic: torque = stall (1 - rate / no_load_rate)."""

    on: str
    stall: float
    no_load_rate: float
    kind: ClassVar[str]

    def __post_init__(self) -> None:
        if any(isinstance(x, str) for x in (self.stall, self.no_load_rate)):
            return  # text with a unit; `laws_of` makes numbers of it
        if not self.no_load_rate or self.stall * self.no_load_rate < 0.0:
            raise MechlabError(
                f"motor on {self.on!r}: expected stall and no_load_rate of one sign, so that the torque falls with the rate, "
                f"got {self.stall!r} and {self.no_load_rate!r}."
            )

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The torque at the present rate."""
        return {self.on: self.stall * (1.0 - plant.rate(self.on) / self.no_load_rate)}

    def formulas(self) -> tuple[Formula, ...]:
        """See `mechlab.experiment.laws.formula`."""
        return (Formula(self.on, (Affine(self.stall, rates=((self.on, -self.stall / self.no_load_rate),)),)),)


@register("dc_motor")
@dataclass(frozen=True)
class DcMotor(OnOne):
    """A DC motor: torque = constant i with inductance i' = voltage - resistance i - constant rate, from i = `current`.

    Its current is a state of the law (`mechlab.experiment.laws.LawStates`), integrated with the motion; without inductance it is
    (voltage - constant rate) / resistance at once. `voltage` [V]: a number, or a motion whose value it is. `neglected`: the time
    constant [s] of an inductance that was left out, for the health record. drive: name of the declared drive that this law is, or
    "" for a law of the scene.
    """

    on: str
    voltage: float | PrescribedMotion
    constant: float
    resistance: float
    inductance: float = 0.0
    current: float = 0.0
    neglected: float = 0.0
    drive: str = ""
    kind: ClassVar[str]

    def __post_init__(self) -> None:
        if not self.resistance > 0 or self.inductance < 0:
            raise MechlabError(
                f"dc_motor on {self.on!r}: expected resistance > 0 and inductance >= 0, "
                f"got {self.resistance!r} and {self.inductance!r}."
            )

    def static(self) -> DcMotor:
        """The motor without inductance; `neglected` then holds the time constant inductance / resistance [s]."""
        return replace(self, inductance=0.0, neglected=self.neglected + self.inductance / self.resistance)

    def start(self) -> tuple[float, ...]:
        """The states at t = 0: the current, or none without inductance."""
        return (self.current,) if self.inductance else ()

    def rest(self, plant: Plant) -> Array:
        """(1,) steady current [A] at the present rate."""
        voltage = self.voltage if isinstance(self.voltage, float | int) else self.voltage.at(plant.t)[0]
        return np.array([(voltage - self.constant * plant.rate(self.on)) / self.resistance])

    def state_rate(self, t: float, plant: Plant, state: Array) -> Array:
        """(1,) rate of the current."""
        return (self.rest(plant) - state) * (self.resistance / self.inductance)

    def after(self, t: float, plant: Plant, state: Array, h: float) -> Array:
        """(1,) current [A] after h seconds at the present rate: the exact solution, stable for every step."""
        rest = self.rest(plant)
        return np.asarray(rest + (state - rest) * math.exp(-h * self.resistance / self.inductance))

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The torque of the present current."""
        if self.inductance:
            state = getattr(plant, "memory", {}).get(self, (self.current,))
        else:
            state = self.rest(plant)
        return {self.on: self.constant * float(state[0])}

    def formulas(self) -> tuple[Formula, ...]:
        """See `mechlab.experiment.laws.formula`."""
        return (
            Formula(
                self.on,
                (Affine(state=self.constant) if self.inductance else self._driven(self.constant / self.resistance),),
            ),
        )

    def state_formula(self) -> Affine:
        """The rate of the current: see `mechlab.experiment.laws.formula`."""
        return replace(self._driven(1.0 / self.inductance), state=-self.resistance / self.inductance)

    def _driven(self, gain: float) -> Affine:
        """gain (voltage - constant rate)."""
        rates = ((self.on, -gain * self.constant),)
        if isinstance(self.voltage, float | int):
            return Affine(gain * self.voltage, rates=rates)
        return Affine(motions=((self.voltage, (gain, 0.0, 0.0)),), rates=rates)
