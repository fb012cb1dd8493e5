"""What every dyad gives back, and how a mode or a gap is told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechlab.analytic.assur.plane import Flags, Point, Real, Scalar
from mechlab.errors import MechlabError, NoSolution


class ChangePoint(MechlabError):
    """Two assembly modes meet on the way: there are two continuations, and none is chosen silently (exit code 3)."""

    exit_code = 3

    def __init__(self, message: str, at: float) -> None:
        super().__init__(message)
        self.at = at


@dataclass(frozen=True)
class Dyad:
    """Solution of a dyad, all arrays of one shape.

    joint: the inner joint (of RPR: the pin of the slider). angles: of its turning links; slides: along its guides.
    quality: sine of the transmission angle, signed; 0 at a dead centre, where rates do not exist and are NaN.
    discriminant: quality squared, negative where the group does not assemble; there everything but it is NaN.
    gap [m]: how far the lengths are from meeting, 0 where they meet.
    """

    kind: str
    joint: Point
    angles: tuple[Scalar, ...]
    slides: tuple[Scalar, ...]
    quality: Real
    discriminant: Real
    gap: Real

    @property
    def assembles(self) -> Flags:
        """Where it closes."""
        return np.asarray(self.discriminant >= 0.0)

    @property
    def regular(self) -> Flags:
        """Where it closes away from a dead centre, so that rates exist."""
        return np.asarray(np.abs(self.quality) > DEAD)

    def require(self) -> Dyad:
        """Itself; raises NoSolution where it does not assemble or rates do not exist, with the largest gap."""
        if not np.all(self.assembles):
            raise NoSolution(
                f"dyad {self.kind}: no assembly exists at {np.count_nonzero(~self.assembles)} of {self.assembles.size} "
                f"positions; the largest gap is {np.max(self.gap):.6g} m. Change the lengths or the range of the input."
            )
        if not np.all(self.regular):
            raise NoSolution(
                f"dyad {self.kind}: dead centre at {np.count_nonzero(~self.regular)} positions (sine of the transmission "
                f"angle below {DEAD:g}); rates do not exist there. Keep away from the limit positions."
            )
        return self


DEAD = 1e-9
"""Below this sine of the transmission angle the inputs do not determine the rates in double precision."""


def divisor(quality: Real, value: Real) -> Real:
    """`value` as a divisor: NaN at a dead centre, so that no rate is invented there."""
    if np.min(np.abs(quality), initial=1.0) > DEAD:
        return value
    return np.where(np.abs(quality) > DEAD, value, np.nan)
