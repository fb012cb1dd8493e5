"""The page in a real browser, offline: poses, player, keys, plots."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mechlab.viewer import Part, Story, from_poses, write_page

Look = Callable[..., Any]
Until = Callable[..., None]

pytestmark = pytest.mark.browser

COUNT_COLORS = """() => {
    lab.viewer.render();
    const gl = lab.viewer.renderer.getContext(), { width, height } = lab.viewer.renderer.domElement;
    const pixels = new Uint8Array(4 * width * height), seen = new Set();
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    for (let i = 0; i < pixels.length; i += 4) seen.add(pixels.slice(i, i + 3).join());
    return seen.size;
}"""


@pytest.fixture(scope="module")
def opened(look: Look, page_file: Path) -> Any:
    return look(page_file.as_uri())


@pytest.fixture
def page(opened: Any) -> Iterator[Any]:
    """The page of the story, at rest at its start."""
    opened.evaluate("lab.pause(), lab.seek(0), document.activeElement.blur(), scrollTo(0, 0)")
    yield opened
    assert opened.errors == []


def poses(page: Any, story: Story) -> np.ndarray:
    return np.array(page.evaluate("names => names.map(name => lab.pose(name))", list(story.bodies)))


def test_recorded_times_show_recorded_poses(page: Any, story: Story) -> None:
    for k in np.random.default_rng(5).choice(len(story.t), 20, replace=False):
        page.evaluate("t => lab.seek(t)", float(story.t[k]))
        np.testing.assert_allclose(poses(page, story), story.poses[k], atol=1e-6)
    assert page.evaluate("lab.bodies") == list(story.bodies)
    assert page.requests == [page.url]


def test_between_two_frames_positions_are_blended(page: Any, story: Story) -> None:
    page.evaluate("t => lab.seek(t)", float(0.3 * story.t[10] + 0.7 * story.t[11]))
    expected = 0.3 * story.poses[10, :, :3, 3] + 0.7 * story.poses[11, :, :3, 3]
    np.testing.assert_allclose(poses(page, story)[:, :3, 3], expected, atol=1e-9)


def test_a_body_that_does_not_exist_is_an_error(page: Any) -> None:
    message = page.evaluate("(() => { try { lab.pose('wheell'); } catch (e) { return e.message; } })()")
    assert message.startswith("body 'wheell' does not exist. Existing: ground, wheel,")


def test_seeking_past_the_end_stops_there(page: Any) -> None:
    assert page.evaluate("lab.seek(99), lab.time") == 4.0
    assert page.evaluate("lab.seek(-1), lab.time") == 0.0


def test_play_and_pause(page: Any, until: Until) -> None:
    assert page.evaluate("lab.playing") is False
    page.get_by_role("button", name="Play").click()
    until(page, "lab.playing && lab.time > 0.1")
    page.get_by_role("button", name="Pause").click()
    assert page.evaluate("lab.playing") is False
    time = page.evaluate("lab.time")
    page.wait_for_timeout(150)
    assert page.evaluate("lab.time") == time


def test_playing_stops_at_the_end_without_loop_and_goes_on_with_it(page: Any, until: Until) -> None:
    page.get_by_label("loop").uncheck()
    page.evaluate("lab.seek(3.9), lab.play()")
    until(page, "!lab.playing")
    assert page.evaluate("lab.time") == 4.0
    page.get_by_label("loop").check()
    page.evaluate("lab.seek(3.9), lab.play()")
    until(page, "lab.time < 3.8")
    assert page.evaluate("lab.playing") is True


def test_keys_and_buttons_step_over_recorded_frames(page: Any, story: Story) -> None:
    def press(key: str) -> float:
        page.keyboard.press(key)
        return float(page.evaluate("lab.time"))

    assert press("End") == 4.0
    assert press("ArrowLeft") == story.t[199]
    assert press("Home") == 0.0
    assert press("ArrowRight") == story.t[1]
    assert press("Shift+ArrowRight") == story.t[11]
    page.evaluate("lab.seek(0.205)")
    assert press("ArrowLeft") == story.t[10]
    page.evaluate("lab.seek(0.205)")
    assert press("ArrowRight") == story.t[11]
    page.get_by_role("button", name="One frame back").click()
    assert page.evaluate("lab.time") == story.t[10]
    page.evaluate("document.activeElement.blur()")
    press(" ")
    assert page.evaluate("lab.playing") is True
    press(" ")
    assert page.evaluate("lab.playing") is False


def test_the_slider_seeks_and_says_the_time(page: Any, story: Story) -> None:
    slider = page.get_by_role("slider", name="Time")
    slider.fill("0.5")
    assert page.evaluate("lab.time") == 2.0
    assert slider.get_attribute("aria-valuetext") == "2.000 of 4.000 seconds"
    assert page.locator("#clock").inner_text() == "2.000 s"
    slider.press("ArrowRight")
    assert page.evaluate("lab.time") == story.t[101]


def test_a_click_in_a_plot_seeks_and_every_cursor_follows(page: Any, until: Until) -> None:
    area = page.locator(".plot-area").first
    area.scroll_into_view_if_needed()
    until(page, "document.querySelector('.plot canvas').width > 0")
    width = area.bounding_box()["width"]
    area.click(position={"x": 56 + 0.25 * (width - 70), "y": 60})
    assert page.evaluate("lab.time") == pytest.approx(1.0, abs=0.02)
    cursors = page.locator(".cursor").evaluate_all("all => all.map(c => c.style.transform)")
    assert len(cursors) == 2
    assert cursors[0] == cursors[1]
    page.evaluate("lab.seek(2)")
    assert page.locator(".legend b").all_inner_texts() == [
        "14.6\u00a0rad",
        "\u22120.2794\u00a0rad",
        "4\u00b710\u207b\u2076\u00a0m",
    ]


def test_the_texts_are_shown_as_texts(page: Any) -> None:
    panel = page.locator("#panel")
    page.evaluate("for (const part of document.querySelectorAll('#panel details')) part.open = true")
    assert panel.locator("h1").inner_text() == "Test <b>rig</b> </script>"
    for words in (
        "Do not trust this result",
        "Warning: The step is coarse.",
        "Error: Energy grows.",
        "0.1 m <x>",
        "ground",
    ):
        assert words in panel.inner_text()


def test_the_picture_is_not_blank_and_every_view_shows_it(page: Any) -> None:
    for name in ("Top", "Front", "Right", "Fit", "Iso"):
        page.get_by_role("button", name=name, exact=True).click()
        assert page.evaluate(COUNT_COLORS) > 50, name


def test_the_picture_can_be_saved(page: Any) -> None:
    with page.expect_download() as download:
        page.get_by_role("button", name="PNG").click()
    assert download.value.suggested_filename == "Test-b-rig-b-script-.png"
    assert Path(download.value.path()).read_bytes().startswith(b"\x89PNG")


def test_an_address_can_name_the_time(look: Look, page_file: Path) -> None:
    assert look(page_file.as_uri() + "#t=1.2").evaluate("lab.time") == 1.2


def test_a_still_story_has_no_player(look: Look, story: Story, tmp_path: Path) -> None:
    part = Part("a", "block", story.parts[0].vertices, story.parts[0].faces)
    page = look(write_page(from_poses("still", {"a": np.eye(4)}, (part,)), tmp_path / "still.html").as_uri())
    assert page.locator("#player").is_hidden()
    np.testing.assert_allclose(page.evaluate("lab.pose('a')"), np.eye(4), atol=1e-12)


@pytest.mark.parametrize("width", [1280, 390])
def test_nothing_sticks_out_sideways(look: Look, page_file: Path, width: int) -> None:
    page = look(page_file.as_uri(), width=width, height=720)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator("#panel").evaluate("p => p.scrollWidth <= p.clientWidth")
