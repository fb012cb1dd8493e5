"""Laws of loads that depend on time, rate or position; and the sum of all laws for repeated evaluation
(`AppliedForce`)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from mechlab.errors import explained
from mechlab.experiment.laws.formula import Affine, Formula
from mechlab.experiment.laws.protocol import Law, OnOne, Plant, register
from mechlab.experiment.motion import Polyline, Sine
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism


@register("constant")
@dataclass(frozen=True)
class Constant(OnOne):
    """A constant force or torque."""

    on: str
    value: float
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The constant force."""
        return {self.on: self.value}

    def formulas(self) -> tuple[Formula, ...]:
        """See `mechlab.experiment.laws.formula`."""
        return (Formula(self.on, (Affine(self.value),)),)


@register("harmonic")
@dataclass(frozen=True)
class Harmonic(OnOne):
    """A force offset + amplitude sin(frequency t + phase) [N m or N]; frequency [rad/s]."""

    on: str
    amplitude: float
    frequency: float
    phase: float = 0.0
    offset: float = 0.0
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The harmonic at t."""
        return {self.on: self.offset + self.amplitude * math.sin(self.frequency * t + self.phase)}

    def formulas(self) -> tuple[Formula, ...]:
        """See `mechlab.experiment.laws.formula`."""
        wave = Sine(self.amplitude, self.frequency, self.phase, self.offset)
        return (Formula(self.on, (Affine(motions=((wave, (1.0, 0.0, 0.0)),)),)),)


@register("table")
@dataclass(frozen=True)
class TableLaw(OnOne):
    """A force [N m or N] given at times [s]: linear interpolation between them, constant beyond the ends."""

    on: str
    times: tuple[float, ...]
    values: tuple[float, ...]
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The interpolated force."""
        return {self.on: float(np.interp(t, self.times, self.values))}

    def formulas(self) -> tuple[Formula, ...]:
        """See `mechlab.experiment.laws.formula`."""
        return (Formula(self.on, (Affine(motions=((Polyline(self.times, self.values), (1.0, 0.0, 0.0)),)),)),)


@register("constant_power")
@dataclass(frozen=True)
class ConstantPower(OnOne):
    """A force power / rate, limited to +-limit [N m or N] near standstill; power [W]."""

    on: str
    power: float
    limit: float
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The force at the present rate."""
        return {self.on: self._at(plant.rate(self.on))}

    def _at(self, rate: float) -> float:
        f = (
            self.power / rate
            if abs(rate) * self.limit > abs(self.power)
            else math.copysign(self.limit, self.power * (rate or 1.0))
        )
        return min(max(f, -self.limit), self.limit)

    def formulas(self) -> tuple[Formula, ...]:
        """See `mechlab.experiment.laws.formula`."""
        return (Formula(self.on, (Affine(rates=((self.on, 1.0),)),), self._at),)


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

    def formulas(self) -> tuple[Formula, ...]:
        """See `mechlab.experiment.laws.formula`."""
        return (Formula(self.on, (Affine(rates=((self.on, -self.coefficient),)),)),)


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
        """The force of the stop, directed against `side`."""
        return {self.on: self._against(self.side * (plant.value(self.on) - self.at), self.side * plant.rate(self.on))}

    def _against(self, depth: float, rate: float) -> float:
        return 0.0 if depth <= 0 else -self.side * max(0.0, self.stiffness * depth + self.damping * rate)

    def formulas(self) -> tuple[Formula, ...]:
        """See `mechlab.experiment.laws.formula`."""
        depth = Affine(-self.side * self.at, values=((self.on, float(self.side)),))
        return (Formula(self.on, (depth, Affine(rates=((self.on, float(self.side)),))), self._against),)


@explained
class AppliedForce:
    """`applied_force` for many states: `self(t, plant)` gives the (nv,) generalized force of all laws, and joint or
    shaft -> force.

    `constant`: all laws are constant loads; every call then returns the same two objects, which must not be changed.
    Raises MechlabError when a law acts on a name that does not exist.
    """

    def __init__(self, mechanism: Mechanism, laws: Sequence[Law]) -> None:
        self.mechanism = mechanism
        self._forces = [law.force for law in laws]
        self._terms: dict[str, tuple[tuple[int, float], ...]] = {}
        for law in laws:
            for name in law.targets():
                self._learn(name)
        self.constant = all(type(law) is Constant for law in laws)
        self._kept: tuple[Array, dict[str, float]] | None = None

    def _learn(self, name: str) -> tuple[tuple[int, float], ...]:
        row = self.mechanism.row(name)
        self._terms[name] = tuple((int(k), float(row[k])) for k in np.flatnonzero(row))
        return self._terms[name]

    def __call__(self, t: float, plant: Plant) -> tuple[Array, dict[str, float]]:
        """(nv,) generalized force at time t [s] in the state of the plant, and the forces by name."""
        if self._kept is not None:
            return self._kept
        by_name: dict[str, float] = {}
        for force in self._forces:
            for name, f in force(t, plant).items():
                by_name[name] = by_name.get(name, 0.0) + f
        total = np.zeros(self.mechanism.nv)
        for name, f in by_name.items():
            for k, c in self._terms.get(name) or self._learn(name):
                total[k] += c * f
        if self.constant:
            total.flags.writeable = False
            self._kept = total, by_name
        return total, by_name
