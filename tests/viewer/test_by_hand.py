"""Moving a mechanism by hand in a real browser: sliders, fields, locks, undo, grabbing with mouse, finger and keys.

Poses are compared with Pinocchio's closure at the values that the page shows, or with closed forms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mechlab import api
from mechlab.analytic.fourbar import solve
from mechlab.engines.pinocchio.inverse import assemble
from mechlab.mechanism import Builder, Inertia, Mechanism, prismatic, shape, spherical
from mechlab.mechanism.geometry import Array
from mechlab.viewer import Part, Story, write_page
from mechlab.viewer.from_recording import placed
from tests.viewer.conftest import box

pytestmark = pytest.mark.browser

OPEN = 1e-9
"""Largest opening of a loop in sizes of the mechanism: what the page promises."""
EXACT = 1e-8
"""Largest difference to Pinocchio's closure at the same values, in sizes and in entries of rotations."""
DOUBLE_ROCKER = {"crank": 0.3, "coupler": 0.25, "rocker": 0.28, "ground": 0.6}
POSES = "lab.bodies.map(name => lab.pose(name))"
CAMERA = "[...lab.viewer.camera.position.toArray(), ...lab.viewer.camera.quaternion.toArray()]"
HELD = "(() => { const h = lab.explorer.grabber.held; return [h.inBody.toArray(), h.target.toArray()]; })()"
MIDDLE = """name => { const g = lab.explorer.stage.groups[lab.bodies.indexOf(name)], box = new MeshCat.THREE.Box3();
  for (const m of g.children.filter(m => m.isMesh)) { m.geometry.computeBoundingBox();
    box.union(m.geometry.boundingBox.clone().applyMatrix4(m.matrix)); }
  return lab.onScreen(box.getCenter(new MeshCat.THREE.Vector3()).applyQuaternion(g.quaternion).add(g.position).toArray()); }"""


@pytest.fixture
def opened(look: Callable[..., Any], tmp_path: Path) -> Callable[..., Any]:
    """Opens the page of a Story."""

    def show(story: Story, width: int = 700, height: int = 560) -> Any:
        page = look(write_page(story, tmp_path / "page.html").as_uri(), width=width, height=height)
        page.evaluate("lab.view('front')")
        return page

    return show


def closed_at(story: Story, values: dict[str, float]) -> Array:
    """(nb, 4, 4) poses by Pinocchio's closure with these values of the drives, along a path from the reference pose."""
    assert story.model is not None
    found = assemble(story.model, values, steps=12, watch=False)
    assert found.closed, found.status
    return np.asarray(placed(story.model, found.q[None])[1][0])


def check_closed(page: Any, story: Story) -> dict[str, float]:
    """The loops are closed and all bodies stand where Pinocchio puts them; returns the values that the page shows."""
    report = page.evaluate("lab.explorer.report")
    size = page.evaluate("lab.explorer.model.size")
    values: dict[str, float] = page.evaluate("lab.explorer.values")
    assert report["closed"] and report["gap"] < OPEN * max(1.0, size)
    expected, seen = closed_at(story, values), np.array(page.evaluate(POSES))
    np.testing.assert_allclose(seen[:, :3, 3], expected[:, :3, 3], atol=EXACT * size)
    np.testing.assert_allclose(seen[:, :3, :3], expected[:, :3, :3], atol=EXACT)
    return values


def drag(page: Any, start: list[float], way: tuple[float, float], steps: int = 6, drop: bool = True) -> None:
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(start[0] + way[0], start[1] + way[1], steps=steps)
    if drop:
        page.mouse.up()


def test_sliders_of_a_four_bar_show_the_closed_form(opened: Callable[..., Any]) -> None:
    """Rocker angles at 41 crank angles, turned through more than a turn, are those of the analytic four-bar."""
    page = opened(api.explore("fourbar", vary={}))
    for crank in np.linspace(-2.0, 5.0, 41):
        report = page.evaluate("v => lab.explorer.move('crank_angle', v)", float(crank))
        assert report["closed"] and report["gap"] < OPEN
        pose = np.array(page.evaluate("lab.pose('rocker')"))
        expected = float(solve(0.1, 0.3, 0.25, 0.3, float(crank), mode=1).rocker_angle)
        assert abs(np.angle(np.exp(1j * (np.arctan2(pose[2, 0], pose[0, 0]) - expected)))) < EXACT
    page.evaluate("lab.explorer.end()")
    assert page.requests == [page.url] and page.errors == []


