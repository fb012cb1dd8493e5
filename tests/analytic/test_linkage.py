"""The compositor: chains without equations, every combination of modes, honest refusals."""

from __future__ import annotations

import numpy as np
import pytest

from mechlab.analytic import assur, fourbar
from mechlab.analytic.linkage import BLOCK, Linkage
from mechlab.errors import MechlabError, NoSolution


def rocker() -> Linkage:
    return (
        Linkage("rocker").pivot("O", 0.0, 0.0).pivot("D", 0.3, 0.0)
        .crank("crank", "O", "A", 0.1).rrr("B", ("coupler", "rocker"), ("A", "D"), (0.3, 0.25)).point("P", "coupler", 0.2, 0.5)
    )  # fmt: skip


def shaper() -> Linkage:
    return (
        Linkage("shaper").pivot("O", 0.0, 0.0).pivot("Q", 0.0, -0.25).crank("crank", "O", "A", 0.1).rpr("lever", "Q", "A", 0.02)
        .point("T", "lever", 0.5).guide("line", 0.0, 0.22).rrp("D", "rod", "T", "line", 0.25)
    )  # fmt: skip


def test_a_four_bar_in_one_chain() -> None:
    phi = np.linspace(-3.0, 3.0, 21)
    motion = rocker().solve(crank=(phi, 1.3, -0.4)).require()
    other = fourbar.solve(0.1, 0.3, 0.25, 0.3, phi, 1.3, -0.4)
    assert np.max(np.abs(motion.turns["rocker"].a - other.rocker_accel)) < 1e-12
    angle = other.coupler_angle
    point = 0.1 * np.exp(1j * phi) + 0.2 * np.exp(1j * (angle + 0.5))
    assert np.max(np.abs(motion.points["P"].p - point)) < 1e-14
    assert motion.points["P"].xy().shape == (21, 3, 2)


def test_blocks_are_the_same_as_one_call() -> None:
    n = BLOCK + 7
    phi = np.linspace(0.0, 6.0, n)
    whole = rocker().solve(crank=(phi, 1.0, 0.0)).points["B"].a
    parts = [m.points["B"].a for _, m in rocker().blocks(n, crank=(phi, 1.0, 0.0))]
    assert np.array_equal(np.concatenate(parts), whole)


@pytest.mark.parametrize("chain", [rocker, shaper])
def test_rates_are_derivatives(chain: object) -> None:
    made = chain()  # type: ignore[operator]
    phi, h = np.linspace(-3.0, 3.0, 31), 1e-5
    here, ahead, behind = (made.solve(crank=(phi + d, 1.0, 0.0)) for d in (0.0, h, -h))
    for name, point in here.points.items():
        p1, p0 = ahead.points[name], behind.points[name]
        assert np.max(np.abs((p1.p - p0.p) / (2 * h) - point.v)) < 1e-8
        assert np.max(np.abs((p1.v - p0.v) / (2 * h) - point.a)) < 1e-8


def test_every_combination_of_modes_is_listed_once() -> None:
    found = shaper().modes(crank=0.4)
    assert len(found) >= 2 and len({tuple(c.items()) for c, _ in found}) == len(found)
    points = np.array([m.points["D"].p for _, m in found])
    assert len(np.unique(np.round(points, 9))) == len(found)


