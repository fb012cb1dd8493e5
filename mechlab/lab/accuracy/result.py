"""The result of error control: a motion, its error, and the sentence that says how it was found and if to trust it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Settings
from mechlab.lab.accuracy.measure import ContinuousMotion, ErrorMeasure
from mechlab.lab.accuracy.rules import RULES
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array


@dataclass(frozen=True)
class MethodCheck:
    """Up to time `until` [s] the check method differs by `difference`; its own error is `own` (both in m or rad)."""

    method: str
    difference: float
    own: float
    until: float
    sentence: str

    def confirms(self, within: float) -> bool:
        """Whether the check method neither differs nor itself still changes by more than `within` [m or rad]."""
        return max(self.difference, self.own) <= within

    def contradicts(self, estimate: float, size: float) -> bool:
        """Whether the difference is more than the errors of both explain. estimate: error of the motion; size: largest
        tracked quantity."""
        return self.difference > RULES.contradiction * (self.own + estimate) + 1e-11 * size


@dataclass(frozen=True)
class NeighbourMotion:
    """A slightly less exact motion of the same scene: `factor` x its difference from the accepted motion is a part of
    the error of every channel.

    q (n, nq), v (n, nv): at the output times; motion: at any time, where it is known; settings: with which an engine
    makes it; captured: held rates are captured in this multiple of their `time`.
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

    t (n,), q (n, nq), v (n, nv): at the output times. estimate [unit]: largest error of the tracked quantities. method: its name.
    step: a step [s], a tolerance, the nodes of a cell, or 0 for a closed form; `control` says which. cpu_s: all CPU
    time, with trials and check, without imports and building of models. reached: whether the estimate meets
    `max_error`. sentence: what was chosen and why, or why the error cannot be reached. neighbours: from which the
    errors of all channels follow; none where there was a single run. run_s: CPU time of the accepted motion alone.
    capture [unit]: the part of the estimate that is the time in which held rates are captured. recorded: Recordings of its last runs by
    their steps [s], where they were made as such. between: accelerations (n, nv), and forces (n,) of the laws by joint or shaft, where
    the steps are longer than the distance of the outputs.
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
    check: MethodCheck | None
    motion: ContinuousMotion | None = None
    extrapolated: bool = False
    neighbours: tuple[NeighbourMotion, ...] = ()
    run_s: float = 0.0
    capture: float = 0.0
    recorded: Mapping[float, Recording] = field(default_factory=dict)
    between: tuple[Array, dict[str, Array]] | None = None

    @property
    def accelerations(self) -> Array | None:
        """Accelerations (n, nv) at the output times, or None where the method does not know them."""
        return None if self.motion is None else self.motion.states(self.t, accelerations=True).a


ROUNDING_COUNTS = 1e-7
"""Below this error [m or rad] the effect of rounding on the motion is estimated and reported too."""


LIMITED_BY_ROUNDING = "double precision does not allow it"
LIMITED_BY_CAPTURE = "it is the time in which the law captures held rates; a smaller `time` of the law, or a larger budget, makes it less"


def conclusion(
    estimate: float, max_error: float, measure: ErrorMeasure, chosen: str, check: MethodCheck | None, size: float,
    part: str = "", cause: str = "",
) -> tuple[bool, str]:  # fmt: skip
    """Whether the error is met and not contradicted by the check, and the sentence that says so.

    size [unit]: largest tracked quantity; part: the largest part of the error in words; cause: why it cannot be less ("" where
    these are not known).
    """
    unit = measure.unit
    text_of_error = f"error of {measure.what} estimated at {estimate:.2g} {unit}"
    text_of_error += f" ({max_error:g} {unit} asked for{', of which ' + part if part else ''})"
    check_text = check.sentence if check is not None else "no other method could check it"
    contradicted = check is not None and check.contradicts(estimate, size)
    ok = estimate <= max_error and not contradicted
    text = f"{text_of_error}; {chosen}; {check_text}"
    if contradicted:
        text += "; the two contradict each other: do not trust this run"
    elif not ok:
        text += f"; the error asked for cannot be reached: {cause or 'this is the best that was found'}"
    return ok, text
