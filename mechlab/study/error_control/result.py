"""What error control gives: a motion with its error, and the sentence that says how it was found."""

from __future__ import annotations

from dataclasses import dataclass

from mechlab.experiment.settings import Settings
from mechlab.mechanism.geometry import Array
from mechlab.study.error_control.check_method import Checked
from mechlab.study.error_control.motion import Motion


@dataclass(frozen=True)
class Neighbour:
    """A cruder or slightly other motion of the same scene: `factor` times its difference from the accepted one is, for every
    channel, a part of the error.

    motion, or q (n, nq), v (n, nv) at the output times; settings: those that a runner makes it with; captured: held rates are
    captured in so many times their `time`.
    """

    factor: float
    settings: Settings
    q: Array
    v: Array
    motion: Motion | None = None
    captured: float = 1.0


@dataclass(frozen=True)
class Result:
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
    checked: Checked | None
    motion: Motion | None = None
    extrapolated: bool = False
    neighbours: tuple[Neighbour, ...] = ()

    @property
    def accelerations(self) -> Array | None:
        """(n, nv) where the method knows them."""
        return None if self.motion is None else self.motion.states(self.t, accelerations=True).a
