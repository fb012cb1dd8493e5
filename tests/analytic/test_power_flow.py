"""Power flow from statics, against textbook formulas worked out by hand; circulation on a graph with a known loop."""

import numpy as np
import pytest

from mechlab.analytic import wolfrom
from mechlab.analytic.power_flow import TrainMesh, circulating_power, efficiency, flow
from mechlab.errors import MechlabError, NoSolution

SUN, CARRIER, PLANET, RING = np.eye(4)
"""Rows over (sun, carrier, planet in carrier, output ring)."""
GROUND_ROW = np.zeros(4)


def mesh(a: int, b: int, ratio: float, total_a: np.ndarray) -> TrainMesh:
    """w_a + ratio w_b = 0 in the carrier (member 2), b the planet (member 3)."""
    return TrainMesh(a, b, 2, 1.0, ratio, total_a - CARRIER, PLANET, total_a, CARRIER + PLANET)


def planetary(zs: int = 24, zp: int = 30, zr: int = 84) -> list[TrainMesh]:
    return [mesh(1, 3, zp / zs, SUN), mesh(0, 3, -zp / zr, GROUND_ROW)]


def wolfrom_meshes(teeth: tuple[int, int, int, int, int]) -> list[TrainMesh]:
    s, p1, r1, p2, r2 = teeth
    return [mesh(1, 3, p1 / s, SUN), mesh(0, 3, -p1 / r1, GROUND_ROW), mesh(4, 3, -p2 / r2, RING)]


def planetary_rates(zs: int = 24, zp: int = 30, zr: int = 84) -> np.ndarray:
    return np.array([1 + zr / zs, 1.0, -zr / zp, 0.0])


def wolfrom_rates(teeth: tuple[int, int, int, int, int]) -> np.ndarray:
    w = wolfrom.speeds(teeth)
    return np.array([float(w.sun), 1.0, float(w.planet) - 1.0, float(w.ring)])


WOLFROM = (22, 44, 110, 44, 116)


@pytest.mark.parametrize("eta", [0.9, 0.98, 1.0])
def test_simple_planetary_is_the_textbook(eta: float) -> None:
    """Ring held, sun drives: eta = (1 - i0 eta0) / (1 - i0), i0 = -z_r / z_s, eta0 both meshes; carrier drives:
    (1 - i0) / (1 - i0 / eta0) (Mueller 1998)."""
    i0, eta0 = -84 / 24, eta**2
    v = planetary_rates()
    ahead = flow(planetary(), v, [eta, eta], [SUN], [1.0], [CARRIER])
    assert -ahead.torques[0] * v[1] / v[0] == pytest.approx((1 - i0 * eta0) / (1 - i0), rel=1e-12)
    back = flow(planetary(), v, [eta, eta], [CARRIER], [1.0], [SUN])
    assert -back.torques[0] * v[0] / v[1] == pytest.approx((1 - i0) / (1 - i0 / eta0), rel=1e-12)
    assert ahead.meshes.toward_b.tolist() == [1.0, -1.0] and back.meshes.toward_b.tolist() == [-1.0, 1.0]
    # rolling power: T_s (w_s - w_c)
    assert ahead.meshes.rolling[0] == pytest.approx(v[0] - v[1], rel=1e-12)


def test_wolfrom_116() -> None:
    """Sun into planet, planet into held ring, output ring back into the planet: from the balance of the planet
    eta r1 l1 + r2 l2 / eta + eta r3 l3 = 0 and l1 + l2 + l3 = 0 (free carrier)."""
    eta, v = 0.98, wolfrom_rates(WOLFROM)
    assert wolfrom.ratio(WOLFROM) == 116
    assert v[0] / v[3] == pytest.approx(116, rel=1e-12)
    found = flow(wolfrom_meshes(WOLFROM), v, [eta] * 3, [SUN], [1.0], [RING])
    r1, r2, r3 = 44 / 22, -44 / 110, -44 / 116
    by_hand = (eta * r1 - r2 / eta) / (r2 / eta - eta * r3)
    assert found.torques[0] == pytest.approx(by_hand, rel=1e-10)
    assert -found.torques[0] / 116 == pytest.approx(0.560, abs=5e-4)
    assert found.meshes.rolling.max() / v[0] == pytest.approx(10.9, abs=0.05)
    back = flow(wolfrom_meshes(WOLFROM), v, [eta] * 3, [RING], [1.0], [SUN])
    assert -back.torques[0] * 116 == pytest.approx(0.236, abs=5e-4)
    lossless = flow(wolfrom_meshes(WOLFROM), v, [1.0] * 3, [SUN], [1.0], [RING])
    assert lossless.torques[0] == pytest.approx(-116, rel=1e-10)


