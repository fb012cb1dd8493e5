"""The workspace of O as a region: reach, slider stops, cardan bend, conditioning and clearance, each in metres.

Everything but the slider stops depends on (x, y) alone, because the rods keep their shape when O moves along Z.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechlab.analytic.delta6._inputs import FloatArray, number
from mechlab.analytic.delta6.geometry import Delta6
from mechlab.analytic.delta6.segments import point_segment_distance, segment_distance
from mechlab.analytic.delta6.workspace import inverse_condition
from mechlab.analytic.regions import Clause, Region, all_of
from mechlab.analytic.regions.region import Coordinates
from mechlab.errors import MechlabError

PLANE = ("x", "y")


@dataclass(frozen=True)
class WorkspaceLimits:
    """Limits of the workspace. slider_min, slider_max [m]; bend_limit [rad]: largest bend of the cardans; least_condition:
    smallest singular value of the slider Jacobian over its largest; least_clearance [m]: between the centre lines of rods
    of different legs, and of rods and the guides of other legs. None: not limited. Raises MechlabError for limits that
    nothing can keep."""

    slider_min: float = 0.25
    slider_max: float = 0.65
    bend_limit: float | None = None
    least_condition: float | None = None
    least_clearance: float | None = None

    def __post_init__(self) -> None:
        low, high = number("slider_min", self.slider_min), number("slider_max", self.slider_max)
        if low > high:
            raise MechlabError(
                f"slider_min = {low:g} is above slider_max = {high:g}; expected slider_min <= slider_max"
            )
        if self.bend_limit is not None and not 0.0 < number("bend_limit", self.bend_limit) <= np.pi / 2:
            raise MechlabError(f"bend_limit = {self.bend_limit!r} rad; expected a value in (0, pi/2], or None")
        if self.least_condition is not None and not 0.0 <= number("least_condition", self.least_condition) <= 1.0:
            raise MechlabError(f"least_condition = {self.least_condition!r}; expected a value in [0, 1], or None")
        if self.least_clearance is not None:
            number("least_clearance", self.least_clearance)


def workspace_region(geom: Delta6, limits: WorkspaceLimits, rod_spacing: float = 0.04) -> Region:
    """The positions of O, axes x, y, z, that keep every limit; each clause with its margin in metres:

    reach: min_i(L - |G_i|), exact horizontal distance. bend: min_i(L sin(bend_limit) - |G_i|), exact horizontal distance.
    slider_min, slider_max: distance of the nearest slider from its stop, exact along Z; beyond the reach limit a rod counts
    as horizontal. condition: rod_length x (inverse condition - least_condition), the rod being the lever. clearance:
    distance of centre lines minus least_clearance. rod_spacing [m]: plain rod beside the cardan rod.
    """
    length = geom.rod_length
    top = geom.platform_height + geom.slider_height

    def radius(p: Coordinates) -> FloatArray:
        return np.sqrt(np.maximum.reduce(list(_squares(geom, p))))

    def lowest(p: Coordinates) -> FloatArray:
        worst = np.maximum.reduce(list(_squares(geom, p)))
        return p["z"] + (top - limits.slider_min + np.sqrt(np.maximum(length**2 - worst, 0.0)))

    def highest(p: Coordinates) -> FloatArray:
        least = np.minimum.reduce(list(_squares(geom, p)))
        return (limits.slider_max - top - np.sqrt(np.maximum(length**2 - least, 0.0))) - p["z"]

    clauses = [
        Clause("reach", lambda p: length - radius(p), PLANE, text="every rod reaches its slider"),
        Clause("slider_min", lowest, text="no slider below its lower stop"),
        Clause("slider_max", highest, text="no slider above its upper stop"),
    ]
    if limits.bend_limit is not None:
        span = length * np.sin(limits.bend_limit)
        clauses.append(Clause("bend", lambda p: span - radius(p), PLANE, text="no cardan bends more than bend_limit"))
    if limits.least_condition is not None:
        least = limits.least_condition
        clauses.append(
            Clause(
                "condition", lambda p: inverse_condition(geom, _positions(p)) - least, PLANE, lever=length,
                text="the slider Jacobian is conditioned well enough",
            )
        )  # fmt: skip
    if limits.least_clearance is not None:
        gap = limits.least_clearance
        clauses.append(
            Clause("clearance", lambda p: clearance(geom, _positions(p), rod_spacing) - gap, PLANE, text="rods keep apart")
        )  # fmt: skip
    return all_of(clauses)


def clearance(geom: Delta6, position: FloatArray, rod_spacing: float = 0.04) -> FloatArray:
    """Smallest distance [m] between centre lines of rods of different legs, and of rods and the guides of other legs.

    Each leg has two parallel rods, the plain one beside the cardan one by rod_spacing along the tangent; a guide is the
    vertical line through the upper cross. position: O (..., 3) -> (...). Beyond the reach limit rods count as horizontal.
    """
    p = np.asarray(position, dtype=np.float64)
    squares = np.stack([np.broadcast_to(s, p.shape[:-1]) for s in _squares(geom, {"x": p[..., 0], "y": p[..., 1]})], -1)
    heights = np.sqrt(np.maximum(geom.rod_length**2 - squares, 0.0))
    rods: list[list[tuple[FloatArray, FloatArray]]] = []
    for i in range(3):
        foot = np.append(p[..., :2] + geom.platform_anchors[i, :2], np.zeros((*p.shape[:-1], 1)), axis=-1)
        head = np.empty(p.shape)
        head[..., :2], head[..., 2] = geom.guide_positions[i], heights[..., i]
        beside = np.append(rod_spacing * geom.tangential_directions[i], 0.0)
        rods.append([(foot, head), (foot + beside, head + beside)])
    smallest = np.full(p.shape[:-1], np.inf)
    for i in range(3):
        for j in range(3):
            for foot, head in rods[j]:
                if i < j:
                    for other in rods[i]:
                        np.minimum(smallest, segment_distance(*other, foot, head), out=smallest)
                if i != j:
                    flat = point_segment_distance(geom.guide_positions[i], foot[..., :2], head[..., :2])
                    np.minimum(smallest, flat, out=smallest)
    return smallest


def _squares(geom: Delta6, p: Coordinates) -> tuple[FloatArray, ...]:
    """|G_i|^2 of the three legs, in the broadcast shape of x and y."""
    g = geom.leg_offsets
    return tuple((p["x"] + g[i, 0]) ** 2 + (p["y"] + g[i, 1]) ** 2 for i in range(3))


def _positions(p: Coordinates) -> FloatArray:
    x, y = np.broadcast_arrays(p["x"], p["y"])
    return np.stack([x, y, np.zeros(x.shape)], axis=-1)
