"""Four-bar: closure, Freudenstein, derivatives, ranges, one-freedom dynamics."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mechlab.analytic import fourbar
from mechlab.errors import MechlabError, NoSolution

BARS = {  # crank, coupler, rocker, ground
    "crank-rocker": (0.1, 0.35, 0.3, 0.4),
    "double crank": (0.3, 0.35, 0.32, 0.1),
    "rocker-crank": (0.3, 0.35, 0.1, 0.4),
    "double rocker": (0.3, 0.1, 0.35, 0.4),
    "triple rocker": (0.3, 0.25, 0.28, 0.5),
    "change point": (0.1, 0.4, 0.2, 0.3),
}
MASSES = (
    fourbar.LinkMass(0.4, 0.03, 2e-4),
    fourbar.LinkMass(0.7, 0.2, 6e-3, 0.05),
    fourbar.LinkMass(0.5, 0.12, 3e-3, -0.02),
)


def inner_angles(name: str, count: int = 200) -> np.ndarray:
    """Angles in all ranges, a few degrees away from the limits."""
    ranges = fourbar.crank_limits(*BARS[name]).ranges
    return np.concatenate([np.linspace(low + 0.06, high - 0.06, count) for low, high in ranges])


@pytest.mark.parametrize("name", BARS)
@pytest.mark.parametrize("mode", [1, -1])
def test_loop_closes_in_the_right_mode(name, mode):
    a, b, c, g = BARS[name]
    phi = inner_angles(name)
    m = fourbar.solve(a, b, c, g, phi, mode=mode).require()
    pin = a * np.exp(1j * phi)
    joint = pin + b * np.exp(1j * m.coupler_angle)
    np.testing.assert_allclose(g + c * np.exp(1j * m.rocker_angle), joint, atol=1e-14)
    side = np.imag(np.conj(g - pin) * (joint - pin))
    assert (np.sign(side) == mode).all()
    at_joint = np.abs(np.angle((pin - joint) / (g - joint)))
    np.testing.assert_allclose(m.transmission_angle, at_joint, atol=1e-12)


@pytest.mark.parametrize("name", BARS)
def test_freudenstein(name):
    # K1 cos(psi) - K2 cos(phi) + K3 = cos(phi - psi), with psi the output angle (Freudenstein 1955).
    a, b, c, g = BARS[name]
    phi = inner_angles(name)
    psi = fourbar.solve(a, b, c, g, phi).rocker_angle
    k3 = (a**2 - b**2 + c**2 + g**2) / (2 * a * c)
    np.testing.assert_allclose(g / a * np.cos(psi) - g / c * np.cos(phi) + k3, np.cos(phi - psi), atol=1e-13)


@pytest.mark.parametrize("name", BARS)
@pytest.mark.parametrize("mode", [1, -1])
def test_rates_and_accelerations_against_differences(name, mode):
    phi, w, eps, t = inner_angles(name, 60), 1.7, -2.3, 1e-5
    m = fourbar.solve(*BARS[name], phi, w, eps, mode)

    def at(time: float) -> fourbar.FourbarMotion:
        return fourbar.solve(*BARS[name], phi + w * time + eps * time**2 / 2, w + eps * time, eps, mode)

    after, before = at(t), at(-t)
    for link in ("coupler", "rocker"):
        angle, rate, accel = f"{link}_angle", f"{link}_rate", f"{link}_accel"
        turned = np.angle(np.exp(1j * (getattr(after, angle) - getattr(before, angle))))
        # Near a limit the third derivative reaches 1e5: relative error of a few 1e-6 at this step.
        np.testing.assert_allclose(getattr(m, rate), turned / (2 * t), rtol=1e-5, atol=1e-6)
        change = getattr(after, rate) - getattr(before, rate)
        np.testing.assert_allclose(getattr(m, accel), change / (2 * t), rtol=1e-5, atol=1e-5)


def test_everything_broadcasts():
    phi = np.linspace(0, 6, 5)
    m = fourbar.solve(np.array([0.1, 0.12])[:, None, None], 0.35, 0.3, 0.4, phi, 1.0, 0.0, np.array([1, -1])[:, None])
    assert m.rocker_accel.shape == (2, 2, 5) == m.gap.shape == m.assembles.shape
    one = fourbar.solve(0.12, 0.35, 0.3, 0.4, phi[2], 1.0, 0.0, -1)
    assert one.rocker_angle == m.rocker_angle[1, 1, 2] and one.rocker_angle.shape == ()


def test_gap_says_how_short():
    far = fourbar.solve(0.3, 0.2, 0.2, 0.4, [0.0, math.pi])
    assert far.assembles.tolist() == [True, False]
    assert far.gap[1] == pytest.approx(0.3) and np.isnan(far.rocker_angle[1]) and np.isnan(far.rocker_rate[1])
    near = fourbar.solve(0.3, 0.5, 0.2, 0.4, 0.0)
    assert not near.assembles and near.gap == pytest.approx(0.2)
    with pytest.raises(NoSolution, match="1 of 2 crank angles, largest gap 0.3"):
        far.require()


def test_in_line_is_flagged():
    exact = fourbar.solve(1.0, 1.0, 2.0, 2.0, math.pi, 1.0)  # f = 3 = 1 + 2 to the last bit
    assert exact.assembles and not exact.regular and np.isnan(exact.rocker_rate) and np.isfinite(exact.rocker_angle)
    with pytest.raises(NoSolution, match="in line"):
        exact.require()
    on_pivot = fourbar.solve(1.0, 2.0, 2.0, 1.0, 0.0)
    assert not on_pivot.assembles and np.isnan(on_pivot.rocker_angle)


@pytest.mark.parametrize("name", BARS)
def test_grashof_class(name):
    assert fourbar.grashof_class(*BARS[name]).value.startswith(name)


@pytest.mark.parametrize("name", BARS)
def test_crank_limits_against_a_scan(name):
    limits = fourbar.crank_limits(*BARS[name])
    phi = np.linspace(-math.pi, math.pi, 20_001)
    inside = np.zeros(phi.shape, dtype=bool)
    for low, high in limits.ranges:
        for turn in (0, 2 * math.pi):
            inside |= (phi + turn >= low) & (phi + turn <= high)
    away = np.min([np.abs(phi - x) for x in (*limits.limit_angles, *limits.change_points, 9.0)], axis=0) > 1e-6
    assembles = fourbar.solve(*BARS[name], phi).assembles
    assert np.array_equal(assembles[away], inside[away])
    assert limits.full_turn == assembles[away].all()
    for angle in limits.limit_angles:
        f = abs(BARS[name][3] - BARS[name][0] * np.exp(1j * angle))
        _, b, c, _ = BARS[name]
        assert min(abs(f - b - c), abs(f - abs(b - c))) < 1e-15


def test_change_points():
    assert fourbar.crank_limits(*BARS["change point"]).change_points == pytest.approx((0.0,))
    assert fourbar.crank_limits(1.0, 2.0, 1.0, 2.0).change_points == pytest.approx((0.0, math.pi))
    assert fourbar.crank_limits(*BARS["crank-rocker"]).change_points == ()


def test_bad_input_is_named():
    with pytest.raises(MechlabError, match="rocker"):
        fourbar.solve(0.1, 0.35, 0.0, 0.4, 0.0)
    with pytest.raises(MechlabError, match="mode"):
        fourbar.solve(0.1, 0.35, 0.3, 0.4, 0.0, mode=0)
    with pytest.raises(MechlabError, match="crank_angle"):
        fourbar.solve(0.1, 0.35, 0.3, 0.4, np.nan)
    with pytest.raises(NoSolution, match="longer than the other three"):
        fourbar.crank_limits(0.1, 0.1, 0.1, 0.4)
    with pytest.raises(MechlabError, match="inertia"):
        fourbar.LinkMass(1.0, 0.1, -1.0)
    with pytest.raises(MechlabError, match="neither mass"):
        fourbar.acceleration(fourbar.rod_fourbar(*BARS["crank-rocker"], 0.0), 0.1, 0.0)


def bar(name: str, mode: int = 1) -> fourbar.MovingFourbar:
    return fourbar.MovingFourbar(*BARS[name], *MASSES, mode=mode)


def centres(b: fourbar.MovingFourbar, phi: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Centres of mass as complex numbers and link angles, straight from the loop."""
    m = fourbar.solve(b.crank, b.coupler, b.rocker, b.ground, phi, mode=b.mode)
    angles = [phi, m.coupler_angle, m.rocker_angle]
    bases = [0.0, b.crank * np.exp(1j * phi), b.ground]
    links = (b.crank_mass, b.coupler_mass, b.rocker_mass)
    points = [
        base + (k.com_along + 1j * k.com_across) * np.exp(1j * q)
        for base, k, q in zip(bases, links, angles, strict=True)
    ]
    return points, angles