def test_a_fold_stops_the_drive_where_the_law_of_cosines_says(opened: Callable[..., Any]) -> None:
    a, b, c, d = DOUBLE_ROCKER.values()
    limit = np.arccos((a**2 + d**2 - (b + c) ** 2) / (2 * a * d))
    page = opened(api.explore("fourbar", DOUBLE_ROCKER, vary={}))
    assert page.locator("#hand .state.ok").count() == 1
    page.evaluate("lab.explorer.move('crank_angle', 3)")
    # The drive is stationary at the fold: a step of 3e-5 along the curve is 1e-9 in its value.
    assert page.evaluate("lab.explorer.values.crank_angle") == pytest.approx(limit, abs=1e-6)
    assert "crank_angle" in page.locator("#hand .state.error").inner_text().lower()
    assert page.locator("#stage.impossible").count() == 1
    assert page.evaluate("lab.explorer.report.closeness") < 1e-2
    page.get_by_role("slider", name="crank_angle").press("Home")
    assert page.locator("#stage.impossible").count() == 0
    page.evaluate("new Promise(done => { const wait = () => lab.explorer.curves.done ? done() : setTimeout(wait, 20); wait(); })")
    ends = np.array(page.evaluate("lab.explorer.curves.values"))
    np.testing.assert_allclose(ends[[0, -1]], [-limit, limit], atol=1e-6)


@pytest.mark.parametrize("name", ["platform_3rrr", pytest.param("delta6", marks=pytest.mark.slow)])
def test_all_drives_stay_where_they_are_put(name: str, opened: Callable[..., Any]) -> None:
    """Each drive is moved by a share of its slider; afterwards all are exactly there, and the poses are Pinocchio's."""
    story = api.explore(name, vary={})
    page = opened(story)
    drives = page.evaluate("lab.explorer.drives")
    share = 0.02 if name == "platform_3rrr" else 0.1
    put = {d["name"]: d["home"] + share * (-1) ** k * (d["high"] - d["low"]) for k, d in enumerate(drives)}
    for drive, value in put.items():
        assert page.evaluate("([n, v]) => lab.explorer.move(n, v)", [drive, value])["stops"] == []
    assert page.evaluate("lab.explorer.values") == put
    if name == "platform_3rrr":
        check_closed(page, story)
    else:  # rods turn idly about themselves: the platform is determined
        assert story.model is not None
        k = story.bodies.index("platform")
        seen = np.array(page.evaluate("lab.pose('platform')"))
        np.testing.assert_allclose(seen, closed_at(story, put)[k], atol=EXACT)
    assert page.evaluate("lab.explorer.otherMode") is False


def test_a_part_is_pulled_with_the_mouse(opened: Callable[..., Any]) -> None:
    """The coupler follows as near as it can: nearer than 2000 crank angles of the closed form come, to their spacing."""
    story = api.explore("fourbar", vary={})
    page = opened(story)
    camera, start = page.evaluate(CAMERA), page.evaluate(MIDDLE, "coupler")
    before = page.evaluate("lab.explorer.values.crank_angle")
    drag(page, start, (-60.0, -40.0), drop=False)
    values = check_closed(page, story)
    assert abs(values["crank_angle"] - before) > 0.05
    local, target = (np.array(x) for x in page.evaluate(HELD))
    crank = np.linspace(0.0, 2 * np.pi, 2001)
    found = solve(0.1, 0.3, 0.25, 0.3, crank, mode=1)
    b = 0.1 * np.stack([np.cos(crank), np.sin(crank)], axis=1)
    angle = np.asarray(found.coupler_angle)
    along, across = np.stack([np.cos(angle), np.sin(angle)], axis=1), np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    # In the body x lies along the coupler and z across it; y is out of the plane.
    places = b + local[0] * along + local[2] * across
    miss = np.hypot(np.hypot(places[:, 0] - target[0], places[:, 1] - target[2]), local[1] - target[1])
    assert page.evaluate("lab.explorer.report.miss") <= miss.min() + 1e-9
    assert page.evaluate("lab.explorer.before.holder.visible") is True
    page.mouse.up()
    assert page.evaluate(CAMERA) == camera
    assert page.evaluate("lab.explorer.grabber.rubber.group.visible") is False


