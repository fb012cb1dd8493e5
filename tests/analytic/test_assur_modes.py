"""Class III and IV groups: every mode, rates, folds, continuation, the closed curve."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mechlab.analytic import assur
from mechlab.catalog.class4_linkage.checks import random_groups
from mechlab.errors import MechlabError
from mechlab.kit.mode_scan import scan_modes

TABLE = np.genfromtxt(Path(__file__).parent / "class4_72_positions.csv", delimiter=",", names=True)


def source(bc: float = 0.3) -> assur.Family:
    """The class IV mechanism of Zinchenko 2009."""
    first = (0.985, 0.251 * np.exp(1j * np.radians(37.3)))
    second = (2.06, 1.3 * np.exp(1j * np.radians(28.1)))
    return lambda phi: assur.class_four(
        assur.driver(assur.fixed(), 0.279, phi, 1.0), assur.fixed(0.0, -1.08), first, second, (bc, 0.554)
    )


def printed_mode(phi: np.ndarray) -> tuple[assur.TwoLoops, np.ndarray, np.ndarray]:
    group = source()(phi)
    modes = assur.all_modes(group)
    k = np.nanargmax(modes.det, axis=1)[:, None]
    return group, np.take_along_axis(modes.theta_t, k, 1)[:, 0], np.take_along_axis(modes.theta_u, k, 1)[:, 0]


def test_the_table_of_72_positions() -> None:
    group, t, u = printed_mode(np.radians(TABLE["phi1_deg"]))
    found = assur.mode_rates(group, t, u)
    third = np.angle(-found.z[0]), np.angle(-found.z[1])
    for name, angle in (("th2", t), ("th3", third[0]), ("th4", third[1]), ("th5", u)):
        miss = (np.degrees(angle) - TABLE[f"{name}_deg"] + 180.0) % 360.0 - 180.0
        assert np.max(np.abs(miss)) < 1e-6  # the file has nine digits
    turns = (found.theta_t, *found.links, found.theta_u)
    for k, turn in enumerate(turns):
        assert np.max(np.abs(turn.v - TABLE[f"w{k + 2}"])) < 1e-8
        assert np.max(np.abs(turn.a - TABLE[f"e{k + 2}"])) < 1e-7
    assert np.max(np.abs(found.det - TABLE["detJ"])) < 1e-9
    assert np.max(np.abs(np.abs(found.z) - group.l)) < 1e-12


def test_rates_are_derivatives() -> None:
    phi, h = np.linspace(-3.0, 3.0, 61), 1e-5
    (g, t, u), (_, t1, u1), (_, t0, u0) = (printed_mode(phi + d) for d in (0.0, h, -h))
    found = assur.mode_rates(g, t, u)
    for turn, ahead, behind in ((found.theta_t, t1, t0), (found.theta_u, u1, u0)):
        assert np.max(np.abs(((ahead - behind + np.pi) % (2 * np.pi) - np.pi) / (2 * h) - turn.v)) < 1e-7
    fast = [assur.mode_rates(source()(phi + d), a, b) for d, a, b in ((h, t1, u1), (-h, t0, u0))]
    for k in ("theta_t", "theta_u"):
        slope = (getattr(fast[0], k).v - getattr(fast[1], k).v) / (2 * h)
        assert np.max(np.abs(slope - getattr(found, k).a)) < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["III", "IV"])
def test_the_polynomial_never_finds_fewer_than_a_scan(kind: str) -> None:
    groups = random_groups(kind, 1000, seed=4)
    modes = assur.all_modes(groups)
    scanned = np.array([scan_modes(groups.take(np.array([k])), 2880) for k in range(1000)])
    assert np.all(modes.count >= scanned)
    assert np.all(modes.count % 2 == 0) and set(np.unique(modes.count)) == {2, 4, 6}
    for k in range(6):
        there = modes.count > k
        some = groups.take(np.flatnonzero(there))
        gap = np.abs(some.residual(modes.theta_t[there, k], modes.theta_u[there, k]))
        assert np.max(gap / some.scale, initial=0.0) < 1e-12


def test_modes_that_exist_are_found() -> None:
    groups = random_groups("IV", 300, seed=9)
    modes = assur.all_modes(groups)
    assert np.all(modes.count >= 2)  # each group was made to close
    # The sum of the signs of det J over all modes of a position vanishes: modes are born and die in pairs.
    assert np.all(np.nansum(np.sign(modes.det), axis=1) == 0)


def test_degenerate_groups_are_solved_too() -> None:
    # A symmetric group where the linear formula for u is 0/0: two equal loops mirrored about the x axis.
    group = assur.two_loops([1.0, 1.0], [0.5, 0.5], [0.4j, -0.4j], [1.2, 1.2])
    modes = assur.all_modes(group)
    assert modes.count >= 2
    residual = group.flat().residual(modes.theta_t[: int(modes.count)], modes.theta_u[: int(modes.count)])
    assert np.max(np.abs(residual)) < 1e-12


def test_the_fold_is_solved_exactly() -> None:
    found = assur.folds(source(0.27))
    assert [f.opens for f in found] == [-1, 1]
    assert np.degrees(found[0].crank) == pytest.approx(-104.261471, abs=1e-6)
    assert np.degrees(found[0].theta_t) == pytest.approx(104.459231, abs=1e-5)
    assert np.degrees(found[0].theta_u) == pytest.approx(100.893700, abs=1e-5)
    assert found[0].crank + found[1].crank == pytest.approx(-np.pi, abs=1e-9)  # the mechanism is symmetric about y
    ((low, high),) = assur.empty_arcs(source(0.27))
    assert (low, high) == (found[0].crank, found[1].crank)
    assert np.max(assur.all_modes(source(0.27)(np.linspace(low + 1e-9, high - 1e-9, 99))).count) == 0


def test_an_arc_narrower_than_a_sample_is_found() -> None:
    # The arc closes near BC = 0.2810; just below it is far narrower than the half degree of the scan.
    widths = {bc: assur.empty_arcs(source(bc)) for bc in (0.28, 0.281, 0.2818, 0.3)}
    assert np.degrees(widths[0.28][0]) == pytest.approx([-94.0891, -85.9109], abs=1e-3)
    assert not widths[0.2818] and not widths[0.3]
    low, high = 0.28, 0.2818
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if assur.empty_arcs(source(middle)) else (low, middle)
    ((a, b),) = assur.empty_arcs(source(low))
    assert 0.0 < np.degrees(b - a) < 0.5


@pytest.mark.parametrize("step", [1, 2.5, 5, 10, 20, 30])
@pytest.mark.parametrize("bc", [0.3, 0.2825])
def test_both_modes_are_followed_round_and_return(bc: float, step: float) -> None:
    crank = np.radians(np.arange(-180.0, 180.0 + step / 2, step))
    modes = assur.all_modes(source(bc)(crank[:1]))
    for k in range(2):
        branch = assur.follow(source(bc), crank, float(modes.theta_t[0, k]), float(modes.theta_u[0, k]))
        assert branch.complete and np.all(np.sign(branch.det) == np.sign(branch.det[0]))
        assert branch.theta_t[-1] == pytest.approx(branch.theta_t[0], abs=1e-9)


@pytest.mark.parametrize("step", [1, 2.5, 5, 10, 20, 30])
def test_a_gap_is_never_crossed(step: float) -> None:
    crank = np.radians(np.arange(-180.0, 180.0 + step / 2, step))
    modes = assur.all_modes(source(0.27)(crank[:1]))
    for k in range(2):
        branch = assur.follow(source(0.27), crank, float(modes.theta_t[0, k]), float(modes.theta_u[0, k]))
        assert branch.fold is not None and branch.crank[-1] <= branch.fold.crank
        assert np.degrees(branch.fold.crank) == pytest.approx(-104.261471, abs=1e-6)


def test_a_start_that_is_no_mode_is_refused() -> None:
    with pytest.raises(MechlabError, match="there are 2 modes"):
        assur.follow(source(), np.array([0.0, 0.1]), 0.0, 0.0)


def test_the_closed_curve_turns_or_swings() -> None:
    for bc, turns, reversals in ((0.3, 1, 0), (0.27, 0, 2)):
        modes = assur.all_modes(source(bc)(np.array([-np.pi])))
        curve = assur.closed_curve(source(bc), -np.pi, float(modes.theta_t[0, 1]), float(modes.theta_u[0, 1]))
        assert curve.net_turns == turns and len(curve.turning_points) == reversals
        residual = source(bc)(curve.crank).residual(curve.theta_t, curve.theta_u)
        assert np.max(np.abs(residual)) < 1e-11
    assert np.degrees(sorted(curve.turning_points)) == pytest.approx([-435.74, -104.26], abs=0.05)
