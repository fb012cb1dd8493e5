"""The path of a mechanism with one freedom: many places together are the places one after the other."""

from __future__ import annotations

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.own.closed_path import ClosedPath
from mechlab.errors import NoSolution


@pytest.mark.parametrize("name", ["fourbar", "slider_crank", "bricard", "stephenson"])
def test_places_together_are_those_one_after_the_other(name: str) -> None:
    m = ml.load(name).mechanism()
    drive = m.drives[0].on if m.drives else m.joints[0].name
    together, alone = ClosedPath(m, drive), ClosedPath(m, drive)
    phis = together.start.phi + np.linspace(-0.5, 0.6, 49)
    for point in together.at_all(phis):
        one = alone.at(point.phi)
        # Newton leaves 1e-13 in the rows, and the slopes of these mechanisms are below 1e2
        np.testing.assert_allclose(point.q, one.q, atol=1e-11)
        np.testing.assert_allclose(point.u, one.u, atol=1e-10)
        np.testing.assert_allclose(point.du, one.du, atol=1e-8)


def test_places_together_have_the_derivatives_of_the_path() -> None:
    m = ml.load("fourbar").mechanism()
    path, h = ClosedPath(m, "crank_angle"), 1e-3
    phis = path.start.phi + h * np.arange(-100, 101)
    points = path.at_all(phis)
    q = np.array([p.q for p in points])
    first = (q[:-4] - 8.0 * q[1:-3] + 8.0 * q[3:-1] - q[4:]) / (12.0 * h)
    second = (-q[:-4] + 16.0 * q[1:-3] - 30.0 * q[2:-2] + 16.0 * q[3:-1] - q[4:]) / (12.0 * h * h)
    # h^4 times a fifth derivative of about 1e2 is 1e-10; rounding 1e-15 / h^2 is 1e-9
    np.testing.assert_allclose(np.array([p.u for p in points[2:-2]]), first, atol=1e-9)
    np.testing.assert_allclose(np.array([p.du for p in points[2:-2]]), second, atol=1e-7)


def test_a_limit_position_among_the_places_is_told() -> None:
    m = ml.load("fourbar").mechanism()
    path = ClosedPath(m, "rocker_angle")
    low, high = path.limits()
    with pytest.raises(NoSolution, match="cannot be moved beyond"):
        path.at_all(np.linspace(low + 0.01, high + 0.1, 40))