def test_empty_space_turns_the_camera(opened: Callable[..., Any]) -> None:
    page = opened(api.explore("fourbar", vary={}))
    camera, values = page.evaluate(CAMERA), page.evaluate("lab.explorer.values")
    drag(page, [20.0, page.evaluate("document.getElementById('viewport').clientHeight") - 20.0], (60.0, -30.0))
    assert page.evaluate(CAMERA) != camera
    assert page.evaluate("lab.explorer.values") == values


def test_out_of_reach_is_said_in_millimetres(opened: Callable[..., Any]) -> None:
    """The crank's tip is pulled away from its pivot: it points there, and misses by the distance less the crank."""
    page = opened(api.explore("fourbar", vary={}))
    tip = page.evaluate("lab.pose('coupler')")
    start = page.evaluate("p => lab.onScreen(p)", [row[3] for row in tip[:3]])
    x, y = page.evaluate("p => lab.onScreen(p)", [0.0, 0.0, 0.0])
    inside = [start[0] + 0.3 * (x - start[0]), start[1] + 0.3 * (y - start[1])]
    drag(page, inside, (-150.0, 0.0), drop=False)
    assert page.evaluate("lab.bodies[lab.explorer.grabber.held.body]") == "crank"
    local, target = (np.array(x) for x in page.evaluate(HELD))
    expected = np.hypot(np.hypot(target[0], target[2]) - np.hypot(local[0], local[2]), target[1] - local[1])
    assert page.evaluate("lab.explorer.report.miss") == pytest.approx(expected, abs=1e-7)
    label = page.locator(".label.missed").inner_text()
    assert float(label.split()[0]) == pytest.approx(1e3 * expected, rel=5e-3) and label.endswith("mm out of reach")
    assert "as near as the mechanism lets it come" in page.locator("#hand .state.warning").inner_text()
    page.mouse.up()
    assert page.locator("#hand .state.ok").count() == 1


def test_a_locked_drive_holds_while_a_part_is_pulled(opened: Callable[..., Any]) -> None:
    story = api.explore("platform_3rrr", vary={})
    page = opened(story)
    names = page.evaluate("lab.explorer.model.drives")
    page.get_by_role("button", name=f"Lock {names[0]}").click()
    before = page.evaluate("lab.explorer.values")
    page.evaluate("lab.view('top')")
    drag(page, page.evaluate(MIDDLE, "platform"), (25.0, 15.0))
    values = check_closed(page, story)
    assert values[names[0]] == pytest.approx(before[names[0]], abs=1e-12)
    assert max(abs(values[n] - before[n]) for n in names[1:]) > 1e-3
    assert page.get_by_role("slider", name=names[0]).is_disabled()
    for name in names[1:]:
        page.get_by_role("button", name=f"Lock {name}").click()
    drag(page, page.evaluate(MIDDLE, "platform"), (25.0, 15.0), drop=False)
    assert page.evaluate("lab.explorer.values") == pytest.approx(values, abs=1e-9)
    said = page.locator("#hand .state.warning strong").inner_text()
    assert all(name in said for name in names) and "locked" in said
    page.mouse.up()


def test_undo_and_redo(opened: Callable[..., Any]) -> None:
    page = opened(api.explore("fourbar", vary={}))
    slider = page.get_by_role("slider", name="crank_angle")
    poses = [page.evaluate(POSES)]
    for press in ("Shift+ArrowRight", "ArrowLeft", "Shift+ArrowRight"):
        slider.press(press)
        poses.append(page.evaluate(POSES))
    undo, redo = page.get_by_role("button", name="Undo"), page.get_by_role("button", name="Redo")
    assert redo.is_disabled()
    page.keyboard.press("Control+z")
    np.testing.assert_allclose(page.evaluate(POSES), poses[2], atol=1e-14)
    undo.click()
    undo.click()
    np.testing.assert_allclose(page.evaluate(POSES), poses[0], atol=1e-14)
    assert undo.is_disabled()
    page.keyboard.press("Control+Shift+z")
    redo.click()
    np.testing.assert_allclose(page.evaluate(POSES), poses[2], atol=1e-14)
    slider.press("ArrowRight")
    assert redo.is_disabled()


