"""Slides in linkages of any class: against the slider-crank by hand, the closed dyads, three points on three lines, and differences."""

import cmath
import math

import numpy as np
import pytest

from mechlab.analytic import assur
from mechlab.analytic.assur.link_modes import branches, modes_by_trial, modes_of, positions
from mechlab.analytic.assur.links import Links, Slide
from mechlab.errors import MechlabError

R, L, E = 0.1, 0.3, 0.02
CRANK = {"crank": {"O": 0j, "A": complex(R)}}
SLIDER_CRANK = Links({**CRANK, "rod": {"A": 0j, "B": complex(L)}}, {"O": 0j}, ("crank",), {"x": Slide("B", "ground", E * 1j, 5 + 0j)})


@pytest.mark.parametrize("angle", [0.7, 2.0, -1.3, 3.1])
def test_slider_crank_by_hand(angle: float) -> None:
    """x = r cos a +- sqrt(l^2 - (e - r sin a)^2), and its two derivatives."""
    w, dw = 10.0, 3.0
    found = modes_of(SLIDER_CRANK, [[angle]], w, dw)
    assert found.bound == 2 and found.count[0] == 2 and found.lost[0] == 0 and found.infinite[0] == 0
    c, s = math.cos(angle), math.sin(angle)
    for sign in (1.0, -1.0):
        y = E - R * s
        root = sign * math.sqrt(L * L - y * y)
        first = -R * s + y * R * c / root
        second = -R * c + (-R * c * R * c - y * R * s) / root - (y * R * c) ** 2 / root**3
        k = int(np.argmin(np.abs(found.turns[0, :, 1] - (R * c + root))))
        assert found.turns[0, k, 1] == pytest.approx(R * c + root, abs=1e-14)
        assert found.rates[0, k, 1] == pytest.approx(first * w, abs=1e-12)
        assert found.accels[0, k, 1] == pytest.approx(second * w * w + first * dw, abs=1e-10)
        assert math.sin(found.turns[0, k, 0]) == pytest.approx(y / L, abs=1e-14)
        at = positions(SLIDER_CRANK, [[angle]], found.turns)["B"][0, k]
        assert at == pytest.approx(R * c + root + E * 1j, abs=1e-14)


def test_its_branches_are_two_and_it_locks_where_the_rod_is_too_short() -> None:
    found = modes_of(SLIDER_CRANK, np.linspace(0.0, 2.0 * np.pi, 73)[:, None], 1.0)
    assert set(branches(found).ravel()) == {0, 1} and found.count.tolist() == [2] * 73
    short = Links({**CRANK, "rod": {"A": 0j, "B": 0.05 + 0j}}, {"O": 0j}, ("crank",), {"x": Slide("B", "ground", 0j, 1 + 0j)})
    assert modes_of(short, [[0.3], [1.5]]).count.tolist() == [2, 0]  # 0.1 sin 1.5 is beyond 0.05


@pytest.mark.parametrize("offset", [0.0, 0.03])
def test_a_slotted_lever_against_the_dyad_rpr(offset: float) -> None:
    """Quick return: the crank's pin in a slot of a lever, the slot beside its pivot."""
    pivot = -0.25j
    slot = Slide("A", "lever", offset * 1j, 1 + 0j)
    linkage = Links({**CRANK, "lever": {"P": 0j, "T": 0.5 + 0j}}, {"O": 0j, "P": pivot}, ("crank",), {"s": slot})
    angle, w, dw = np.array([0.4, 2.2, 4.0]), 6.0, -2.0
    found = modes_of(linkage, angle[:, None], w, dw)
    crank = assur.driver(assur.fixed(0.0, 0.0), R, angle, w, dw)
    for mode in (1, -1):
        closed = assur.rpr(assur.fixed(pivot.real, pivot.imag), crank, offset, mode)
        for i in range(len(angle)):
            k = int(np.argmin(np.abs(found.turns[i, :, 1] - closed.slides[0].x[i])))
            for array, turn, slide in zip((found.turns, found.rates, found.accels), *(
                (x.x[i], x.v[i], x.a[i]) for x in (closed.angles[0], closed.slides[0])
            ), strict=True):  # fmt: skip
                if array is found.turns:
                    assert cmath.exp(1j * array[i, k, 0]) == pytest.approx(cmath.exp(1j * turn), abs=1e-12)
                else:
                    assert array[i, k, 0] == pytest.approx(turn, abs=1e-9)
                assert array[i, k, 1] == pytest.approx(slide, abs=1e-9)


def test_a_slider_on_a_driven_guide_against_the_dyad_rrp() -> None:
    """A rod from a fixed pin to a slider on a turning bar: the guide is the drive."""
    pin, rod, w, dw = 0.2 + 0.05j, 0.3, 4.0, 2.0
    linkage = Links({"bar": {"O": 0j, "T": 1 + 0j}, "rod": {"P": 0j, "B": complex(rod)}}, {"O": 0j, "P": pin}, ("bar",),
                    {"s": Slide("B", "bar", 0.04j, 1 + 0j)})  # fmt: skip
    angle = np.array([0.3, 1.0, 2.5])
    found = modes_of(linkage, angle[:, None], w, dw)
    guide = assur.Guide(assur.fixed(0.0, 0.0), assur.Scalar(angle, w + 0.0 * angle, dw + 0.0 * angle), 0.04)
    for mode in (1, -1):
        closed = assur.rrp(assur.fixed(pin.real, pin.imag), guide, rod, mode)
        for i in range(len(angle)):
            k = int(np.argmin(np.abs(found.turns[i, :, 1] - closed.slides[0].x[i])))
            assert found.turns[i, k, 1] == pytest.approx(closed.slides[0].x[i], abs=1e-12)
            for j, true in ((1, closed.slides[0]), (0, closed.angles[0])):
                assert [found.rates[i, k, j], found.accels[i, k, j]] == pytest.approx([true.v[i], true.a[i]], abs=1e-9)


