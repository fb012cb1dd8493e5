"""All six drives: round trip, 6 x 6 Jacobian, accelerations, what is coupled and what is not."""

import math

import numpy as np
import pytest

from mechlab.analytic import delta6
from mechlab.errors import NoSolution

GEOM = delta6.Delta6(k_bevel=0.8)


def random_poses(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    r, turn = 0.12 * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    centre = np.stack([r * np.cos(turn), r * np.sin(turn), rng.uniform(-0.2, 0.2, count)], -1)
    angles = rng.uniform([-3, -1.2, -3], [3, 1.2, 3], (count, 3))
    return centre + GEOM.head_offset * delta6.output_axis(angles), angles


def test_round_trip():
    d, a = random_poses(0, 100_000)
    drives = delta6.inverse(GEOM, d, *a.T).require()
    pose = delta6.forward(GEOM, drives[:, :3], drives[:, 3:])
    # Roundoff amplified by the slider conditioning (below 4) and 1 / k.
    assert np.abs(pose.require() - d).max() < 1e-12 and np.abs(pose.angles - a).max() < 1e-12


def test_axes_and_angles_agree():
    d, a = random_poses(1, 200)
    r = delta6.rotation_matrix(*a.T)
    by_axes = delta6.inverse_from_axes(GEOM, d, r[..., 0], r[..., 1])
    np.testing.assert_allclose(by_axes.drives, delta6.inverse(GEOM, d, *a.T).drives, atol=1e-12)


def test_jacobian_against_differences():
    d, a = random_poses(2, 50)
    jacobian = delta6.jacobian(GEOM, d, *a.T)
    step = 1e-6
    for k in range(6):
        twist = np.eye(6)[k]
        # Angle rates come from a matrix logarithm here, not from E.
        spin = np.zeros((3, 3))
        spin[[2, 0, 1], [1, 2, 0]] = twist[3:]
        spin = spin - spin.T
        sides = []
        for sign in (1, -1):
            turn = np.eye(3) + sign * step * spin + step**2 / 2 * spin @ spin
            angles = delta6.extract_angles(turn @ delta6.rotation_matrix(*a.T)).values
            sides.append(delta6.inverse(GEOM, d + sign * step * twist[:3], *angles.T).drives)
        difference = (sides[0] - sides[1]) / (2 * step)
        np.testing.assert_allclose(jacobian[..., k], difference, atol=1e-7)  # step^2 f''' + 1e-16 / step


def test_rates_and_accelerations_both_ways():
    d, a = random_poses(3, 100)
    rng = np.random.default_rng(4)
    twist, twist_rate = rng.normal(size=(2, 100, 6))
    rates = delta6.drive_rates(GEOM, d, *a.T, twist)
    np.testing.assert_allclose(rates, (delta6.jacobian(GEOM, d, *a.T) @ twist[..., None])[..., 0], atol=1e-12)
    np.testing.assert_allclose(delta6.output_twist(GEOM, d, *a.T, rates), twist, atol=1e-12)
    accelerations = delta6.drive_accelerations(GEOM, d, *a.T, twist, twist_rate)
    np.testing.assert_allclose(delta6.output_acceleration(GEOM, d, *a.T, rates, accelerations), twist_rate, atol=1e-10)


def test_accelerations_against_differences():
    d, a = random_poses(5, 50)
    rng = np.random.default_rng(6)
    velocity, acceleration, rate, second = rng.normal(size=(4, 50, 3))
    t = 2e-4

    def drives(time: float) -> np.ndarray:
        angles = a + rate * time + second * time**2 / 2
        return delta6.inverse(GEOM, d + velocity * time + acceleration * time**2 / 2, *angles.T).drives

    difference = (drives(t) - 2 * drives(0.0) + drives(-t)) / t**2
    twist = np.concatenate([velocity, delta6.angular_velocity(a, rate)], -1)
    twist_rate = np.concatenate([acceleration, delta6.angular_acceleration(a, rate, second)], -1)
    exact = delta6.drive_accelerations(GEOM, d, *a.T, twist, twist_rate)
    # Second difference: t^2/12 times a fourth derivative of up to 1e5 near the rim, plus 4e-16 / t^2 = 1e-8.
    np.testing.assert_allclose(exact, difference, rtol=1e-3, atol=1e-5)


def test_holding_d_moves_the_sliders_holding_o_does_not():
    a = np.random.default_rng(7).uniform(-1, 1, (100, 3))
    held_d = delta6.inverse(GEOM, np.zeros(3), *a.T).drives[:, :3]
    assert np.ptp(held_d, axis=0).min() > 0.01
    held_o = delta6.inverse(GEOM, GEOM.head_offset * delta6.output_axis(a), *a.T).drives[:, :3]
    assert np.ptp(held_o, axis=0).max() < 1e-12
    assert np.abs(delta6.jacobian(GEOM, np.zeros(3), 0.1, 0.2, 0.3)[3:, :3]).max() == 0.0


def test_pole_is_flagged_and_useful():
    result = delta6.inverse(GEOM, [0.0, 0.0, 0.0], 0.2, math.pi / 2, 0.3)
    assert result.singular and np.isfinite(result.drives).all()
    with pytest.raises(NoSolution, match="90 deg"):
        delta6.jacobian(GEOM, [0.0, 0.0, 0.0], 0.2, math.pi / 2, 0.3)
    twist = delta6.output_twist(GEOM, [0.0, 0.0, 0.0], 0.2, math.pi / 2, 0.3, np.ones(6))
    assert np.isfinite(twist).all()


def test_out_of_reach_is_never_silent():
    result = delta6.inverse(GEOM, [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]], 0.0, 0.0, 0.0)
    assert result.reachable.tolist() == [True, False]
    assert np.isnan(result.drives[1, :3]).all() and np.isfinite(result.drives[1, 3:]).all()
    with pytest.raises(NoSolution, match=r"1 of 2 poses \(first at index \(1,\)\)"):
        result.require()
    with pytest.raises(NoSolution, match="out of reach"):
        delta6.jacobian(GEOM, [0.5, 0.0, 0.0], 0.0, 0.0, 0.0)