def test_numbers_with_units(opened: Callable[..., Any]) -> None:
    page = opened(api.explore("fourbar", vary={}))
    field = page.get_by_label("crank_angle, a number with a unit")
    given = {"37deg": np.deg2rad(37.0), "-0.5": -0.5, "0.25 rev": np.pi / 2, "\u221240\u00b0": np.deg2rad(-40.0), "1,2": 1.2}
    for text, value in given.items():
        field.fill(text)
        field.press("Enter")
        assert page.evaluate("lab.explorer.values.crank_angle") == pytest.approx(value, abs=1e-12)
        assert field.input_value() == f"{value:.3f} rad".replace("-", "\u2212")
    refused = {"5mm": "mm does not fit here; expected rad, mrad, deg", "abc": "abc is not a number; expected one such as 37deg"}
    for text, words in refused.items():
        field.fill(text)
        field.press("Enter")
        assert words in page.get_by_role("alert").first.inner_text()
        assert page.evaluate("lab.explorer.values.crank_angle") == pytest.approx(1.2, abs=1e-12)


def test_keys_take_the_next_part_and_push_it(opened: Callable[..., Any]) -> None:
    """An arrow key pushes the crank's end by a hundredth of the size along the screen, as far as its circle lets it."""
    story = api.explore("fourbar", vary={})
    page = opened(story)
    page.locator("#viewport").focus()
    for body in ("crank", "coupler", "crank"):
        page.keyboard.press("Tab" if body != "crank" or page.evaluate("!lab.explorer.grabber.held") else "Shift+Tab")
        assert page.evaluate("lab.bodies[lab.explorer.grabber.held.body]") == body
    step = 0.01 * page.evaluate("2 * lab.explorer.stage.framing.radius")
    place = "lab.explorer.grabber.place().toArray()"
    for key, axis, sign in (("ArrowUp", 2, 1), ("ArrowLeft", 0, -1), ("ArrowDown", 2, -1)):
        before = np.array(page.evaluate(place))
        page.keyboard.press(key)
        after, target = np.array(page.evaluate(place)), np.array(page.evaluate("lab.explorer.grabber.held.target.toArray()"))
        expected = before.copy()
        expected[axis] += sign * step
        np.testing.assert_allclose(target, expected, atol=1e-9)
        arm = target * [1.0, 0.0, 1.0]  # the crank turns about the y axis through the origin
        nearest = arm / np.linalg.norm(arm) * np.linalg.norm(before * [1.0, 0.0, 1.0]) + before * [0.0, 1.0, 0.0]
        # Beside the nearest point by d, the miss m grows by d^2 / 2m: at 1e-12 of it d is some 1e-7.
        np.testing.assert_allclose(after, nearest, atol=1e-6)
    check_closed(page, story)
    page.keyboard.press("Escape")
    assert page.evaluate("lab.explorer.grabber.held") is None
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement !== document.getElementById('viewport')")
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    assert page.evaluate("lab.explorer.values.crank_angle") == 1


def telescope() -> Mechanism:
    """A user's mechanism that is not planar: a tube that slides on an arm with a ball joint."""
    b = Builder("telescope")
    heavy = Inertia(mass=0.1, com=(0.0, 0.0, 0.0), tensor=(1e-4, 1e-4, 1e-4, 0.0, 0.0, 0.0))
    b.body("arm", spherical("ball"), inertia=heavy, shapes=(shape("rod", length=0.2, radius=0.01),))
    b.body("tube", prismatic("length", "x"), parent="arm", at=(0.2, 0.0, 0.0), inertia=heavy, shapes=(shape("sphere", radius=0.04),))
    return b.build()


TOUCH = """([type, id, x, y]) => { const c = lab.viewer.renderer.domElement;
  c.setPointerCapture = () => {};  // no such pointer exists for the browser
  c.dispatchEvent(new PointerEvent(type, { pointerId: id, pointerType: "touch", isPrimary: id === 1, clientX: x, clientY: y,
    bubbles: true, buttons: type === "pointerup" ? 0 : 1 })); }"""