@pytest.mark.parametrize("name", BARS)
@pytest.mark.parametrize("mode", [1, -1])
def test_reduced_inertia_against_differences(name, mode):
    b, phi, step = bar(name, mode), inner_angles(name, 40), 1e-6
    (r1, q1), (r0, q0) = centres(b, phi + step), centres(b, phi - step)
    energy = np.zeros(phi.shape)
    for link, after, before, turned, was in zip(MASSES, r1, r0, q1, q0, strict=True):
        spin = np.angle(np.exp(1j * (turned - was))) / (2 * step)
        energy += link.mass * np.abs((after - before) / (2 * step)) ** 2 + link.inertia * spin**2
    reduced = fourbar.generalised_inertia(b, phi)
    np.testing.assert_allclose(reduced.inertia, energy, rtol=1e-6)
    change = fourbar.generalised_inertia(b, phi + step).inertia - fourbar.generalised_inertia(b, phi - step).inertia
    np.testing.assert_allclose(reduced.slope, change / (2 * step), rtol=1e-5, atol=1e-6)


def test_potential_against_centres():
    b, phi = bar("crank-rocker"), np.linspace(-3, 3, 20)
    heights = sum(k.mass * np.imag(r) for k, r in zip(MASSES, centres(b, phi)[0], strict=True))
    np.testing.assert_allclose(fourbar.potential_energy(b, phi, (0.0, -9.81)), 9.81 * heights, atol=1e-13)


