"""Real mechanisms in a real browser, offline: the scene is the recording; the sliders keep the loops closed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mechlab import api
from mechlab.errors import MechlabError
from mechlab.experiment.recording import Finding, Health
from mechlab.formats import save_recording
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute, shape
from mechlab.viewer import Story, write_page

pytestmark = pytest.mark.browser

POSES = "names => names.map(name => lab.pose(name))"


def rocker(length: float = 0.2) -> Mechanism:
    """A user's mechanism: two bars that hang from each other."""
    b = Builder("rocker")
    bar = (shape("rod", length=length, radius=0.01),)
    heavy = Inertia(mass=0.1, com=(0.5 * length, 0.0, 0.0), tensor=(1e-4, 4e-4, 4e-4, 0.0, 0.0, 0.0))
    b.body("upper", revolute("upper_angle", "y"), inertia=heavy, shapes=bar)
    b.body("lower", revolute("lower_angle", "y"), parent="upper", at=(length, 0.0, 0.0), inertia=heavy, shapes=bar)
    b.frame("tip", "lower", at=(length, 0.0, 0.0))
    return b.build()


def run_of(name: str) -> Story:
    if name == "user":
        return api.story(api.simulate(rocker, duration=1.0))
    return api.story(api.simulate(name))


@pytest.mark.parametrize("name", ["fourbar", "planetary_stage", "user", pytest.param("delta6", marks=pytest.mark.slow)])
def test_the_scene_is_the_recording(
    name: str, look: Callable[..., Any], until: Callable[..., None], tmp_path: Path
) -> None:
    """At 20 recorded times every body stands where the run left it, to 1e-6 (quaternions of 32 bits: 2e-7)."""
    story = run_of(name)
    path = write_page(story, tmp_path / "page.html")
    assert path.stat().st_size < 3_000_000
    page = look(path.as_uri())
    for k in np.random.default_rng(3).choice(len(story.t), 20, replace=False):
        page.evaluate("t => lab.seek(t)", float(story.t[k]))
        np.testing.assert_allclose(page.evaluate(POSES, list(story.bodies)), story.poses[k], atol=1e-6)
    page.evaluate("lab.seek(0), lab.play()")
    until(page, "lab.time > 0")
    page.keyboard.press("End")
    assert page.evaluate("lab.time") == pytest.approx(story.t[-1], abs=1e-12)
    assert page.evaluate("lab.playing") is False
    with pytest.raises(Exception, match="body 'crankk' does not exist"):
        page.evaluate("lab.pose('crankk')")
    assert page.requests == [page.url]
    assert page.errors == []


def test_arrows_are_the_channels(look: Callable[..., Any], tmp_path: Path) -> None:
    """The pin force arrow points along the recorded reaction, its length is |F| by the scale that the page states."""
    recording = api.simulate("fourbar")
    story = api.story(recording)
    page = look(write_page(story, tmp_path / "page.html").as_uri())
    for k in (3, 200, 444):
        page.evaluate("t => lab.seek(t)", float(story.t[k]))
        tip, start, size = page.evaluate(
            "(() => { const a = lab.arrows.find(a => a.name === 'pin'); return [a.tip.toArray(), a.group.position.toArray(), a.size]; })()"
        )
        force = np.array([recording.at(f"pin_f{a}", float(story.t[k])) for a in "xyz"])
        assert size == pytest.approx(np.linalg.norm(force), rel=1e-9)
        along = np.array(tip) - np.array(start)
        np.testing.assert_allclose(along / np.linalg.norm(along), force / np.linalg.norm(force), atol=1e-9)
        np.testing.assert_allclose(start, [recording.at(f"C_{a}", float(story.t[k])) for a in "xyz"], atol=2e-2)
    words = page.locator("#scale").inner_text()
    assert "arrow one grid step long: 1 N" in words and "ring one grid step wide: 0.2 N\u00b7m" in words
    assert page.evaluate("lab.arrows.map(a => a.label)") == ["pin, on rocker", "drive, on crank"]


RING = """() => {
    const { shaft, group, size, vectors } = lab.arrows.find(a => a.kind === 'torque'), p = shaft.geometry.getAttribute('position');
    const at = k => { const x = group.position.clone(); x.fromBufferAttribute(p, k);
        return x.applyQuaternion(group.quaternion).toArray(); };
    const ring = [];
    for (let i = 0; i < p.count / 8; i++) ring.push([0, 1, 2].map(c => [...Array(8).keys()].reduce((s, j) => s + at(8 * i + j)[c], 0) / 8));
    return ring;
}"""


