"""The page of modes: a button for each, with its frequency; it plays that mode alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mechlab import api

pytestmark = pytest.mark.browser


def test_a_button_plays_one_mode(look: Callable[..., Any], until: Callable[..., None], tmp_path: Any) -> None:
    result = api.modes("pendulum", html=tmp_path / "modes.html", only=[1])
    many = api.modes("platform_3rrr", html=tmp_path / "many.html")
    for path, found in ((tmp_path / "modes.html", result), (tmp_path / "many.html", many)):
        page = look(path.as_uri(), width=1100, height=750)
        buttons = page.locator("#clips button")
        shown = [m for m in found.modes if m.kind != "rigid"] or list(found.modes)
        assert buttons.count() == min(8, len(shown))
        for k in range(buttons.count()):
            if shown[k].kind == "oscillating":
                assert f"{shown[k].frequency_hz:.4g} Hz" in buttons.nth(k).inner_text()
        last = buttons.count() - 1
        buttons.nth(last).click()
        until(page, "lab.playing")
        page.evaluate("lab.pause(), lab.seek(0)")
        start, end = 4.0 * last, 4.0 * (last + 1)
        assert page.evaluate("lab.time") == pytest.approx(start, abs=1e-9)
        page.evaluate("lab.seek(99)")
        assert page.evaluate("lab.time") == pytest.approx(end, abs=1e-9)
        page.get_by_role("slider", name="Time").fill("0.5")
        assert page.evaluate("lab.time") == pytest.approx((start + end) / 2, abs=1e-9)
        assert page.evaluate("[lab.curves.window.start, lab.curves.window.end]") == pytest.approx([start, end])
        # Only the path of this mode is drawn: none at its start.
        page.evaluate("lab.seek(0)")
        drawn = "lab.traces.tubes.map(t => t.mesh.geometry.drawRange.count)"
        assert set(page.evaluate(drawn)) <= {0}
        page.evaluate("lab.seek(99)")
        assert max(page.evaluate(drawn), default=1) > 0
        assert page.errors == []
    # The frequency of the pendulum is that of its parameters: sqrt(m g s / J) / (2 pi) about its pivot.
    m = result.mechanism
    body = m.bodies[-1]
    if len(m.bodies) == 1:
        axis = np.array(body.joints[0].axis)
        com = np.array(body.inertia.com)
        xx, yy, zz, xy, xz, yz = body.inertia.tensor
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        arm = com - axis * (com @ axis)
        about = axis @ tensor @ axis + body.inertia.mass * (arm @ arm)
        expected = np.sqrt(body.inertia.mass * 9.81 * np.linalg.norm(arm) / about) / (2 * np.pi)
        assert result.modes[0].frequency_hz == pytest.approx(expected, rel=1e-6)
