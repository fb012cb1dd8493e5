"""Looking at parts in a real browser: hovering, picking, hiding; what the card says is what the recording says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mechlab import api
from mechlab.experiment.recording import Recording
from mechlab.mechanism import TreeKinematics
from mechlab.viewer import write_page

Look = Callable[..., Any]
Until = Callable[..., None]

pytestmark = pytest.mark.browser

ON_SCREEN = """body => {
    const { camera, renderer } = lab.viewer, box = renderer.domElement.getBoundingClientRect();
    const k = lab.bodies.indexOf(body);
    // The first place of the window on a grid where a ray meets this body.
    for (let y = box.top + 8; y < box.bottom; y += 6) for (let x = box.left + 8; x < box.right; x += 6) {
        const hit = lab.inspector.picker.hit(x, y);
        if (hit && hit.body === k && document.elementFromPoint(x, y) === renderer.domElement) return [x, y];
    }
    return null;
}"""


@pytest.fixture(scope="module")
def recording() -> Recording:
    return api.simulate("fourbar")


@pytest.fixture(scope="module")
def page(look: Look, recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> Any:
    path = write_page(api.story(recording), tmp_path_factory.mktemp("inspect") / "page.html")
    return look(path.as_uri(), width=1000, height=700)


def test_hover_names_a_part_and_a_click_pins_it(page: Any, until: Until) -> None:
    page.evaluate("lab.seek(0.5)")
    x, y = page.evaluate(ON_SCREEN, "rocker")
    page.mouse.move(x, y)
    until(page, "!document.getElementById('hover').hidden")
    assert page.locator("#hover").inner_text().startswith("rocker")
    page.mouse.click(x, y)
    assert page.locator("#card h2").inner_text() == "rocker"
    page.keyboard.press("Escape")
    assert page.locator("#card").is_hidden()
    # A drag turns the view and pins nothing.
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 40, y + 5)
    page.mouse.up()
    assert page.locator("#card").is_hidden()
    page.evaluate("lab.view('iso')")


def test_a_ray_meets_the_part_that_is_seen(page: Any, recording: Recording) -> None:
    """A point of the surface that is hit lies in the body: its distance from the pin axis is at most the width of the bar."""
    page.evaluate("lab.seek(0)")
    x, y = page.evaluate(ON_SCREEN, "crank")
    body, point = page.evaluate(
        "([x, y]) => { const h = lab.inspector.picker.hit(x, y); return [lab.bodies[h.body], h.point.toArray()]; }",
        [x, y],
    )
    assert body == "crank"
    start, end = np.zeros(3), np.array([recording.at(f"B_{a}", 0.0) for a in "xyz"])
    along = (end - start) / np.linalg.norm(end - start)
    share = float(np.clip((np.array(point) - start) @ along, 0.0, 0.1))
    assert np.linalg.norm((np.array(point) - start - share * along)[[0, 2]]) < 0.02


def test_pose_and_velocity_of_the_card_are_those_of_the_recording(page: Any, recording: Recording) -> None:
    """Poses to 1e-6; velocities from the cubic through coordinates and rates: to 1e-4 of the largest."""
    tree = TreeKinematics(recording.mechanism)
    for time in (0.0, 0.3, 1.2, 2.0):
        k = int(np.abs(recording.t - time).argmin())
        page.evaluate("t => lab.seek(t)", float(recording.t[k]))
        reading = page.evaluate("lab.inspector.readings.of(lab.bodies.indexOf('coupler'))")
        tree.set(recording.q[k], recording.v[k])
        _, origin = tree.pose("coupler")
        np.testing.assert_allclose(reading["position"], origin, atol=1e-6)
        np.testing.assert_allclose(reading["velocity"]["linear"], tree.velocity("coupler", origin)[:3], atol=5e-5)
        np.testing.assert_allclose(reading["velocity"]["angular"], tree.velocity("coupler", origin)[3:], atol=5e-4)


def test_the_card_says_what_the_model_says(page: Any, recording: Recording) -> None:
    m = recording.mechanism
    k = int(np.abs(recording.t - 0.7).argmin())
    page.evaluate("t => lab.seek(t)", float(recording.t[k]))
    for name in ("crank", "coupler", "rocker"):
        reading = page.evaluate("name => lab.inspector.readings.of(lab.bodies.indexOf(name))", name)
        body = m.body(name)
        assert reading["inertia"]["mass"] == body.inertia.mass and reading["inertia"]["com"] == list(body.inertia.com)
        (joint,) = reading["joints"]
        assert (joint["name"], joint["kind"], joint["parent"]) == (body.joints[0].name, "revolute", body.parent)
        value = float(m.value(joint["name"], recording.q[k : k + 1])[0])
        assert joint["value"] == pytest.approx(value, rel=1e-6)  # channels of 32 bits
        poses = page.evaluate(
            "name => { const r = lab.inspector.readings, b = r.byName.get(name); return r.fromPoses(b, b.joints[0]); }",
            name,
        )
        assert (poses - value) % (2 * np.pi) == pytest.approx(0, abs=1e-6) or (value - poses) % (
            2 * np.pi
        ) == pytest.approx(0, abs=1e-6)
    page.evaluate("lab.inspector.pin(lab.bodies.indexOf('rocker'))")
    text = page.locator("#card").inner_text()
    assert (
        "pin: spherical, with coupler" in text
        and f"{m.body('rocker').inertia.mass:g} kg" in text
        and "no limits" in text
    )
    page.keyboard.press("Escape")


def test_hide_isolate_and_show_all(page: Any) -> None:
    shown = "lab.viewer.scene && lab.bodies.filter((_, k) => lab.inspector.stage.groups[k].visible)"
    page.evaluate("lab.inspector.pin(lab.bodies.indexOf('coupler'))")
    page.get_by_role("button", name="Hide", exact=True).click()
    assert page.evaluate(shown) == ["crank", "rocker", "ground"]
    assert page.evaluate(ON_SCREEN, "coupler") is None
    page.locator("#parts summary").click()
    assert page.locator("#parts summary").inner_text() == "Parts (3 of 4)"
    page.get_by_role("button", name="Show all").click()
    page.get_by_label("isolate rocker").click()
    assert page.evaluate(shown) == ["rocker"]
    page.get_by_role("button", name="Show all").click()
    assert len(page.evaluate(shown)) == 4
    page.get_by_role("button", name="crank", exact=True).click()
    assert page.locator("#card h2").inner_text() == "crank"
    page.keyboard.press("Escape")
    assert page.locator("#parts").evaluate("d => d.open") is False


def seen(page: Any, point: list[float]) -> np.ndarray:
    """Where a point of the mechanism is in the picture, -1 to 1."""
    project = "p => { const v = lab.viewer.camera.position.clone().set(p[0], p[2], -p[1]).project(lab.viewer.camera); return [v.x, v.y]; }"
    page.evaluate("lab.viewer.render()")
    return np.array(page.evaluate(project, point))


def test_a_planar_mechanism_opens_face_on_without_perspective(page: Any, look: Look, tmp_path: Path) -> None:
    """The four-bar moves in x, z: depth y changes nothing in its picture, and lengths keep one scale; in perspective they do not."""
    page.evaluate("lab.rig.open()")
    near, far, right = (seen(page, p) for p in ([0.1, -0.2, 0.1], [0.1, 0.3, 0.1], [0.2, 0.0, 0.1]))
    np.testing.assert_allclose(near, far, atol=1e-9)
    width, height = page.evaluate(
        "[lab.viewer.renderer.domElement.clientWidth, lab.viewer.renderer.domElement.clientHeight]"
    )
    up = seen(page, [0.1, 0.0, 0.2])
    assert (right - near)[0] * width == pytest.approx((up - near)[1] * height, rel=1e-9)
    page.get_by_role("button", name="Flat").click()
    assert np.linalg.norm(seen(page, [0.1, -0.2, 0.1]) - seen(page, [0.1, 0.3, 0.1])) > 0.01
    # The picture keeps its size where the view turns about.
    target = page.evaluate("(() => { const t = lab.viewer.controls.target; return [t.x, -t.z, t.y]; })()")
    before = seen(page, [target[0] + 0.05, target[1], target[2]])
    page.get_by_role("button", name="Flat").click()
    np.testing.assert_allclose(seen(page, [target[0] + 0.05, target[1], target[2]]), before, atol=1e-6)
    spatial = look(write_page(api.story("bricard"), tmp_path / "spatial.html").as_uri())
    assert spatial.evaluate("lab.rig.projection.flat") is False
    assert spatial.get_by_role("button", name="Face").count() == 0
