"""Particles against tensors, and that the check of masses, momenta, energy and power sees what it is there for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mechlab.analytic.linkage import Linkage
from mechlab.errors import MechlabError
from mechlab.kit.mass_check import Particles, State, compare, rod, solid, spread_of
from mechlab.kit.planar_build import Style, mechanism_of
from mechlab.kit.planar_mass import compare_planar, rods
from mechlab.mechanism import Builder, Inertia, Mechanism, Spring, prismatic, revolute
from mechlab.mechanism.geometry import axis_rotation


def summed(p: Particles) -> Inertia:
    """Mass, centre and tensor of particles."""
    centre = p.mass @ p.place / np.sum(p.mass)
    t = sum(m * (x @ x * np.eye(3) - np.outer(x, x)) for m, x in zip(p.mass, p.place - centre, strict=True))
    return Inertia(float(np.sum(p.mass)), tuple(centre), (t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2]))


@pytest.mark.parametrize(
    ("particles", "tensor"),
    [
        (rod(3.0, (0.1, 0.2, -0.3), (0.9, -0.4, 0.5), (0, 0, 0), (0, 0, 0), 0.07),
         Inertia.rod(3.0, (0.1, 0.2, -0.3), (0.9, -0.4, 0.5), 0.07)),
        (solid(2.0, (1, 2, 3), np.array([0.3, 0.5, 0.2]) / np.sqrt(12.0)), Inertia.box(2.0, 0.3, 0.5, 0.2, (1, 2, 3))),
        (solid(2.0, (0, 0, 1), (0.1, 0.1, 0.4 / np.sqrt(12.0))), Inertia.cylinder(2.0, 0.2, 0.4, com=(0, 0, 1))),
        (solid(5.0, (0, 0, 0), spread_of(5.0, (0.3, 0.4, 0.6))), Inertia(5.0, (0, 0, 0), (0.3, 0.4, 0.6, 0, 0, 0))),
        (solid(4.0, (0.5, 0, 0)) + solid(4.0, (-0.5, 0, 0)), Inertia(8.0, (0, 0, 0), (0.0, 2.0, 2.0, 0, 0, 0))),
    ],
)  # fmt: skip
def test_particles_have_the_inertia_of_the_part(particles: Particles, tensor: Inertia) -> None:
    found = summed(particles)
    np.testing.assert_allclose([found.mass, *found.com], [tensor.mass, *tensor.com], atol=1e-13)
    np.testing.assert_allclose(found.matrix(), tensor.matrix(), atol=1e-13)


def test_turning_particles_have_the_momentum_of_the_part() -> None:
    axes = axis_rotation([0.6, 0.0, 0.8], 0.7)
    moments, turn, speed = np.array([0.3, 0.4, 0.6]), np.array([1.0, -2.0, 0.5]), np.array([0.2, 0.1, -0.4])
    p = solid(5.0, (1.0, 2.0, 3.0), spread_of(5.0, moments), axes, speed, turn)
    tensor = axes @ np.diag(moments) @ axes.T
    np.testing.assert_allclose(p.mass @ p.velocity, 5.0 * speed, atol=1e-13)
    spin = p.mass @ np.cross(p.place - (1.0, 2.0, 3.0), p.velocity)
    np.testing.assert_allclose(spin, tensor @ turn, atol=1e-13)
    energy = 0.5 * (5.0 * speed @ speed + turn @ tensor @ turn)
    assert 0.5 * p.mass @ np.sum(p.velocity**2, axis=1) == pytest.approx(energy, rel=1e-13)


SPRING = Spring("spring", "ground", "block", (0.0, 0.3, 0.0), stiffness=40.0, damping=3.0, rest_length=0.2)


def wagon() -> Mechanism:
    """A block on a rail along x with a leaning rod on it, held by a spring and damper from a post."""
    b = Builder("wagon", gravity=(0.0, 0.0, -9.81))
    b.body("block", prismatic("x", "x", zero=0.1), inertia=Inertia.box(2.0, 0.3, 0.2, 0.1))
    b.body(
        "rod",
        revolute("tilt", "y", armature=0.02),
        parent="block",
        inertia=Inertia.rod(1.5, (0, 0, 0), (0.1, 0.2, 0.5), 0.02),
    )
    b.frame("tip", "rod", (0.1, 0.2, 0.5)).shaft("twice", {"tilt": 2})
    return replace(b.build(), springs=(SPRING,))


def rolling() -> State:
    """The wagon at a moving state; the block's placement is 0, so that x counts from there."""
    x, tilt, speed, rate = 0.4, 0.7, 0.6, -1.1
    c, s = np.cos(tilt), np.sin(tilt)
    at = np.array([x - 0.1, 0.0, 0.0])
    arm = np.array([0.1 * c + 0.5 * s, 0.2, -0.1 * s + 0.5 * c])
    going = np.array([speed, 0.0, 0.0])
    tip = going + np.cross((0.0, rate, 0.0), arm)
    # The rod turns about y, along which it leans: it has spin about itself, which its ends do not tell.
    u = arm / np.linalg.norm(arm)
    slender = rod(1.5, at, at + arm, going, tip)
    axes = np.linalg.svd(u[None])[2].T
    thick = solid(
        1.5,
        (at + at + arm) / 2,
        (np.linalg.norm(arm) / np.sqrt(12.0), 0.01, 0.01),
        axes,
        (going + tip) / 2,
        (0, rate, 0),
    )
    assert summed(slender).com == pytest.approx(summed(thick).com)
    box = solid(2.0, at, np.array([0.3, 0.2, 0.1]) / np.sqrt(12.0), velocity=going)
    way = at - np.array([0.0, 0.3, 0.0])
    length = float(np.linalg.norm(way))
    longer = float(way @ going) / length
    return State(
        {"x": x, "tilt": tilt, "twice": 2 * tilt}, {"x": speed, "tilt": rate, "twice": 2 * rate}, box + thick, {"tip": at + arm},
        (0.0, 0.0, -9.81), 2, rotors=0.5 * 0.02 * rate**2, stored=40.0 * (length - 0.2) * longer, lost=3.0 * longer**2,
    )  # fmt: skip


