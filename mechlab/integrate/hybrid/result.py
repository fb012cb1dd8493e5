"""What a hybrid integration returns: samples, events, time stuck, cost, and how it ended."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from mechlab.integrate.hybrid.problem import Array, Modes


class Ending(Enum):
    """How a hybrid integration ended, as a sentence."""

    COMPLETE = "complete"
    STEP_TOO_SMALL = "the step size fell below rounding: a singularity or a stiff problem"
    NOT_FINITE = "the state is not finite"
    TOO_MANY = "the largest number of evaluations was reached; try a larger tolerance"
    CHATTER = "events follow each other without time passing: the friction law has no consistent continuation here"


@dataclass(frozen=True)
class Event:
    """An element changed its mode: time, state, index of the element, modes before and after."""

    t: float
    y: Array
    element: int
    before: int
    after: int


@dataclass(frozen=True)
class HybridTrajectory:
    """States y (m, n) and modes (m, k) at the sample times t (m,); events; time stuck (k,); evaluations; modes at the end.

    An integration that could not go on has the samples up to there and says why in `ending`; `last_t`, `last_y` is
    where it stopped.
    """

    t: Array
    y: Array
    modes: NDArray[np.int64]
    events: tuple[Event, ...]
    stuck_time: Array
    evaluations: int
    steps: int
    ending: Ending
    last_t: float
    last_y: Array
    last_modes: Modes

    @property
    def complete(self) -> bool:
        """True when the end time was reached."""
        return self.ending is Ending.COMPLETE
