"""Laws as data: forces that are affine in the state and in functions of time, followed by a function of one or two such numbers.

    argument = constant + sum of gains @ (value, rate, acceleration) of motions at t
                        + sum of gain x value + sum of gain x rate of joints and shafts + sum of gain x state of the law
    force    = shape(arguments), or the argument itself

A law that has `formulas()` is compiled (`mechlab.experiment.laws.compiled`); its `force` remains what it is.
"""

from __future__ import annotations

from collections.abc import Callable

from mechlab.experiment.motion import PrescribedMotion
from mechlab.lazy_dataclass import dataclass

Named = tuple[tuple[str, float], ...]
"""Pairs of a joint or shaft and its gain."""


@dataclass(frozen=True)
class Affine:
    """An affine function: see the module. motions: pairs of a motion and the gains of its value, rate and acceleration; values,
    rates: pairs of a joint or shaft and its gain; state: gain of the first state of the law."""

    constant: float = 0.0
    motions: tuple[tuple[PrescribedMotion, tuple[float, float, float]], ...] = ()
    values: Named = ()
    rates: Named = ()
    state: float = 0.0


@dataclass(frozen=True)
class Formula:
    """The force on a joint or shaft: shape(arguments), without a shape the one argument."""

    on: str
    arguments: tuple[Affine, ...]
    shape: Callable[..., float] | None = None


def within(limit: float) -> Callable[[float], float]:
    """A shape: the number, limited to +-limit."""
    return lambda f: min(max(f, -limit), limit)
