"""A cutting force: a knife meets it in the stack, on its way down."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from mechlab.experiment.laws import Plant, register
from mechlab.experiment.laws.formula import Affine, Formula
from mechlab.experiment.laws.protocol import OnOne
from mechlab.lazy_dataclass import dataclass

RAMP = 0.1
"""Share of the stack over which the force grows to its full size, so that a step of the engines does not miss its begin."""


@register("cutting")
@dataclass(frozen=True)
class Cutting(OnOne):
    """A force [N] on a slide that goes down through a stack between the places low and top [m]: it grows over the first tenth of the
    stack, is `size` below, and 0 on the way up."""

    on: str
    size: float
    low: float
    top: float
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The force at the present place and rate."""
        return {self.on: self.at(plant.value(self.on), plant.rate(self.on))}

    def at(self, place: float, rate: float) -> float:
        """The force [N] at a place [m] and a rate [m/s]."""
        if rate >= 0.0 or place >= self.top:
            return 0.0
        return self.size * min((self.top - place) / (RAMP * (self.top - self.low)), 1.0)

    def formulas(self) -> tuple[Formula, ...]:
        """See `mechlab.experiment.laws.formula`."""
        return (Formula(self.on, (Affine(values=((self.on, 1.0),)), Affine(rates=((self.on, 1.0),))), self.at),)
