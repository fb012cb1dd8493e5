"""Cardan shafts: closure of the chain, constant ratio, mis-phase."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mechlab.analytic import delta6
from mechlab.errors import MechlabError, NoSolution

GEOM = delta6.Delta6()


def samples(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    r, turn = 0.12 * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    return np.stack([r * np.cos(turn), r * np.sin(turn), 0 * r], -1), rng.uniform(-7, 7, (count, 3))


def turn(axis: np.ndarray, angle: np.ndarray) -> Rotation:
    return Rotation.from_rotvec(np.asarray(angle)[:, None] * axis)


def rod_orientation(c: delta6.CardanAngles, leg: int) -> Rotation:
    _, a, b = delta6.home_axes(GEOM)
    z = np.array([0.0, 0.0, 1.0])
    return turn(z, c.upper_shaft[:, leg]) * turn(a[leg], c.upper_fork[:, leg]) * turn(b[leg], c.upper_cross[:, leg])


def test_chain_closes_from_the_slider_and_from_the_platform():
    p, phi = samples(0, 500)
    c = delta6.cardan_angles(GEOM, p, phi)
    u0, a, b = delta6.home_axes(GEOM)
    g, h = delta6.leg_vectors(GEOM, p), delta6.leg_heights(GEOM, p)
    for leg in range(3):
        rod = rod_orientation(c, leg)
        wanted = np.concatenate([g[:, leg], -h[:, leg, None]], -1)
        np.testing.assert_allclose(GEOM.rod_length * rod.apply(u0[leg]), wanted, atol=1e-15)
        cross = turn(np.array([0.0, 0.0, 1.0]), c.lower_shaft[:, leg]) * turn(a[leg], c.lower_fork[:, leg])
        from_rod = rod * turn(b[leg], c.lower_cross[:, leg])
        np.testing.assert_allclose(from_rod.as_matrix(), cross.as_matrix(), atol=1e-14)


def test_home_is_zero_and_lower_shaft_repeats_the_upper():
    home = delta6.cardan_angles(GEOM, np.zeros(3), np.zeros(3))
    for angle in (home.upper_fork, home.upper_cross, home.lower_cross, home.lower_fork):
        np.testing.assert_allclose(angle, 0.0, atol=1e-15)
    p, phi = samples(1, 50)
    c = delta6.cardan_angles(GEOM, p, phi)
    np.testing.assert_array_equal(c.lower_shaft, c.upper_shaft)


def test_joints_are_continuous_over_a_turn():
    phi = np.linspace(0, 2 * np.pi, 2001)
    c = delta6.cardan_angles(GEOM, [0.05, 0.03, 0.0], phi[:, None] + np.zeros(3))
    for angle in (c.upper_fork, c.upper_cross):
        assert np.abs(np.diff(angle, axis=0)).max() < 0.01  # a step of 3e-3 rad times the speed ratio


def test_rod_speed_ratio():
    p, phi = samples(2, 200)
    step = 1e-6
    u0 = delta6.home_axes(GEOM)[0]
    ratios = delta6.rod_speed_ratios(GEOM, p, phi)
    for leg in range(3):
        before, after = (rod_orientation(delta6.cardan_angles(GEOM, p, phi + s), leg) for s in (-step, step))
        spin = (after * before.inv()).as_rotvec() / (2 * step)
        along = np.sum(spin * -before.apply(u0[leg]), -1)
        np.testing.assert_allclose(ratios[:, leg], along, atol=1e-8)
    home = np.linspace(0, np.pi, 10_001)
    at_home = delta6.rod_speed_ratio(delta6.cardan_bend(GEOM, np.zeros(3))[0], home)
    assert at_home.min() == pytest.approx(0.7876, abs=1e-4) and at_home.max() == pytest.approx(1.2697, abs=1e-4)


def test_bend():
    assert np.degrees(delta6.cardan_bend(GEOM, np.zeros(3))) == pytest.approx([38.045] * 3, abs=1e-3)
    with pytest.raises(NoSolution):
        delta6.cardan_angles(GEOM, [0.5, 0, 0], np.zeros(3))


def test_misphase():
    bend = math.radians(38.045)
    theta = np.linspace(0, 2 * np.pi, 20_001)
    assert np.degrees(np.abs(delta6.misphase_error(theta, bend, 0.0))).max() < 1e-8
    quarter = np.degrees(np.abs(delta6.misphase_error(theta, bend, math.pi / 2))).max()
    assert quarter == pytest.approx(13.557, abs=1e-3)
    k = math.cos(bend) ** 2
    assert math.degrees(math.asin((1 - k) / (1 + k))) == pytest.approx(quarter, abs=1e-5)  # grid of 0.018 deg
    # Measured from the home position (pin 90 deg from the normal), 45 deg out of phase: 17.26 deg.
    half = delta6.misphase_error(theta, bend, math.pi / 4) - delta6.misphase_error(math.pi / 2, bend, math.pi / 4)
    assert np.degrees(np.abs(half)).max() == pytest.approx(17.26, abs=0.01)
    for delta in np.radians([10, 45, 80, 135]):
        error = delta6.misphase_error(theta, bend, delta)
        assert delta6.misphase_amplitude(bend, delta) == pytest.approx(np.ptp(error) / 2, abs=1e-6)
    with pytest.raises(MechlabError, match="90 deg"):
        delta6.misphase_output(0.0, math.pi / 2, 0.0)


def test_misphase_output_against_vectors():
    bend, delta = 0.6, 0.7
    theta = np.linspace(0, 3 * np.pi, 500)
    rod = np.array([0.0, math.sin(bend), math.cos(bend)])
    pin = np.stack([np.cos(theta), np.sin(theta), 0 * theta], -1)
    on_rod = np.cross(rod, pin)  # perpendicular to the driving pin and to the rod
    on_rod /= np.linalg.norm(on_rod, axis=-1, keepdims=True)
    turned = Rotation.from_rotvec(delta * rod).apply(on_rod)
    out = np.cross(turned, [0.0, 0.0, 1.0])
    out = out[:, :2] / np.linalg.norm(out[:, :2], axis=-1, keepdims=True)
    angle = delta6.misphase_output(theta, bend, delta)
    same_line = np.abs(out[:, 0] * np.sin(angle) - out[:, 1] * np.cos(angle))
    assert same_line.max() < 1e-14
    assert np.abs(np.diff(angle)).max() < 0.1  # no jumps over one and a half turns
