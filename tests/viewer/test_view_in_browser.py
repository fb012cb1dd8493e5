"""What the view shows, in a real browser: springs, a section, a camera that follows, and a link that brings all of it back."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mechlab import api
from mechlab.experiment.recording import Recording
from mechlab.mechanism import TreeKinematics
from mechlab.viewer import Part, from_poses, write_page
from tests.viewer.conftest import box

Look = Callable[..., Any]

pytestmark = pytest.mark.browser

PROJECT = """body => {
    lab.viewer.render();
    const p = lab.inspector.stage.groups[lab.bodies.indexOf(body)].position;
    const v = p.clone().set(p.x, p.z, -p.y).project(lab.viewer.camera);
    return [v.x, v.y];
}"""


@pytest.fixture(scope="module")
def recording() -> Recording:
    return api.simulate("andrews")


@pytest.fixture(scope="module")
def path(recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(api.story(recording), tmp_path_factory.mktemp("view") / "page.html")


@pytest.fixture(scope="module")
def page(look: Look, path: Path) -> Any:
    return look(path.as_uri(), width=1000, height=700)


def test_a_spring_goes_from_point_to_point(page: Any, recording: Recording) -> None:
    (spring,) = recording.mechanism.springs
    tree = TreeKinematics(recording.mechanism)
    for k in (0, len(recording.t) // 2, len(recording.t) - 1):
        page.evaluate("t => lab.seek(t)", float(recording.t[k]))
        tree.set(recording.q[k])
        ends = [tree.pose(b)[1] + tree.pose(b)[0] @ np.array(p) for b, p in
                ((spring.body_a, spring.point_a), (spring.body_b, spring.point_b))]  # fmt: skip
        # The coil is made along z from 0 to 1: its ends are where the group puts 0 and 1.
        drawn = page.evaluate("""() => {
            const g = lab.springs.items[0].group, at = z => g.position.clone().set(0, 0, z).applyMatrix4(g.matrix).toArray();
            g.updateMatrix();
            const box = g.children[0].geometry; box.computeBoundingBox();
            return [at(box.boundingBox.min.z), at(box.boundingBox.max.z)];
        }""")
        length = np.linalg.norm(ends[1] - ends[0])
        # Poses to 1e-6; the wire's own thickness at its ends to 2 % of the length.
        np.testing.assert_allclose(drawn, ends, atol=1e-6 + 0.02 * length)
        assert page.evaluate("lab.springs.items[0].length") == pytest.approx(length, abs=1e-6)


def test_a_spring_is_named_under_the_pointer(page: Any, recording: Recording, until: Callable[..., None]) -> None:
    page.evaluate("lab.seek(0), lab.rig.open()")
    (spring,) = recording.mechanism.springs
    tree = TreeKinematics(recording.mechanism, recording.q[0])
    ends = [tree.pose(b)[1] + tree.pose(b)[0] @ np.array(p) for b, p in
            ((spring.body_a, spring.point_a), (spring.body_b, spring.point_b))]  # fmt: skip
    length = float(np.linalg.norm(ends[1] - ends[0]))
    # The straight piece of wire at its free end, a twentieth of its length from there.
    spot = page.evaluate("p => lab.onScreen(p)", (ends[1] + 0.05 * (ends[0] - ends[1])).tolist())
    page.mouse.move(*spot)
    until(page, "document.getElementById('hover').innerText.startsWith('spring: ')")
    words = page.locator("#hover").inner_text()
    assert f"{length * 1e3:.4g} mm long" in words
    assert (
        f"{abs(length - spring.rest_length) * 1e3:.4g} mm {'shorter' if length < spring.rest_length else 'longer'} than at rest"
        in words
    )


def test_a_section_cuts_the_parts_and_what_is_picked(page: Any) -> None:
    page.evaluate("lab.seek(0)")
    page.locator("#section summary").click()
    page.get_by_role("button", name="\u22a5 x").click()
    slider = page.get_by_role("slider", name="Place of the section")
    slider.fill("0.6")
    low, high = page.evaluate("lab.inspector.section.limits")
    at = page.evaluate("lab.inspector.section.at")
    assert at == pytest.approx(low + 0.6 * (high - low), abs=1e-9)
    beyond = """() => { const s = lab.inspector.section, out = [], box = lab.viewer.renderer.domElement.getBoundingClientRect();
        for (let y = box.top; y < box.bottom; y += 9) for (let x = box.left; x < box.right; x += 9) {
            const hit = lab.inspector.picker.hit(x, y); if (hit) out.push(hit.point.x); }
        return out; }"""
    kept = np.array(page.evaluate(beyond))
    flipped = page.evaluate("lab.inspector.section.flipped")
    assert len(kept) > 5 and np.all((kept >= at - 1e-9) if flipped else (kept <= at + 1e-9))
    page.get_by_role("button", name="Other side").click()
    other = np.array(page.evaluate(beyond))
    assert len(other) > 5 and np.all((other <= at + 1e-9) if flipped else (other >= at - 1e-9))
    planes = page.evaluate("""lab.inspector.stage.groups.flatMap(g => g.children.filter(x => x.isMesh))
        .map(x => [x.material.clippingPlanes.length, x.material.clippingPlanes[0].constant])""")
    assert planes and all(p == planes[0] and abs(p[1]) == pytest.approx(abs(at)) for p in planes)
    page.get_by_role("button", name="Off").click()
    assert len(page.evaluate(beyond)) > max(len(kept), len(other))
    page.keyboard.press("Escape")


def test_a_section_shows_where_it_runs_through_material(look: Look, tmp_path: Path) -> None:
    """A box of 0.2 x 0.1 x 0.06 m with a bore of 0.06 x 0.02 m along x, made of four bars: the cut across x has the area of their
    ends, counted in pixels of the colour of cuts."""
    bars = [(0.1, 0.02, 0.0, 0.02), (0.1, 0.02, 0.0, -0.02), (0.02, 0.02, 0.04, 0.0), (0.02, 0.02, -0.04, 0.0)]
    parts = []
    for k, (y, z, at_y, at_z) in enumerate(bars):
        place = np.eye(4)
        place[:3, 3] = [0.0, at_y, at_z]
        parts.append(Part("block", f"bar_{k}", *box(0.2, y, z), color=(0.5, 0.5, 0.5, 1.0), placement=place))
    page = look(
        write_page(from_poses("block", {"block": np.eye(4)}, parts), tmp_path / "page.html").as_uri(),
        width=900,
        height=700,
    )
    page.evaluate(
        "lab.rig.view('right'), lab.rig.projection.set(true), lab.rig.fit(), lab.inspector.section.set('x', 0.01, false)"
    )
    (x1, y1), (x2, y2) = (page.evaluate("p => lab.onScreen(p)", [0.0, y, 0.0]) for y in (0.0, 0.1))
    scale = float(np.hypot(x2 - x1, y2 - y1)) / 0.1
    count = page.evaluate("""() => {
        lab.quality.full();
        const gl = lab.viewer.renderer.getContext(), { width, height } = lab.viewer.renderer.domElement;
        const pixels = new Uint8Array(4 * width * height);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        let count = 0;
        for (let i = 0; i < pixels.length; i += 4) if (pixels[i] - pixels[i + 2] > 60) count++;
        return count;
    }""")
    area = sum(y * z for y, z, _, _ in bars)
    assert count / scale**2 == pytest.approx(area, rel=0.03)  # whole pixels along 0.4 m of border


def test_the_camera_follows_a_part(page: Any) -> None:
    page.evaluate("lab.seek(0), lab.rig.open()")
    page.evaluate("lab.inspector.pin(lab.bodies.indexOf('K2'))")
    before = page.evaluate(PROJECT, "K2")
    page.get_by_role("button", name="Follow").click()
    page.evaluate("lab.seek(0.03)")
    np.testing.assert_allclose(page.evaluate(PROJECT, "K2"), before, atol=1e-6)
    assert "follows K2" in page.locator("#following").inner_text()
    page.get_by_role("button", name="Stop following").click()
    page.evaluate("lab.seek(0.04)")
    assert np.linalg.norm(np.subtract(page.evaluate(PROJECT, "K2"), before)) > 0.01
    page.keyboard.press("Escape")


def test_a_link_brings_the_whole_view_back(page: Any, look: Look, path: Path) -> None:
    page.evaluate("""() => {
        lab.seek(0.0123); lab.rig.view('iso'); lab.rig.projection.set(false);
        lab.inspector.visibility.set([2, 4]); lab.inspector.pin(3); lab.inspector.follow.set(1);
        lab.inspector.section.set('y', 0.01, true); document.getElementById('show-axes').click();
        lab.curves.picker.choose('beta_rate'); lab.curves.window.zoom(0.01, 0.02);
    }""")
    page.get_by_role("button", name="Link").click()
    text = page.evaluate("lab.address.text()")
    other = look(path.as_uri() + "#" + text, width=1000, height=700)
    state = """() => ({ time: lab.time, flat: lab.rig.projection.flat, hidden: [...lab.inspector.visibility.hidden],
        pin: lab.inspector.card.body, follow: lab.inspector.follow.body, axes: document.getElementById('show-axes').checked,
        section: [lab.inspector.section.axis, lab.inspector.section.at, lab.inspector.section.flipped],
        plots: lab.curves.picker.chosen, zoom: [lab.curves.window.start, lab.curves.window.end] })"""
    assert other.evaluate(state) == page.evaluate(state)
    assert other.evaluate("lab.address.text()") == text
    for body in ("K2", "K5"):
        np.testing.assert_allclose(other.evaluate(PROJECT, body), page.evaluate(PROJECT, body), atol=1e-4)
    # What does not exist is left alone.
    other.evaluate("lab.address.apply('hide=nobody&pin=nobody&plot=nothing&section=w,1&camera=1,2&t=x&drive=1,none')")
    for broken in ("section=constructor,0", "drive=1,toString", "camera=0,0,0,0,0,0", "camera=1e300,0,0,0,0,0", "%"):
        other.evaluate("text => { lab.address.apply(text); lab.viewer.render(); }", broken)
    assert other.errors == []


def test_at_most_twelve_names_are_shown(look: Look, tmp_path: Path) -> None:
    page = look(write_page(api.story("delta6"), tmp_path / "page.html").as_uri(), width=1400, height=900)
    page.evaluate("for (const box of document.querySelectorAll('#show input')) if (!box.checked) box.click()")
    page.evaluate(
        "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done))))"
    )
    names = "[...document.querySelectorAll('.label')].filter(e => e.id !== 'hover' && !e.hidden && e.textContent).map(e => e.textContent)"
    assert 4 < len(page.evaluate(names)) <= 12
    hidden = next(b for b in page.evaluate("lab.bodies") if b not in page.evaluate(names) and b.startswith("rod"))
    page.evaluate("name => lab.inspector.labels.focus(lab.bodies.indexOf(name))", hidden)
    page.evaluate(
        "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done))))"
    )
    assert hidden in page.evaluate(names)


def test_a_link_carries_parameters_drives_forces_and_measuring(look: Look, tmp_path: Path) -> None:
    path = write_page(api.explore("fourbar", vary={"crank": (0.08, 0.1, 0.12)}), tmp_path / "page.html")
    page = look(path.as_uri(), width=1000, height=700)
    page.evaluate("""() => {
        lab.explorer.pick(0, 2); lab.explorer.move('crank_angle', 1.3); lab.explorer.freeBody.choose('coupler', ['net']);
        const m = lab.inspector.measuring; m.switch(true);
        m.take(0, m.named.find(x => x.name === 'point B')); m.take(1, m.named.find(x => x.name === 'axis of rocker_angle'));
    }""")
    text = page.evaluate("lab.address.text()")
    other = look(path.as_uri() + "#" + text, width=1000, height=700)
    state = """() => ({ picked: lab.explorer.picked, values: lab.explorer.values, forces: lab.arrows.map(a => [a.label, a.size]),
        measured: lab.inspector.measuring.result })"""
    mine, theirs = page.evaluate(state), other.evaluate(state)
    assert mine["picked"] == theirs["picked"] == [2]
    assert mine["values"] == theirs["values"] and mine["measured"]["distance"] == pytest.approx(
        theirs["measured"]["distance"], abs=1e-9
    )
    assert [a for a, _ in mine["forces"]] == [a for a, _ in theirs["forces"]] and "joint with crank, on coupler" in [
        a for a, _ in mine["forces"]
    ]
    np.testing.assert_allclose([x for _, x in mine["forces"]], [x for _, x in theirs["forces"]], rtol=1e-6)
    assert other.evaluate("lab.address.text()") == text