def test_class_three_and_four_as_elements() -> None:
    first, second = (0.985, 0.251 * np.exp(1j * np.radians(37.3))), (2.06, 1.3 * np.exp(1j * np.radians(28.1)))
    chain = (
        Linkage("four").pivot("O", 0.0, 0.0).pivot("F", 0.0, -1.08).crank("crank", "O", "A", 0.279)
        .class_four("g", ("l2", "l5", "l3", "l4"), ("A", "F"), first, second, (0.3, 0.554), joints=("C", "D", "B", "E"))
    )  # fmt: skip
    m = chain.solve(crank=(np.linspace(-3.0, 3.0, 13), 1.0, 0.0))
    for a, b, length in (
        ("A", "C", 0.985),
        ("A", "D", 0.251),
        ("C", "B", 0.3),
        ("D", "E", 0.554),
        ("F", "B", 2.06),
        ("F", "E", 1.3),
    ):
        assert np.max(np.abs(np.abs(m.points[a].p - m.points[b].p) - length)) < 1e-13
        relative = m.points[b].v - m.points[a].v
        assert np.max(np.abs(np.real(np.conj(m.points[b].p - m.points[a].p) * relative))) < 1e-13
    with pytest.raises(NoSolution, match="mode \\+2 does not exist at 13 of 13"):
        chain.with_modes({"g": 2}).solve(crank=np.linspace(-3.0, 3.0, 13))
    legs = (
        Linkage("three").pivot("A", -0.4, -0.2).pivot("B", 0.4, -0.2).pivot("C", 0.0, 0.5)
        .class_three("p", ("a", "b", "c", "plate"), ("A", "B", "C"), (0.4, 0.4, 0.4), (0.2, 0.1 + 0.17j))
    )  # fmt: skip
    m = legs.solve()
    for a, b, length in (("A", "p_1", 0.4), ("B", "p_2", 0.4), ("C", "p_3", 0.4), ("p_1", "p_2", 0.2)):
        assert abs(abs(m.points[a].p - m.points[b].p) - length) < 1e-13


def test_guides_on_links_and_cross_slides() -> None:
    yoke = (
        Linkage("yoke")
        .pivot("O", 0.0, 0.0)
        .crank("crank", "O", "A", 0.1)
        .guide("bed", 0.0, 0.0)
        .rpp("yoke", "A", "bed", np.pi / 2)
    )
    phi = np.linspace(0.0, 6.0, 9)
    m = yoke.solve(crank=(phi, 2.0, 0.0))
    assert np.max(np.abs(m.slides["yoke_1"].x - 0.1 * np.cos(phi))) < 1e-15
    assert np.max(np.abs(m.slides["yoke_1"].a + 0.4 * np.cos(phi))) < 1e-14
    arm = (
        Linkage("arm")
        .pivot("O", 0.0, 0.0)
        .crank("crank", "O", "A", 0.1)
        .guide_on("slot", "crank")
        .guide("wall", 0.3, 0.0, np.pi / 2)
    )
    m = arm.prp("X", ("slot", "wall")).solve(crank=(0.5, 1.0, 0.0))
    assert m.points["X"].p == pytest.approx(0.3 + 0.3j * np.tan(0.5))
    assert m.points["X"].v == pytest.approx(0.3j / np.cos(0.5) ** 2)


def test_following_a_mode_stops_where_modes_meet() -> None:
    chain = (
        Linkage("p").pivot("O", 0.0, 0.0).pivot("D", 0.3, 0.0).crank("crank", "O", "A", 0.1)
        .rrr("B", ("coupler", "rocker"), ("A", "D"), (0.3, 0.1))
    )  # fmt: skip
    with pytest.raises(assur.ChangePoint):
        chain.follow("crank", np.radians([10.0, 270.0]))
    motion = rocker().follow("crank", np.radians(np.arange(0.0, 361.0, 5.0)))
    assert np.all(motion.dyads["B"].regular)


def test_names_are_checked() -> None:
    chain = rocker()
    with pytest.raises(MechlabError, match="the name 'B' is used twice"):
        chain.pivot("B", 0.0, 0.0)
    with pytest.raises(MechlabError, match="input 'motor' does not exist"):
        chain.solve(motor=1.0)
    with pytest.raises(MechlabError, match="input 'crank' is missing"):
        chain.solve()
    with pytest.raises(MechlabError, match="point 'Z' does not exist"):
        chain.rrr("Y", ("u", "v"), ("Z", "D"), (1.0, 1.0)).solve(crank=0.0)
    with pytest.raises(MechlabError, match="group with modes 'C' does not exist"):
        chain.with_modes({"C": 1})
    with pytest.raises(NoSolution, match="group 'Y'"):
        chain.rrr("Y", ("u", "v"), ("P", "D"), (0.01, 0.01)).solve(crank=0.0).require()
