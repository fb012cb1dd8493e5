"""Epicyclic stage: Willis, torques, dynamics against a stage written with every body and mesh."""

import math

import numpy as np
import pytest

from mechlab.analytic import planetary_stage as ps
from mechlab.errors import MechlabError

STAGE = ps.PlanetaryStage(24, 18, 60, 3, 2e-4, 3e-5, 5e-3, 8e-4, 0.12, 0.042)


def test_textbook_ratios():
    # Ring held: 1 + z_r/z_s; carrier held: -z_s/z_r; sun held: ring over carrier 1 + z_s/z_r.
    assert ps.speeds(24, 60, sun=3.5, ring=0.0).carrier == pytest.approx(1.0)
    assert ps.speeds(24, 60, sun=1.0, carrier=0.0).ring == pytest.approx(-0.4)
    assert ps.speeds(24, 60, sun=0.0, carrier=1.0).ring == pytest.approx(1.4)
    whole = ps.speeds(24, 60, ring=2.0, carrier=2.0)  # locked: everything turns together
    assert whole.sun == pytest.approx(2.0) and whole.planet == pytest.approx(2.0)


def test_mesh_speeds_agree_at_the_pitch_points():
    rng = np.random.default_rng(0)
    sun, ring = rng.normal(size=(2, 100))
    s = ps.speeds(24, 60, sun=sun, ring=ring)
    rs, rp, rr = 12.0, 9.0, 30.0
    np.testing.assert_allclose(s.sun * rs, s.carrier * (rs + rp) - s.planet * rp, atol=1e-12)
    np.testing.assert_allclose(s.ring * rr, s.carrier * (rs + rp) + s.planet * rp, atol=1e-12)


@pytest.mark.parametrize("given", [("sun", "ring"), ("sun", "carrier"), ("ring", "carrier")])
def test_any_two_speeds_give_the_third(given):
    full = ps.speeds(24, 60, sun=np.array([1.0, -2.0]), ring=0.7)
    again = ps.speeds(24, 60, **{name: getattr(full, name) for name in given})
    for name in ("sun", "ring", "carrier", "planet"):
        np.testing.assert_allclose(getattr(again, name), getattr(full, name), atol=1e-14)


def test_steady_torques_balance_and_do_no_work():
    t = ps.balance(24, 60, carrier=-7.0)
    assert t.sun + t.ring + t.carrier == pytest.approx(0.0, abs=1e-15)
    assert (t.sun, t.ring) == pytest.approx((2.0, 5.0))
    s = ps.speeds(24, 60, sun=1.3, ring=-0.4)
    assert t.sun * s.sun + t.ring * s.ring + t.carrier * s.carrier == pytest.approx(0.0, abs=1e-14)
    assert ps.balance(24, 60, sun=2.0).carrier == pytest.approx(-7.0)


def multipliers(stage: ps.PlanetaryStage, ts: float, tc: float, tr: float, hold: bool) -> np.ndarray:
    """Accelerations of sun, carrier, ring and planets from Newton-Euler rows with mesh forces as unknowns."""
    n, radius = stage.planets, stage.orbit_radius
    module = 2 * radius / (stage.sun_teeth + stage.planet_teeth)
    rs, rp, rr = (module * z / 2 for z in (stage.sun_teeth, stage.planet_teeth, stage.ring_teeth))
    size = 3 + n
    mass = np.diag(
        [stage.sun_inertia, stage.carrier_inertia + n * stage.planet_mass * radius**2, stage.ring_inertia]
        + n * [stage.planet_inertia]
    )
    rows = []
    for k in range(n):
        spin = np.eye(size)[3 + k]
        rows.append(rs * np.eye(size)[0] - radius * np.eye(size)[1] + rp * spin)
        rows.append(rr * np.eye(size)[2] - radius * np.eye(size)[1] - rp * spin)
    if hold:
        rows.append(np.eye(size)[2])
    g = np.array(rows)
    kkt = np.block([[mass, g.T], [g, np.zeros((len(rows), len(rows)))]])
    right = np.concatenate([[ts, tc, tr], np.zeros(n + len(rows))])
    return np.linalg.lstsq(kkt, right, rcond=1e-13)[0][:size]  # one planet's meshes imply the others': redundant rows


@pytest.mark.parametrize("torques", [(1.0, 0.0, 0.0), (0.3, -0.8, 0.5), (0.0, 0.0, 2.0)])
def test_free_stage_against_mesh_forces(torques):
    a = ps.free_accelerations(STAGE, *torques)
    full = multipliers(STAGE, *torques, hold=False)
    np.testing.assert_allclose([a.sun, a.carrier, a.ring, a.planet], full[:4], rtol=1e-9)
    s = ps.speeds(24, 60, sun=a.sun, carrier=a.carrier)
    np.testing.assert_allclose([s.ring, s.planet], [a.ring, a.planet], atol=1e-10)


