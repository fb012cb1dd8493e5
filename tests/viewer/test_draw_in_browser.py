"""The empty plane in a real browser: linkages drawn by pointer and by keys, saved, and run by mechlab.

Poses are compared with the closed form of the four-bar, with Pinocchio's closure, and with numbers of freedoms counted by hand.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

import numpy as np
import pytest

from mechlab import api
from mechlab.analytic.fourbar import solve
from mechlab.cli import main
from mechlab.engines.pinocchio.inverse import assemble
from mechlab.formats.mechanism_json import from_json
from mechlab.mechanism import Mechanism, structure
from mechlab.viewer.drawing_page import DrawingServer, drawing_page

PLACE = "p => { const b = lab.view.svg.getBoundingClientRect(), s = lab.view.toScreen(p); return [s[0] + b.left, s[1] + b.top]; }"
STATE = "document.querySelector('.state').textContent"
EXACT = 1e-12
"""Largest difference [rad] of angles between the saved file and the closed form of its lengths."""


class Plane:
    """The page, and hands that draw in it; coordinates in metres."""

    def __init__(self, page: Any) -> None:
        self.page = page

    def at(self, point: tuple[float, float]) -> list[float]:
        return list(self.page.evaluate(PLACE, list(point)))

    def click(self, *point: float) -> None:
        self.page.mouse.click(*self.at((point[0], point[1])))

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        self.page.mouse.move(*self.at(start))
        self.page.mouse.down()
        self.page.mouse.move(*self.at(end), steps=4)
        self.page.mouse.up()

    def tool(self, name: str) -> None:
        self.page.get_by_role("button", name=name, exact=True).click(timeout=20000)

    def save(self, folder: Path) -> tuple[Path, Mechanism]:
        with self.page.expect_download() as found:
            self.tool("Save")
        path = folder / found.value.suggested_filename
        found.value.save_as(path)
        return path, from_json(path.read_text(encoding="utf-8"))


@pytest.fixture
def plane(look: Callable[..., Any], tmp_path: Path) -> Plane:
    path = tmp_path / "draw.html"
    api.draw(html=path)
    return Plane(look(path.as_uri(), width=1000, height=700))


def draw_fourbar(plane: Plane) -> None:
    """A crank-rocker A C D B, its crank AC 50 mm, its ground 200 mm."""
    plane.click(0.0, 0.0)
    plane.click(0.2, 0.0)
    plane.drag((0.0, 0.0), (0.03, 0.04))
    plane.drag((0.03, 0.04), (0.18, 0.12))
    plane.drag((0.2, 0.0), (0.181, 0.121))


@pytest.mark.browser
def test_a_four_bar_is_drawn_saved_and_run(plane: Plane, tmp_path: Path) -> None:
    """Its lengths are those of the grid; the rocker stands where the closed form has it, at every angle of the crank."""
    draw_fourbar(plane)
    assert "1 freedom" in plane.page.evaluate(STATE) and "1 loop" in plane.page.evaluate(STATE)
    path, model = plane.save(tmp_path)
    crank, coupler, rocker = (float(b.shapes[0].parameters["length"]) for b in (model.body(n) for n in ("AC", "CD", "BD")))
    assert [crank, coupler, rocker] == pytest.approx([0.05, 0.17, np.hypot(0.02, 0.12)], abs=1e-15)
    assert len(structure(model).independent) == 1 and [d.on for d in model.drives] == ["AC_angle"]
    home = float(np.arctan2(0.04, 0.03))
    assert model.joint("AC_angle").zero == pytest.approx(home, abs=1e-15)
    for angle in np.linspace(home - 3.0, home + 3.0, 13):
        found = assemble(model, {"AC_angle": float(angle)}, steps=20, watch=False)
        assert found.closed
        expected = float(solve(crank, coupler, rocker, 0.2, float(angle), mode=1).rocker_angle)
        seen = float(model.value("BD_angle", found.q))
        assert abs(np.angle(np.exp(1j * (seen - expected)))) < 1e-9  # Newton ends at 1e-12 of residuals
    assert model.body("AC").inertia.mass == pytest.approx(crank, abs=1e-15)
    assert main(["run", str(path), "-o", str(tmp_path / "out")]) == 0


@pytest.mark.browser
def test_what_is_drawn_moves_is_edited_and_undone(plane: Plane, tmp_path: Path) -> None:
    """Lengths survive motion bit for bit; a typed length and a shifted pivot change them; undo takes all of it back."""
    draw_fourbar(plane)
    lengths = "lab.drawing.sketch.bars.map(bar => bar.length)"
    first = plane.page.evaluate(lengths)
    plane.tool("Move")
    plane.drag((0.03, 0.04), (0.0, 0.09))
    moved = plane.page.evaluate("lab.drawing.sketch.points.find(p => p.name === 'C')")
    assert np.hypot(moved["x"], moved["y"]) == pytest.approx(0.05, abs=EXACT) and moved["y"] > 0.045
    _, model = plane.save(tmp_path)
    assert [b.shapes[0].parameters["length"] for b in model.bodies] == pytest.approx(first, abs=0.0)
    assert model.joint("AC_angle").zero == pytest.approx(np.arctan2(moved["y"], moved["x"]), abs=EXACT)
    plane.tool("Draw")
    plane.click(moved["x"] / 2, moved["y"] / 2)
    field = plane.page.get_by_label("length")
    field.fill("60mm")
    field.press("Enter")
    assert plane.page.evaluate(lengths)[0] == 0.06
    tip = plane.page.evaluate("lab.drawing.sketch.points.find(p => p.name === 'C')")
    assert np.hypot(tip["x"], tip["y"]) == pytest.approx(0.06, abs=EXACT)
    plane.tool("Shift pivot")
    plane.drag((0.2, 0.0), (0.21, 0.0))
    assert plane.page.evaluate("lab.drawing.sketch.points[1].x") == pytest.approx(0.21, abs=1e-15)
    for _ in range(3):
        plane.tool("\u21b6 Undo")
    assert plane.page.evaluate(lengths) == first
    assert plane.page.evaluate("lab.drawing.built.freedoms") == 1


@pytest.mark.browser
def test_a_slider_crank_and_gears_have_their_freedoms(plane: Plane, tmp_path: Path) -> None:
    """A slider-crank moves by one motor along its rail; two gears of 20 and 40 teeth turn as 2 to -1."""
    plane.click(0.0, 0.0)
    plane.drag((0.0, 0.0), (0.03, 0.04))
    plane.drag((0.03, 0.04), (0.18, 0.0))
    assert "2 freedoms" in plane.page.evaluate(STATE)
    plane.tool("Slider")
    plane.click(0.18, 0.0)
    assert "1 freedom" in plane.page.evaluate(STATE)
    _, model = plane.save(tmp_path)
    q = assemble(model, {model.drives[0].on: 0.3}, steps=10, watch=False).q
    rod = 0.05 * np.cos(0.3) + np.sqrt(0.15**2 + 0.04**2 - (0.05 * np.sin(0.3)) ** 2)  # of a rod 150 along and 40 down
    slide = next(j.name for j in model.joints if j.kind == "prismatic")
    assert 0.18 + float(model.value(slide, q)) == pytest.approx(rod, abs=1e-9)
    plane.tool("Draw")
    plane.click(0.0, -0.05)
    plane.click(0.075, -0.05)
    plane.tool("Gear")
    plane.click(0.0, -0.05)
    plane.click(0.075, -0.05)
    plane.page.get_by_label("teeth").fill("40")
    plane.page.get_by_label("teeth").press("Enter")
    assert "2 freedoms" in plane.page.evaluate(STATE) and "1 mesh of gears" in plane.page.evaluate(STATE)
    _, model = plane.save(tmp_path)
    (relation,) = model.relations
    small, large = (model.coefficient_row(relation.coefficients) @ model.row(n) for n in sorted(
        n for n in model.scalar_names if n.startswith("gear_")))  # fmt: skip
    assert large / small == pytest.approx(2.0, abs=1e-15)


@pytest.mark.browser
def test_a_four_bar_is_drawn_with_keys_and_with_a_finger(plane: Plane) -> None:
    """A cross that arrow keys move draws what a pointer draws; what makes no sense is said."""
    plane.page.locator("#plane").focus()
    keys = plane.page.keyboard
    keys.press("ArrowRight")
    start = plane.page.evaluate("lab.drawing.cursor")
    keys.press("Enter")
    keys.press(" ")
    for _ in range(4):
        keys.press("ArrowUp")
    keys.press(" ")
    bars = plane.page.evaluate("lab.drawing.sketch.bars.map(bar => bar.length)")
    assert bars == pytest.approx([0.02], abs=1e-15)
    assert "1 freedom" in plane.page.evaluate(STATE)
    plane.tool("Motor")
    plane.click(start[0], start[1] + 0.02)
    assert "A motor stands on the ground" in plane.page.evaluate(STATE)
    plane.tool("Delete")
    plane.click(*start)
    assert plane.page.evaluate("lab.drawing.sketch.bars.length") == 0


def test_the_page_is_one_small_file_without_requests() -> None:
    page = drawing_page()
    assert len(page) < 250_000 and "@@" not in page
    assert "://" not in page.replace("http://www.w3.org/2000/svg", "")


def test_the_server_answers_this_computer_alone() -> None:
    with DrawingServer() as server:
        with urlopen(server.url, timeout=10) as answer:
            assert b"Draw a linkage" in answer.read()
        with pytest.raises(OSError, match="421"):
            urlopen(Request(server.url, headers={"Host": "evil.example"}), timeout=10)
