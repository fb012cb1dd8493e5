"""How good a pose is, and which poses exist: conditioning, distance to the reach limit, grid counts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.analytic.delta6._inputs import BoolArray, FloatArray, number
from mechlab.analytic.delta6.geometry import Delta6
from mechlab.analytic.delta6.translation import leg_vectors, squared_heights
from mechlab.analytic.delta6.translation_rates import translation_jacobian
from mechlab.errors import MechlabError


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

    xy_nodes: nodes (x, y) with all h_i real and the bend limit kept, sliders not asked. voxels: nodes (x, y, z) that
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
    """All margins of O (..., 3) in one go; never raises for a pose that is out of reach, its mask says so."""
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
    low, high = number("slider_min", slider_min), number("slider_max", slider_max)
    if low > high:
        raise MechlabError(f"slider_min = {low:g} is above slider_max = {high:g}; expected slider_min <= slider_max")
    if bend_limit is not None and not 0.0 < number("bend_limit", bend_limit) <= np.pi / 2:
        raise MechlabError(f"bend_limit = {bend_limit!r} rad; expected a value in (0, pi/2], or None")
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