def test_three_points_of_a_plate_on_three_lines() -> None:
    """Class III with three slides: Re(conj(n_k) (p + c_k z)) = h_k; without p there remains a cos + b sin = c, of two roots or none."""
    rng, counts = np.random.default_rng(5), []
    for _ in range(30):
        points = rng.standard_normal(3) + 1j * rng.standard_normal(3)
        along = np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, 3))
        through = rng.standard_normal(3) + 1j * rng.standard_normal(3)
        slides = {f"s{k}": Slide(f"P{k}", "ground", through[k], along[k]) for k in range(3)}
        linkage = Links({"plate": {f"P{k}": points[k] for k in range(3)}}, {}, (), slides)
        normal = 1j * along
        rows = np.column_stack([normal.real, normal.imag])
        left = np.linalg.svd(rows)[0][:, 2]  # annihilates p
        turned = np.conj(normal) * points  # Re(turned z) = Re turned cos - Im turned sin
        a, b, c = left @ turned.real, -(left @ turned.imag), left @ (np.conj(normal) * through).real
        found = modes_of(linkage, np.zeros((1, 0)))
        assert found.bound == 6 and found.lost[0] == 0
        size = math.hypot(a, b)
        turns = [] if abs(c) > size else [math.atan2(b, a) + s * math.acos(c / size) for s in (1.0, -1.0)]
        counts.append(len(turns))
        assert found.count[0] == len(turns)
        for t in turns:
            assert np.abs(np.exp(1j * found.turns[0, : len(turns), 0]) - cmath.exp(1j * t)).min() < 1e-9
    assert set(counts) == {0, 2}


CLASS_FOUR = Links(
    {"1": {"O": 0j, "A": 0.25 + 0j}, "2": {"A": 0j, "C": 0.9 + 0j, "D": 0.3 + 0.1j}, "3": {"C": 0j, "B": 0.5 + 0j},
     "5": {"F": 0j, "B": 1.6 + 0j, "E": 0.9 + 0.5j}},
    {"O": 0j, "F": -1.0j}, ("1",), {"s": Slide("D", "5", 0.2j, 1 + 0.3j)},
)  # fmt: skip
"""Two loops that a pin in a slot of an unknown link closes."""


def test_two_loops_with_a_slot_in_a_moving_link() -> None:
    angle, step = np.array([[0.4], [1.9]]), 1e-5
    found, tried = modes_of(CLASS_FOUR, angle, 1.5, 0.7), modes_by_trial(CLASS_FOUR, angle, 1.5, 0.7)
    assert found.count.min() >= 1 and found.lost.max() == 0
    np.testing.assert_array_equal(found.count, tried.count)
    most = found.count.max()
    for mine, other in ((found.turns, tried.turns), (found.rates, tried.rates), (found.accels, tried.accels)):
        np.testing.assert_allclose(mine[:, :most], other[:, :most], atol=1e-8)
    # Rates by central differences of the poses: second order in the step.
    time = np.array([-step, step])
    near = [modes_of(CLASS_FOUR, angle + 1.5 * t + 0.35 * t * t, 1.5 + 0.7 * t, 0.7) for t in time]
    for i in range(2):
        for k in range(found.count[i]):
            ends = [m.turns[i][int(np.argmin(np.abs(m.apart(m.turns[i] - found.turns[i, k])).max(axis=-1)))] for m in near]
            speeds = [m.rates[i][int(np.argmin(np.abs(m.apart(m.turns[i] - found.turns[i, k])).max(axis=-1)))] for m in near]
            np.testing.assert_allclose(found.rates[i, k], found.apart(ends[1] - ends[0]) * [1, 1, 1, found.size] / (2 * step), atol=1e-6)
            np.testing.assert_allclose(found.accels[i, k], (speeds[1] - speeds[0]) / (2 * step), atol=1e-5)


@pytest.mark.parametrize(
    ("slides", "match"),
    [
        ({"s": Slide("B", "nothing", 0j, 1 + 0j)}, "guide of 's'"),
        ({"s": Slide("Z", "ground", 0j, 1 + 0j)}, "point of 's'"),
        ({"s": Slide("B", "rod", 0j, 1 + 0j)}, "off its guide"),
        ({"rod": Slide("B", "ground", 0j, 1 + 0j)}, "two names"),
        ({"s": Slide("B", "ground", 0j, 1 + 0j), "t": Slide("B", "ground", 1j, 1j)}, "constraints too many"),
        ({}, "more drives are needed|hangs on nothing"),
    ],
)  # fmt: skip
def test_bad_slides(slides: dict[str, Slide], match: str) -> None:
    with pytest.raises(MechlabError, match=match):
        modes_of(Links(dict(SLIDER_CRANK.links), {"O": 0j}, ("crank",), slides), [[0.3]])
    with pytest.raises(MechlabError, match="no direction"):
        Slide("B", "ground", 0j, 0j)