def test_reflected_inertia_is_the_kinetic_energy() -> None:
    w = wolfrom.speeds(WOLFROM)
    v = np.array([float(w.sun), float(w.ring), 1.0, float(w.planet)])
    energy = v**2 @ [2e-5, 2e-3, 1e-4 + 3 * 4e-5, 3 * 1.5e-5]
    got = wolfrom.reflected_inertia(WOLFROM, 3, 2e-5, 2e-3, 1e-4, 1.5e-5, 4e-5) * v[0] ** 2
    assert got == pytest.approx(energy, rel=1e-12)
    with pytest.raises(MechlabError, match="stands still"):
        wolfrom.ratio((22, 44, 110, 44, 110))


@pytest.mark.parametrize("eta", [1.0, 0.95])
def test_power_balances_at_every_mesh_part_and_in_all(eta: float) -> None:
    rng = np.random.default_rng(1)
    for _ in range(30):
        zs, zp = (int(x) for x in rng.integers(12, 60, 2))
        v = planetary_rates(zs, zp, zs + 2 * zp) * rng.uniform(-9, 9)
        found = flow(planetary(zs, zp, zs + 2 * zp), v, [eta, eta], [SUN], [rng.uniform(-2, 2)], [CARRIER])
        f = found.meshes
        size = np.abs(f.power_a).max()
        assert np.allclose(f.power_a + f.power_b + f.power_carrier, -f.loss, atol=1e-12 * size)
        assert f.power_b.sum() == pytest.approx(0.0, abs=1e-12 * size)  # the planet passes all on
        assert f.power_carrier.sum() == pytest.approx(-found.torques[0] * v[1], abs=1e-12 * size)


def test_differential_with_three_torques() -> None:
    """Two freedoms: torques stand as z_s : z_r : -(z_s + z_r) whatever the speeds."""
    meshes = [mesh(1, 3, 30 / 24, SUN), mesh(4, 3, -30 / 84, RING)]
    v = np.array([10.0, 3.0, 0.0, 0.0])
    v[2] = -(v[0] - v[1]) * 24 / 30
    v[3] = v[1] + v[2] * 30 / 84
    found = flow(meshes, v, [1.0, 1.0], [SUN], [24.0], [CARRIER, RING])
    assert found.torques == pytest.approx([-108.0, 84.0], rel=1e-12)


def test_bad_questions() -> None:
    v = planetary_rates()
    with pytest.raises(MechlabError, match="2 external torques are unknown, but only 1"):
        flow(planetary(), v, [1, 1], [SUN], [1.0], [CARRIER, SUN])
    with pytest.raises(MechlabError, match="no equilibrium"):
        flow(planetary(), v, [1, 1], [SUN, CARRIER], [1.0, -4.0], np.zeros((0, 4)))
    with pytest.raises(MechlabError, match="efficiency: expected 2 numbers"):
        flow(planetary(), v, [1.0, 1.2], [SUN], [1.0], [CARRIER])


def test_a_brake_at_the_input_of_a_self_locking_train() -> None:
    """At 0.9 a mesh the Wolfrom train locks: taking power out at the sun has no steady state, driving both ends has."""
    v = wolfrom_rates(WOLFROM)
    with pytest.raises(NoSolution, match="locks itself"):
        flow(wolfrom_meshes(WOLFROM), v, [0.9] * 3, [SUN], [-1.0], [RING])
    back = flow(wolfrom_meshes(WOLFROM), v, [0.9] * 3, [RING], [1.0], [SUN])
    assert back.torques[0] > 0.0  # the sun must help


def test_efficiency_of_powers() -> None:
    assert efficiency([100.0, -90.0]) == pytest.approx(0.9)
    assert efficiency([60.0, 40.0, -70.0, -20.0]) == pytest.approx(0.9)
    assert efficiency([-1.0]) is None


def test_circulation_of_a_known_graph() -> None:
    """Members 0 to 3: 10 W from 0 to 3 through meshes, and a loop 1 - 2 - 1 that carries 4 W on top."""
    members = [[0, 1, 9], [1, 2, 9], [2, 1, 9], [2, 3, 9]]
    powers = [[-10, 10, 0], [-14, 14, 0], [-4, 4, 0], [-10, 10, 0]]
    assert circulating_power(members, powers) == pytest.approx(4.0, rel=1e-9)
    assert circulating_power(members[:1], powers[:1]) == 0.0
    assert circulating_power([[0, 1, 2]], [[0, 0, 0]]) == 0.0
    with pytest.raises(MechlabError, match="meshes, 3"):
        circulating_power([[0, 1]], [[1, 2]])
