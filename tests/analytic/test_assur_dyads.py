"""Dyads against finite differences (moving pins and guides), against other solvers, and at their limits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mechlab.analytic import assur, fourbar
from mechlab.analytic.assur import Dyad, Guide, Point, Scalar
from mechlab.errors import MechlabError, NoSolution

STEP = 1e-4


def moving_point(t: np.ndarray, x: float, y: float, size: float, w: float) -> Point:
    """A point on an ellipse, with exact derivatives."""
    p = x + size * np.cos(w * t) + 1j * (y + 0.7 * size * np.sin(w * t))
    v = -size * w * np.sin(w * t) + 0.7j * size * w * np.cos(w * t)
    a = -size * w * w * np.cos(w * t) - 0.7j * size * w * w * np.sin(w * t)
    return Point(p, v, a)


def moving_guide(t: np.ndarray, x: float, y: float, angle: float, offset: float) -> Guide:
    turn = Scalar(angle + 0.3 * np.sin(1.1 * t), 0.33 * np.cos(1.1 * t), -0.363 * np.sin(1.1 * t))
    return Guide(moving_point(t, x, y, 0.1, 1.7), turn, offset)


def rrr(mode: int) -> Callable[[np.ndarray], Dyad]:
    return lambda t: assur.rrr(moving_point(t, 0.0, 0.0, 0.2, 1.3), moving_point(t, 1.0, 0.2, 0.1, 0.9), 0.9, 0.7, mode)


def rrp(mode: int) -> Callable[[np.ndarray], Dyad]:
    return lambda t: assur.rrp(moving_point(t, 0.0, 0.0, 0.2, 1.3), moving_guide(t, 0.1, 0.3, 0.2, 0.05), 0.9, mode)


def rpr(mode: int) -> Callable[[np.ndarray], Dyad]:
    return lambda t: assur.rpr(moving_point(t, 0.0, 0.0, 0.2, 1.3), moving_point(t, 1.0, 0.5, 0.1, 0.8), 0.15, mode)


def rpp(mode: int) -> Callable[[np.ndarray], Dyad]:
    return lambda t: assur.rpp(moving_point(t, 0.5, 0.4, 0.2, 1.3), moving_guide(t, 0.0, 0.0, 0.2, 0.1), 1.1 * mode)


def true_prp(t: np.ndarray) -> Dyad:
    return assur.prp(moving_guide(t, 0.0, 0.0, 0.2, 0.1), moving_guide(t, 1.0, 0.2, 1.7, -0.1))


@pytest.mark.parametrize("mode", [1, -1])
@pytest.mark.parametrize("dyad", [rrr, rrp, rpr, rpp])
def test_rates_and_accelerations_are_derivatives(
    dyad: Callable[[int], Callable[[np.ndarray], Dyad]], mode: int
) -> None:
    _derivatives(dyad(mode))


def test_rates_of_crossing_guides_are_derivatives() -> None:
    _derivatives(true_prp)


def _derivatives(solve: Callable[[np.ndarray], Dyad]) -> None:
    t = np.linspace(0.0, 3.0, 31)
    here, ahead, behind = (solve(t + h).require() for h in (0.0, STEP, -STEP))
    assert np.max(np.abs((ahead.joint.p - behind.joint.p) / (2 * STEP) - here.joint.v)) < 1e-6
    assert np.max(np.abs((ahead.joint.v - behind.joint.v) / (2 * STEP) - here.joint.a)) < 1e-6
    for kind in ("angles", "slides"):
        for a, b, c in zip(getattr(here, kind), getattr(ahead, kind), getattr(behind, kind), strict=True):
            step = (b.x - c.x + np.pi) % (2 * np.pi) - np.pi if kind == "angles" else b.x - c.x
            # Central differences of step 1e-4: truncation 1e-8 x third derivative.
            assert np.max(np.abs(step / (2 * STEP) - a.v)) < 1e-6
            assert np.max(np.abs((b.v - c.v) / (2 * STEP) - a.a)) < 1e-6


@pytest.mark.parametrize("mode", [1, -1])
def test_rrr_is_the_fourbar(mode: int) -> None:
    phi = np.linspace(-3.0, 3.0, 41)
    pin = assur.driver(assur.fixed(), 0.1, phi, 1.3, -0.4)
    dyad = assur.rrr(pin, assur.fixed(0.3, 0.0), 0.3, 0.25, mode)
    other = fourbar.solve(0.1, 0.3, 0.25, 0.3, phi, 1.3, -0.4, mode)
    for turn, name in zip(dyad.angles, ("coupler", "rocker"), strict=True):
        assert np.max(np.abs(turn.x - getattr(other, f"{name}_angle"))) < 1e-12
        assert np.max(np.abs(turn.v - getattr(other, f"{name}_rate"))) < 1e-12
        assert np.max(np.abs(turn.a - getattr(other, f"{name}_accel"))) < 1e-11
    assert np.max(np.abs(np.abs(dyad.quality) - np.sin(other.transmission_angle))) < 1e-12


def test_mode_plus_is_the_clockwise_triangle() -> None:
    a, c = assur.fixed(0.0, 0.0), assur.fixed(1.0, 0.0)
    b = assur.rrr(a, c, 0.8, 0.7, 1).joint.p
    assert b.imag > 0  # left of A -> C
    assert np.imag(np.conj(b - a.p) * (c.p - a.p)) < 0  # A, B, C clockwise


def test_lengths_that_do_not_meet_are_marked_and_raised() -> None:
    dyad = assur.rrr(assur.fixed(), assur.fixed([0.9, 1.5], 0.0), 0.5, 0.6)
    assert dyad.assembles.tolist() == [True, False]
    assert dyad.gap[1] == pytest.approx(0.4)
    with pytest.raises(NoSolution, match="largest gap is 0.4 m"):
        dyad.require()


def test_a_dead_centre_gives_no_rates() -> None:
    pin = assur.driver(assur.fixed(), 0.1, 0.0, 1.0)
    dyad = assur.rrr(pin, assur.fixed(0.6, 0.0), 0.3, 0.2)
    assert dyad.assembles and not dyad.regular and np.isnan(dyad.angles[0].v)
    with pytest.raises(NoSolution, match="dead centre"):
        dyad.require()


def test_bad_input_is_named() -> None:
    with pytest.raises(MechlabError, match="RRR: l1"):
        assur.rrr(assur.fixed(), assur.fixed(1.0), 0.0, 1.0)
    with pytest.raises(MechlabError, match="mode must be"):
        assur.rrp(assur.fixed(), assur.fixed_guide(), 1.0, 2)
    with pytest.raises(MechlabError, match="parallel"):
        assur.rpp(assur.fixed(), assur.fixed_guide(), np.pi)
    with pytest.raises(MechlabError, match="finite"):
        assur.fixed(np.nan, 0.0)


def parallelogram(c: float) -> Callable[[np.ndarray], Dyad]:
    return lambda phi: assur.rrr(assur.driver(assur.fixed(), 0.1, phi, 1.0), assur.fixed(0.3, 0.0), 0.3, c)


STEPS = [1.0, 2.5, 5.0, 7.0, 10.0, 20.0]


@pytest.mark.parametrize("step", STEPS)
def test_a_parallelogram_stops_at_its_change_point(step: float) -> None:
    with pytest.raises(assur.ChangePoint) as caught:
        assur.follow_dyad(parallelogram(0.1), np.radians(np.arange(10.0, 270.1, step)))
    assert caught.value.at == pytest.approx(np.pi, abs=1e-6) and caught.value.exit_code == 3


@pytest.mark.parametrize("step", STEPS)
def test_a_near_parallelogram_stays_in_its_mode(step: float) -> None:
    phi = np.radians(np.arange(10.0, 270.1, step))
    found = assur.follow_dyad(parallelogram(0.1001), phi)
    # Antiparallel on the far side: the rocker stands at +126.9 deg where the crank is at -90 deg.
    assert np.all(found.quality > 0.0)
    phi_end = float(np.degrees(phi[-1]))
    end = assur.follow_dyad(parallelogram(0.1001), np.radians([10.0, phi_end])).angles[1].x[-1]
    assert found.angles[1].x[-1] == pytest.approx(end, abs=1e-14)  # whatever the steps between
    assert float(np.degrees(end)) == pytest.approx(126.87, abs=0.01) or phi_end < 270.0


@pytest.mark.parametrize("step", STEPS)
def test_a_crank_that_cannot_pass_is_told_whatever_the_step(step: float) -> None:
    with pytest.raises(NoSolution, match="between 3.08995036 and 3.19323494"):
        assur.follow_dyad(parallelogram(0.0999), np.radians(np.arange(10.0, 270.1, step)))
