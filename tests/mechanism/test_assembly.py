"""Closing mechanisms: the closed pose is right, the mode is kept, what cannot close says so."""

import math

import numpy as np
import pytest

import mechlab as ml
from mechlab.errors import MechlabError
from mechlab.experiment.assembly_modes import ModeWatch
from mechlab.mechanism import Builder, Status, close, mode_sign, revolute, same_mode
from tests.mechanism.samples import fourbar


def rocker_angle(crank: float, mode: int) -> float:
    """Rocker angle of the sample four-bar by the law of cosines: independent of the solver."""
    bx, by = 0.1 * math.cos(crank), 0.1 * math.sin(crank)
    d = math.hypot(0.3 - bx, by)
    base = math.atan2(by, bx - 0.3)
    return base - mode * math.acos((d * d + 0.25**2 - 0.3**2) / (2 * d * 0.25))


@pytest.mark.parametrize("crank", [-2.5, 0.3, 2.0, 3.1])
def test_close_finds_the_angle_of_the_triangle(crank: float) -> None:
    m = fourbar()
    found = close(m, None, {"crank": crank}, steps=10)
    assert found.closed and found.residual < 1e-13
    difference = float(m.value("rocker", found.q)) - rocker_angle(crank, 1)
    assert abs((difference + math.pi) % (2 * math.pi) - math.pi) < 1e-12


def test_the_mirror_mode_is_another_mode() -> None:
    m = fourbar()
    mirrored = m.reference()
    mirrored[m.q_slice["rocker"]] = rocker_angle(1.0, -1) - m.zero("rocker")
    mirrored[m.q_slice["coupler"]] = -1.5
    found = close(m, mirrored, {"crank": 1.0})
    assert found.closed
    assert abs(float(m.value("rocker", found.q)) - float(m.value("rocker", m.reference()))) > 0.5
    assert not same_mode(m, m.reference(), found.q, ["crank"])
    assert mode_sign(m, found.q, ["crank"]) == -mode_sign(m, m.reference(), ["crank"]) != 0


def test_a_path_that_ends_at_a_fold_says_so() -> None:
    """Driving the rocker past its limit angle: the path ends where two modes meet."""
    m = fourbar()
    limit = math.pi - math.acos((0.3**2 + 0.25**2 - 0.4**2) / (2 * 0.3 * 0.25))
    beyond = close(
        m, None, {"rocker": limit + 0.2 if limit > float(m.value("rocker", m.reference())) else limit - 0.2}, steps=20
    )
    assert beyond.status in (Status.CHANGE_POINT, Status.NOT_CONVERGED) and np.all(np.isfinite(beyond.q))


def test_assemble_takes_the_closed_pose_as_reference() -> None:
    m = fourbar()
    assert np.array_equal(m.reference(), np.zeros(3))
    assert m.zero("crank") == 1.0
    assert math.isclose(m.zero("rocker"), rocker_angle(1.0, 1), abs_tol=1e-12)


def test_lengths_that_cannot_meet_are_told_by_the_name_of_the_loop() -> None:
    b = Builder("short")
    b.bar("crank", revolute("crank"), 0.1).bar("coupler", revolute("coupler"), 0.05, parent="crank", at=(0.1, 0, 0))
    b.bar("rocker", revolute("rocker"), 0.05, at=(0.5, 0, 0))
    b.loop("pin", "coupler", "rocker", (0.05, 0, 0), (0.05, 0, 0))
    with pytest.raises(MechlabError, match=r"short: it does not close: pin\.[xy] stays open"):
        b.assemble()
    with pytest.raises(MechlabError, match=r"not assembled: pin\.[xyz] is open by"):
        b.build()


def test_repeated_rows_change_their_choice_not_the_mode() -> None:
    """A Schmidt coupling has a third link more than needed: all turn together, whatever the angle (parallelograms); asked from
    the reference pose, and step by step. Fixed rows of its loops become dependent at about 1 rad."""
    m = ml.load("schmidt").mechanism(None)
    for angle in (0.9, 1.2, 2.5, 5.0):
        found = close(m, None, {"driver_angle": angle})
        assert found.closed
        assert m.value("follower_angle", found.q) == pytest.approx(m.value("follower_angle", m.reference()) + angle, abs=1e-9)
    q, turn = m.reference(), []
    for angle in np.linspace(0.0, 6.0, 61):
        q = close(m, q, {"driver_angle": angle}).q
        turn.append(q)
    assert ModeWatch(m, ["driver_angle"]).first_change(np.array(turn)) is None


def test_a_jump_to_the_other_mode_is_a_change_where_rows_repeat() -> None:
    """The loop of a planar four-bar has a row that says nothing. Poses of its two modes, mirror images by the law of cosines."""
    m, modes = fourbar(), ([], [])
    for crank in (1.0, 1.05, 1.1):
        for mode, poses in zip((1, -1), modes, strict=True):
            start = m.reference()
            start[m.q_slice["rocker"]] = rocker_angle(crank, mode) - m.zero("rocker")
            start[m.q_slice["coupler"]] = 0.0 if mode == 1 else -1.5
            poses.append(close(m, start, {"crank": crank}).q)
    assert abs(modes[0][0] - modes[1][0]).max() > 0.5
    watch = ModeWatch(m, ["crank"])
    assert watch.first_change(np.array(modes[0])) is None
    assert watch.first_change(np.array(modes[0][:2] + modes[1])) == 2
