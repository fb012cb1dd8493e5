"""Laws of loads: given in time, or by the rate or position of what they act on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mechlab.experiment.laws.protocol import OnOne, Plant, register


@register("constant")
@dataclass(frozen=True)
class Constant(OnOne):
    """A constant force or torque."""

    on: str
    value: float
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The constant."""
        return {self.on: self.value}


@register("harmonic")
@dataclass(frozen=True)
class Harmonic(OnOne):
    """offset + amplitude sin(frequency t + phase), frequency in rad/s."""

    on: str
    amplitude: float
    frequency: float
    phase: float = 0.0
    offset: float = 0.0
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The harmonic at t."""
        return {self.on: self.offset + self.amplitude * math.sin(self.frequency * t + self.phase)}


@register("table")
@dataclass(frozen=True)
class TableLaw(OnOne):
    """A force given at times, linear between, held at the ends."""

    on: str
    times: tuple[float, ...]
    values: tuple[float, ...]
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The interpolated force."""
        return {self.on: float(np.interp(t, self.times, self.values))}


@register("constant_power")
@dataclass(frozen=True)
class ConstantPower(OnOne):
    """power / rate, limited to `limit` near standstill."""

    on: str
    power: float
    limit: float
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The force at the present rate."""
        rate = plant.rate(self.on)
        f = (
            self.power / rate
            if abs(rate) * self.limit > abs(self.power)
            else math.copysign(self.limit, self.power * (rate or 1.0))
        )
        return {self.on: min(max(f, -self.limit), self.limit)}


@register("viscous")
@dataclass(frozen=True)
class Viscous(OnOne):
    """A load proportional to the rate: -coefficient x rate."""

    on: str
    coefficient: float
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The drag at the present rate."""
        return {self.on: -self.coefficient * plant.rate(self.on)}


@register("one_sided_stop")
@dataclass(frozen=True)
class OneSidedStop(OnOne):
    """A spring and damper that pushes when the value passes `at` towards `side` (+1 or -1), and never pulls."""

    on: str
    at: float
    side: int
    stiffness: float
    damping: float = 0.0
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The push."""
        depth = self.side * (plant.value(self.on) - self.at)
        if depth <= 0:
            return {self.on: 0.0}
        push = self.stiffness * depth + self.damping * self.side * plant.rate(self.on)
        return {self.on: -self.side * max(0.0, push)}
