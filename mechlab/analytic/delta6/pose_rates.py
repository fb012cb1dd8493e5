"""Velocity and acceleration of the output link against all six drives.

A twist is (..., 6): v_D, then omega, base axes. With G = the slider Jacobian of O, K the drive matrix, E the rate
matrix: v_O = v_D + head_offset [e1]x omega, so the 6 x 6 Jacobian is [[G, head_offset G [e1]x], [0, K E^-1]].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6._inputs import FloatArray, vectors
from mechlab.analytic.delta6.drives import angles_from_drives, drive_matrix, drives_from_angles
from mechlab.analytic.delta6.geometry import Delta6
from mechlab.analytic.delta6.pose import output_axis, pose_arrays, require_head_centre
from mechlab.analytic.delta6.rotation_rates import (
    angle_accelerations,
    angle_rates,
    angular_acceleration,
    angular_velocity,
    inverse_rate_matrix,
)
from mechlab.analytic.delta6.translation_rates import (
    platform_acceleration,
    platform_velocity,
    slider_accelerations,
    slider_rates,
    translation_jacobian,
)


def jacobian(geom: Delta6, tool: ArrayLike, alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike) -> FloatArray:
    """J with (qdot, phidot) = J (v_D, omega), shape (..., 6, 6).

    Raises NoSolution out of reach, at h_i = 0 and at cos(beta) = 0, where no finite J exists.
    """
    d, angles = pose_arrays(tool, alpha, beta, gamma)
    linear = translation_jacobian(geom, require_head_centre(geom, d, angles))
    e1 = output_axis(angles)
    result = np.zeros(linear.shape[:-2] + (6, 6))
    result[..., :3, :3] = linear
    result[..., :3, 3:] = geom.head_offset * np.cross(linear, e1[..., None, :])
    result[..., 3:, 3:] = drive_matrix(geom) @ inverse_rate_matrix(angles)
    return result


def drive_rates(
    geom: Delta6, tool: ArrayLike, alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike, twist: ArrayLike
) -> FloatArray:
    """Rates of the six drives for a twist of the output link, (..., 6). Raises where `jacobian` does."""
    d, angles = pose_arrays(tool, alpha, beta, gamma)
    t = vectors("twist", twist, 6)
    arm = geom.head_offset * output_axis(angles)
    linear = slider_rates(geom, require_head_centre(geom, d, angles), t[..., :3] + np.cross(arm, t[..., 3:]))
    return _join(linear, drives_from_angles(geom, angle_rates(angles, t[..., 3:])))


def output_twist(
    geom: Delta6, tool: ArrayLike, alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike, rates: ArrayLike
) -> FloatArray:
    """Twist of the output link for rates of the six drives, (..., 6). Valid at cos(beta) = 0 too."""
    d, angles = pose_arrays(tool, alpha, beta, gamma)
    r = vectors("rates", rates, 6)
    arm = geom.head_offset * output_axis(angles)
    omega = angular_velocity(angles, angles_from_drives(geom, r[..., 3:]))
    centre = platform_velocity(geom, require_head_centre(geom, d, angles), r[..., :3])
    return _join(centre + np.cross(omega, arm), omega)


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
    d, angles = pose_arrays(tool, alpha, beta, gamma)
    t, a = vectors("twist", twist, 6), vectors("twist_rate", twist_rate, 6)
    omega, omega_rate = t[..., 3:], a[..., 3:]
    arm = geom.head_offset * output_axis(angles)
    centre = require_head_centre(geom, d, angles)
    centre_velocity = t[..., :3] - np.cross(omega, arm)
    centre_acceleration = a[..., :3] - np.cross(omega_rate, arm) - np.cross(omega, np.cross(omega, arm))
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
    d, angles = pose_arrays(tool, alpha, beta, gamma)
    r, a = vectors("rates", rates, 6), vectors("accelerations", accelerations, 6)
    angle_rate = angles_from_drives(geom, r[..., 3:])
    omega = angular_velocity(angles, angle_rate)
    omega_rate = angular_acceleration(angles, angle_rate, angles_from_drives(geom, a[..., 3:]))
    centre = require_head_centre(geom, d, angles)
    centre_velocity = platform_velocity(geom, centre, r[..., :3])
    centre_acceleration = platform_acceleration(geom, centre, centre_velocity, a[..., :3])
    arm = geom.head_offset * output_axis(angles)
    return _join(centre_acceleration + np.cross(omega_rate, arm) + np.cross(omega, np.cross(omega, arm)), omega_rate)


def _join(linear: FloatArray, angular: FloatArray) -> FloatArray:
    shape = np.broadcast_shapes(linear.shape, angular.shape)
    return np.concatenate([np.broadcast_to(linear, shape), np.broadcast_to(angular, shape)], axis=-1)
