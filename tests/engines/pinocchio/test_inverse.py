"""Assembly and inverse kinematics: against closed forms, at the boundary, out of reach, on the wrong side."""

import numpy as np
import pytest
from random_mechanisms import random_mechanism
from samples import fourbar, planetary, scara

from mechlab.engines.pinocchio.closer import Closer
from mechlab.engines.pinocchio.inverse import assemble
from mechlab.errors import MechlabError
from mechlab.mechanism import ConstraintSet, Status, TreeKinematics, close, integrate
from mechlab.mechanism.geometry import axis_rotation


def tip(m, q, frame="tip"):
    tree = TreeKinematics(m, q)
    rotation, origin = tree.pose(m.frame(frame).body)
    return origin + rotation @ m.frame(frame).placement.translation


def test_two_link_arm_reaches_points_in_its_mode():
    m = scara()
    rng = np.random.default_rng(2)
    for _ in range(20):
        angle, reach = rng.uniform(-1.2, 1.2), rng.uniform(0.15, 0.45)
        target = reach * np.array([np.cos(angle), np.sin(angle)])
        found = assemble(m, {"tip_x": target[0], "tip_y": target[1]}, steps=10)
        assert found.status is Status.SOLVED and found.residual < 1e-11
        elbow = np.arccos((reach**2 - 0.3**2 - 0.2**2) / (2 * 0.3 * 0.2))
        assert m.value("elbow", found.q) == pytest.approx(elbow, abs=1e-9)
        assert np.allclose(tip(m, found.q)[:2], target, atol=1e-11)


def test_out_of_reach_says_so_and_by_how_much():
    m = scara()
    found = assemble(m, {"tip_x": 0.6, "tip_y": 0.0})
    assert found.status is Status.OUT_OF_REACH and found.status.exit_code == 4
    assert np.all(np.isfinite(found.q)) and found.gap and "tip_x" in found.sentence
    inside = assemble(m, {"tip_x": 0.05, "tip_y": 0.0})
    assert inside.status is Status.OUT_OF_REACH


def test_a_hair_outside_is_out_of_reach_and_a_hair_inside_is_solved():
    m = scara()
    for gap in (1e-4, 1e-6, 1e-8):
        outside = assemble(m, {"tip_x": 0.5 + gap, "tip_y": 0.0})
        assert outside.status is Status.OUT_OF_REACH, gap
        inside = assemble(m, {"tip_x": 0.5 - gap, "tip_y": 0.0})
        assert inside.closed, gap
        assert abs(tip(m, inside.q)[0] - 0.5 + gap) < 1e-11


def test_the_stretched_arm_is_on_the_boundary():
    m = scara()
    found = assemble(m, {"tip_x": 0.5, "tip_y": 0.0})
    assert found.status is Status.BOUNDARY and found.singularities == ("serial",) and found.closed
    assert (
        np.allclose(tip(m, found.q)[:2], (0.5, 0.0), atol=1e-11)
        and "singular" in found.sentence
        and found.status.exit_code == 0
    )


def test_fourbar_against_the_numpy_closure_and_its_toggle():
    m = fourbar()
    for angle in np.linspace(0.0, 6.0, 13):
        a = assemble(m, {"crank_angle": angle}, steps=10)
        b = close(m, None, {"crank_angle": angle}, steps=10)
        assert a.status is Status.SOLVED and np.allclose(a.q, b.q, atol=1e-10)
    top = np.arccos((0.25**2 + 0.3**2 - 0.4**2) / (2 * 0.25 * 0.3))  # crank and coupler in one line
    found = assemble(m, {"rocker_angle": np.pi - top - 1e-9})
    assert found.closed or found.status is Status.OUT_OF_REACH
    beyond = assemble(m, {"rocker_angle": np.pi - top + 0.1}, steps=10)
    assert beyond.status in (Status.OUT_OF_REACH, Status.SOLVED)
    far = assemble(m, {"rocker_angle": 3.1})
    assert far.status is Status.OUT_OF_REACH


def test_no_assembly_for_a_drive_that_cannot_get_there():
    from dataclasses import replace

    from mechlab.mechanism import Drive

    m = replace(fourbar(), drives=(Drive("servo", "rocker_angle"),))
    found = assemble(m, {"rocker_angle": 3.1})
    assert found.status is Status.NO_ASSEMBLY and found.status.exit_code == 4


def test_rotation_targets():
    m = random_mechanism(5, loops=False)
    rng = np.random.default_rng(0)
    goal = integrate(m, m.reference(), 0.3 * rng.normal(size=m.nv))
    tree = TreeKinematics(m, goal)
    rotation, origin = tree.pose(m.frame("tip").body)
    place = m.frame("tip").placement
    target = {"tip_rotation": rotation @ place.rotation}
    point = origin + rotation @ place.translation
    target |= {f"tip_{a}": x for a, x in zip("xyz", point, strict=True)}
    found = assemble(m, target, keep_mode=False, watch=False)
    assert found.closed
    tree.set(found.q)
    r, p = tree.pose(m.frame("tip").body)
    assert np.allclose(r @ place.rotation, target["tip_rotation"], atol=1e-9)
    assert np.allclose(p + r @ place.translation, point, atol=1e-9)


def test_planetary_with_redundant_rows():
    m = planetary()
    found = assemble(m, {"sun": 2.0, "carrier": 0.5})
    assert found.closed
    tree = TreeKinematics(m, found.q)
    assert np.abs(ConstraintSet(m).residual(tree)).max() < 1e-12
    assert m.value("ring", found.q) == pytest.approx(0.5 - (2.0 - 0.5) * 24 / 84, abs=1e-12)
    impossible = assemble(m, {"sun": 2.0, "carrier": 0.5, "ring": 0.0})
    assert impossible.status.exit_code == 4


def test_a_random_start_near_by_comes_back():
    for seed in range(6):
        m = random_mechanism(seed)
        closer = Closer(m, [])
        start = integrate(m, m.reference(), 1e-3 * np.random.default_rng(seed).normal(size=m.nv))
        found = assemble(closer, {}, start, watch=False)
        assert found.closed and np.abs(ConstraintSet(m).residual(TreeKinematics(m, found.q))).max() < 1e-10


def test_wrong_targets_are_told():
    m = scara()
    with pytest.raises(MechlabError, match="quantity 'tip_w' does not exist.*tip_x"):
        assemble(m, {"tip_w": 1.0})
    with pytest.raises(MechlabError, match="finite"):
        assemble(m, {"elbow": np.nan})
    with pytest.raises(MechlabError, match="rotation matrix"):
        assemble(m, {"tip_rotation": 2 * np.eye(3)})
    with pytest.raises(MechlabError, match="expected one number"):
        assemble(m, {"elbow": [1.0, 2.0]})
    with pytest.raises(MechlabError, match="expected a number"):
        assemble(m, {"elbow": "far"})
    with pytest.raises(MechlabError, match="rate of turning"):
        assemble(m, {"tip_wx": 0.0})


def test_rotation_about_the_plane_axis():
    m = scara()
    both = {"tip_rotation": axis_rotation((0, 0, 1), 1.0)}
    found = assemble(m, both, watch=False, keep_mode=False)
    assert found.closed
    assert m.value("shoulder", found.q) + m.value("elbow", found.q) == pytest.approx(1.0, abs=1e-12)
