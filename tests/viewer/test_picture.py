"""The still picture: the right size, something in it, and clear words where it cannot be drawn."""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from mechlab import api
from mechlab.errors import EngineMissing, MechlabError
from mechlab.mechanism import TreeKinematics
from mechlab.viewer import Part, Story, from_poses, picture
from mechlab.viewer.framing import FIELD_OF_VIEW, fit_camera, frame_story
from mechlab.viewer.picture_springs import COIL, Springs
from tests.viewer.conftest import box, turning


@pytest.fixture(scope="module", autouse=True)
def drawing() -> None:
    pytest.importorskip("mujoco")
    try:
        picture._open_context(16, 16).free()
    except EngineMissing as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(str(error))


def test_a_picture_has_the_size_and_a_white_background(story: Story, tmp_path: Path) -> None:
    from PIL import Image

    path = picture.write_png(story, tmp_path / "still.png", time=1.0, size=(320, 240), samples=2)
    pixels = np.asarray(Image.open(path))
    assert pixels.shape == (240, 320, 3)
    assert np.all(pixels[:5, :5] > 225)


SIZE = (320, 240)
COLORS = {"red": (0.9, 0.05, 0.05, 1.0), "green": (0.05, 0.7, 0.05, 1.0), "blue": (0.05, 0.1, 0.9, 1.0)}
EDGES = {"red": (0.3, 0.3, 0.3), "green": (0.5, 0.15, 0.2), "blue": (0.2, 0.2, 0.6)}


def moving_boxes() -> Story:
    """Three boxes of one colour each, apart from each other in both views: one stands, one turns, one travels."""
    t = np.linspace(0.0, 1.0, 11)
    poses = {
        "red": turning(0.0 * t, 2, np.array([-1.0, -0.6, 0.2])),
        "green": turning(2.0 * t, 2, np.array([0.0, 0.9, 0.3])),
        "blue": turning(0.4 * t, 0, np.column_stack([0.6 + 0.7 * t, -0.5 - 0.3 * t, 0.5 + 0.4 * t])),
    }
    parts = [Part(name, name, *box(*EDGES[name]), color=COLORS[name]) for name in COLORS]
    return from_poses("boxes", poses, parts, t=t)


def inside(story: Story, body: str, frame: int, toward: tuple[float, float, float], margin: float) -> np.ndarray:
    """(height, width) True where a box lies in the picture of a pinhole camera, grown by `margin` [pixels].

    The eye stands at target + distance x `toward`; a point at (x, y) across and z towards the eye, from the target, appears at
    (x, y) / (distance - z) / tan(half the field of view), in halves of the height of the picture. The outline of a convex
    body is the convex hull of its corners.
    """
    width, height = SIZE
    target, distance = fit_camera(frame_story(story).points, np.array(toward), width / height)
    back = np.array(toward) / np.linalg.norm(toward)
    right = np.cross([0.0, 0.0, 1.0], back) / np.linalg.norm(np.cross([0.0, 0.0, 1.0], back))
    pose = story.poses[frame, story.bodies.index(body)]
    corners = box(*EDGES[body])[0] @ pose[:3, :3].T + pose[:3, 3] - target
    depth = (distance - corners @ back)[:, None]
    seen = corners @ np.stack([right, np.cross(back, right)], axis=1) / depth / np.tan(FIELD_OF_VIEW / 2.0)
    hull = ConvexHull(np.array([0.5 * width, 0.5 * height]) + 0.5 * height * seen * np.array([1.0, -1.0]))
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    return np.asarray(
        np.all(np.stack([x, y], axis=-1) @ hull.equations[:, :2].T + hull.equations[:, 2] <= margin, axis=-1)
    )


@pytest.mark.parametrize("toward", [(0.6, -1.0, 0.72), (-0.3, -0.5, 1.6)])
@pytest.mark.parametrize("frame", [0, 6])
def test_bodies_are_drawn_where_they_are(toward: tuple[float, float, float], frame: int) -> None:
    story = moving_boxes()
    pixels = picture.render(story, float(story.t[frame]), SIZE, toward, samples=1).astype(int)
    others = np.stack([np.max(np.delete(pixels, k, axis=2), axis=2) for k in range(3)], axis=2)
    anywhere = np.zeros(SIZE[::-1], dtype=bool)
    for channel, body in enumerate(COLORS):
        coloured = pixels[..., channel] - others[..., channel] > 40
        where = inside(story, body, frame, toward, -2.0)
        assert where.sum() > 150
        assert coloured[where].mean() > 0.9  # the rest: edges, drawn in a darker colour
        assert not coloured[~inside(story, body, frame, toward, 2.0)].any()
        anywhere |= inside(story, body, frame, toward, 2.0)
    grey = np.ptp(pixels, axis=2) < 40  # white floor, bluish lines of the grid, shadows
    assert grey[~anywhere].all()


def test_the_time_decides_what_is_seen(story: Story) -> None:
    first, later = (picture.render(story, time, (160, 120), samples=1) for time in (0.0, 2.0))
    assert np.any(first != later)


def test_there_must_be_something_to_draw() -> None:
    with pytest.raises(MechlabError, match="'empty' has no parts"):
        picture.render(from_poses("empty", {}, ()))


def test_without_a_graphics_library_the_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> Any:
        raise ImportError(f"no {name}")

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(EngineMissing, match="libegl1 .*or libosmesa6"):
        picture._open_context(16, 16)
    with pytest.raises(EngineMissing, match="pip install mujoco"):
        picture._engine()


def test_springs_reach_from_end_to_end() -> None:
    """The coil of the squeezer's spring ends at its two points, by the kinematics of one pose, and turns about their line."""
    recording = api.simulate("andrews", duration=0.01)
    story = api.story(recording)
    springs = Springs(story, frame_story(story))
    (spring,) = recording.mechanism.springs
    for frame in (0, len(story.t) // 2):
        (wire,) = springs.at(frame)
        tree = TreeKinematics(recording.mechanism)
        tree.set(recording.q[int(np.argmin(np.abs(recording.t - story.t[frame])))])
        both = ((spring.body_a, spring.point_a), (spring.body_b, spring.point_b))
        ends = [tree.pose(body)[0] @ np.array(point) + tree.pose(body)[1] for body, point in both]
        np.testing.assert_allclose(wire[[0, -1]], ends, atol=1e-12)
        axis = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        off = np.linalg.norm(np.cross(wire - ends[0], axis), axis=1)
        assert 0.0 < off.max() <= COIL * frame_story(story).radius * (1 + 1e-9)
        assert np.all(np.diff((wire - ends[0]) @ axis) > 0)
