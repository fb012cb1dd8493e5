"""Closed forms of the closed differential against independent truths: rolling contacts, kinetic energy, integration."""

import math
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from mechlab.analytic import differential as closed
from mechlab.analytic.differential.motion import exponential
from mechlab.analytic.differential.train import closed_differential_teeth, stage_teeth, sun_shares
from mechlab.errors import MechlabError

LAB = closed.Train(72, 18, 108, 18, 72, 162)
USED = closed.Train(80, 20, 120, 20, 80, 180)
STATED = closed.Train(30, 30, 90, 40, 60, 160)
INERTIAS = closed.Inertias(0.02, 0.03, 0.15, 0.02, 2.4e-4, 0.3, 0.0512, 4.0, 3, 0.2, 0.2)
J = closed.mass_matrix(LAB, INERTIAS)
NO_DRAG = np.zeros((2, 2))
U1, U2 = LAB.carriers


def start() -> np.ndarray:
    v = closed.speeds(LAB, w_H1=100.0, w_H2=50.0)
    return np.array([v.w1, v.w3])


@pytest.mark.parametrize("train", [LAB, USED, STATED, closed.Train(20, 40, 100, 50, 20, 90)])
def test_teeth_roll_without_sliding(train: closed.Train) -> None:
    rng = np.random.default_rng(1)
    h1, h2 = rng.uniform(-100, 100, (2, 50))
    v = closed.speeds(train, w_H1=h1, w_H2=h2)
    # Velocities of both wheels at the pitch point, as pitch radius x speed: centre of the planet +- its own radius.
    for sun, planet, ring, carrier, spin in (
        (train.z1, train.z2, train.z3, h1, v.w2),
        (train.z4, train.z5, train.z6, h2, v.w5),
    ):
        centre = (sun + planet) * carrier
        np.testing.assert_allclose(centre - planet * spin, sun * v.w1, rtol=0, atol=1e-9 * ring * 1e3)
        np.testing.assert_allclose(centre + planet * spin, ring * v.w3, rtol=0, atol=1e-9 * ring * 1e3)
    printed = closed.printed_speeds(train, h1, h2)
    np.testing.assert_allclose([printed.w1, printed.w3], [v.w1, v.w3], rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize(
    ("train", "speeds", "moments", "start_moment", "internal", "ratio", "braked"),
    [
        (USED, (200.0, 100.0 / 3.0, -300.0, 12.5), (40, 60, 20, 180), 700 / 3, 400 / 3, -4 / 3, (4.0, 2.0 / 3.0)),
        (STATED, (850.0, -150.0, -650.0, -1450 / 3), (25, 75, 40, 160), 109.375, 9.375, -0.09375, (1.25, 0.9375)),
    ],
)
def test_numeric_example(train, speeds, moments, start_moment, internal, ratio, braked) -> None:
    v = closed.speeds(train, w_H1=100.0, w_H2=50.0)
    np.testing.assert_allclose([v.w1, v.w3, v.w2, v.w5], speeds, rtol=1e-12)
    m = closed.mesh_moments(train, 100.0, 200.0)
    np.testing.assert_allclose([m.M21, m.M23, m.M54, m.M56], moments, rtol=1e-12)
    assert float(closed.start_moment(train, 100.0)) == pytest.approx(start_moment, rel=1e-12)
    assert float(closed.internal_moment(train, 100.0)) == pytest.approx(internal, rel=1e-12)
    assert closed.start_ratio(train) == pytest.approx(ratio, rel=1e-12)
    assert closed.braked_ratios(train) == pytest.approx(braked, rel=1e-12)


@pytest.mark.parametrize("known", [{"w1": 3.0, "w3": -7.0}, {"w_H1": 3.0, "w3": 0.0}, {"w_H2": 2.0, "w1": 5.0}])
def test_speeds_from_any_two(known: dict[str, float]) -> None:
    v = vars(closed.speeds(LAB, **known))
    again = vars(closed.speeds(LAB, w_H1=v["w_H1"], w_H2=v["w_H2"]))
    for name, value in again.items():
        assert float(value) == pytest.approx(float(v[name]), abs=1e-10)


def test_mass_matrix_is_the_kinetic_energy_of_all_parts() -> None:
    rng = np.random.default_rng(2)
    i, k = INERTIAS, INERTIAS.planets
    for w in rng.uniform(-50, 50, (20, 2)):
        v = closed.speeds(LAB, w1=w[0], w3=w[1])
        twice = i.J14 * v.w1**2 + i.J36 * v.w3**2 + i.J_H1 * v.w_H1**2 + i.J_H2 * v.w_H2**2
        twice += k * (i.J2 * v.w2**2 + i.m2 * (i.r_H1 * v.w_H1) ** 2 + i.J5 * v.w5**2 + i.m5 * (i.r_H2 * v.w_H2) ** 2)
        assert w @ J @ w == pytest.approx(float(twice), rel=1e-13)
        total = i.J14 * v.w1 + i.J36 * v.w3 + (i.J_H1 + k * i.m2 * i.r_H1**2) * v.w_H1 + k * i.J2 * v.w2
        total += (i.J_H2 + k * i.m5 * i.r_H2**2) * v.w_H2 + k * i.J5 * v.w5
        assert closed.momentum_row(LAB, i) @ w == pytest.approx(float(total), rel=1e-12)
    # Numbers of an independent null-space computation, to their five printed digits.
    np.testing.assert_allclose(J, [[0.04924, 0.03252], [0.03252, 0.77604]], atol=5e-6)
    hat = closed.carrier_mass_matrix(LAB, J)
    np.testing.assert_allclose(hat, [[0.46434667, -0.48858667], [-0.48858667, 1.40314667]], atol=5e-9)


def test_constant_moments() -> None:
    q = closed.block_torques(LAB, 100.0, 200.0)
    t = np.linspace(0, 0.5, 11)
    found = closed.motion(J, NO_DRAG, q, start(), (), t)
    np.testing.assert_allclose(found.rates[-1], [461.383100, -54.935543], atol=1e-6)
    np.testing.assert_allclose(found.rates[-1] @ LAB.carriers.T, [151.592, -3.304], atol=5e-4)
    power = found.rates @ LAB.carriers.T @ [100.0, -200.0]
    np.testing.assert_allclose(np.diff(power) / np.diff(t), closed.power_rate(LAB, J, 100.0, 200.0), rtol=1e-9)
    assert closed.power_rate(LAB, J, 100.0, 200.0) == pytest.approx(31639.854, abs=1e-3)
    momentum = found.rates @ closed.momentum_row(LAB, INERTIAS)
    np.testing.assert_allclose(momentum - momentum[0], -100.0 * t, atol=1e-9)


@pytest.mark.parametrize(
    ("damping", "force", "contacts", "w0", "duration"),
    [
        (np.diag([0.02, 2.0]), (20.0, -120.0), (), None, 5.0),
        (0.5 * np.array([[1.0, -1], [-1, 1]]), (20.0, -120.0), (), None, 2.0),
        (NO_DRAG, (0.0, 0.0), (("input", U1, 100.0, -np.inf, np.inf), ("dry", U2, 0.0, -200.0, 200.0)), None, 0.6),
        (NO_DRAG, (20.0, -120.0), (("stop", (0.0, 1.0), 0.0, 0.0, np.inf),), None, 1.0),
        (0.05 * np.array([[1.0, -1], [-1, 1]]), (9.0, 11.0), (("dry", U2, 0.0, -30.0, 30.0),), (-40.0, 5.0), 2.0),
    ],
)  # fmt: skip
def test_motion_against_integration_of_regularised_contacts(damping, force, contacts, w0, duration) -> None:
    """A contact as a steep viscous law of its own: slope 1e5 N m s, which moves rates by at most bound/1e5."""
    w_start = start() if w0 is None else np.array(w0)
    slope = 1e5

    def rhs(t: float, w: np.ndarray) -> np.ndarray:
        f = np.array(force) - damping @ w
        for _, row, target, low, high in contacts:
            f = f + np.clip(-slope * (np.array(row) @ w - target), low, high) * np.array(row)
        return np.linalg.solve(J, f)

    t = np.linspace(0, duration, 13)
    truth = solve_ivp(rhs, (0, duration), w_start, "Radau", t_eval=t, rtol=1e-9, atol=1e-9).y.T
    given = tuple(closed.Contact(n, tuple(float(x) for x in row), *rest) for n, row, *rest in contacts)
    found = closed.motion(J, damping, force, w_start, given, t)
    np.testing.assert_allclose(found.rates, truth, atol=2e-2)


def test_dry_load_stops_and_sticks() -> None:
    contacts = (
        closed.Contact("input", tuple(U1.tolist()), 100.0),
        closed.Contact("dry", tuple(U2.tolist()), 0.0, -200.0, 200.0),
    )
    found = closed.motion(J, NO_DRAG, np.zeros(2), start(), contacts, np.linspace(0, 1, 101))
    ((when, what),) = found.events
    assert when == pytest.approx(0.35079, abs=5e-6) and what == "dry holds"
    braking = found.t < when
    np.testing.assert_allclose(found.moments["input"][braking], 69.642, atol=5e-4)
    np.testing.assert_allclose(found.moments["input"][~braking], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.rates[~braking] @ U2, 0.0, atol=1e-12)


def test_contacts_that_cannot_be_met_are_refused() -> None:
    with pytest.raises(MechlabError, match="starts .* off it"):
        closed.motion(J, NO_DRAG, np.zeros(2), start(), (closed.Contact("lock", (1.0, -5.0)),), [0.0, 1.0])


def test_steady_state_with_drag_on_the_housing() -> None:
    steady = closed.housing_drag(LAB, 0.02, 2.0, 100.0, 200.0)
    q = closed.block_torques(LAB, 100.0, 200.0)
    far = closed.motion(J, np.diag([0.02, 2.0]), q, start(), (), [0.0, 200.0]).rates[-1] @ LAB.carriers.T
    np.testing.assert_allclose([steady.w_H1, steady.w_H2], far, rtol=1e-9)
    ratio, efficiency = closed.drag_ratio(LAB, 100.0, [0.5, 1.0, 2.0, 2.4])
    np.testing.assert_allclose(ratio, [3.876, 4.330, 7.913, 27.88], rtol=2e-4)
    np.testing.assert_allclose(efficiency, [0.129, 0.231, 0.253, 0.086], atol=5e-4)
    assert closed.drag_stall(LAB, 100.0) == pytest.approx(2.508, abs=5e-4)
    with pytest.raises(MechlabError, match="drag_14"):
        closed.mobility(LAB, 0.0, 1.0)


@pytest.mark.parametrize("load", [50.0, 100.0, 150.0, 200.0, 400.0])
def test_backstop_with_two_ranges(load: float) -> None:
    damping = 0.2 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    contacts = (
        closed.Contact("input", tuple(U1.tolist()), 100.0),
        closed.Contact("stop", (0.0, 1.0), 0.0, 0.0, np.inf),
    )
    found = closed.motion(J, damping, closed.block_torques(LAB, 0.0, load), start(), contacts, np.linspace(0, 25, 26))
    steady = closed.backstop(LAB, 0.2, 100.0, load)
    assert float(steady.w_H2) == pytest.approx(found.rates[-1] @ U2, abs=1e-9)
    assert float(steady.M_H1) == pytest.approx(found.moments["input"][-1], abs=1e-7)
    assert float(steady.w_H2) == pytest.approx({50: 77.5, 100: 55.0, 150: 32.5}.get(int(load), 25.0))


def test_start_moment_is_one_inertia_limit() -> None:
    def felt(**kept: float) -> float:
        values = dict.fromkeys(("J_H1", "J14", "J36", "J_H2", "J2", "m2", "J5", "m5"), 0.0) | kept
        j = closed.mass_matrix(LAB, closed.Inertias(**values, planets=3, r_H1=0.2, r_H2=0.2))
        return float(closed.held_output_moment(LAB, j, 100.0))

    assert felt(J5=1.0) == pytest.approx(float(closed.start_moment(LAB, 100.0)), rel=1e-12)
    assert felt(J36=1.0) == pytest.approx(400.0) and felt(J14=1.0) == pytest.approx(200 / 3)
    assert felt(J2=1.0) == pytest.approx(114.2857, abs=1e-4)
    assert float(closed.held_output_moment(LAB, J, 100.0)) == pytest.approx(105.2202, abs=1e-4)


def test_printed_synthesis_gives_negative_teeth() -> None:
    assert closed.printed_z4(30, 30, 60, 100 / 60 / (200 / 100)) == pytest.approx(-10.0)
    assert closed.printed_z4(80, 20, 80, 0.5) == pytest.approx(-30.0)


def test_assembly_conditions() -> None:
    assert all(c.even and c.neighbours for c in closed.conditions(LAB, 3))
    assert [c.even for c in closed.conditions(USED, 3)] == [False, False]
    assert all(c.even and c.neighbours for c in closed.conditions(USED, 2))
    assert [c.neighbours for c in closed.conditions(USED, 4)] == [True, False]


def test_softness_law_against_a_soft_row_at_rest() -> None:
    """Two rotors, one row with the stiffness that MuJoCo gives it: r = f (1 - d) tc^2 A at quasi-rest."""
    mass, row, force = np.diag([1e-6, 1.0]), np.array([[1.0, -1.0]]), np.array([1.0, 0.0])
    lag = closed.predicted_lag(mass, row, force, 0.02, 0.95)
    a = float((row @ np.linalg.inv(mass) @ row.T)[0, 0])
    f = float((row @ np.linalg.inv(mass) @ force)[0]) / a
    assert lag[0] == pytest.approx(0.05 * 0.02**2 * a * f, rel=1e-12)
    # Redundant rows share: the sum of the multipliers is that of one.
    twice = closed.reactions(mass, np.vstack([row, row]), force)
    assert abs(twice.sum()) == pytest.approx(f, rel=1e-9) and twice[0] == pytest.approx(twice[1], rel=1e-9)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: closed.Train(30, 30, 91, 40, 60, 160), "z3 = z1 \\+ 2 z2"),
        (lambda: closed.Train(0, 30, 60, 40, 60, 160), "at least one tooth"),
        (lambda: closed.speeds(LAB, w1=1.0), "exactly two"),
        (lambda: closed.speeds(closed.Train(20, 20, 60, 30, 30, 90), w_H1=1.0, w_H2=2.0), "turn as one"),
        (lambda: closed.Inertias(-1, 0, 0, 0, 0, 0, 0, 0, 3, 0.2, 0.2), "J_H1"),
        (lambda: closed.backstop(LAB, 0.0, 100.0, 1.0), "backstop"),
    ],
)
def test_bad_input(call, message: str) -> None:
    with pytest.raises(MechlabError, match=message):
        call()


