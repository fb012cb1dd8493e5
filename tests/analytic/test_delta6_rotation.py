"""Angles, rates and rotary drives."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mechlab.analytic import delta6
from mechlab.errors import MechlabError, NoSolution

GEOM = delta6.Delta6()
UNEVEN = delta6.Delta6(k_spur=1.3, k_transfer=0.7, k_bevel=0.6, rotary_signs=(-1, -1, 1))


def random_angles(seed: int, count: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.uniform([-np.pi, -1.5, -np.pi], [np.pi, 1.5, np.pi], (count, 3))


def rotation(angles: np.ndarray) -> np.ndarray:
    return delta6.rotation_matrix(angles[..., 0], angles[..., 1], angles[..., 2])


def test_matrix_against_scipy():
    a = random_angles(0, 100)
    np.testing.assert_allclose(rotation(a), Rotation.from_euler("xyz", a).as_matrix(), atol=1e-15)


def test_extraction_in_every_quadrant():
    a = random_angles(1, 100_000)
    found = delta6.extract_angles(rotation(a))
    assert not found.singular.any()
    # |beta| up to 1.5: noise 1e-16 is amplified by 1 / cos(1.5) = 14.
    np.testing.assert_allclose(found.values, a, atol=1e-13)
    np.testing.assert_allclose(rotation(found.values), rotation(a), atol=2e-15)


def test_extraction_is_the_identity_on_whole_quarter_turns():
    quarter = np.array([-np.pi / 2, 0.0, np.pi / 2, np.pi])
    a = np.stack(np.meshgrid(quarter, quarter, quarter), axis=-1).reshape(-1, 3)
    found = delta6.extract_angles(rotation(a))
    np.testing.assert_allclose(rotation(found.values), rotation(a), atol=1e-15)
    assert np.isfinite(found.values).all()


@pytest.mark.parametrize("beta", [math.pi / 2, -math.pi / 2])
def test_pole_is_flagged_and_reproduced(beta):
    rng = np.random.default_rng(2)
    al, ga = rng.uniform(-3, 3, (2, 1000))
    exact = np.zeros((1000, 3, 3))  # cos(beta) = 0 without rounding
    sign, turn = np.sign(beta), al - np.sign(beta) * ga
    exact[:, 2, 0] = -sign
    exact[:, 0, 1], exact[:, 0, 2] = sign * np.sin(turn), sign * np.cos(turn)
    exact[:, 1, 1], exact[:, 1, 2] = np.cos(turn), -np.sin(turn)
    for r in (exact, delta6.rotation_matrix(al, beta, ga)):
        found = delta6.extract_angles(r)
        assert found.singular.all() and np.isfinite(found.values).all()
        np.testing.assert_allclose(rotation(found.values), r, atol=1e-12)
        combination = found.values[:, 0] - sign * found.values[:, 2]
        np.testing.assert_allclose(np.exp(1j * combination), np.exp(1j * turn), atol=1e-12)


def test_second_set_gives_the_same_rotation():
    a = random_angles(3, 1000)
    other = delta6.other_angles(a)
    np.testing.assert_allclose(rotation(other), rotation(a), atol=2e-15)
    np.testing.assert_allclose(delta6.other_angles(other), a, atol=1e-14)
    assert (np.abs(other) <= np.pi).all()


def test_printed_turn_back_loses_the_quadrant():
    e1 = rotation(np.array([0.0, 0.0, math.radians(150)]))[:, 0]
    assert math.degrees(-delta6.printed_turn_back(e1)) == pytest.approx(-30.0)
    inside = random_angles(4, 200)
    inside[:, 2] *= 0.49
    np.testing.assert_allclose(-delta6.printed_turn_back(rotation(inside)[..., :, 0]), inside[:, 2], atol=1e-13)
    assert abs(delta6.printed_turn_back([0.0, 1.0, 0.0])) == pytest.approx(math.pi / 2)
    with pytest.raises(MechlabError, match="parallel to Z"):
        delta6.printed_turn_back([0.0, 0.0, 1.0])


@pytest.mark.parametrize("beta_deg, expected", [(80, 1.5e-8), (89.9, 1.5e-6), (89.999, 1.5e-4)])
def test_noise_grows_towards_the_pole(beta_deg, expected):
    rng = np.random.default_rng(5)
    a = np.array([0.3, math.radians(beta_deg), -0.4])
    r = rotation(a)
    noisy = r[None] + 1e-9 * rng.normal(size=(3000, 3, 3))
    worst = np.abs(delta6.extract_angles(noisy).values - a).max(axis=0)
    # A maximum over 3000 normal draws lies near 3.5 sigma: the order of magnitude is what is checked.
    assert expected / 2 < worst[0] < 10 * expected and expected / 2 < worst[2] < 10 * expected


def test_axes_are_checked():
    with pytest.raises(MechlabError, match=r"\|e1\|"):
        delta6.rotation_from_axes([1.1, 0, 0], [0, 1, 0])
    with pytest.raises(MechlabError, match=r"e1 \. e2"):
        delta6.rotation_from_axes([1, 0, 0], [0.1, math.sqrt(0.99), 0])
    with pytest.raises(MechlabError, match="reflection"):
        delta6.extract_angles(np.diag([1.0, 1.0, -1.0]))
    with pytest.raises(MechlabError, match="orthonormal"):
        delta6.extract_angles(2 * np.eye(3))
    np.testing.assert_allclose(
        delta6.rotation_from_axes([0, 1, 0], [-1, 0, 0]), rotation(np.array([0, 0, np.pi / 2])), atol=1e-15
    )


def test_source_drive_example():
    # Source: IK of (1,1,1) = 1.4, 2.966, 1. Its forward answer "0, -0.51, 1" has alpha' and beta' swapped.
    np.testing.assert_allclose(delta6.drives_from_angles(GEOM, np.ones(3)), [1.4, 2.966, 1.0], atol=1e-12)
    np.testing.assert_allclose(delta6.angles_from_drives(GEOM, np.ones(3)), [-0.5109, 0.0, 1.0], atol=5e-5)
    assert np.linalg.det(delta6.drive_matrix(GEOM)) == pytest.approx(1.226178)
    assert np.linalg.cond(delta6.drive_matrix(GEOM)) == pytest.approx(5.36, abs=5e-3)
    np.testing.assert_array_equal(delta6.drive_matrix(GEOM), delta6.printed_drive_matrix(GEOM))


def test_mechanical_and_printed_law_differ_in_beta_only():
    mechanical, printed = delta6.drive_matrix(UNEVEN), delta6.printed_drive_matrix(UNEVEN)
    np.testing.assert_array_equal(mechanical[:, [0, 2]], printed[:, [0, 2]])
    np.testing.assert_allclose(printed[:2, 1], mechanical[:2, 1] * UNEVEN.k_bevel)
    # A locked output gear: turning T by beta turns the double bevels by beta, whatever k_bevel is.
    np.testing.assert_allclose(np.abs(mechanical[:2, 1]), UNEVEN.k_transfer)
    a = random_angles(6, 100)
    np.testing.assert_allclose(delta6.angles_from_drives(UNEVEN, delta6.drives_from_angles(UNEVEN, a)), a, atol=1e-13)
    np.testing.assert_allclose(delta6.drives_from_angles(UNEVEN, a), a @ mechanical.T, atol=1e-14)


def test_mesh_equations():
    # phi = k_spur rho, rho - gamma = kp nu (moving axis), nu_1,2 = p -+ beta, p = k_bevel alpha.
    a = random_angles(7, 100)
    geom = delta6.Delta6(k_bevel=0.6)
    phi = delta6.drives_from_angles(geom, a)
    kp = geom.k_transfer / geom.k_spur
    for drive, sign in ((0, -1.0), (1, 1.0)):
        nu = geom.k_bevel * a[:, 0] + sign * a[:, 1]
        np.testing.assert_allclose(phi[:, drive], geom.k_spur * (a[:, 2] + kp * nu), atol=1e-14)


def test_determinant_and_inverse():
    a = random_angles(8, 1000)
    e = delta6.rate_matrix(a)
    np.testing.assert_allclose(np.linalg.det(e), delta6.orientation_determinant(a[:, 1]), atol=1e-15)
    np.testing.assert_allclose(delta6.inverse_rate_matrix(a) @ e, np.broadcast_to(np.eye(3), e.shape), atol=1e-13)
    with pytest.raises(NoSolution, match="90 deg"):
        delta6.inverse_rate_matrix([0.1, np.pi / 2, 0.2])


@pytest.mark.parametrize("beta_deg, gain", [(0, 2.44), (60, 6.30), (80, 18.6), (89, 186), (89.99, 1.86e4)])
def test_conditioning_table(beta_deg, gain):
    # The table of drive rates is the 2-norm of the three rates, not the fastest drive.
    assert delta6.drive_rate_gain(GEOM, math.radians(beta_deg)) == pytest.approx(gain, rel=2e-3)
    single = delta6.single_drive_rate_gain(GEOM, math.radians(beta_deg)).max()
    assert single <= delta6.drive_rate_gain(GEOM, math.radians(beta_deg))


def test_angular_velocity_and_acceleration_against_differences():
    a, rng = random_angles(9, 50), np.random.default_rng(10)
    rates, accelerations = rng.normal(size=(2, 50, 3))
    t = 1e-5

    def at(time: float) -> np.ndarray:
        return a + rates * time + accelerations * time**2 / 2

    spin = (rotation(at(t)) - rotation(at(-t))) / (2 * t) @ np.swapaxes(rotation(a), -1, -2)
    omega = delta6.angular_velocity(a, rates)
    np.testing.assert_allclose(omega, np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], -1), atol=1e-8)
    np.testing.assert_allclose(delta6.angle_rates(a, omega), rates, atol=1e-12)
    difference = (
        delta6.angular_velocity(at(t), rates + accelerations * t)
        - delta6.angular_velocity(at(-t), rates - accelerations * t)
    ) / (2 * t)
    acceleration = delta6.angular_acceleration(a, rates, accelerations)
    np.testing.assert_allclose(acceleration, difference, atol=1e-7)
    np.testing.assert_allclose(delta6.angle_accelerations(a, rates, acceleration), accelerations, atol=1e-11)