def test_slender_rods():
    b = fourbar.rod_fourbar(*BARS["crank-rocker"], 2.0)
    assert b.coupler_mass == fourbar.LinkMass(0.7, 0.175, 0.7 * 0.35**2 / 12)
    # Fixed crank end: a rod about its end, plus the other two at their own rates.
    phi = np.array(0.7)
    m = fourbar.solve(*BARS["crank-rocker"], phi, 1.0)
    pin = 0.1 * 1j * np.exp(0.7j)
    joint = 0.3j * m.rocker_rate * np.exp(1j * m.rocker_angle)
    # A uniform rod between points of velocity u, v: m / 6 (u.u + u.v + v.v) = T.
    energy = [
        k / 6 * (abs(u) ** 2 + np.real(np.conj(u) * v) + abs(v) ** 2)
        for k, u, v in ((0.2, 0.0, pin), (0.7, pin, joint), (0.6, 0.0, joint))
    ]
    assert fourbar.generalised_inertia(b, phi).inertia == pytest.approx(2 * sum(energy), rel=1e-13)


@pytest.mark.parametrize("gravity, torque", [((0.0, 0.0), 0.0), ((1.0, -9.81), 0.0), ((0.0, -9.81), 0.4)])
def test_motion_keeps_the_energy_law(gravity, torque):
    b = bar("crank-rocker", -1)

    def slope(_: float, y: np.ndarray) -> list[float]:
        return [y[1], float(fourbar.acceleration(b, y[0], y[1], torque, gravity))]

    run = solve_ivp(slope, (0, 0.5), [0.3, 30.0], "DOP853", rtol=1e-11, atol=1e-12)
    speed = fourbar.energy_speed(b, run.y[0], 0.3, 30.0, torque, gravity)
    np.testing.assert_allclose(run.y[1], speed, rtol=1e-8)  # tolerance of the integrator over two turns
    assert run.y[0, -1] > 2 * math.pi


