"""All six drives together: pose, velocity and acceleration of the output link from the drives, and back.

A pose is D (..., 3) [m] with alpha, beta, gamma [rad]. Drives are (..., 6): three sliders q [m], then three rotary drives
phi [rad]. O = D - r with r = head_offset e1 depends on the orientation: when D is held and the head turns, the sliders move.

A twist is (..., 6): v_D, then omega, base axes. With G, the slider Jacobian at O, K, the drive matrix, and E, the rate matrix:
v_O = v_D - omega x r and (qdot, phidot) = [[G, head_offset G [e1]x], [0, K E^-1]] (v_D, omega).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6.geometry import BoolArray, Delta6, FloatArray, cross, demand, finite, vectors
from mechlab.analytic.delta6.rotation import (
    SINGULAR_COSINE,
    angle_accelerations,
    angle_rates,
    angles_from_drives,
    angular_acceleration,
    angular_velocity,
    drive_matrix,
    drives_from_angles,
    extract_angles,
    inverse_rate_matrix,
    rotation_from_axes,
)
from mechlab.analytic.delta6.translation import (
    ForwardPosition,
    InversePosition,
    forward_position,
    inverse_position,
    platform_acceleration,
    platform_velocity,
    slider_accelerations,
    slider_rates,
    translation_jacobian,
)
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class PoseDrives:
    """Answer of the inverse problem.

    drives: (..., 6), sliders NaN exactly where `reachable` is False. head_centre: O (..., 3). angles: (..., 3).
    translation: the `InversePosition` with radicands and mask. singular: (...) cos(beta) below SINGULAR_COSINE,
    where the drives are valid but one angular velocity cannot be produced.
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
    d, angles = _pose_arrays(tool, alpha, beta, gamma)
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


def _pose_arrays(tool: ArrayLike, alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """D and the stacked angles, both (..., 3), broadcast against each other."""
    d = vectors("tool", tool)
    angles = np.broadcast_arrays(finite("alpha", alpha), finite("beta", beta), finite("gamma", gamma))
    stacked = np.stack(angles, axis=-1)
    shape = np.broadcast_shapes(d.shape, stacked.shape)
    return np.broadcast_to(d, shape), np.broadcast_to(stacked, shape)


def _reached(
    geom: Delta6, tool: ArrayLike, alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Angles, r = head_offset e1 and O = D - r of a pose, each (..., 3). Raises NoSolution out of reach."""
    d, angles = _pose_arrays(tool, alpha, beta, gamma)
    arm = geom.head_offset * output_axis(angles)
    centre = np.asarray(d - arm)
    demand(inverse_position(geom, centre).reachable, "out of reach", "Move D towards the centre")
    return angles, arm, centre


def _singular(angles: FloatArray) -> BoolArray:
    return np.asarray(np.abs(np.cos(angles[..., 1])) < SINGULAR_COSINE)


def jacobian(geom: Delta6, tool: ArrayLike, alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike) -> FloatArray:
    """J with (qdot, phidot) = J (v_D, omega), shape (..., 6, 6).

    Raises NoSolution out of reach, at h_i = 0 and at cos(beta) = 0, where no finite J exists.
    """
    angles, _, centre = _reached(geom, tool, alpha, beta, gamma)
    linear = translation_jacobian(geom, centre)
    e1 = output_axis(angles)
    result = np.zeros(linear.shape[:-2] + (6, 6))
    result[..., :3, :3] = linear
    result[..., :3, 3:] = geom.head_offset * cross(linear, e1[..., None, :])
    result[..., 3:, 3:] = drive_matrix(geom) @ inverse_rate_matrix(angles)
    return result


def drive_rates(
    geom: Delta6, tool: ArrayLike, alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike, twist: ArrayLike
) -> FloatArray:
    """Rates of the six drives for a twist of the output link, (..., 6). Raises where `jacobian` does."""
    angles, arm, centre = _reached(geom, tool, alpha, beta, gamma)
    t = vectors("twist", twist, 6)
    linear = slider_rates(geom, centre, t[..., :3] + cross(arm, t[..., 3:]))
    return _join(linear, drives_from_angles(geom, angle_rates(angles, t[..., 3:])))


def output_twist(
    geom: Delta6, tool: ArrayLike, alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike, rates: ArrayLike
) -> FloatArray:
    """Twist of the output link for rates of the six drives, (..., 6). Valid at cos(beta) = 0 too."""
    angles, arm, centre = _reached(geom, tool, alpha, beta, gamma)
    r = vectors("rates", rates, 6)
    omega = angular_velocity(angles, angles_from_drives(geom, r[..., 3:]))
    return _join(platform_velocity(geom, centre, r[..., :3]) + cross(omega, arm), omega)


def drive_accelerations(
    geom: Delta6,
    tool: ArrayLike,
    alpha: ArrayLike,
    beta: ArrayLike,
    gamma: ArrayLike,
    twist: ArrayLike,
    twist_rate: ArrayLike,
) -> FloatArray:
    """Accelerations of the six drives for a twist and its rate (a_D, d omega/dt), (..., 6).

    Raises where `jacobian` does. a_O = a_D - d omega/dt x r - omega x (omega x r) with r = head_offset e1.
    """
    angles, arm, centre = _reached(geom, tool, alpha, beta, gamma)
    t, a = vectors("twist", twist, 6), vectors("twist_rate", twist_rate, 6)
    omega, omega_rate = t[..., 3:], a[..., 3:]
    centre_velocity = t[..., :3] - cross(omega, arm)
    centre_acceleration = a[..., :3] - cross(omega_rate, arm) - cross(omega, cross(omega, arm))
    linear = slider_accelerations(geom, centre, centre_velocity, centre_acceleration)
    second = angle_accelerations(angles, angle_rates(angles, omega), omega_rate)
    return _join(linear, drives_from_angles(geom, second))


def output_acceleration(
    geom: Delta6,
    tool: ArrayLike,
    alpha: ArrayLike,
    beta: ArrayLike,
    gamma: ArrayLike,
    rates: ArrayLike,
    accelerations: ArrayLike,
) -> FloatArray:
    """(a_D, d omega/dt), (..., 6), for rates and accelerations of the six drives. Valid at cos(beta) = 0 too."""
    angles, arm, centre = _reached(geom, tool, alpha, beta, gamma)
    r, a = vectors("rates", rates, 6), vectors("accelerations", accelerations, 6)
    angle_rate = angles_from_drives(geom, r[..., 3:])
    omega = angular_velocity(angles, angle_rate)
    omega_rate = angular_acceleration(angles, angle_rate, angles_from_drives(geom, a[..., 3:]))
    centre_velocity = platform_velocity(geom, centre, r[..., :3])
    centre_acceleration = platform_acceleration(geom, centre, centre_velocity, a[..., :3])
    return _join(centre_acceleration + cross(omega_rate, arm) + cross(omega, cross(omega, arm)), omega_rate)


def _join(linear: FloatArray, angular: FloatArray) -> FloatArray:
    shape = np.broadcast_shapes(linear.shape, angular.shape)
    return np.concatenate([np.broadcast_to(linear, shape), np.broadcast_to(angular, shape)], axis=-1)