def test_two_fingers_move_a_part_in_depth(opened: Callable[..., Any]) -> None:
    """A telescope on a ball joint reaches every target: one finger moves it across, a second one away."""
    page = opened(api.explore(telescope))
    camera, (x, y) = page.evaluate(CAMERA), page.evaluate(MIDDLE, "tube")
    touch = lambda *what: page.evaluate(TOUCH, list(what))  # noqa: E731
    touch("pointerdown", 1, x, y)
    touch("pointermove", 1, x + 12, y)
    across = np.array(page.evaluate("lab.explorer.grabber.held.target.toArray()"))
    touch("pointerdown", 2, x + 80, y)
    touch("pointermove", 2, x + 80, y - 30)
    deep = np.array(page.evaluate("lab.explorer.grabber.held.target.toArray()"))
    away = np.array(page.evaluate("(() => { const h = lab.explorer.grabber.held; return h.normal.toArray(); })()"))
    assert (deep - across) @ away > 0
    assert np.linalg.norm(page.evaluate("p => lab.onScreen(p)", deep.tolist()) - np.array([x + 12, y])) < 1e-6
    place = page.evaluate("lab.explorer.grabber.place().toArray()")
    np.testing.assert_allclose(place, deep, atol=1e-9)
    touch("pointerup", 2, x + 80, y - 30)
    touch("pointerup", 1, x + 12, y)
    assert page.evaluate("lab.explorer.grabber.held") is None
    assert page.evaluate("lab.viewer.controls.enabled") is True
    assert page.evaluate(CAMERA) == camera


def test_shift_moves_a_part_in_depth_and_a_veil_is_grabbed_through(opened: Callable[..., Any]) -> None:
    """With shift the mouse moves the target along the line of sight only; something see-through that stands still is no obstacle."""
    story = api.explore(telescope)
    size, still = np.array([0.6, 0.6, 0.6]), "ground"
    veil = Part(still, "veil", *box(*size), color=(0.2, 0.4, 0.8, 0.4))
    page = opened(replace(story, parts=(*story.parts, veil)))
    x, y = page.evaluate(MIDDLE, "tube")
    assert page.evaluate("([x, y]) => lab.inspector.picker.hit(x, y).part", [x, y]) == "veil"
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 10, y, steps=2)
    across = np.array(page.evaluate(HELD)[1])
    page.keyboard.down("Shift")
    page.mouse.move(x + 10, y - 25, steps=2)
    deep = np.array(page.evaluate(HELD)[1])
    seen = [page.evaluate("p => lab.onScreen(p)", p.tolist()) for p in (across, deep)]
    np.testing.assert_allclose(seen[0], seen[1], atol=1e-6)
    assert np.linalg.norm(deep - across) > 0.01
    assert page.evaluate("lab.explorer.report.miss") < 1e-9
    page.keyboard.up("Shift")
    page.mouse.move(x + 20, y - 25, steps=2)
    after = page.evaluate("p => lab.onScreen(p)", page.evaluate(HELD)[1])
    np.testing.assert_allclose(after, [seen[1][0] + 10, seen[1][1]], atol=1e-6)
    page.mouse.up()


def test_a_recorded_pose_is_moved_on_by_hand(opened: Callable[..., Any]) -> None:
    """Grabbing leaves the playback at the pose shown; the button and the player lead back to it."""
    recording = api.simulate("fourbar")
    story = api.story(recording)
    page = opened(story, width=900)
    page.evaluate("lab.seek(0.7)")
    recorded = np.array(page.evaluate(POSES))
    assert page.locator("#hand").is_hidden()
    start = page.evaluate(MIDDLE, "rocker")
    drag(page, start, (6.0, 0.0), steps=3)
    assert "Moved by hand. The recording waits at 0.7\u00a0s." in page.locator("#by-hand").inner_text()
    values = check_closed(page, story)
    assert 1e-4 < abs(values["crank_angle"] - recording.at("crank_angle", 0.7)) < 0.5
    page.keyboard.press("Control+z")
    # The coordinates of a page have 32 bits; they are closed again.
    np.testing.assert_allclose(page.evaluate(POSES), recorded, atol=2e-6)
    page.get_by_role("button", name="Back to the recording").click()
    np.testing.assert_allclose(page.evaluate(POSES), recorded, atol=1e-12)
    assert page.locator("#by-hand").is_hidden() and page.locator("#hand").is_hidden()
    drag(page, start, (6.0, 0.0), steps=3)
    page.evaluate("lab.seek(0.2)")
    assert page.locator("#by-hand").is_hidden()
    assert page.evaluate("lab.time") == pytest.approx(0.2)


