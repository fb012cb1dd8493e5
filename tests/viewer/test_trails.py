"""Paths as thin tubes: near the path, few pieces, growing with it."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from mechlab.viewer.trails import SIDES, Trail, distances, thinned

RADIUS, TOLERANCE = 3e-3, 5e-4


def circle(turns: float, count: int) -> np.ndarray:
    angle = 2.0 * np.pi * turns * np.linspace(0.0, 1.0, count)
    return np.stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), 0.0 * angle], axis=1)


def test_no_point_is_farther_from_the_thinned_path_than_told() -> None:
    rng = np.random.default_rng(4)
    points = np.cumsum(rng.normal(size=(700, 3)) * 1e-3, axis=0)
    kept = points[thinned(points, TOLERANCE)]
    assert len(kept) < len(points)
    assert distances(points, kept[:-1], kept[1:]).min(axis=1).max() <= TOLERANCE
    # a chord of a circle with sagitta s spans 2 acos(1 - s / r): no fewer pieces will do
    arc = thinned(circle(1.0, 4001), TOLERANCE)
    assert len(arc) - 1 < 2.2 * np.pi / np.arccos(1.0 - TOLERANCE / 0.3)


def test_a_motion_that_repeats_itself_is_drawn_once() -> None:
    once, often = (Trail(circle(turns, 400 * turns + 1), RADIUS, TOLERANCE) for turns in (1, 10))
    assert len(often.faces) < 1.5 * len(once.faces)


@pytest.mark.parametrize("frame", [0, 1, 37, 100, 399])
def test_the_tube_grows_along_the_path(frame: int) -> None:
    """Its area is that of a prism with SIDES corners along the way done; all of it is near that way."""
    points = circle(0.9, 400)
    trail = Trail(points, RADIUS, TOLERANCE)
    vertices = trail.grown(frame)
    done = points[: frame + 1]
    way = np.linalg.norm(np.diff(done, axis=0), axis=1).sum()
    round_about = 2.0 * SIDES * RADIUS * np.sin(np.pi / SIDES)
    area = trimesh.triangles.area(vertices[trail.faces]).sum()
    assert area == pytest.approx(way * round_about, rel=0.02, abs=RADIUS**2)  # the end is slightly turned against the piece
    if frame:
        assert distances(vertices, done[:-1], done[1:]).min(axis=1).max() < RADIUS + TOLERANCE
    whole = trimesh.Trimesh(trail.grown(len(points) - 1), trail.faces, process=False)
    assert whole.is_winding_consistent


def test_a_point_that_rests_has_no_tube() -> None:
    assert len(Trail(np.ones((50, 3)), RADIUS, TOLERANCE).faces) == 0
