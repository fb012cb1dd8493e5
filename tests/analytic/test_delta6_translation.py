"""Sliders and O: the source's example, round trips, derivatives, the reach limit."""

import numpy as np
import pytest

from mechlab.analytic import delta6
from mechlab.errors import MechlabError, NoSolution

GEOM = delta6.Delta6()


def random_positions(seed: int, count: int, radius: float = 0.13) -> np.ndarray:
    rng = np.random.default_rng(seed)
    r, angle = radius * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    return np.stack([r * np.cos(angle), r * np.sin(angle), rng.uniform(-0.5, 0.5, count)], axis=-1)


def test_source_velocity_example():
    # Source, chapter 4: A to three digits, IK of (1,1,1) = 1.27, 1.79, -0.06, FK of (1,1,1) = (0,0,1).
    a, b = delta6.implicit_matrices(GEOM, np.zeros(3))
    printed = [[-0.39, 0.233, -0.58], [-0.00663, -0.456, -0.58], [0.398, 0.222, -0.58]]
    np.testing.assert_allclose(a[:, :2], np.array(printed)[:, :2], atol=2e-3)
    np.testing.assert_allclose(a[:, :2], [[-0.39159, 0.23374], [-0.00663, -0.45600], [0.39822, 0.22226]], atol=5e-6)
    np.testing.assert_allclose(b, 0.58277 * np.eye(3), atol=5e-6)
    rates = delta6.slider_rates(GEOM, np.zeros(3), np.ones(3))
    np.testing.assert_allclose(rates, [1.27086, 1.79385, -0.06471], atol=1e-5)
    np.testing.assert_allclose(-np.linalg.solve(b, a @ np.ones(3)), rates, atol=1e-14)
    np.testing.assert_allclose(delta6.platform_velocity(GEOM, np.zeros(3), np.ones(3)), [0, 0, 1], atol=1e-14)


def test_round_trip():
    p = random_positions(0, 100_000)
    inverse = delta6.inverse_position(GEOM, p)
    assert inverse.reachable.all()
    forward = delta6.forward_position(GEOM, inverse.require())
    assert forward.on_branch.all()
    # Roundoff of the trilateration, amplified by the conditioning 4.5 at this radius: a few 1e-16.
    assert np.abs(forward.require() - p).max() < 1e-14


def test_rods_have_their_length():
    p = random_positions(1, 200)
    q = delta6.inverse_position(GEOM, p).drives
    guides = np.broadcast_to(GEOM.guide_positions, (200, 3, 2))
    upper = np.concatenate([guides, (q - GEOM.slider_height)[..., None]], -1)
    rods = p[:, None, :] + GEOM.platform_anchors - upper
    np.testing.assert_allclose(np.linalg.norm(rods, axis=-1), GEOM.rod_length, atol=1e-15)
    assert (rods[..., 2] < 0).all()


def test_jacobian_against_differences():
    p = random_positions(2, 200)
    step = 1e-6
    jacobian = delta6.translation_jacobian(GEOM, p)
    for k in range(3):
        shift = step * np.eye(3)[k]
        difference = delta6.inverse_position(GEOM, p + shift).drives - delta6.inverse_position(GEOM, p - shift).drives
        # Central differences: step^2 * third derivative (up to 1e4 near the rim) + roundoff 1e-16 / step.
        np.testing.assert_allclose(jacobian[..., k], difference / (2 * step), atol=1e-7)


def test_accelerations_both_ways():
    p, rng = random_positions(3, 100), np.random.default_rng(4)
    v, a = rng.normal(size=(2, 100, 3))
    accelerations = delta6.slider_accelerations(GEOM, p, v, a)
    t = 1e-5

    def rates(time: float) -> np.ndarray:
        return delta6.slider_rates(GEOM, p + v * time + a * time**2 / 2, v + a * time)

    difference = (rates(t) - rates(-t)) / (2 * t)
    np.testing.assert_allclose(accelerations, difference, rtol=1e-5, atol=1e-5)  # differences of step 1e-5
    np.testing.assert_allclose(delta6.platform_acceleration(GEOM, p, v, accelerations), a, atol=1e-11)
    np.testing.assert_allclose(delta6.platform_velocity(GEOM, p, delta6.slider_rates(GEOM, p, v)), v, atol=1e-13)


def test_outside_reach_is_never_silent():
    limit = GEOM.rod_length - np.hypot(GEOM.radial_offset, GEOM.tangential_offset)
    outwards = GEOM.leg_offsets[0] / np.linalg.norm(GEOM.leg_offsets[0])
    for excess in (1e-6, 1e-3, 0.5):  # Newton stalls 1e-6 m outside without an error
        p = np.append((limit + excess) * outwards, 0.0)
        result = delta6.inverse_position(GEOM, p)
        assert not result.reachable and result.h2.min() < 0 and np.isnan(result.drives).all()
        with pytest.raises(NoSolution, match="out of reach"):
            result.require()
        with pytest.raises(NoSolution, match="reach limit"):
            delta6.translation_jacobian(GEOM, p)
    inside = delta6.inverse_position(GEOM, np.append((limit - 1e-6) * outwards, 0.0))
    assert inside.reachable and np.isfinite(inside.drives).all()


