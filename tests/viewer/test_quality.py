"""A page on a slow machine leaves details out while it moves, and shows every one of them when it stands still."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import trimesh

from mechlab.shapes.feature_edges import split_at_edges

PICTURE = "() => { lab.viewer.render(); return lab.viewer.renderer.domElement.toDataURL(); }"
DETAILS = """() => { let lights = 0; lab.viewer.scene.traverse((o) => { if (o.isLight && o.castShadow) lights += 1; });
  return { lights, edges: (lab.viewer.camera.layers.mask & 2) === 2, width: lab.viewer.renderer.domElement.width }; }"""

STILL = "lab.quality.shown === 0 && !lab.viewer.needs_render"


@pytest.mark.browser
def test_slow_frames_cost_details_until_the_picture_stands_still(
    page_file: Path, look: Callable[..., Any], until: Callable[..., None]
) -> None:
    page = look(page_file.as_uri())
    page.evaluate("lab.seek(1)")
    until(page, STILL)  # a loaded machine may leave details out on the way here
    before, picture = page.evaluate(DETAILS), page.evaluate(PICTURE)
    assert before["lights"] == 1 and before["edges"]
    page.evaluate("for (let k = 0; k < 6; k++) lab.quality.judge(400)")  # as if six frames had taken 0.4 s each
    page.evaluate("lab.play()")
    until(page, "lab.quality.shown > 0")
    moving = page.evaluate(DETAILS)
    assert moving["lights"] == 0 and not moving["edges"] and moving["width"] < before["width"]
    page.evaluate("lab.pause(); lab.seek(1)")
    until(page, STILL)
    assert page.evaluate(DETAILS) == before
    assert page.evaluate(PICTURE) == picture


@pytest.mark.browser
def test_fast_frames_keep_every_detail(page_file: Path, look: Callable[..., Any]) -> None:
    page = look(page_file.as_uri())
    level = "() => { lab.quality.level = 0; for (let k = 0; k < 50; k++) lab.quality.judge(k % 2 ? 400 : 16); return lab.quality.level; }"
    assert page.evaluate(level) == 0  # single slow frames, as of a garbage collection, are no reason


def test_solids_are_told_from_open_surfaces() -> None:
    """Against trimesh's own test, for solids, a solid inside out, one with a hole, and one of two solids that touch."""
    ball, box = trimesh.creation.icosphere(2), trimesh.creation.box((1.0, 2.0, 3.0))
    inside_out = box.copy()
    inside_out.invert()
    two = trimesh.util.concatenate([box, box.copy().apply_translation([3.0, 0.0, 0.0])])
    holed = trimesh.Trimesh(ball.vertices, ball.faces[1:], process=False)
    for mesh in (ball, box, inside_out, two, holed):
        own = split_at_edges(mesh.vertices, mesh.faces).closed
        assert own == (mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0)
    assert split_at_edges(ball.vertices, ball.faces).closed and not split_at_edges(holed.vertices, holed.faces).closed
