"""Moving a mechanism by hand in a real browser: sliders, fields, locks, undo, grabbing with mouse, finger and keys.

Poses are compared with Pinocchio's closure at the values that the page shows, or with closed forms.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mechlab.viewer import Story, write_page

pytestmark = pytest.mark.browser

OPEN = 1e-9
"""Largest opening of a loop, in sizes of the mechanism: what the page promises."""
EXACT = 1e-8
"""Largest difference of positions [sizes] and directions to Pinocchio's closure at the same values."""
DOUBLE_ROCKER = {"crank": 0.3, "coupler": 0.25, "rocker": 0.28, "ground": 0.6}
DRIVES = "[...lab.explorer.model.drives]"
PLACES = """name => { const k = lab.bodies.indexOf(name), g = lab.explorer.stage.groups[k];
  return [...g.position.toArray(), ...g.quaternion.toArray()]; }"""


@pytest.fixture
def opened(look: Callable[..., Any], tmp_path: Path) -> Callable[..., Any]:
    """Opens the page of a Story."""

    def show(story: Story, width: int = 900, height: int = 640) -> Any:
        page = look(write_page(story, tmp_path / "page.html").as_uri(), width=width, height=height)
        page.wait_for_timeout(50)
        return page

    return show
