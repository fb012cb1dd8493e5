"""The accepted motion against another method: over as much of the scene as a share of the work done allows.

What error control gives: a motion with its error, and the sentence that says how it was found.

Whether an error is met and believed, and the sentence that says so.

A Recording of a motion whose error is known: the states that were estimated, at even times and at those asked for.
"""

from __future__ import annotations

from dataclasses import dataclass

from mechlab.experiment.scene import Settings
from mechlab.lab.accuracy.check import MethodCheck
from mechlab.lab.accuracy.measure import ContinuousMotion, ErrorMeasure
from mechlab.mechanism.geometry import Array


@dataclass(frozen=True)
class NeighbourMotion:
    """A cruder or slightly other motion of the same scene: `factor` times its difference from the accepted one is, for every
    channel, a part of the error.

    motion, or q (n, nq), v (n, nv) at the output times; settings: those that a runner makes it with; captured: held rates are
    captured in so many times their `time`.
    """

    factor: float
    settings: Settings
    q: Array
    v: Array
    motion: ContinuousMotion | None = None
    captured: float = 1.0


@dataclass(frozen=True)
class Solution:
    """A motion with its error.

    t (n,); q (n, nq), v (n, nv): at the output times. estimate [unit]: of the largest error of the tracked quantities;
    method, step (a step [s], a tolerance, the nodes of a cell, 0 of a closed form; see `control`); cpu_s: all CPU spent, probing and check
    included, imports and building of models excluded; reached: whether the estimate meets `max_error`; sentence: what was
    chosen and why, or why it cannot be reached; neighbours: from which the errors of all channels follow, none where there was
    one run alone.
    """

    t: Array
    q: Array
    v: Array
    estimate: float
    max_error: float
    unit: str
    method: str
    step: float
    control: str
    cpu_s: float
    evaluations: int
    reached: bool
    sentence: str
    settings: Settings
    checked: MethodCheck | None
    motion: ContinuousMotion | None = None
    extrapolated: bool = False
    neighbours: tuple[NeighbourMotion, ...] = ()

    @property
    def accelerations(self) -> Array | None:
        """(n, nv) where the method knows them."""
        return None if self.motion is None else self.motion.states(self.t, accelerations=True).a


ROUNDING_COUNTS = 1e-7
"""Below this error, what rounding does to the motion is looked at and told [m or rad]."""


LIMITED_BY_ROUNDING = "double precision does not allow it"
LIMITED_BY_CAPTURE = "it is the time in which the law captures held rates; a smaller `time` of the law makes it less"


def conclusion(
    estimate: float, max_error: float, measure: ErrorMeasure, chosen: str, checked: MethodCheck | None, size: float,
    part: str = "", cause: str = "",
) -> tuple[bool, str]:  # fmt: skip
    """Whether the error is met and believed, and the sentence; `part`: what makes it up most, `cause`: why it cannot be less,
    where these are known; `size`: of the tracked quantities."""
    unit = measure.unit
    told = f"error of {measure.what} estimated at {estimate:.2g} {unit}"
    told += f" ({max_error:g} {unit} asked for{', of which ' + part if part else ''})"
    says = checked.sentence if checked is not None else "no other method could check it"
    against = checked is not None and checked.contradicts(estimate, size)
    ok = estimate <= max_error and not against
    text = f"{told}; {chosen}; {says}"
    if against:
        text += "; the two contradict each other: do not trust this run"
    elif not ok:
        text += f"; the error asked for cannot be reached: {cause or 'this is the best that was found'}"
    return ok, text