def test_differential_teeth_of_the_example() -> None:
    found = closed_differential_teeth(Fraction(4), Fraction(2, 3))
    assert found.teeth[0].tolist() == [72, 18, 108, 18, 72, 162] and (found.a, found.b) == (
        Fraction(2, 5),
        Fraction(1, 10),
    )
    for z1, z2, z3, z4, z5, z6 in found.teeth.tolist():
        a, b = Fraction(z1, z1 + z3), Fraction(z4, z4 + z6)
        assert (a / b, (1 - a) / (1 - b)) == (4, Fraction(2, 3))
        assert z3 == z1 + 2 * z2 and z6 == z4 + 2 * z5 and (z1 + z3) % 3 == 0 and (z4 + z6) % 3 == 0
        for sun, planet in ((z1, z2), (z4, z5)):
            assert (sun + planet) * math.sin(math.pi / 3) >= planet + 2


def test_stages_by_brute_force() -> None:
    found = {tuple(row) for row in stage_teeth(Fraction(3, 10), 4, range(12, 91)).tolist()}
    expected = {
        (s, p, s + 2 * p) for s, p in product(range(12, 91), repeat=2)
        if s + 2 * p <= 90 and Fraction(s, 2 * s + 2 * p) == Fraction(3, 10) and (2 * s + 2 * p) % 4 == 0
        and 2 * (s + p) * math.sin(math.pi / 4) >= 2 * (p + 2)
    }  # fmt: skip
    assert found == expected and found


