"""A Story refuses what does not fit together, and says what it is."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from mechlab.errors import MechlabError
from mechlab.viewer import Part, Plot, Story, from_poses

TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def changed(story: Story, **changes: Any) -> Story:
    return dataclasses.replace(story, **changes)


def test_a_body_that_stands_still_needs_one_pose(story: Story) -> None:
    assert story.poses.shape == (201, 3, 4, 4)
    np.testing.assert_array_equal(story.poses[:, 0], np.broadcast_to(np.eye(4), (201, 4, 4)))


def test_nothing_in_a_story_can_be_written_to(story: Story) -> None:
    for array in (story.t, story.poses, story.parts[0].vertices, story.parts[0].faces, story.plots[0].series["wheel"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_the_frame_nearest_to_a_time(story: Story) -> None:
    assert (story.frame(), story.frame(1.011), story.frame(99.0)) == (0, 51, 200)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"t": [0.0, 0.0]}, "strictly increasing"),
        ({"poses": np.zeros((201, 2, 4, 4))}, r"poses: expected shape \(201, 3, 4, 4\), got \(201, 2, 4, 4\)"),
        ({"poses": np.zeros((201, 3, 4, 4))}, r"poses\[0, 0\]: not a rigid placement"),
        ({"bodies": ("a", "b", "a")}, "these repeat: a"),
        ({"reconstructed": ("wheell",)}, r"'wheell' does not exist. Did you mean 'wheel'\?"),
        (
            {"plots": (Plot("P", "m", {"s": np.zeros(3)}),)},
            r"plot 'P', series 's': expected shape \(201,\), got \(3,\)",
        ),
        ({"traces": {"tip": np.zeros((201, 2))}}, r"trace 'tip': expected shape \(201, 3\), got \(201, 2\)"),
        ({"health": (("bad", "Hm."),)}, "severity 'bad' of 'Hm.' must be one of ok, warning, error"),
        ({"parts": (Part("leg", "x", TRIANGLE, np.array([[0, 1, 2]])),)}, "body 'leg' does not exist"),
    ],
)
def test_what_does_not_fit_is_named(story: Story, change: dict[str, Any], message: str) -> None:
    with pytest.raises(MechlabError, match=message):
        changed(story, **change)


def test_a_pose_that_is_not_a_number_is_named(story: Story) -> None:
    poses = story.poses.copy()
    poses[7, 1, 0, 3] = np.nan
    with pytest.raises(MechlabError, match=r"poses\[7, 1, 0, 3\] is nan"):
        changed(story, poses=poses)


def test_a_mirror_is_not_a_rigid_placement() -> None:
    with pytest.raises(MechlabError, match="not a rigid placement"):
        from_poses("mirror", {"a": np.diag([1.0, 1.0, -1.0, 1.0])}, ())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vertices": np.zeros((3, 2))}, r"part 'p' of body 'b': vertices: expected shape \(any, 3\), got \(3, 2\)"),
        ({"faces": np.array([[0, 1, 3]])}, r"indices must lie in 0..2, got 0..3"),
        ({"faces": np.zeros((0, 3))}, "at least one face"),
        ({"color": (1.0, 0.0, 2.0, 1.0)}, "must lie in 0..1"),
        ({"placement": 2.0 * np.eye(4)}, "not a rigid placement"),
    ],
)
def test_a_part_is_checked_at_once(change: dict[str, Any], message: str) -> None:
    part = Part("b", "p", TRIANGLE, np.array([[0, 1, 2]]))
    with pytest.raises(MechlabError, match=message):
        dataclasses.replace(part, **change)