def test_energy_barrier_is_not_jumped():
    b = bar("crank-rocker")
    with pytest.raises(NoSolution, match="turns back"):
        fourbar.energy_speed(b, 2 * math.pi - 1.5, -1.5, 0.5, gravity=(0.0, -9.81))
    with pytest.raises(NoSolution, match="does not assemble"):
        fourbar.energy_speed(bar("triple rocker"), 2 * math.pi + 0.9, 0.9, 1.0)


def test_positions_alone_are_those_of_the_motion():
    # Longer than one block, with positions out of reach: modes and lengths broadcast.
    phi = np.linspace(-math.pi, math.pi, 9001)
    given = (0.3, np.array([[0.2], [0.35]]), 0.25, 0.4, phi)
    here, whole = fourbar.positions(*given, mode=-1), fourbar.solve(*given, 0.7, 0.2, mode=-1)
    assert here.coupler_angle.shape == (2, 9001)
    assert 0 < np.count_nonzero(here.assembles[0]) < 9001
    for name in ("coupler_angle", "rocker_angle", "transmission_angle", "gap", "assembles", "regular"):
        np.testing.assert_array_equal(getattr(here, name), getattr(whole, name))
    np.testing.assert_array_equal(np.isnan(here.rocker_angle), ~here.assembles)
    np.testing.assert_array_equal(np.isnan(whole.rocker_rate), ~whole.regular)
    np.testing.assert_array_equal(here.gap > 0.0, ~here.assembles)
    with pytest.raises(NoSolution, match="does not assemble"):
        here.require()
    assert fourbar.positions(*BARS["crank-rocker"], []).gap.shape == (0,)


def exact_motion(bars: tuple[float, ...], phi: float, mode: int) -> np.ndarray:
    """Angles, rates, accelerations for the crank rate 1 in extended precision, by the circles' intersection."""
    a, b, c, g, angle = (np.longdouble(x) for x in (*bars, phi))
    px, py = a * np.cos(angle), a * np.sin(angle)
    dx, dy = g - px, -py
    square = dx * dx + dy * dy
    x = (square + b * b - c * c) / (2 * square)
    y = mode * np.sqrt(b * b / square - x * x)
    rx, ry = x * dx - y * dy, x * dy + y * dx
    sx, sy = rx - dx, ry - dy
    det = rx * sy - ry * sx
    theta, psi = (sx * py - sy * px) / det, (rx * py - ry * px) / det
    both = rx * sx + ry * sy
    theta2 = (sx * px + sy * py + theta**2 * both - psi**2 * c * c) / det
    psi2 = (rx * px + ry * py + theta**2 * b * b - psi**2 * both) / det
    return np.array([np.arctan2(ry, rx), np.arctan2(sy, sx), theta, psi, theta2, psi2])


@pytest.mark.skipif(np.finfo(np.longdouble).eps > 1e-18, reason="long double is double here")
@pytest.mark.parametrize("distance", [0.3, 1e-2, 1e-4, 1e-6, 1e-8])
def test_digits_near_a_limit_position(distance):
    # The angles go with the root of the distance to the limit: a rounding of the crank angle, 2.2e-16, moves them by that
    # over sqrt(distance), rates by that over distance of themselves, accelerations by three times as much. Two such
    # roundings are allowed (largest seen: half of one).
    bars = BARS["triple rocker"]
    for limit in fourbar.crank_limits(*bars).limit_angles:
        for k in range(20):
            phi, mode = limit - math.copysign(distance * (1.0 + k / 20), limit), (-1) ** k
            m = fourbar.solve(*bars, phi, 1.0, 0.0, mode)
            exact = exact_motion(bars, phi, mode)
            found = [
                m.coupler_angle, m.rocker_angle, m.coupler_rate, m.rocker_rate, m.coupler_accel, m.rocker_accel,
            ]  # fmt: skip
            error = np.abs(np.array(found) - exact)
            rounding = 2.0 * 2.2e-16 * (1.0 + 1.0 / distance)
            assert np.all(error[:2] < 2.0 * 2.2e-16 * (1.0 + 1.0 / math.sqrt(distance)))
            assert np.all(error[2:4] < rounding * (1.0 + np.abs(exact[2:4])))
            assert np.all(error[4:] < 3.0 * rounding * (1.0 + np.abs(exact[4:])))