def test_a_right_mechanism_passes() -> None:
    found = compare([(wagon(), rolling())])
    assert found.passed, found.note
    assert set(found.values) == {"numpy", "pinocchio", "mujoco"}


def _body(m: Mechanism, k: int, **changes: object) -> Mechanism:
    bodies = list(m.bodies)
    bodies[k] = replace(bodies[k], **changes)
    return replace(m, bodies=tuple(bodies))


def _inertia(m: Mechanism, k: int, **changes: object) -> Mechanism:
    return _body(m, k, inertia=replace(m.bodies[k].inertia, **changes))


WRONG = {
    "mass": lambda m: _inertia(m, 0, mass=2.2),
    "centre of mass": lambda m: _inertia(m, 1, com=(0.05, 0.1, 0.251)),
    "inertia tensor": lambda m: _inertia(m, 0, tensor=tuple(m.bodies[0].inertia.tensor[k] for k in (1, 0, 2, 3, 4, 5))),
    "power of gravity and springs": lambda m: replace(m, gravity=(0.0, 0.0, 9.81)),
    "power of dampers": lambda m: replace(m, springs=(replace(SPRING, damping=4.0),)),
    "kinetic energy": lambda m: _body(m, 1, joints=(replace(m.bodies[1].joints[0], armature=0.04),)),
    "points": lambda m: replace(m, frames=(replace(m.frames[0], body="block"),)),
    "shafts": lambda m: replace(m, shafts=(replace(m.shafts[0], zero=0.1),)),
}


@pytest.mark.parametrize("quantity", WRONG)
def test_what_is_wrong_is_named(quantity: str) -> None:
    wrong = WRONG[quantity](wagon())
    found = compare([(wrong, rolling())])
    assert not found.passed and f"{quantity} (" in found.note


@pytest.mark.parametrize(
    "change", [{"stiffness": 44.0}, {"rest_length": 0.22}, {"point_a": (0.0, 0.31, 0.0)}], ids=lambda x: next(iter(x))
)
def test_springs_are_felt(change: dict[str, object]) -> None:
    wrong = replace(wagon(), springs=(replace(SPRING, **change),))
    assert "power of gravity and springs" in compare([(wrong, rolling())]).note


def test_a_coordinate_counted_from_another_pose_is_seen() -> None:
    state = replace(rolling(), values={"x": 0.1, "tilt": 0.0, "twice": 0.0}, is_reference=True)
    turned = _body(wagon(), 1, joints=(replace(wagon().bodies[1].joints[0], zero=2 * np.pi),))
    said = [compare([(m, state)]).note for m in (wagon(), turned)]
    assert "coordinates" not in said[0] and "coordinates (numpy" in said[1]


def test_a_name_that_the_closed_form_leaves_out_is_told() -> None:
    with pytest.raises(MechlabError, match="no points of tip"):
        compare([(wagon(), replace(rolling(), points={}))])


# -- planar linkages -----------------------------------------------------------------------------------------------------

STYLE = Style(1.3, 0.4, 9.81, 0.03)


def oldham() -> Linkage:
    """A crank and a block where two guides cross, one of them on the crank (PRP)."""
    chain = Linkage("crossing").pivot("O", 0.0, 0.0).crank("crank", "O", "A", 0.2)
    return chain.guide_on("arm", "crank", 0.3, 0.05).guide("line", 0.3, 0.1, 1.4, 0.02).prp("X", ("arm", "line"))


def yoke() -> Linkage:
    """A Scotch yoke whose cross slide leans (RPP)."""
    chain = Linkage("yoke").pivot("O", 0.0, 0.0).crank("crank", "O", "A", 0.2).guide("line", 0.0, 0.5, 0.1, 0.03)
    return chain.rpp("yoke", "A", "line", 1.3)


def press() -> Linkage:
    """A rod whose end slides on a turning crank's guide (RRP), and a slotted lever with a point (RPR)."""
    chain = Linkage("press").pivot("O", 0.0, 0.0).pivot("Q", 0.4, 0.1).crank("crank", "O", "A", 0.1)
    chain = chain.rpr("lever", "Q", "A", 0.02).point("T", "lever", 0.5, 0.2).guide_on("slot", "lever", 1.2, 0.05)
    return chain.pivot("R", 0.2, -0.3).rrp("B", "rod", "R", "slot", 0.9)


@pytest.mark.parametrize("make", [oldham, yoke, press])
def test_linkages_of_every_slider(make: Callable[[], Linkage]) -> None:
    chain = make()
    m = mechanism_of(chain, {"crank": 0.5}, STYLE)
    found = compare_planar(m, chain, [{"crank": (a, 1.3, 0.0)} for a in (0.5, 0.9)], STYLE)
    assert found.passed, found.note


def test_a_slotted_link_without_a_point_has_no_length() -> None:
    chain = (
        Linkage("lever").pivot("O", 0.0, 0.0).pivot("Q", 0.4, 0.1).crank("crank", "O", "A", 0.1).rpr("lever", "Q", "A")
    )
    with pytest.raises(MechlabError, match="how long"):
        list(rods(chain))
