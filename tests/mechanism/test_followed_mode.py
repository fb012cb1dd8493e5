"""The assembly mode of overconstrained loops, followed from pose to pose.

The independent truth is the motion itself: a held joint has a dead point where its value turns back along the path, and nowhere else.
"""

from __future__ import annotations

import numpy as np
import pytest

import mechlab as ml
from mechlab.experiment.assembly_modes import ModeWatch, mode_signs
from mechlab.experiment.findings import kinematic_findings
from mechlab.mechanism import Mechanism, close
from mechlab.mechanism.closing import close_many
from mechlab.mechanism.followed_mode import followed_signs
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_rows import ManyRows


def a_turn(m: Mechanism, count: int = 121) -> Array:
    """(count, nq) poses of a little more than one turn of the drive; they start off the symmetric pose."""
    drive, q, out = m.drives[0].on, m.reference(), []
    for angle in np.linspace(0.013, 0.2 + 2.0 * np.pi, count):
        found = close(m, q, {drive: angle})
        assert found.closed
        q = found.q
        out.append(q)
    return np.array(out)


@pytest.mark.parametrize("name", ["schatz", "bent_pin", "goldberg"])
def test_the_sign_changes_where_the_held_joint_turns_back_and_nowhere_else(name: str) -> None:
    m = ml.load(name).mechanism(None)
    poses = a_turn(m)
    backs = 0
    for joint in m.joints:
        signs = mode_signs(m, poses, [joint.name])
        assert np.all(signs != 0.0)
        back = np.flatnonzero(np.diff(np.sign(np.diff(m.value(joint.name, poses)))))
        changes = np.flatnonzero(np.diff(signs))
        # differences of values turn back between two steps, the sign in one of these steps
        assert len(back) == len(changes) and np.all((changes == back) | (changes == back + 1))
        backs += len(back)
    assert backs >= (0 if name == "goldberg" else 4)


def test_a_watch_stops_at_the_first_dead_point_in_whatever_pieces_it_sees_the_run() -> None:
    m = ml.load("schatz").mechanism(None)
    poses = a_turn(m)
    value = m.value("theta_4", poses)
    dead = int(np.argmax(np.abs(value - value[0])))  # theta_4 rocks once to and fro in a turn
    for size in (1, 7, len(poses)):
        watch = ModeWatch(m, ["theta_4"])
        first = [watch.first_change(poses[i : i + size]) for i in range(0, len(poses), size)]
        k = next(i for i, x in enumerate(first) if x is not None)
        assert abs(size * k + first[k] - dead) <= 1
        assert all(x is None for x in [ModeWatch(m, ["theta_1"]).first_change(poses)])


def test_a_run_warns_of_dead_points_only() -> None:
    m = ml.load("schatz").mechanism(None)
    poses = a_turn(m)
    rates = np.zeros((len(poses), m.nv))
    for held, changes in (("theta_1", 0.0), ("theta_4", 2.0), ("theta_5", 2.0)):
        found = {x.name: x for x in kinematic_findings(m, poses, rates, [held])}["assembly_mode"]
        assert found.value == changes and found.severity == ("warning" if changes else "ok")


def test_paths_side_by_side_are_followed_each_for_itself() -> None:
    m = ml.load("schatz").mechanism(None)
    poses = a_turn(m)
    both = mode_signs(m, np.stack([poses, poses[::-1]]), ["theta_4"])
    for signs, path in zip(both, (poses, poses[::-1]), strict=True):
        assert np.array_equal(signs, mode_signs(m, path, ["theta_4"]))
        assert np.count_nonzero(np.diff(signs)) == 2


def test_many_poses_of_a_turn_close_from_one_pose() -> None:
    """Every pose of the turn is in the mode of the first; beyond the dead point of theta_4 there is no pose in it."""
    m = ml.load("schatz").mechanism(None)
    poses = a_turn(m, 61)
    found = close_many(ManyRows(m, ["theta_1"]), poses[0], (m.value("theta_1", poses),))
    assert found.closed.all()
    np.testing.assert_allclose(found.q, poses, atol=1e-9)
    start = poses[10]
    reach = m.value("theta_4", poses)
    wanted = np.linspace(reach[10], reach[np.argmax(np.abs(reach - reach[0]))], 9)[:-1]
    found = close_many(ManyRows(m, ["theta_4"]), start, (wanted,))
    assert found.closed.all() and np.all(np.diff(m.value("theta_1", found.q)) > 0.0)


def test_signs_by_hand() -> None:
    """Two rows that repeat each other, (c, s, 0) turning about z: they leave (-s, c, 0) and z free; (x, z) held, det = -s."""
    angles = np.linspace(0.2, 2.0 * np.pi + 0.1, 40)
    row = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    rows = np.stack([row * np.cos(3.0 * angles)[:, None], row * np.sin(3.0 * angles)[:, None], 0.0 * row], axis=1)
    signs = followed_signs(rows, np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    np.testing.assert_array_equal(signs * signs[0], np.sign(np.sin(angles)))
    assert not followed_signs(rows, np.array([[1.0, 0.0, 0.0]])).any()  # one held joint does not fix two freedoms
