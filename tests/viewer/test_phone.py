"""The page on a phone: the mechanism stays in sight, whatever is read below it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

BOXES = """() => Object.fromEntries(["viewport", "views", "menus", "player", "panel"].map((id) => {
  const { left, top, right, bottom } = document.getElementById(id).getBoundingClientRect(); return [id, [left, top, right, bottom]]; }))"""


@pytest.mark.browser
def test_the_mechanism_stays_in_sight(page_file: Path, look: Callable[..., Any]) -> None:
    page = look(page_file.as_uri(), width=390, height=844)
    page.evaluate("for (const part of document.querySelectorAll('#panel details')) part.open = true")
    before = page.evaluate(BOXES)
    page.evaluate("window.scrollTo(0, document.documentElement.scrollHeight)")
    page.wait_for_timeout(100)
    after = page.evaluate(BOXES)
    assert after["panel"][1] < before["panel"][1] - 300  # it was scrolled far
    for name in ("viewport", "views", "menus", "player"):
        assert after[name] == pytest.approx(before[name], abs=0.5), name
    left, top, right, bottom = after["viewport"]
    assert (left, top, right) == (0, 0, 390) and bottom > 350
    on_top = "([x, y]) => !!document.elementFromPoint(x, y).closest('#viewport, #labels')"
    assert page.evaluate(on_top, [195, 250])
    assert page.evaluate("document.documentElement.scrollWidth") <= 390  # nothing to scroll sideways


@pytest.mark.browser
@pytest.mark.parametrize("width", [390, 1280])
def test_all_points_are_below_the_buttons(page_file: Path, look: Callable[..., Any], width: int) -> None:
    page = look(page_file.as_uri(), width=width, height=844)
    points = "JSON.parse(document.getElementById('story').textContent).framing.points"
    top = page.evaluate(f"Math.min(...{points}.map((p) => lab.onScreen(p)[1]))")
    buttons = page.evaluate(BOXES)
    below = max(buttons["views"][3], buttons["menus"][3])
    assert top > below - 6