@pytest.mark.parametrize("torques", [(1.0, 0.0), (0.3, -0.8)])
def test_held_ring_against_mesh_forces(torques):
    a = ps.held_ring_accelerations(STAGE, *torques)
    full = multipliers(STAGE, *torques, 0.0, hold=True)
    np.testing.assert_allclose([a.sun, a.carrier, a.ring, a.planet], full[:4], rtol=1e-9, atol=1e-9)
    free = ps.free_accelerations(STAGE, *torques, a.ring_torque)
    np.testing.assert_allclose([free.sun, free.carrier, free.ring], [a.sun, a.carrier, 0.0], rtol=1e-12, atol=1e-10)


def test_held_ring_closed_form():
    i = 1 + 60 / 24
    inertia = i**2 * 2e-4 + 8e-4 + 3 * 0.12 * 0.042**2 + 3 * 3e-5 * (1 - 60 / 18) ** 2
    assert ps.held_ring_accelerations(STAGE, 0.3, -0.8).carrier == pytest.approx((i * 0.3 - 0.8) / inertia, rel=1e-14)


def test_steady_limit_of_the_hold():
    # Without inertia torque the hold is the static balance: pick the carrier torque that gives no acceleration.
    a = ps.held_ring_accelerations(STAGE, 2.0, -7.0)
    assert a.carrier == pytest.approx(0.0, abs=1e-12) and a.ring_torque == pytest.approx(5.0)


def test_energy_against_moving_planets():
    # Every planet's centre and turn angle followed in time, by differences.
    sun, carrier, t = 5.0, -2.0, 1e-4
    s = ps.speeds(24, 60, sun=sun, carrier=carrier)
    energy = 0.5 * (2e-4 * s.sun**2 + 5e-3 * s.ring**2 + 8e-4 * s.carrier**2)
    for k in range(3):
        place = [0.042 * np.exp(1j * (carrier * time + 2 * math.pi * k / 3)) for time in (-t, t)]
        energy += 0.5 * 0.12 * abs((place[1] - place[0]) / (2 * t)) ** 2 + 0.5 * 3e-5 * s.planet**2
    assert ps.kinetic_energy(STAGE, sun, carrier) == pytest.approx(energy, rel=1e-7)
    assert ps.kinetic_energy(STAGE, np.ones((4, 1)), np.ones(3)).shape == (4, 3)


def test_power_is_the_growth_of_energy():
    a = ps.free_accelerations(STAGE, 0.3, -0.8, 0.5)
    sun, carrier, t = 5.0, -2.0, 1e-6
    s = ps.speeds(24, 60, sun=sun, carrier=carrier)
    growth = (
        ps.kinetic_energy(STAGE, sun + a.sun * t, carrier + a.carrier * t)
        - ps.kinetic_energy(STAGE, sun - a.sun * t, carrier - a.carrier * t)
    ) / (2 * t)
    assert growth == pytest.approx(float(0.3 * s.sun - 0.8 * s.carrier + 0.5 * s.ring), rel=1e-7)


def test_conditions():
    good = ps.conditions(24, 18, 60, 3)
    assert good.coaxial and good.even and good.neighbours
    assert good.neighbour_margin == pytest.approx(42 * math.sqrt(3) / 2 - 20)
    assert not ps.conditions(24, 18, 60, 5).even
    assert not ps.conditions(24, 18, 59, 3).coaxial
    assert not ps.conditions(18, 60, 138, 4).neighbours
    assert ps.conditions(22, 18, 58, 6).neighbours and not ps.conditions(21, 18, 57, 6).neighbours  # touching counts
    assert ps.conditions(24, 18, 60, 1).neighbours


def test_bad_input_is_named():
    with pytest.raises(MechlabError, match="3 speeds given"):
        ps.speeds(24, 60, sun=1.0, ring=1.0, carrier=1.0)
    with pytest.raises(MechlabError, match="0 torques given"):
        ps.balance(24, 60)
    with pytest.raises(MechlabError, match="planet_teeth"):
        ps.speeds(60, 24, sun=1.0, ring=1.0)
    with pytest.raises(MechlabError, match="sun_inertia"):
        ps.PlanetaryStage(24, 18, 60, 3, -1.0, 0, 0, 0, 0, 0)
    with pytest.raises(MechlabError, match="no inertia"):
        ps.free_accelerations(ps.PlanetaryStage(24, 18, 60, 3, 1.0, 0, 0, 0, 0, 0))
    with pytest.raises(MechlabError, match="sun_teeth"):
        ps.conditions(0, 18, 60, 3)
