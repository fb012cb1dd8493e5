"""The workspace coloured by its dexterity, in a real browser against the closed form."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mechlab import api
from mechlab.analytic import delta6 as closed
from mechlab.cli import main

pytestmark = pytest.mark.browser

DRAWN = """() => { const f = lab.field, p = f.mesh.geometry.getAttribute('position'), i = f.mesh.geometry.index;
    return { positions: [...p.array], values: [...f.values], colors: [...f.mesh.geometry.getAttribute('color').array] }; }"""


def test_the_workspace_is_colored_by_its_dexterity(look: Callable[..., Any], tmp_path: Any) -> None:
    pytest.importorskip("skimage")
    assert (
        main(
            [
                "workspace",
                "delta6",
                "x=-0.2:0.2:21",
                "y=-0.2:0.2:21",
                "z=-0.2:0.3:21",
                "--html",
                str(tmp_path / "page.html"),
            ]
        )
        == 0
    )
    page = look((tmp_path / "page.html").as_uri(), width=1000, height=700)
    g = api.load("delta6").parameters.geometry
    drawn = page.evaluate(DRAWN)
    places = np.array(drawn["positions"]).reshape(-1, 3)
    expected = closed.inverse_condition(g, np.column_stack([places[:, :2], np.zeros(len(places))]))
    # Vertices and values of 32 bits; near the border of the reach the dexterity falls as a square root.
    inside = expected > 0.02
    assert inside.sum() > 100
    np.testing.assert_allclose(np.array(drawn["values"])[inside], expected[inside], atol=2e-5)
    # Brighter where the mechanism is more dexterous.
    bright = np.array(drawn["colors"]).reshape(-1, 3).sum(axis=1)
    order = np.argsort(drawn["values"])
    assert np.all(np.diff(bright[order]) > -1e-5)
    spot = page.evaluate("""() => { const box = lab.viewer.renderer.domElement.getBoundingClientRect();
        for (let y = box.top + 60; y < box.bottom; y += 7) for (let x = box.left + 5; x < box.right; x += 7) {
            const hit = lab.inspector.picker.hit(x, y);
            if (hit && hit.mesh === lab.field.mesh) return { x, y, value: lab.field.valueAt(hit), point: hit.point.toArray() };
        } }""")
    page.mouse.move(spot["x"], spot["y"])
    expected = float(closed.inverse_condition(g, np.array([*spot["point"][:2], 0.0])))
    assert spot["value"] == pytest.approx(expected, abs=0.05)  # linear over a triangle of 2 cm
    page.locator("#field-select").select_option("reach margin")
    assert "mm" in page.locator("#field .ends").inner_text() or " m" in page.locator("#field .ends").inner_text()
    page.locator("#field-select").select_option("one colour")
    assert page.locator("#field .bar").is_hidden()
    assert page.errors == []
