"""A live page gets another story while its reader is editing: the edit stays until it is built, undone or given up."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import pytest

from mechlab.api import load
from mechlab.viewer import Story
from mechlab.viewer.from_recording import mechanism_story
from mechlab.viewer.live import Server, serve

pytestmark = pytest.mark.browser
CRANK = "lab.explorer.model.document.bodies[0].shapes[0].size.length"
WAITING = "document.getElementById('notice').className === 'waiting'"
NEWER = "lab.ready && document.querySelector('h1').textContent === 'newer'"


@contextmanager
def typing(look: Callable[..., Any], until: Callable[..., None]) -> Iterator[tuple[Any, Server, Story]]:
    """A page in edit mode with a length half typed, its server, and the newer story that the server now shows."""
    story = mechanism_story(load("fourbar").mechanism())
    with serve(story, quiet=True) as server:
        page = look(server.url, offline=False, width=1000, height=700)
        until(page, "document.getElementById('edit-send')")
        page.keyboard.press("e")
        page.get_by_label("length", exact=True).fill("12")
        newer = replace(story, title="newer")
        server.show(newer)
        until(page, WAITING)
        yield page, server, newer


def test_nothing_typed_is_lost_and_leaving_brings_the_newer_page(look: Callable[..., Any], until: Callable[..., None]) -> None:
    with typing(look, until) as (page, _, _):
        assert page.get_by_label("length", exact=True).input_value() == "12"
        page.get_by_label("length", exact=True).press("Escape")
        page.keyboard.press("e")
        until(page, NEWER)
        assert page.evaluate(CRANK) == pytest.approx(0.1)
        assert not page.evaluate("lab.explorer.editor.on") and page.locator("#notice").inner_text() == ""


def test_an_edited_shape_stays_when_edit_mode_is_left_until_it_is_undone(
    look: Callable[..., Any], until: Callable[..., None]
) -> None:
    with typing(look, until) as (page, server, newer):
        page.get_by_label("length", exact=True).fill("120mm")
        page.get_by_label("length", exact=True).press("Enter")
        page.get_by_role("button", name="Done").click()
        server.show(replace(newer, title="newest"))
        page.evaluate("new Promise(done => setTimeout(done, 200))")  # time to do the wrong thing
        assert page.evaluate(CRANK) == pytest.approx(0.12) and page.evaluate(WAITING)
        page.evaluate("lab.explorer.undo()")
        until(page, "lab.ready && document.querySelector('h1').textContent === 'newest'")
        assert page.evaluate(CRANK) == pytest.approx(0.1)


def test_the_newer_page_can_be_had_at_once(look: Callable[..., Any], until: Callable[..., None]) -> None:
    with typing(look, until) as (page, _, _):
        page.get_by_role("button", name="Show it").click()
        until(page, NEWER)


def test_a_part_in_the_hand_stays_in_it(look: Callable[..., Any], until: Callable[..., None]) -> None:
    story = mechanism_story(load("fourbar").mechanism())
    with serve(story, quiet=True) as server:
        page = look(server.url, offline=False, width=1000, height=700)
        page.evaluate("lab.explorer.move('crank_angle', 1.2)")
        server.show(replace(story, title="newer"))
        page.evaluate("new Promise(done => setTimeout(done, 200))")
        assert page.locator("h1").inner_text() != "newer"
        page.evaluate("lab.explorer.end()")
        until(page, NEWER)
        assert page.evaluate("lab.explorer.value('crank_angle')") == pytest.approx(1.2, abs=1e-9)  # a link keeps nine digits
