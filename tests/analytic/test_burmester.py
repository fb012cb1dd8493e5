"""Five positions of a body: the four-bar from which they were taken is found again; all solutions carry the body exactly."""

import numpy as np
import pytest

from mechlab.analytic import fourbar
from mechlab.analytic.burmester import leading_dyads, leading_fourbars
from mechlab.errors import MechlabError


def positions(seed: int) -> tuple[np.ndarray, np.ndarray, complex, complex]:
    """Five positions of a frame on the coupler of a random crank-rocker, and its two body points."""
    rng = np.random.default_rng(seed)
    crank, coupler, rocker, ground = 0.1, *rng.uniform(0.24, 0.34, 2), 0.3
    t = np.sort(rng.uniform(0.0, 2.0, 5))
    found = fourbar.solve(crank, coupler, rocker, ground, t)
    body = complex(*rng.uniform(-0.1, 0.1, 2))  # origin of the moving frame on the coupler
    turn, place = rng.uniform(-1, 1), complex(*rng.uniform(-1, 1, 2))
    angle = found.coupler_angle + turn
    d = crank * np.exp(1j * t) + np.exp(1j * found.coupler_angle) * body
    pin, far = -body * np.exp(-1j * turn), (coupler - body) * np.exp(-1j * turn)
    return place + d, angle, pin, far


@pytest.mark.parametrize("seed", range(12))
def test_the_fourbar_of_the_positions_is_among_the_solutions(seed: int) -> None:
    d, t, pin, far = positions(seed)
    found = leading_dyads(d, t)
    assert 2 <= len(found) <= 4  # Burmester: none, two or four
    for point in (pin, far):
        assert min(abs(x.point - point) for x in found) < 1e-7
    assert any({True} == {abs(f.coupler - abs(pin - far)) < 1e-7, f.same_mode} for f in leading_fourbars(d, t))


@pytest.mark.parametrize("seed", range(6))
def test_every_solution_carries_the_body_through_random_positions(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    d, t = rng.uniform(-1, 1, 5) + 1j * rng.uniform(-1, 1, 5), rng.uniform(-1, 1, 5)
    found = leading_dyads(d, t)
    assert len(found) in (0, 2, 4)
    for x in found:
        lengths = np.abs(d + np.exp(1j * t) * x.point - x.pivot)
        np.testing.assert_allclose(lengths, x.length, rtol=1e-8)


def test_wrong_positions_are_named() -> None:
    with pytest.raises(MechlabError, match="expected 5 places and 5 angles, got 4 and 5"):
        leading_dyads(np.zeros(4), np.zeros(5))
    with pytest.raises(MechlabError, match="positions 2 and 4 are the same"):
        leading_dyads([0, 1, 2, 1, 3], [0, 0.1, 0.2, 0.1, 0.4])
