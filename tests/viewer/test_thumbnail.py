"""The moving pictures of the gallery: what they hold against the poses of the run, and when they move."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mechlab import api
from mechlab.viewer import Story
from mechlab.viewer.gallery import Exhibit, write_gallery
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
