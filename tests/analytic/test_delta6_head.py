"""Head dynamics, control law, friction, mobility, workspace."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mechlab.analytic import delta6
from mechlab.errors import MechlabError

GEOM = delta6.Delta6()
INERTIAS = delta6.HeadInertias()


def test_head_numbers():
    # Values that a MuJoCo 4.0.0 model with every gear a joint gives too (relative difference 1.5e-16).
    m = 1e3 * delta6.mass_matrix(GEOM, INERTIAS, 0.7)
    expected = [[2.613915, 0, 4.515541], [0, 3.048915, 0], [4.515541, 0, 11.056019]]
    np.testing.assert_allclose(m, expected, atol=5.1e-7)
    bias = delta6.bias(INERTIAS, 0.7, [1.0, -2.0, 1.5])
    np.testing.assert_allclose(bias, [6.8836e-5, 4.61241e-4, 1.184085e-3], rtol=1e-5)


def kinetic_energy(geom: delta6.Delta6, j: delta6.HeadInertias, angles: np.ndarray, v: np.ndarray) -> float:
    """Sum over bodies of their own spin and centre speed, built from vectors instead of rows."""
    be, ga = angles[1], angles[2]
    al_rate, be_rate, ga_rate = v
    z = np.array([0.0, 0.0, 1.0])
    y = np.array([-math.sin(ga), math.cos(ga), 0.0])
    x = np.array([math.cos(ga) * math.cos(be), math.sin(ga) * math.cos(be), -math.sin(be)])
    up = np.cross(x, y)
    tee = be_rate * y + ga_rate * z
    energy = 0.5 * (j.tee_x * (tee @ x) ** 2 + j.tee_y * (tee @ y) ** 2 + j.tee_z * (tee @ up) ** 2)
    link = tee + al_rate * x
    energy += 0.5 * (j.output_axial * (link @ x) ** 2 + j.output_transverse * ((link @ y) ** 2 + (link @ up) ** 2))
    energy += 0.5 * (j.carrier_z + j.third_shaft) * ga_rate**2
    for sign in (-1.0, 1.0):
        p_rate = geom.k_bevel * al_rate  # relative to the T, about sign * y
        bevel = tee + sign * p_rate * y
        speed = np.cross(tee, sign * j.bevel_offset * y)
        energy += 0.5 * (
            j.bevel_axial * (bevel @ y) ** 2
            + j.bevel_transverse * ((bevel @ x) ** 2 + (bevel @ up) ** 2)
            + j.bevel_mass * speed @ speed
        )
        nu = p_rate + sign * be_rate
        rho = ga_rate + geom.k_transfer / geom.k_spur * nu
        energy += 0.5 * (j.planet_axial * (ga_rate + nu) ** 2 + j.planet_mass * (j.planet_offset * ga_rate) ** 2)
        energy += 0.5 * (j.transfer_gear * rho**2 + j.input_gear * (geom.k_spur * rho) ** 2)
    return float(energy)


@pytest.mark.parametrize("geom", [GEOM, delta6.Delta6(k_spur=1.2, k_transfer=0.6, k_bevel=0.75)])
def test_mass_matrix_is_the_energy(geom):
    rng = np.random.default_rng(0)
    for _ in range(50):
        a, v = rng.uniform(-2, 2, (2, 3))
        m = delta6.mass_matrix(geom, INERTIAS, a[1])
        assert 0.5 * v @ m @ v == pytest.approx(kinetic_energy(geom, INERTIAS, a, v), rel=1e-13)
        assert np.linalg.eigvalsh(m).min() > 0


def test_slope_and_bias_against_differences():
    rng = np.random.default_rng(1)
    be, v = rng.uniform(-1.4, 1.4, 20), rng.normal(size=(20, 3))
    step = 1e-6
    difference = delta6.mass_matrix(GEOM, INERTIAS, be + step) - delta6.mass_matrix(GEOM, INERTIAS, be - step)
    np.testing.assert_allclose(delta6.mass_matrix_slope(INERTIAS, be), difference / (2 * step), atol=1e-11)
    # d/dt (dT/dv) - dT/dq by definition.
    slope = difference / (2 * step)
    momentum = (slope @ v[..., None])[..., 0] * v[:, 1:2]
    momentum[:, 1] -= 0.5 * np.einsum("ni,nij,nj->n", v, slope, v)
    np.testing.assert_allclose(delta6.bias(INERTIAS, be, v), momentum, atol=1e-10)


def test_gravity_is_the_gradient_of_the_height():
    mass, arm, step = 0.3, 0.05, 1e-6
    be = np.linspace(-1.5, 1.5, 7)

    def potential(beta: np.ndarray) -> np.ndarray:
        axis = delta6.output_axis(np.stack([0 * beta, beta, 0.4 + 0 * beta], -1))
        return mass * 9.81 * arm * axis[:, 2]

    term = delta6.gravity(be, mass, arm)
    np.testing.assert_allclose(term[:, 1], (potential(be + step) - potential(be - step)) / (2 * step), atol=1e-9)
    assert np.abs(term[:, [0, 2]]).max() == 0


def test_torques_and_accelerations_are_inverse_and_do_work():
    rng = np.random.default_rng(2)
    be, v, a = rng.uniform(-1, 1, 30), rng.normal(size=(30, 3)), rng.normal(size=(30, 3))
    g = delta6.gravity(be, 0.3, 0.05)
    torques = delta6.drive_torques(GEOM, INERTIAS, be, v, a, g)
    back = delta6.angle_accelerations_from_torques(GEOM, INERTIAS, be, v, torques, g)
    np.testing.assert_allclose(back, a, atol=1e-12)
    power = np.sum(torques * delta6.drives_from_angles(GEOM, v), -1)
    np.testing.assert_allclose(np.sum(delta6.generalized_forces(GEOM, torques) * v, -1), power, atol=1e-13)


def test_bad_inertia_is_named():
    with pytest.raises(MechlabError, match="planet_mass"):
        delta6.HeadInertias(planet_mass=-1.0)


def source_errors() -> tuple[np.ndarray, np.ndarray]:
    start = delta6.source_targets(0.0)
    return delta6.SOURCE_START_ANGLES - start.angles, delta6.SOURCE_START_RATES - start.rates


def test_source_targets_and_command():
    t, step = np.linspace(0, 3, 50), 1e-5
    target = delta6.source_targets(t)
    after, before = delta6.source_targets(t + step), delta6.source_targets(t - step)
    np.testing.assert_allclose(target.rates, (after.angles - before.angles) / (2 * step), atol=1e-8)
    np.testing.assert_allclose(target.accelerations, (after.rates - before.rates) / (2 * step), atol=1e-6)
    e, r = source_errors()
    np.testing.assert_allclose(e, [0.05, 0, 0.3], atol=1e-15)
    np.testing.assert_allclose(r, [-0.4, 0.8, -0.6], atol=1e-15)
    acc = delta6.command(delta6.source_targets(0.0), delta6.SOURCE_START_ANGLES, delta6.SOURCE_START_RATES)
    np.testing.assert_allclose(acc, [72, -202, 0], atol=1e-11)


def test_error_law_numbers():
    e, r = source_errors()
    response = delta6.error_response(np.array([1.0, 3.0])[:, None], e, r, 240, 480)
    np.testing.assert_allclose(response.error[0], [0.006484, 0.000451, 0.039921], atol=5.1e-7)
    np.testing.assert_allclose(response.error[1], [0.000115, 0.000008, 0.000707], atol=5.1e-7)
    for gains, settled in (((240, 480), 2.83), ((480, 240), 11.39)):
        t = np.linspace(0, 15, 150_001)
        gamma = np.abs(delta6.error_response(t, e[2], r[2], *gains).error)
        assert t[np.flatnonzero(gamma > 1e-3)[-1]] == pytest.approx(settled, abs=0.005)


@pytest.mark.parametrize(
    "kv, kp",
    [(240, 480), (480, 240), (4, 100), (20, 100), (20, 100 + 1e-9), (20, 100 - 1e-9), (0, 9), (3, 0), (0, 0), (-1, 2)],
)
def test_error_law_against_integration(kv, kp):
    t = np.linspace(0, 1.5, 7)
    numeric = solve_ivp(
        lambda _, y: [y[1], -kv * y[1] - kp * y[0]], (0, 1.5), [0.3, -0.6], "Radau", t, rtol=1e-10, atol=1e-12
    )
    response = delta6.error_response(t, 0.3, -0.6, kv, kp)
    np.testing.assert_allclose(response.error, numeric.y[0], atol=1e-8)  # the integrator's tolerance
    np.testing.assert_allclose(response.error_rate, numeric.y[1], atol=1e-7)


def test_error_law_passes_smoothly_through_critical_damping():
    kp = 100 + np.array([-1e-12, 0.0, 1e-12, 1e-7])
    e = delta6.error_response(0.2, 0.3, -0.6, 20.0, kp).error
    np.testing.assert_allclose(e, e[1], rtol=1e-8)


def test_sliding_velocity():
    x = delta6.tip_distance(20, 0.03)
    contact = delta6.contact_point(x)
    np.testing.assert_allclose(contact, [0.02358, 0.06478], atol=5e-6)
    result = delta6.sliding_velocity(contact, 0.3, 0.3)
    np.testing.assert_allclose(result.velocity, [0.1296, -0.0472], atol=5e-5)
    assert result.contact_rate == -2 and result.driven_rate == 1
    printed = delta6.sliding_velocity([0.024, 0.065], 0.3, 0.3).velocity
    np.testing.assert_allclose(printed, [0.13, -0.048], atol=1e-15)


def test_sliding_velocity_against_the_four_equations():
    rng = np.random.default_rng(3)
    for _ in range(20):
        ra, rc, wa = rng.uniform(0.1, 1, 3)
        bx, by = rng.uniform(0.01, 0.1, 2)
        matrix = [[1, 1, 0, 0], [by, 0, 1, 0], [-bx, -rc, 0, 1], [0, 0, bx, by]]
        wb, wc, vx, vy = np.linalg.solve(matrix, [-wa, 0, -ra * wa, 0])
        result = delta6.sliding_velocity([bx, by], ra, rc, wa)
        found = [result.contact_rate, result.driven_rate, *result.velocity]
        np.testing.assert_allclose(found, [wb, wc, vx, vy], atol=1e-12)


def test_loss_factors():
    assert delta6.approach_loss(19, 19, 0.16) == pytest.approx(1.09066, abs=1e-5)
    assert delta6.approach_loss(20, 20, 0.16) == pytest.approx(1.08670, abs=1e-5)
    assert delta6.recess_loss(20, 20, 0.16) == pytest.approx(1.07679, abs=1e-5)
    assert delta6.approach_loss(17, 40, 0.0) == delta6.recess_loss(17, 40, 0.0) == 1.0
    with pytest.raises(MechlabError, match="locks"):
        delta6.approach_loss(20, 20, 2.0)


def test_loss_along_the_line_of_action_against_statics():
    """Moments of the tilted reaction about both axes, by vectors: gears about (-r1, 0) and (r2, 0), module 1, driver turning by +1."""
    rng = np.random.default_rng(5)
    along = np.array([np.sin(np.radians(20.0)), np.cos(np.radians(20.0))])
    for _ in range(30):
        z1, z2, f, s = rng.integers(15, 60), rng.integers(15, 60), rng.uniform(0.0, 0.2), rng.uniform(-2.0, 2.0)
        contact, a, c = s * along, np.array([-z1 / 2, 0.0]), np.array([z2 / 2, 0.0])
        spin = np.array([[0.0, -1.0], [1.0, 0.0]])
        slide = spin @ (contact - a) + z1 / z2 * (spin @ (contact - c))  # of the driver's tooth on the driven one
        force = along + f * slide / np.linalg.norm(slide)
        moments = [(p[0] * force[1] - p[1] * force[0]) for p in (contact - a, contact - c)]
        assert delta6.contact_loss(z1, z2, f, s) == pytest.approx(moments[0] / -moments[1] * z2 / z1, abs=1e-12)
    np.testing.assert_array_equal(delta6.contact_loss(19, 31, 0.2, [0.0, 0.0]), 1.0)
    with pytest.raises(MechlabError, match="locks"):
        delta6.contact_loss(20, 20, 2.0, -2.0)


def test_torque_table():
    chain = delta6.torque_chain(50.0)
    np.testing.assert_allclose(chain.frictionless, delta6.SOURCE_TABLE_FRICTIONLESS, atol=6e-3)
    np.testing.assert_array_equal(chain.loaded, chain.frictionless)
    table = delta6.SOURCE_TABLE_FRICTION
    losses = table[1:] / table[:-1] / delta6.SOURCE_STAGE_RATIOS
    np.testing.assert_allclose(losses, [1.0501, 1.0907, 1.0758, 1.0013], atol=2e-4)  # two decimals
    loaded = delta6.torque_chain(50.0, losses=losses)
    np.testing.assert_allclose(100 * loaded.cumulative_loss[1:], [5.0, 14.5, 23.2, 23.4], atol=0.05)
    np.testing.assert_allclose(loaded.loaded, delta6.SOURCE_TABLE_FRICTION, atol=1e-2)


def test_mobility_counts():
    assert delta6.somov_malyshev(10, 3, 0, 12) == 9  # ball-ball rods: 3 and 6 idle spins
    assert delta6.somov_malyshev(16, 9, 6, 6) == 9
    assert delta6.somov_malyshev(10, 3, 6, 6) == 3
    assert delta6.chebyshev(7, 7, 4) == 3
    assert delta6.artobolevsky(6, 6, 4) == 2
    with pytest.raises(MechlabError, match="p5"):
        delta6.chebyshev(7, -1)


@pytest.mark.parametrize(
    "bend_deg, xy, voxels",
    [
        (None, 811, 18_724),
        (60, 362, 10_885),
        (45, 55, 2_003),
        (40, 4, None),
        (35, 0, 0),
    ],
)
def test_workspace_counts(bend_deg, xy, voxels):
    counts = delta6.workspace_counts(GEOM, bend_limit=None if bend_deg is None else math.radians(bend_deg))
    assert counts.xy_nodes == xy == counts.xy_mask.sum()
    assert counts.voxels == counts.levels.sum() and (voxels is None or counts.voxels == voxels)


def test_workspace_against_poses_one_by_one():
    counts = delta6.workspace_counts(GEOM)
    nodes = np.arange(-100, 101) / 100
    rng = np.random.default_rng(4)
    for i, j in rng.integers(80, 121, (200, 2)):
        p = np.stack([np.full(201, nodes[i]), np.full(201, nodes[j]), nodes], -1)
        q = delta6.inverse_position(GEOM, p)
        inside = q.reachable & np.all((q.drives >= 0.25) & (q.drives <= 0.65), -1)
        assert counts.xy_mask[i, j] == q.reachable[0] and counts.levels[i, j] == inside.sum()


def test_workspace_limits_are_checked():
    with pytest.raises(MechlabError, match="slider_min"):
        delta6.workspace_counts(GEOM, 0.6, 0.5)
    with pytest.raises(MechlabError, match="bend_limit"):
        delta6.workspace_counts(GEOM, bend_limit=45)


def test_condition_and_margins():
    assert delta6.condition(GEOM, np.zeros(3)) == pytest.approx(1.80, abs=0.01)
    g = np.hypot(GEOM.radial_offset, GEOM.tangential_offset)
    assert delta6.reach_margin(GEOM, np.zeros(3)) == pytest.approx(GEOM.rod_length - g, abs=1e-15)
    angle = np.linspace(0, 2 * np.pi, 721)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)
    reached = delta6.inverse_position(GEOM, 0.14195 * ring).reachable
    assert reached.all() and not delta6.inverse_position(GEOM, 0.1420 * ring).reachable.all()
    margins = delta6.pose_margins(GEOM, 0.15 * ring)
    assert 0 < margins.reachable.sum() < 721
    assert np.array_equal(margins.reachable, margins.reach_margin >= 0)
    assert (margins.inverse_condition[~margins.reachable] == 0).all()
    assert not delta6.pose_margins(GEOM, 0.5 * ring).reachable.any()
    single = delta6.pose_margins(GEOM, np.zeros(3))
    assert single.reachable and single.inverse_condition == pytest.approx(1 / 1.80, abs=0.005)


def test_reach_margin_is_the_distance_to_type_one():
    p = np.array([0.05, -0.03, 0.1])
    margin = float(delta6.reach_margin(GEOM, p))
    angle = np.linspace(0, 2 * np.pi, 20_001)
    for scale, expected in ((1 - 1e-6, True), (1 + 1e-6, False)):
        ring = p + scale * margin * np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)
        assert delta6.inverse_position(GEOM, ring).reachable.all() == expected
