"""A planar loop with a tilted axis is refused, or gets a ball joint; spatial loops are left alone."""

from __future__ import annotations

import math

import pytest

from mechlab.errors import MechlabError
from mechlab.mechanism import Builder, Mechanism, revolute
from mechlab.mechanism.structure import structure
from mechlab.mechanism.tilt import tilts

GUESS = {"crank": 1.0, "coupler": -0.5, "rocker": 1.8}


def fourbar(tilt: float) -> Builder:
    """A four-bar whose coupler axis is tilted about x by `tilt` [rad]."""
    b = Builder("tilted", gravity=(0.0, 0.0, -9.81))
    b.bar("crank", revolute("crank", "-y"), 0.1)
    b.bar(
        "coupler", revolute("coupler", (0.0, -math.cos(tilt), -math.sin(tilt))), 0.3, parent="crank", at=(0.1, 0.0, 0.0)
    )
    b.bar("rocker", revolute("rocker", "-y"), 0.25, at=(0.3, 0.0, 0.0))
    b.loop("pin", "coupler", "rocker", (0.3, 0.0, 0.0), (0.25, 0.0, 0.0))
    return b.drive("crank", stiffness=1.0)


def made(b: Builder) -> Mechanism:
    return b.assemble(GUESS, hold=["crank"])


@pytest.mark.parametrize("tilt", [3.67e-6, 1e-4, 1e-3, 1e-2])
def test_a_tilt_is_refused_and_named(tilt: float) -> None:
    with pytest.raises(MechlabError, match="joint 'coupler' is tilted by .* planar loop 'pin'.*balls_for_tilt"):
        made(fourbar(tilt))


def test_the_angle_is_measured() -> None:
    b = fourbar(1e-3)
    (found,) = tilts(b.bodies, b.loops)
    assert found.joint == "coupler" and found.angle == pytest.approx(1e-3, rel=1e-6)


def test_exact_axes_pass() -> None:
    m = made(fourbar(0.0))
    assert structure(m).mobility == 1
    assert len({j.axis for j in m.joints}) == 1  # one shared vector, bit for bit


def test_a_tilted_planar_loop_with_a_ball_joint_moves() -> None:
    m = made(fourbar(1e-3).balls_for_tilt())
    assert m.joint("coupler").kind == "spherical"
    found = structure(m)
    assert found.mobility == 1 and found.idle == ("spin of coupler",) and not found.redundant


def test_a_spatial_loop_is_not_a_tilt() -> None:
    b = fourbar(0.2)
    assert not tilts(b.bodies, b.loops)


def test_a_joint_that_is_named_elsewhere_is_not_replaced() -> None:
    b = fourbar(1e-3).shaft("sum", {"crank": 1, "coupler": 1})
    b.drive("rocker")
    with pytest.raises(MechlabError, match="no binary link at its ends"):
        b.balls_for_tilt()
