"""The swept space, the grid step and the fitted camera."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mechlab import api
from mechlab.viewer import Part, Story, from_poses
from mechlab.viewer.framing import THREE_QUARTER, fit_camera, frame_story, nice_step


@pytest.mark.parametrize(("length", "step"), [(0.4, 0.05), (12.0, 1.0), (1.3, 0.2), (2.4e-3, 2e-4), (700.0, 100.0)])
def test_the_grid_step_is_a_nice_number(length: float, step: float) -> None:
    assert nice_step(length) == pytest.approx(step)


def test_the_box_contains_everything_that_moves(story: Story) -> None:
    framing = frame_story(story)
    for part in story.parts:
        poses = story.poses[:, story.bodies.index(part.body)] @ part.placement
        points = np.einsum("nij,kj->nki", poses[:, :3, :3], part.vertices) + poses[:, None, :3, 3]
        # 98 directions stand for all, so a turning corner may stick out by a little.
        assert np.all(points.min(axis=(0, 1)) >= framing.low - 0.02 * framing.radius)
        assert np.all(points.max(axis=(0, 1)) <= framing.high + 0.02 * framing.radius)
    assert framing.floor < framing.low[2]


@pytest.mark.parametrize("toward", [THREE_QUARTER, [0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
@pytest.mark.parametrize("aspect", [0.5, 1.0, 1.8])
def test_the_camera_sees_everything_and_wastes_nothing(story: Story, toward: list[float], aspect: float) -> None:
    points, angle = frame_story(story).points, math.radians(30.0)
    target, distance = fit_camera(points, np.array(toward), aspect, angle)
    back = np.array(toward) / np.linalg.norm(toward)
    right = np.cross([0.0, 0.0, 1.0], back) if abs(back[2]) < 0.99 else np.array([1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    seen = (points - target - distance * back) @ np.stack([right, np.cross(back, right), -back]).T
    fraction = np.abs(seen[:, :2] / seen[:, 2:]).max(axis=0) / (math.tan(angle / 2.0) * np.array([aspect, 1.0]))
    assert 0.85 < fraction.max() <= 1.0


@pytest.mark.parametrize("name", ["quick_return", "class4_linkage", "platform_3rrr", "wolfrom"])
@pytest.mark.parametrize("toward", [THREE_QUARTER, [0.0, -1.0, 0.0], [1.0, 0.2, 0.3]])
def test_no_vertex_of_a_mechanism_is_cropped(name: str, toward: list[float]) -> None:
    """Every vertex, projected as a camera does, lies inside a picture of 4:3."""
    story, half = api.story(name), math.tan(math.radians(15.0))
    target, distance = fit_camera(frame_story(story).points, np.array(toward), 4 / 3, math.radians(30.0))
    back = np.array(toward) / np.linalg.norm(toward)
    right = np.cross([0.0, 0.0, 1.0], back) / np.linalg.norm(np.cross([0.0, 0.0, 1.0], back))
    for part in story.parts:
        pose = story.poses[0, story.bodies.index(part.body)] @ part.placement
        seen = part.vertices @ pose[:3, :3].T + pose[:3, 3] - target
        depth = distance - seen @ back
        assert np.all(np.abs(seen @ np.cross(back, right)) <= half * depth), part.name
        assert np.all(np.abs(seen @ right) <= 4 / 3 * half * depth), part.name


def test_a_story_without_parts_still_has_a_size() -> None:
    assert frame_story(from_poses("nothing", {}, ())).radius > 0.0


def test_a_single_point_has_a_size_too() -> None:
    speck = Part("a", "speck", np.zeros((3, 3)), np.array([[0, 1, 2]]))
    assert frame_story(from_poses("speck", {"a": np.eye(4)}, (speck,))).step > 0.0
