"""The workspace of the head centre O: conditioning, distance to the limit of the reach, clearance of the rods, counts of grid
nodes, and the region that keeps every limit.

Everything but the slider stops depends on (x, y) alone, because the rods keep their shape when O moves along Z.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.analytic.delta6.geometry import BoolArray, Delta6, FloatArray, number
from mechlab.analytic.delta6.translation import leg_vectors, squared_heights, squared_offsets, translation_jacobian
from mechlab.analytic.regions import Clause, Coordinates, Region, all_of
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class PoseMargins:
    """Quality of translational poses; arrays over the leading axes of O.

    reachable: all h_i real. inverse_condition: smallest over largest singular value of the slider Jacobian, in [0, 1],
    0 at and beyond the reach limit. reach_margin: metres, the exact horizontal distance of O from type I (a rod
    becoming horizontal), min_i(L - |G_i|); negative beyond it. smallest_height: min h_i, metres, NaN where not
    reachable. largest_bend: largest cardan bend in radians, NaN where not reachable.
    """

    reachable: BoolArray
    inverse_condition: FloatArray
    reach_margin: FloatArray
    smallest_height: FloatArray
    largest_bend: FloatArray


@dataclass(frozen=True)
class WorkspaceCounts:
    """Nodes of the 0.01 m grid on [-1, 1] m in each axis. Nodes are positions of O.

    xy_nodes: nodes (x, y) with all h_i real and the bend limit kept, sliders not limited. voxels: nodes (x, y, z) that
    also keep the slider limits. xy_mask: (201, 201) bool over x, y. levels: (201, 201) voxels above each xy node.
    """

    xy_nodes: int
    voxels: int
    xy_mask: BoolArray
    levels: NDArray[np.int64]


def condition(geom: Delta6, position: ArrayLike) -> FloatArray:
    """Condition number of the slider Jacobian, O (..., 3) -> (...). Raises NoSolution at and beyond the reach limit."""
    return np.asarray(np.linalg.cond(translation_jacobian(geom, position)))


def reach_margin(geom: Delta6, position: ArrayLike) -> FloatArray:
    """min_i(L - |G_i|) in metres, O (..., 3) -> (...): horizontal distance to type I inside, negative outside.

    The reach is the common area of three discs of radius L about -g_i, so inside it the value is exact.
    """
    distance = np.linalg.norm(leg_vectors(geom, position), axis=-1)
    return np.asarray(geom.rod_length - distance.max(axis=-1))


def inverse_condition(geom: Delta6, position: ArrayLike) -> FloatArray:
    """Smallest over largest singular value of the slider Jacobian, O (..., 3) -> (...), in [0, 1]; 0 at and beyond the
    reach limit, so that it never raises for a pose out of reach."""
    p = np.asarray(position, dtype=np.float64)
    regular = np.asarray(squared_heights(geom, p).min(axis=-1) > 0.0)
    out = np.zeros(regular.shape)
    out[regular] = 1.0 / np.linalg.cond(translation_jacobian(geom, p[regular]))
    return out


def pose_margins(geom: Delta6, position: ArrayLike) -> PoseMargins:
    """All margins of O (..., 3) at once; a pose out of reach has `reachable` False and never raises."""
    p = np.asarray(position, dtype=np.float64)
    smallest = squared_heights(geom, p).min(axis=-1)
    reachable = np.asarray(smallest >= 0.0)
    inverse = inverse_condition(geom, p)
    height = np.where(reachable, np.sqrt(np.maximum(smallest, 0.0)), np.nan)
    return PoseMargins(reachable, inverse, reach_margin(geom, p), height, np.arccos(height / geom.rod_length))


def workspace_counts(
    geom: Delta6, slider_min: float = 0.25, slider_max: float = 0.65, bend_limit: float | None = None
) -> WorkspaceCounts:
    """Count reachable nodes i/100, i = -100..100, in x, y, z.

    A voxel needs all h_i real, every cardan bend <= bend_limit (radians, None = no limit) and every slider in
    [slider_min, slider_max]. Raises MechlabError for limits in the wrong order or a bend limit outside (0, pi/2].
    """
    low, high = _checked_limits(slider_min, slider_max, bend_limit)
    nodes = np.arange(-100, 101) / 100.0
    plane = np.zeros((201, 201, 3))
    plane[..., 0], plane[..., 1] = nodes[:, None], nodes[None, :]
    h2 = squared_heights(geom, plane)
    floor = 0.0 if bend_limit is None else (geom.rod_length * np.cos(bend_limit)) ** 2
    mask = np.asarray(h2.min(axis=-1) >= floor)
    tops = np.sqrt(h2[mask]) + (geom.platform_height + geom.slider_height)
    drives = nodes[:, None, None] + tops
    counts = np.all((drives >= low) & (drives <= high), axis=-1).sum(axis=0)
    levels = np.zeros((201, 201), dtype=np.int64)
    levels[mask] = counts
    return WorkspaceCounts(int(mask.sum()), int(counts.sum()), mask, levels)


def _checked_limits(slider_min: float, slider_max: float, bend_limit: float | None) -> tuple[float, float]:
    """The slider stops; raises MechlabError for stops in the wrong order or a bend limit outside (0, pi/2]."""
    low, high = number("slider_min", slider_min), number("slider_max", slider_max)
    if low > high:
        raise MechlabError(f"slider_min = {low:g} is above slider_max = {high:g}; expected slider_min <= slider_max")
    if bend_limit is not None and not 0.0 < number("bend_limit", bend_limit) <= np.pi / 2:
        raise MechlabError(f"bend_limit = {bend_limit!r} rad; expected a value in (0, pi/2], or None")
    return low, high


# -- the region that keeps every limit -------------------------------------------------------------------------------------

PLANE = ("x", "y")


@dataclass(frozen=True)
class WorkspaceLimits:
    """Limits of the workspace. slider_min, slider_max [m]; bend_limit [rad]: largest bend of the cardans; least_condition:
    smallest singular value of the slider Jacobian over its largest; least_clearance [m]: between the centre lines of rods
    of different legs, and of rods and the guides of other legs. None: not limited. Raises MechlabError for limits
    in the wrong order or out of range."""

    slider_min: float = 0.25
    slider_max: float = 0.65
    bend_limit: float | None = None
    least_condition: float | None = None
    least_clearance: float | None = None

    def __post_init__(self) -> None:
        _checked_limits(self.slider_min, self.slider_max, self.bend_limit)
        if self.least_condition is not None and not 0.0 <= number("least_condition", self.least_condition) <= 1.0:
            raise MechlabError(f"least_condition = {self.least_condition!r}; expected a value in [0, 1], or None")
        if self.least_clearance is not None:
            number("least_clearance", self.least_clearance)


def workspace_region(geom: Delta6, limits: WorkspaceLimits, rod_spacing: float = 0.04) -> Region:
    """The positions of O, axes x, y, z, that keep every limit; each clause with its margin in metres:

    reach: min_i(L - |G_i|), exact horizontal distance. bend: min_i(L sin(bend_limit) - |G_i|), exact horizontal distance.
    slider_min, slider_max: distance of the nearest slider from its stop, exact along Z; beyond the reach limit a rod counts
    as horizontal. condition: rod_length x (inverse condition - least_condition), the rod being the lever. clearance:
    distance of centre lines minus least_clearance. rod_spacing [m]: distance of the plain rod from the cardan rod.
    """
    length = geom.rod_length
    top = geom.platform_height + geom.slider_height

    def radius(p: Coordinates) -> FloatArray:
        return np.sqrt(np.maximum.reduce(squared_offsets(geom, p["x"], p["y"])))

    def lowest(p: Coordinates) -> FloatArray:
        worst = np.maximum.reduce(squared_offsets(geom, p["x"], p["y"]))
        return p["z"] + (top - limits.slider_min + np.sqrt(np.maximum(length**2 - worst, 0.0)))

    def highest(p: Coordinates) -> FloatArray:
        least = np.minimum.reduce(squared_offsets(geom, p["x"], p["y"]))
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
                text="the slider Jacobian is conditioned well enough"
            )
        )  # fmt: skip
    if limits.least_clearance is not None:
        gap = limits.least_clearance
        clauses.append(
            Clause("clearance", lambda p: clearance(geom, _positions(p), rod_spacing) - gap, PLANE, text="rods keep apart")
        )  # fmt: skip
    return all_of(clauses)


def _positions(p: Coordinates) -> FloatArray:
    x, y = np.broadcast_arrays(p["x"], p["y"])
    return np.stack([x, y, np.zeros(x.shape)], axis=-1)


# -- clearance of the rods -------------------------------------------------------------------------------------------------


def clearance(geom: Delta6, position: FloatArray, rod_spacing: float = 0.04) -> FloatArray:
    """Smallest distance [m] between centre lines of rods of different legs, and of rods and the guides of other legs.

    Each leg has two parallel rods, the plain one rod_spacing from the cardan one along the tangent; a guide is the
    vertical line through the upper cross. position: O (..., 3) -> (...). Beyond the reach limit rods count as horizontal.
    """
    p = np.asarray(position, dtype=np.float64)
    squares = np.stack(squared_offsets(geom, p[..., 0], p[..., 1]), axis=-1)
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


def point_segment_distance(point: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Distance of a point from the segment start..end; (..., n) each, broadcast -> (...).

    C. Ericson, Real-Time Collision Detection, 2005, 5.1.9.
    """
    along = end - start
    share = _dot(point - start, along) / np.maximum(_dot(along, along), np.finfo(float).tiny)
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * along
    return np.asarray(np.linalg.norm(point - nearest, axis=-1))


def segment_distance(start: FloatArray, end: FloatArray, other_start: FloatArray, other_end: FloatArray) -> FloatArray:
    """Smallest distance of two segments; (..., n) each, broadcast -> (...).

    The nearest pair is that of the two lines when it lies inside both segments, else one end belongs to it.
    """
    ends = np.minimum.reduce([
        point_segment_distance(start, other_start, other_end), point_segment_distance(end, other_start, other_end),
        point_segment_distance(other_start, start, end), point_segment_distance(other_end, start, end)
    ])  # fmt: skip
    u, v, w = end - start, other_end - other_start, start - other_start
    a, b, c, d, e = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    det = a * c - b * b
    crossing = det > 1e-14 * a * c
    safe = np.where(crossing, det, 1.0)
    s, t = (b * e - c * d) / safe, (a * e - b * d) / safe
    between = crossing & (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
    line = np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1)
    return np.where(between, np.minimum(line, ends), ends)


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.sum(a * b, axis=-1))