def test_six_planets_that_touch_exactly_fit() -> None:
    """sin(pi / 6) = 1/2: (sun + planet) / 2 >= planet + 2 in whole numbers, so that equality is no matter of a last bit."""
    share, teeth = Fraction(1, 3), range(4, 60)
    expected = {
        (s, p, s + 2 * p) for s, p in product(teeth, repeat=2)
        if s + 2 * p < 60 and Fraction(s, 2 * s + 2 * p) == share and (2 * s + 2 * p) % 6 == 0 and s + p >= 2 * (p + 2)
    }  # fmt: skip
    assert (8, 4, 16) in expected
    assert {tuple(row) for row in stage_teeth(share, 6, teeth).tolist()} == expected


def test_equal_ratios_are_refused() -> None:
    with pytest.raises(MechlabError, match="must differ"):
        sun_shares(Fraction(2), Fraction(2))


@pytest.mark.parametrize("size", [1e-9, 0.3, 4.0, 60.0])
def test_the_exponential_of_a_matrix(size: float) -> None:
    """A turn against cosine and sine; a damped 5 x 5 system, as here, against SciPy, whose own error of a turn by 60 rad is 4e-13."""
    turn = np.array([[math.cos(size), math.sin(size)], [-math.sin(size), math.cos(size)]])
    # Squaring k times multiplies the rounding by at most 2^k, which is at most 4 times the norm.
    np.testing.assert_allclose(exponential(np.array([[0.0, size], [-size, 0.0]])), turn, rtol=0, atol=2.3e-16 * max(1.0, 4.0 * size))
    rng = np.random.default_rng(3)
    a = np.zeros((5, 5))
    a[:2, 2:4] = np.eye(2)
    a[2:4, 2:4] = -size * (np.eye(2) + 0.3 * rng.standard_normal((2, 2)))
    a[2:4, 4] = rng.standard_normal(2)
    np.testing.assert_allclose(exponential(a), expm(a), rtol=0, atol=1e-14 * max(1.0, size) * np.abs(expm(a)).max())