def test_a_torque_is_a_ring_about_its_axis(look: Callable[..., Any], tmp_path: Path) -> None:
    """The ring turns about +M by the right-hand rule, and its width is |M| by the scale that the page states, for both signs."""
    recording = api.simulate("fourbar")
    story = api.story(recording)
    page = look(write_page(story, tmp_path / "page.html").as_uri())
    torque = recording.channels["crank_angle_force"]
    shown = np.interp(story.t, recording.t, torque)  # a page may hold fewer samples than a run
    for time in (story.t[np.argmax(shown)], story.t[np.argmin(shown)]):
        page.evaluate("t => lab.seek(t)", float(time))
        ring = np.array(page.evaluate(RING))
        k = int(np.abs(recording.t - time).argmin())
        # The axis of the crank is -y.
        moment = np.array([0.0, -torque[k], 0.0])
        np.testing.assert_allclose(np.linalg.norm(ring, axis=1), 0.5 * np.linalg.norm(moment) / 0.2 * 0.05, rtol=1e-3)
        turns = np.cross(ring[:-1], ring[1:])
        assert np.all(turns @ moment > 0.999 * np.linalg.norm(turns, axis=1) * np.linalg.norm(moment))


def test_the_ghost_of_a_second_run(look: Callable[..., Any], tmp_path: Path) -> None:
    first, second = api.simulate("fourbar"), api.simulate("fourbar", speed=7.0)
    story = api.story(first, against=second)
    page = look(write_page(story, tmp_path / "page.html").as_uri())
    k = story.frame(1.0)
    page.evaluate("t => lab.seek(t)", float(story.t[k]))
    other = api.story(second)
    expected = other.poses[other.frame(1.0), other.bodies.index("rocker"), :3, 3]
    np.testing.assert_allclose(page.evaluate("lab.ghostPose('rocker')"), expected, atol=1e-6)
    readout = page.locator(".legend b").first.text_content()
    assert readout == f"{first.at('crank_angle', 1.0):.4g} ({second.at('crank_angle', 1.0):.4g})\u00a0rad"


def test_a_comparison_tells_both_healths_and_what_differs(look: Callable[..., Any], tmp_path: Path) -> None:
    """Four-bars with other cranks: the ghost has its own links and paths, and its error decides the verdict."""
    first, second = api.simulate("fourbar", duration=0.2), api.simulate("fourbar", crank=0.09, duration=0.3)
    lost = Finding("gap", 1.0, 1e-3, "m", "error", "the loop is open")
    second = replace(second, health=second.health + Health((lost,)), settings=replace(second.settings, timestep=5e-4))
    path = save_recording(second, tmp_path / "b.npz")
    made = api.view(first, against=path, html=tmp_path / "page.html")
    assert made.exit_code == 3 and "the run b.npz: the loop is open" in made.text()
    assert api.view(first, against=first, html=tmp_path / "same.html").exit_code == first.health.exit_code
    story = api.story(first, against=path)
    assert story.differences == (
        ("crank", "0.1 m", "0.09 m"), ("duration [s]", "0.2", "0.3"), ("timestep", "0.001", "0.0005"),
    )  # fmt: skip
    crank = [p for p in story.ghost_parts if p.body == "crank"]
    assert np.ptp(crank[0].vertices[:, 0]) < np.ptp([p for p in story.parts if p.body == "crank"][0].vertices[:, 0])
    for name in ("B", "C"):  # pins of the second run, along its own channels
        there = np.array([second.at(f"{name}_{a}", float(story.t[50])) for a in "xyz"])
        np.testing.assert_allclose(story.ghost_traces[name][50], there, atol=1e-9)
    page = look((tmp_path / "page.html").as_uri(), width=1200, height=800)
    assert page.locator(".verdict").inner_text().endswith("Do not trust this result")
    assert "the run b.npz: the loop is open" in page.locator(".health li.error").inner_text()
    rows = [r.split("\t") for r in page.locator("table.differences tbody tr").all_inner_texts()]
    assert rows == [list(row) for row in story.differences]
    paths = page.evaluate("lab.ghostPaths()")
    assert {p["name"] for p in paths} >= {"trace B", "trace C"} and all(p["shown"] for p in paths)
    page.evaluate("document.getElementById('show-ghost').click()")
    assert not any(p["shown"] for p in page.evaluate("lab.ghostPaths()"))
    same = look((tmp_path / "same.html").as_uri())
    assert "are the same" in same.locator("#panel").inner_text()


def test_runs_without_a_common_body_are_refused() -> None:
    with pytest.raises(MechlabError, match="no body in common"):
        api.story(api.simulate("fourbar", duration=0.1), against=api.simulate(rocker, duration=0.1))


def test_names_do_not_cover_each_other(look: Callable[..., Any], until: Callable[..., None], tmp_path: Path) -> None:
    page = look(write_page(run_of("fourbar"), tmp_path / "page.html").as_uri(), width=900, height=600)
    page.locator("#show summary").click()
    for box in page.locator("#show input").all():
        box.check()
    page.evaluate("lab.seek(0.7)")
    until(page, "[...document.querySelectorAll('.label')].filter(e => !e.hidden).length >= 8")
    page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")  # drawn once more
    boxes = page.locator(".label").evaluate_all(
        "all => all.filter(e => !e.hidden).map(e => { const r = e.getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom]; })"
    )
    assert len(boxes) >= 8
    for i, (l, t, r, b) in enumerate(boxes):
        for L, T, R, B in boxes[:i]:
            assert r <= L or R <= l or b <= T or B <= t
