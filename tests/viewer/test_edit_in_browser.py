"""Edit mode in a real browser: pivots that are dragged, numbers that are typed, undo, and the file that is saved."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mechlab import api
from mechlab.analytic.fourbar import solve
from mechlab.cli import main
from mechlab.engines.pinocchio.inverse import assemble
from mechlab.formats.mechanism_json import from_json
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.viewer import write_page
from mechlab.viewer.from_recording import placed
from mechlab.viewer.pack import quaternions

pytestmark = pytest.mark.browser

POSES = "lab.bodies.map(name => lab.pose(name))"
WORDS = "document.querySelector('#edit .state').textContent"
EXACT = 1e-12
"""Largest difference of poses between the page and the saved file, in sizes and in entries of rotations."""
IN_32_BITS = 2e-7
"""Rotations that the picture shows have 32 bits where they come from quaternions of three.js."""


@pytest.fixture
def opened(look: Callable[..., Any], tmp_path: Path) -> Callable[..., Any]:
    """Opens the page of a mechanism to explore, in edit mode."""

    def show(name: str, width: int = 900, height: int = 700) -> Any:
        page = look(write_page(api.explore(name), tmp_path / "page.html").as_uri(), width=width, height=height)
        page.keyboard.press("e")
        return page

    return show


def drag(page: Any, name: str, way: tuple[float, float]) -> None:
    box = page.locator(f".handle[title='{name}']").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + way[0], y + way[1], steps=4)
    page.mouse.up()


def type_into(page: Any, label: str, text: str) -> None:
    page.get_by_label(label, exact=True).fill(text)
    page.get_by_label(label, exact=True).press("Enter")


def saved(page: Any, tmp_path: Path) -> tuple[Path, Mechanism]:
    with page.expect_download() as found:
        page.get_by_role("button", name="Save").click()
    path = tmp_path / found.value.suggested_filename
    found.value.save_as(path)
    return path, from_json(path.read_text(encoding="utf-8"))


def shown(page: Any) -> tuple[Array, Array]:
    """Positions (nb, 3) and quaternions (nb, 4) of the solver of the page, in the order of the model."""
    found = page.evaluate(
        "(() => { const p = lab.explorer.model.poses(lab.explorer.solver.q);"
        " return [Array.from(p.position), Array.from(p.quaternion)]; })()"
    )
    return np.array(found[0]).reshape(-1, 3), np.array(found[1]).reshape(-1, 4)


def test_an_edit_saved_and_run_has_the_same_poses(opened: Callable[..., Any], tmp_path: Path) -> None:
    """The reference pose of the saved file is what the page showed; `run`, `solve` and Pinocchio take it."""
    page = opened("fourbar")
    drag(page, "pin", (25.0, -30.0))
    page.evaluate("document.activeElement.blur()")
    type_into(page, "length", "112mm")
    page.evaluate("lab.explorer.move('crank_angle', 0.7); lab.explorer.end()")
    path, model = saved(page, tmp_path)
    position, quaternion = shown(page)
    _, poses, _ = placed(model, model.reference()[None])
    np.testing.assert_allclose(poses[0, :, :3, 3], position, atol=EXACT * model.size)
    same = np.abs(np.sum(quaternions(poses[0, :, :3, :3]) * quaternion, axis=1))
    np.testing.assert_allclose(same, 1.0, atol=EXACT)
    np.testing.assert_allclose(np.array(page.evaluate(POSES)), poses[0], atol=IN_32_BITS)
    assert model.joint("crank_angle").zero == pytest.approx(0.7, abs=EXACT)
    # The closed form of the lengths in the file, read from the pivots alone.
    crank, coupler = (float(model.body(n).shapes[0].parameters["length"]) for n in ("crank", "coupler"))
    rocker, ground = float(model.body("rocker").shapes[0].parameters["length"]), 0.3
    assert crank == pytest.approx(0.112, abs=1e-15) and abs(rocker - 0.25) > 1e-3
    expected = float(solve(crank, coupler, rocker, ground, 0.7, mode=1).rocker_angle)
    assert model.joint("rocker_angle").zero == pytest.approx(expected, abs=1e-11)
    assert assemble(model, {"crank_angle": 1.1}, steps=8, watch=False).closed
    assert main(["run", str(path), "-o", str(tmp_path / "out")]) == 0
    again = from_json(next((tmp_path / "out").rglob(f"{model.name}.json")).read_text(encoding="utf-8"))
    assert again == model


def test_numbers_are_undone_and_impossible_ones_refused(opened: Callable[..., Any]) -> None:
    page = opened("fourbar")
    type_into(page, "length", "150mm")
    lengths = "lab.explorer.model.document.bodies.map(b => (b.shapes[0].size.length))"
    assert page.evaluate(lengths) == pytest.approx([0.15, 0.3, 0.25], abs=1e-15)
    drawn = "lab.explorer.stage.groups[0].children.find(m => m.isMesh && m.name === 'crank').geometry"
    page.evaluate(f"{drawn}.computeBoundingBox()")
    width = page.evaluate("lab.explorer.model.document.bodies[0].shapes[0].size.width")
    assert page.evaluate(f"{drawn}.boundingBox.max.x") == pytest.approx(0.15 + width / 2, abs=1e-6)
    type_into(page, "length", "2 m")
    assert "cannot be assembled" in page.evaluate(WORDS)
    type_into(page, "length", "3 kg")
    assert "does not fit" in page.evaluate(WORDS)
    assert page.evaluate(lengths) == pytest.approx([0.15, 0.3, 0.25], abs=1e-15)
    page.keyboard.press("Escape")
    page.evaluate("lab.explorer.undo()")
    assert page.evaluate(lengths) == pytest.approx([0.1, 0.3, 0.25], abs=1e-15)
    page.evaluate("lab.explorer.redo()")
    assert page.evaluate(lengths) == pytest.approx([0.15, 0.3, 0.25], abs=1e-15)


def test_gears_that_no_longer_mesh_say_so(opened: Callable[..., Any]) -> None:
    """Teeth that stay, axes that are drawn apart."""
    page = opened("gear_linkage")
    drag(page, "rocker angle", (20.0, 0.0))
    assert "idler and output do not mesh" in page.evaluate(WORDS)
    page.evaluate("lab.explorer.undo(); lab.explorer.editor.refresh()")
    drag(page, "crank angle", (-20.0, 0.0))
    assert "do not mesh" not in page.evaluate(WORDS)


def test_a_pivot_is_pushed_with_keys_and_a_recording_is_left(look: Callable[..., Any], tmp_path: Path) -> None:
    """In the page of a run edit mode begins at the pose that is shown, and the recording comes back unchanged."""
    story = api.story(api.simulate("slider_crank", duration=0.2))
    page = look(write_page(story, tmp_path / "run.html").as_uri(), width=900, height=700)
    page.evaluate("lab.seek(0.1)")
    before = page.evaluate(POSES)
    page.locator("#edit-button").click(timeout=20000)
    handle = page.locator(".handle[title='crank angle']")
    handle.focus()
    handle.press("Shift+ArrowLeft")
    size = page.evaluate("lab.explorer.model.size")
    moved = np.array(page.evaluate("lab.explorer.model.document.bodies[0].placement.position"))
    assert np.linalg.norm(moved) == pytest.approx(0.05 * size, rel=0.05)
    assert page.evaluate("lab.explorer.report.closed")
    page.evaluate("lab.seek(0.1)")
    np.testing.assert_allclose(np.array(page.evaluate(POSES)), np.array(before), atol=1e-9)
    assert json.dumps(page.evaluate("lab.explorer.model.document.bodies[0].placement.position")) == "[0, 0, 0]"


def test_the_line_that_reproduces_an_edit(opened: Callable[..., Any]) -> None:
    """Two lengths that are parameters give key=value; built with it the definition has the lengths of the page. A pivot that no
    parameter moves says so."""
    page = opened("fourbar")
    code = page.locator(".reproduce code")
    type_into(page, "length", "120mm")
    assert code.text_content() == "mechlab view fourbar crank=120mm"
    drag(page, "pin", (12.0, -9.0))
    words = code.text_content().split()
    assert words[:4] == ["mechlab", "view", "fourbar", "crank=120mm"]
    given = dict(word.split("=") for word in words[3:])
    assert set(given) == {"crank", "coupler", "rocker"}
    twin = api.load("fourbar", given).mechanism()
    document = page.evaluate("lab.explorer.model.document")
    for body, same in zip(document["bodies"], twin.bodies, strict=True):
        assert body["shapes"][0]["size"]["length"] == pytest.approx(same.shapes[0].parameters["length"], rel=1e-10)
        assert body["inertia"]["mass"] == pytest.approx(same.inertia.mass, rel=1e-9)
    middle = next(f for f in document["frames"] if f["name"] == "middle")["placement"]["position"][0]
    assert middle == pytest.approx(twin.frame("middle").placement.position[0], rel=1e-10)
    drag(page, "rocker angle", (0.0, -15.0))
    assert "No named parameters" in page.locator(".reproduce").text_content()