def test_bulk_mask_is_exact():
    p = np.random.default_rng(5).uniform(-0.2, 0.2, (2000, 3))
    result = delta6.inverse_position(GEOM, p)
    assert 0 < result.reachable.sum() < 2000
    assert np.array_equal(np.isnan(result.drives).all(-1), ~result.reachable)
    assert np.array_equal(np.isnan(result.drives).any(-1), ~result.reachable)
    assert np.isfinite(result.h2).all()


def test_forward_branches():
    q = np.random.default_rng(6).uniform(0.25, 0.65, (50_000, 3))
    result = delta6.forward_position(GEOM, q)
    assert np.array_equal(np.isnan(result.position[:, 0]), ~result.assembles)
    off = result.assembles & ~result.on_branch
    assert 0.03 < off.mean() < 0.05  # 3.9 % by a random count
    near = delta6.forward_position(GEOM, np.random.default_rng(7).uniform(0.25, 0.55, (50_000, 3)))
    assert near.on_branch.all()
    with pytest.raises(NoSolution, match="points upwards"):
        delta6.forward_position(GEOM, q[off][0]).require()
    apart = delta6.forward_position(GEOM, [0.0, 0.0, 5.0])
    assert not apart.assembles and np.isnan(apart.position).all() and apart.discriminant < 0
    with pytest.raises(NoSolution, match="no assembly"):
        apart.require()


def test_forward_spheres_hold_off_branch_too():
    q = np.random.default_rng(8).uniform(0.25, 0.65, (2000, 3))
    result = delta6.forward_position(GEOM, q)
    p, h = result.position[result.assembles], result.heights[result.assembles]
    g = delta6.leg_vectors(GEOM, p)
    length = np.sqrt(np.sum(g * g, axis=-1) + h * h)
    np.testing.assert_allclose(length, GEOM.rod_length, atol=1e-13)


def test_shapes_and_scalars():
    empty = np.zeros((0, 3))
    assert delta6.inverse_position(GEOM, empty).require().shape == (0, 3)
    assert delta6.forward_position(GEOM, empty).require().shape == (0, 3)
    assert delta6.translation_jacobian(GEOM, empty).shape == (0, 3, 3)
    p = random_positions(9, 24).reshape(2, 3, 4, 3)
    assert delta6.inverse_position(GEOM, p).drives.shape == (2, 3, 4, 3)
    assert delta6.translation_jacobian(GEOM, p).shape == (2, 3, 4, 3, 3)
    single = delta6.inverse_position(GEOM, p[1, 2, 3])
    np.testing.assert_array_equal(single.drives, delta6.inverse_position(GEOM, p).drives[1, 2, 3])
    assert delta6.forward_position(GEOM, single.drives).position.shape == (3,)


@pytest.mark.parametrize("azimuths", [(0.3, 2.0, 4.4), (4.4, 2.0, 0.3)])
def test_other_geometry_and_leg_order(azimuths):
    geom = delta6.Delta6(rod_length=0.5, radial_offset=0.2, tangential_offset=-0.02, leg_azimuths=azimuths)
    p = random_positions(10, 500, 0.1)
    q = delta6.inverse_position(geom, p).require()
    np.testing.assert_allclose(delta6.forward_position(geom, q).require(), p, atol=1e-13)


@pytest.mark.parametrize(
    "changes, culprit",
    [
        ({"rod_length": -1.0}, "rod_length"),
        ({"rod_length": float("nan")}, "rod_length"),
        ({"rod_length": 0.2}, "rod_length"),
        ({"k_spur": 0.0}, "k_spur"),
        ({"leg_azimuths": (0.0, 0.0, 1.0)}, "leg_azimuths"),
        ({"leg_azimuths": (0.0, 1.0)}, "leg_azimuths"),
        ({"radial_offset": 0.0, "tangential_offset": 0.0}, "leg_azimuths"),
        ({"rotary_signs": (1, 2, 1)}, "rotary_signs"),
    ],
)
def test_bad_geometry_names_the_culprit(changes, culprit):
    with pytest.raises(MechlabError, match=culprit):
        delta6.Delta6(**changes)


def test_bad_arrays_are_named():
    with pytest.raises(MechlabError, match="position has shape"):
        delta6.inverse_position(GEOM, [1.0, 2.0])
    with pytest.raises(MechlabError, match="position holds 1 values"):
        delta6.inverse_position(GEOM, [0.0, np.nan, 0.0])
