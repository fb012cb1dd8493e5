"""The moving pictures of the gallery: what they hold against the poses of the run, and when they move."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from mechlab import api
from mechlab.viewer import Story
from mechlab.viewer.gallery import Exhibit, write_gallery
from mechlab.viewer.outline import MOST, hollow_outline
from mechlab.viewer.story import Part
from mechlab.viewer.thumbnail import thumbnail


@pytest.fixture(scope="module")
def story() -> Story:
    return api.story(api.simulate("fourbar"))


@pytest.fixture(scope="module")
def moving(story: Story) -> dict[str, Any]:
    return thumbnail(story)


def on_screen(moving: dict[str, Any], body: int, point: list[int], frame: int) -> np.ndarray:
    """Place on the screen as the script of the page computes it."""
    frames = moving["bodies"][body]
    m = np.array(frames[frame if len(frames) > 1 else 0], dtype=float)
    return m[:6].reshape(2, 3) @ point / 400 + m[6:]


def test_parts_keep_their_distances_and_fit_the_picture(moving: dict[str, Any]) -> None:
    """A planar mechanism is seen face on, so the points of a part keep their distances in all frames, to the whole numbers; nothing
    leaves the picture of 800 x 600."""
    assert len(moving["parts"]) > 4 and any(len(frames) > 1 for frames in moving["bodies"].values())
    for part in moving["parts"]:
        spans = []
        for frame in range(24):
            seen = np.array([on_screen(moving, part["body"], p, frame) for p in part["points"]])
            assert np.abs(seen[:, 0]).max() <= 400 and np.abs(seen[:, 1]).max() <= 300
            spans.append(np.linalg.norm(seen[0] - seen[len(seen) // 2]))
        assert np.ptp(spans) < 3.0


def test_a_crank_turns_as_it_does_in_the_run(story: Story, moving: dict[str, Any]) -> None:
    """Angles of the crank on the screen against the recorded poses at the times of the frames, which lie even from the first on; the
    last time follows from the last angle. No step is above 24 degrees."""
    body = story.bodies.index("crank")
    recorded = np.unwrap(np.arctan2(story.poses[:, body, 2, 0], story.poses[:, body, 0, 0]))
    recorded = np.abs(recorded - recorded[0])
    frames = np.array(moving["bodies"][body], dtype=float)
    across = frames[:, [0, 3]]  # the x axis of the crank on the screen
    turned = np.unwrap(np.arctan2(across[:, 1], across[:, 0]))
    turned = np.abs(turned - turned[0])
    assert 1.0 < turned[-1] and np.diff(turned).max() < math.radians(24.0) + 0.02
    times = np.linspace(story.t[0], np.interp(turned[-1], recorded, story.t), 24)
    assert turned == pytest.approx(np.interp(times, story.t, recorded), abs=0.01)


@pytest.mark.browser
@pytest.mark.parametrize("reduced", [False, True])
def test_a_card_moves_under_the_pointer_unless_less_motion_is_asked_for(
    reduced: bool, moving: dict[str, Any], tmp_path: Path, browser: Any, until: Any
) -> None:
    from PIL import Image

    buffer = io.BytesIO()
    Image.new("RGB", (40, 30), "white").save(buffer, format="png")
    exhibits = [Exhibit(n, n.upper(), "One.", buffer.getvalue(), "", True, "", "linkage", m) for n, m in (("a", moving), ("b", {}))]
    page = browser.new_page(reduced_motion="reduce" if reduced else "no-preference")
    wrong: list[str] = []
    page.on("console", lambda m: wrong.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto(write_gallery(exhibits, tmp_path).as_uri())
    page.hover("article >> nth=0")
    assert page.locator("canvas").count() == (0 if reduced else 1)
    if not reduced:
        page.evaluate("window.first = document.querySelector('canvas').toDataURL()")
        until(page, "document.querySelector('canvas').toDataURL() !== window.first")
    page.hover("article >> nth=1")  # it has nothing that moves
    assert page.locator("canvas").count() == 0 and not wrong


def solid(mesh: trimesh.Trimesh) -> Part:
    return Part("body", "solid", np.asarray(mesh.vertices), np.asarray(mesh.faces))


def test_a_hollow_part_has_its_true_outline_and_a_full_one_none() -> None:
    """A ring of radii .8 and 1, seen from above: two circles; from its edge, or full: the convex outline does. A long tube only from its
    end, where its face is all that one sees."""
    above, ring = np.array([0.0, 0.0, 1.0]), solid(trimesh.creation.annulus(0.8, 1.0, 0.2, sections=180))
    loops = sorted((np.linalg.norm(loop, axis=1) for loop in hollow_outline(ring, above)), key=np.mean)
    height = 0.1  # of the face over the middle
    assert [len(x) <= MOST for x in loops] == [True, True]
    np.testing.assert_allclose(loops[0], np.hypot(0.8, height), rtol=1e-3)
    np.testing.assert_allclose(loops[1], np.hypot(1.0, height), rtol=1e-3)
    assert hollow_outline(ring, np.array([1.0, 0.0, 0.1])) == []
    assert hollow_outline(solid(trimesh.creation.cylinder(1.0, 0.2)), above) == []
    tube = solid(trimesh.creation.annulus(0.8, 1.0, 5.0))
    assert len(hollow_outline(tube, above)) == 2 and hollow_outline(tube, np.array([0.0, 0.6, 0.8])) == []


def test_a_slotted_part_keeps_its_area() -> None:
    """A square of side 2 with a slot of .6 by 1.8 from one side: area 2.92 of 4, by the sum of cross products of its outline."""
    x, y = np.array([-1.0, -0.3, 0.3, 1.0]), np.array([-1.0, -0.8, 1.0])
    flat = np.stack(np.meshgrid(x, y, [0.0, 0.1], indexing="ij"), axis=-1).reshape(-1, 3)
    faces = []
    for i, j in ((0, 0), (1, 0), (2, 0), (0, 1), (2, 1)):
        a, b, c, d = (6 * u + 2 * v for u, v in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
        faces += [(a + 1, b + 1, c + 1), (a + 1, c + 1, d + 1), (a, c, b), (a, d, c)]
    (loop,) = hollow_outline(Part("body", "plate", flat, np.array(faces)), np.array([0.2, 0.0, 1.0]))
    x, y = loop[:, 0], loop[:, 1]
    assert abs(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) == pytest.approx(2.92, abs=1e-9)


def test_nothing_hides_behind_a_ring_gear() -> None:
    """The planets of the stage stand between sun and ring: the ring is drawn with its hole, and its mark lies on it."""
    moving = thumbnail(api.story(api.simulate("planetary_stage")))
    ring = max(moving["parts"], key=lambda p: np.ptp(np.array(p["points"])))
    outer, inner = sorted((np.linalg.norm(np.array(loop)[:, :2], axis=1) for loop in ring["loops"]), key=np.mean)[::-1]
    assert outer.min() > inner.max() > 0.8 * outer.max()
    assert np.linalg.norm(np.array(ring["mark"])[:, :2], axis=1).min() > inner.max() - 2
