"""Sampled laws of cams, Geneva wheels and oval gears against their closed forms, and the drawn contours against their contact."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from scipy.integrate import quad

from mechlab.analytic.cams import LAWS, rise_and_fall, rise_law, roller_contour
from mechlab.analytic.geneva import engaged_from, fastest, slot_law, wheel_law
from mechlab.errors import MechlabError
from mechlab.kit.profiles import cam_curve, geneva_curve, oval_curve, oval_law
from mechlab.shapes import mesh

TURNS = np.linspace(-10.0, 10.0, 20001)
EDGE = 1e-3
"""Nearer than this to a jump of the second derivative either side is right."""


def away(x: np.ndarray, knots: tuple[float, ...]) -> np.ndarray:
    """(n,) places that are not at a knot, whatever the turn."""
    return np.all([np.abs(np.angle(np.exp(1j * (x - k)))) > EDGE for k in knots], axis=0) if knots else np.ones(len(x), dtype=bool)


@pytest.mark.parametrize("law", LAWS)
def test_laws_rise_from_zero_to_one_and_are_integrals_of_each_other(law: str) -> None:
    (start, end), slopes, _ = rise_law(law, [0.0, 1.0])
    assert (start, end) == (0.0, pytest.approx(1.0)) and np.max(np.abs(slopes)) < 1e-12
    for u in (0.3, 0.8):
        for k in (0, 1):
            area = quad(lambda x, k=k: float(rise_law(law, x)[k + 1]), 0.0, u, epsabs=1e-13)[0]
            assert area == pytest.approx(float(rise_law(law, u)[k]), abs=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_cam_curves_are_their_laws(law: str) -> None:
    lift, rise, top, fall = 0.02, 2.0, 0.5, 1.5
    curve = cam_curve(law, lift, rise, top, fall)
    found, wanted = curve.many(TURNS), rise_and_fall(law, TURNS, lift, rise, top, fall)
    inside = away(TURNS, curve.jumps)
    assert np.max(np.abs(found[0] - wanted[0])) < 1e-10 * lift
    assert np.max(np.abs(found[2] - wanted[2])[inside]) < 1e-5 * lift / fall**2
    assert curve.jumps == ((2.0, 2.5, 4.0, 2.0 * math.pi) if law == "harmonic" else ())


@pytest.mark.parametrize("slots", [3, 4, 6, 16])
def test_geneva_curves_are_their_law(slots: int) -> None:
    curve = geneva_curve(slots)
    found, wanted = curve.many(TURNS), wheel_law(slots, TURNS)
    inside = away(TURNS, curve.jumps)
    assert np.max(np.abs(found[0] - wanted[0])) < 2e-11
    assert np.max(np.abs(found[2] - wanted[2])[inside]) < 4e-7 * fastest(slots)[1]
    end = engaged_from(slots)
    np.testing.assert_allclose(curve.jumps, (end, 2.0 * math.pi - end), rtol=1e-15)
    assert curve.rise == pytest.approx(-2.0 * math.pi / slots)


@pytest.mark.parametrize("slots", [3, 4, 6, 16])
def test_the_pin_stands_in_its_slot(slots: int) -> None:
    """The slot of the turned wheel points at the pin; it enters at right angles, where the acceleration is tan(pi / n)."""
    center, crank = 1.0, math.sin(math.pi / slots)
    for a in np.linspace(-engaged_from(slots), engaged_from(slots), 7):
        b = float(geneva_curve(slots).at(float(a))[0])
        way = crank * cmath.exp(1j * a) - center
        assert abs(cmath.phase(-way * cmath.exp(-1j * b))) < 1e-10
    start = -engaged_from(slots)
    way = crank * cmath.exp(1j * start) - center
    assert abs((way * cmath.exp(-1j * start)).real) < 1e-12  # slot and crank at right angles
    assert float(slot_law(slots, start)[2]) == pytest.approx(math.tan(math.pi / slots))


@pytest.mark.parametrize("e", [0.0, 0.3, 0.6])
def test_oval_curves_roll(e: float) -> None:
    curve, a = oval_curve(e), np.linspace(-3.1, 3.1, 5001)
    found, wanted = curve.many(a), oval_law(e, a)
    assert np.max(np.abs(found[0] - wanted[0])) < 1e-10 and np.max(np.abs(found[2] - wanted[2])) < 1e-6
    # equal arcs: radii in the inverse ratio of the rates, r1 + r2 = 2
    r1, r2 = ((1 - e * e) / (1 - s * e * np.cos(x)) for s, x in ((1.0, a), (-1.0, found[0])))
    np.testing.assert_allclose(r1 + r2, 2.0, atol=1e-9)
    np.testing.assert_allclose(-found[1], r1 / r2, atol=1e-7)


@pytest.mark.parametrize("law", LAWS)
def test_the_roller_touches_the_contour_of_its_cam(law: str) -> None:
    """Its distance from the contour in the turned cam is its radius, nowhere less: to the chords of 4000 points, 1e-6 of it."""
    motion, base, roller = (0.02, 2.0, 0.5, 1.5), 0.04, 0.01
    t = 2.0 * math.pi * np.arange(4000) / 4000
    s, slope, _ = rise_and_fall(law, t, *motion)
    outline = roller_contour(t, s, slope, base, roller) @ [1.0, 1.0j]
    for turn in (0.0, 0.7, 1.1, 2.2, 3.3, 5.0):
        lift = float(rise_and_fall(law, np.array([turn]), *motion)[0][0])
        apart = np.abs(outline * cmath.exp(1j * turn) - 1j * (base + roller + lift))
        assert np.min(apart) == pytest.approx(roller, rel=2e-5)


def test_wrong_profiles_are_refused() -> None:
    for make, message in (
        (lambda: cam_curve("trapeze", 0.02, 1.0, 0.5, 1.0), "does not exist"),
        (lambda: cam_curve("poly345", 0.02, 4.0, 0.5, 2.0), "do not fit"),
        (lambda: geneva_curve(2), "at least 3"),
        (lambda: oval_curve(1.0), "from 0 to 0.9"),
        (lambda: mesh("disc_cam", {"base": 0.01, "lift": 0.03, "rise": 0.6, "fall": 0.6, "roller": 0.02, "thickness": 0.01}), "undercut"),
        (lambda: mesh("geneva_wheel", {"slots": 16, "center": 0.1, "pin": 0.009, "thickness": 0.01}), "pin"),
    ):
        with pytest.raises(MechlabError, match=message):
            make()
