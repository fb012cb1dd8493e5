"""All six drives together: pose of the output link from drives and back.

A pose is D (..., 3) with alpha, beta, gamma. Drives are (..., 6): three sliders q, then three rotary drives phi.
O = D - head_offset e1 depends on the orientation, so holding D and turning the head moves the sliders.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6._inputs import BoolArray, FloatArray, demand, finite, vectors
from mechlab.analytic.delta6.drives import angles_from_drives, drives_from_angles
from mechlab.analytic.delta6.geometry import Delta6
from mechlab.analytic.delta6.rotation import SINGULAR_COSINE, extract_angles, rotation_from_axes
from mechlab.analytic.delta6.translation import ForwardPosition, InversePosition, forward_position, inverse_position


@dataclass(frozen=True)
class PoseDrives:
    """Answer of the inverse problem.

    drives: (..., 6), sliders NaN exactly where `reachable` is False. head_centre: O (..., 3). angles: (..., 3).
    translation: the `InversePosition` with radicands and mask. singular: (...) cos(beta) below SINGULAR_COSINE,
    where the drives are right but one angular velocity is lost.
    """

    drives: FloatArray
    head_centre: FloatArray
    angles: FloatArray
    translation: InversePosition
    singular: BoolArray

    @property
    def reachable(self) -> BoolArray:
        """(...) all three rods reach."""
        return self.translation.reachable

    def require(self) -> FloatArray:
        """The six drives, or NoSolution if any pose is out of reach."""
        self.translation.require()
        return self.drives


@dataclass(frozen=True)
class OutputPose:
    """Answer of the forward problem.

    tool: D (..., 3), NaN exactly where the rods do not assemble. angles: (..., 3) alpha, beta, gamma as the gears give
    them (not wrapped, any quadrant). translation: the `ForwardPosition` of O. singular: (...) as in `PoseDrives`.
    """

    tool: FloatArray
    angles: FloatArray
    translation: ForwardPosition
    singular: BoolArray

    def require(self) -> FloatArray:
        """D, or NoSolution if a pose does not assemble or lies on a branch with a rod pointing upwards."""
        self.translation.require()
        return self.tool


def output_axis(angles: ArrayLike) -> FloatArray:
    """e1 = (cos gamma cos beta, sin gamma cos beta, -sin beta). angles (..., 3) -> (..., 3)."""
    a = vectors("angles", angles)
    cb = np.cos(a[..., 1])
    return np.stack([np.cos(a[..., 2]) * cb, np.sin(a[..., 2]) * cb, -np.sin(a[..., 1])], axis=-1)


def inverse(geom: Delta6, tool: ArrayLike, alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike) -> PoseDrives:
    """Six drives for D and angles; tool (..., 3), angles (...), broadcast against each other."""
    d, angles = pose_arrays(tool, alpha, beta, gamma)
    head_centre = d - geom.head_offset * output_axis(angles)
    translation = inverse_position(geom, head_centre)
    drives = np.concatenate([translation.drives, drives_from_angles(geom, angles)], axis=-1)
    return PoseDrives(drives, head_centre, angles, translation, _singular(angles))


def inverse_from_axes(geom: Delta6, tool: ArrayLike, e1: ArrayLike, e2: ArrayLike) -> PoseDrives:
    """Six drives for D and the output link's axes e1, e2, all (..., 3). Raises unless they are orthonormal."""
    angles = extract_angles(rotation_from_axes(e1, e2)).values
    return inverse(geom, tool, angles[..., 0], angles[..., 1], angles[..., 2])


def forward(geom: Delta6, sliders: ArrayLike, rotary: ArrayLike) -> OutputPose:
    """D and angles for sliders q (..., 3) and rotary drives phi (..., 3)."""
    translation = forward_position(geom, sliders)
    angles = angles_from_drives(geom, rotary)
    tool = translation.position + geom.head_offset * output_axis(angles)
    return OutputPose(tool, angles, translation, _singular(angles))


def pose_arrays(tool: ArrayLike, alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """D and the stacked angles, both (..., 3), broadcast against each other."""
    d = vectors("tool", tool)
    angles = np.broadcast_arrays(finite("alpha", alpha), finite("beta", beta), finite("gamma", gamma))
    stacked = np.stack(angles, axis=-1)
    shape = np.broadcast_shapes(d.shape, stacked.shape)
    return np.broadcast_to(d, shape), np.broadcast_to(stacked, shape)


def require_head_centre(geom: Delta6, d: FloatArray, angles: FloatArray) -> FloatArray:
    """O of poses that are in reach; raises NoSolution otherwise."""
    centre = d - geom.head_offset * output_axis(angles)
    reachable = inverse_position(geom, centre).reachable
    demand(reachable, "out of reach", "Move D towards the centre")
    return np.asarray(centre)


def _singular(angles: FloatArray) -> BoolArray:
    return np.asarray(np.abs(np.cos(angles[..., 1])) < SINGULAR_COSINE)