def test_a_parameter_takes_the_page_to_another_exact_mechanism(opened: Callable[..., Any]) -> None:
    """Rocker angles of the variants are those of the closed form, loops closed; a value without a mechanism says why."""
    page = opened(api.explore("fourbar", vary={"crank": (0.08, 0.1, 0.12), "ground": (0.3, 0.9)}))
    for k, crank in enumerate((0.08, 0.1, 0.12)):
        page.evaluate("k => lab.explorer.pick(0, k)", k)
        for angle in (-1.3, 0.4, 2.2):
            assert page.evaluate("v => lab.explorer.move('crank_angle', v)", angle)["gap"] < OPEN
            pose = np.array(page.evaluate("lab.pose('rocker')"))
            expected = float(solve(crank, 0.3, 0.25, 0.3, angle, mode=1).rocker_angle)
            assert np.arctan2(pose[2, 0], pose[0, 0]) == pytest.approx(np.angle(np.exp(1j * expected)), abs=EXACT)
    page.evaluate("lab.explorer.end()")
    slider = page.get_by_role("slider", name="parameter ground")
    slider.fill("1")
    assert "No mechanism here" in page.locator("#hand .state.error").inner_text()
    assert "0.9 m" in page.locator("#hand .state.error").inner_text()
    slider.fill("0")
    assert page.locator("#hand .state.ok").count() == 1
    page.get_by_role("slider", name="parameter crank").fill("0")
    pin = "lab.explorer.model.document.bodies.find(b => b.name === 'coupler').placement.position[0]"
    longer, shorter = f"{pin} === 0.1", f"{pin} === 0.08"
    assert page.evaluate(shorter)
    page.get_by_role("button", name="Undo").click()
    assert page.evaluate(longer) and page.locator("#hand .state.ok").count() == 1
    page.get_by_role("button", name="Redo").click()
    assert page.evaluate(shorter)


def test_the_curves_of_a_drive_are_those_of_its_points(opened: Callable[..., Any]) -> None:
    """The path of the coupler's middle, drawn by the page, is that of the closed form at every one of its points."""
    page = opened(api.explore("fourbar", vary={}))
    page.evaluate("new Promise(done => { const wait = () => lab.explorer.curves.done ? done() : setTimeout(wait, 20); wait(); })")
    crank = np.array(page.evaluate("lab.explorer.curves.values"))
    assert np.ptp(crank) == pytest.approx(2 * np.pi, abs=1e-9) and len(crank) > 200
    paths = page.evaluate("lab.explorer.curves.paths")
    angle = np.asarray(solve(0.1, 0.3, 0.25, 0.3, crank, mode=1).coupler_angle)
    for name, along in (("B", 0.0), ("middle", 0.15), ("C", 0.3)):
        path = np.reshape(paths[name], (-1, 3))
        expected = np.stack([0.1 * np.cos(crank) + along * np.cos(angle), 0.1 * np.sin(crank) + along * np.sin(angle)], axis=1)
        np.testing.assert_allclose(path[:, [0, 2]], expected, atol=EXACT)


def test_the_free_body_of_a_part(opened: Callable[..., Any]) -> None:
    """The arrows on the coupler are its loads in Newton's law: they give it the acceleration of the closed form."""
    story = api.explore("fourbar", vary={})
    page = opened(story)
    page.locator("#free-body").select_option("on coupler")
    page.evaluate("lab.explorer.move('crank_angle', 0.7)")
    seen = page.evaluate("lab.arrows.map(a => [a.name, a.kind, (a.sign || 1), [...a.vectors]])")
    assert {name for name, *_ in seen} == {"pin", "coupler_joint", "weight of coupler"}
    total = sum(sign * np.array(vector) for _, _, sign, vector in seen)
    rate = 2 * np.pi
    found = solve(0.1, 0.3, 0.25, 0.3, 0.7, rate, 0.0, mode=1)

    def radial(length: float, angle: float, turn: float, change: float) -> Array:
        out, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        return np.asarray(length * (change * across - turn**2 * out))

    angle, turn, change = (float(x) for x in (found.coupler_angle, found.coupler_rate, found.coupler_accel))
    acceleration = radial(0.1, 0.7, rate, 0.0) + radial(0.15, angle, turn, change)
    assert story.model is not None
    mass = next(b for b in story.model.bodies if b.name == "coupler").inertia.mass
    # Differences over 2e-3 rad of poses closed to 1e-13: 1e-7 of the acceleration.
    np.testing.assert_allclose(total[[0, 2]], mass * acceleration, atol=1e-6 * mass * np.linalg.norm(acceleration))
    assert "moving steadily at 6.283 rad/s" in page.locator(".forces").inner_text()
    page.locator("#free-body").select_option("none")
    assert page.evaluate("lab.arrows.length") == 0
