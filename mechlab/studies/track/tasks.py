"""What a mechanism is to do along a path, and what it must keep: tasks and limits as data.

A task has a priority: 0 comes first and must be met; a task of a higher number is met as far as those before it allow.
Tasks of one priority share by their weights.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Literal

from mechlab.errors import explained
from mechlab.lazy_dataclass import dataclass
from mechlab.values import Numbers, Value

Row = Numbers | Sequence[float]
Points = Value | Sequence[Row] | Sequence[Sequence[Row]]
"""Numbers, or an array of up to three dimensions."""
Target = Points | Callable[[float], Points]
"""A constant, values along the path (one a time, first axis), or a function of the time [s]."""


@explained
@dataclass(frozen=True, eq=False)
class FrameTask:
    """A Frame of the mechanism is led along a path.

    target: position (3,) or (n, 3) [m], pose (4, 4) or (n, 4, 4), with part="rotation" a rotation (3, 3) or (n, 3, 3), frame
    axes to world; or a function of time that gives one of them. axes: coordinates of the position that count, such as "xz";
    the target may then hold these alone, (n, 2). weight (squared): against tasks of the same priority; a distance counts in sizes of
    the mechanism, an angle in rad. tolerance [m, rad]: largest error that counts as met; None: that of the call.
    """

    frame: str
    target: Target
    axes: str = "xyz"
    part: Literal["", "rotation"] = ""
    priority: int = 0
    weight: float = 1.0
    tolerance: float | None = None


@explained
@dataclass(frozen=True, eq=False)
class PostureTask:
    """Joints or shafts are led along values, or held near them.

    targets: name -> value [rad, m], values (n,) or a function of time. As a wish of low priority it chooses among the
    motions that the other tasks leave.
    """

    targets: Mapping[str, Target]
    priority: int = 1
    weight: float = 1.0
    tolerance: float | None = None


@explained
@dataclass(frozen=True, eq=False)
class CenterOfMassTask:
    """The centre of mass of all bodies is led along positions (3,) or (n, 3) [m]; axes, weight as of a FrameTask."""

    target: Target
    axes: str = "xyz"
    priority: int = 0
    weight: float = 1.0
    tolerance: float | None = None


@explained
@dataclass(frozen=True)
class RateLimit:
    """Joints or shafts move by at most rate x (time between two points of the path): name -> rate [rad/s, m/s]."""

    rates: Mapping[str, float]


@explained
@dataclass(frozen=True)
class RangeLimit:
    """Joints or shafts stay within (low, high) [rad, m]. The ranges of the joints hold without being named; one that is
    named here replaces them."""

    ranges: Mapping[str, tuple[float, float]]


@explained
@dataclass(frozen=True)
class SingularityLimit:
    """The distance from singularity stays at least `at_least`.

    of: "closure", the smallest singular value of the rows that close the mechanism; "drives", that of these rows with the
    drives held; "targets", that of the targets of priority 0 on the motions that are left. Rows have unit size at a usual
    pose, lengths count in sizes of the mechanism; see `mechlab.studies.track.closed`.
    """

    at_least: float
    of: Literal["closure", "drives", "targets"] = "closure"


Task = FrameTask | PostureTask | CenterOfMassTask
Limit = RateLimit | RangeLimit | SingularityLimit
