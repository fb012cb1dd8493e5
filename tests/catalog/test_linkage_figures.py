"""Figures of the class IV linkage and of the leg: their readings against the numbers of the specification."""

import numpy as np
import pytest

from mechlab.catalog.class4_linkage import figures as class4
from mechlab.catalog.prosthetic_leg import figures as leg
from mechlab.experiment.figure import Drawing


def ours(drawing: Drawing, *words: str) -> object:
    (found,) = [r.ours for r in drawing.readings if all(w in r.what for w in words)]
    return found


def test_ranges_of_the_72_positions() -> None:
    drawing = class4.steps_2_and_5()
    np.testing.assert_allclose(ours(drawing, "theta2", "+1"), [87.62, 140.57], atol=5e-3)
    np.testing.assert_allclose(ours(drawing, "theta5", "+1"), [84.02, 114.14], atol=5e-3)
    assert ours(drawing, "modes at") == [2, 2]


def test_rates_of_the_printed_step_4() -> None:
    """True ranges -.609..+.989 and -.374..+.402; rms errors 1.007 and .636."""
    drawing = class4.step_4()
    for k, (name, ends, rms) in enumerate((("theta2", [-0.609, 0.989], 1.007), ("theta5", [-0.374, 0.402], 0.636))):
        np.testing.assert_allclose(ours(drawing, name, "true range"), ends, atol=5e-4)
        assert ours(drawing, name, "rms")[2] == pytest.approx(rms, abs=5e-4)
        true, literal = drawing.panels[k].curves
        assert len(np.asarray(literal.x)) == 72
        slope = np.gradient(np.unwrap(class4.at(class4.PRINTED, class4.DENSE).angles[name].x), class4.DENSE)
        # a central difference over a degree, of angles with third derivatives below 10
        np.testing.assert_allclose(np.asarray(true.y)[1:-1], slope[1:-1], atol=5e-4)


def test_arcs_without_a_position() -> None:
    drawing = class4.step_10()
    np.testing.assert_allclose(ours(drawing, "without a position", "0.27 m"), [[-104.261471, -75.738529]], atol=1e-6)
    assert ours(drawing, "0.2818 m") == "none"
    assert ours(drawing, "length DE") == pytest.approx(0.0237, abs=5e-5)


def test_what_the_slides_of_the_leg_do() -> None:
    """Specification: 2.7, 10.0 and 12.0 mm."""
    drawing = leg.conclusion()
    found = [ours(drawing, words) for words in ("thigh and shin", "no hitch", "at all")]
    assert np.round(found, 1).tolist() == [2.7, 10.0, 12.0]
    assert ours(leg.figure_3(), "along x") == pytest.approx(0.0, abs=1e-15)
