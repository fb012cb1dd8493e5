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
from mechlab.viewer.explore import blend_weights

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
    for time in (story.t[np.argmax(torque)], story.t[np.argmin(torque)]):
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
    assert made.to_dict()["status"] == "finished, do not trust it" and "the loop is open" in made.to_dict()["message"]
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


def sweep_positions(page: Any, sweep: int, count: int) -> list[tuple[float, float]]:
    """(gap, value) in the page at positions spread over the reach of a drive, ends included, none of them a sample."""
    code = (
        "([k, n]) => { const e = lab.explorer, s = e.sweeps[k], out = [];"
        " for (let i = 0; i < n; i++) { const v = s.first + (s.last - s.first) * (i / (n - 1)) ** 1.013;"
        " e.move(k, v); out.push([e.gap(), v]); }"
        " return out; }"
    )
    return [tuple(x) for x in page.evaluate(code, [sweep, count])]


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("fourbar", {}),
        ("fourbar", {"crank": 0.3, "coupler": 0.25, "rocker": 0.28, "ground": 0.6}),
        ("platform_3rrr", {}),
        pytest.param("delta6", {}, marks=pytest.mark.slow),
    ],
)
def test_the_sliders_keep_the_loops_closed(
    name: str, values: dict[str, float], look: Callable[..., Any], tmp_path: Path
) -> None:
    """At 100 positions of every slider the loops open by less than 1e-6 of the mechanism's size."""
    story = api.explore(name, values, vary={})
    assert story.explore is not None
    page = look(write_page(story, tmp_path / "page.html").as_uri())
    for k in range(len(story.explore.sweeps)):
        gaps = [gap for gap, _ in sweep_positions(page, k, 100)]
        assert max(gaps) < 1e-6 * story.explore.size
        assert len(set(gaps)) > 50, "the gap must be that of the pose shown"
    assert page.errors == []


def test_a_slider_shows_the_closed_form(look: Callable[..., Any], tmp_path: Path) -> None:
    """The rocker angle in the page is that of the analytic four-bar (independent of Newton and of the blend)."""
    from mechlab.analytic.fourbar import solve

    story = api.explore("fourbar", vary={})
    page = look(write_page(story, tmp_path / "page.html").as_uri())
    for crank in (-1.7, 0.2, 1.0, 2.9, 4.0):
        page.evaluate("v => lab.explorer.move(0, v)", crank)
        pose = np.array(page.evaluate("lab.pose('rocker')"))
        expected = float(solve(0.1, 0.3, 0.25, 0.3, crank, mode=1).rocker_angle)
        direction = pose[:3, 0]
        assert np.arctan2(direction[2], direction[0]) == pytest.approx(np.angle(np.exp(1j * expected)), abs=1e-6)


def test_it_turns_red_where_no_assembly_exists(look: Callable[..., Any], tmp_path: Path) -> None:
    """A double rocker: its crank stops where coupler and rocker are stretched (law of cosines)."""
    a, b, c, d = 0.3, 0.25, 0.28, 0.6
    story = api.explore("fourbar", {"crank": a, "coupler": b, "rocker": c, "ground": d}, vary={})
    assert story.explore is not None
    sweep = story.explore.sweeps[0]
    limit = np.arccos((a**2 + d**2 - (b + c) ** 2) / (2 * a * d))
    assert sweep.values[-1] == pytest.approx(limit, abs=1e-6)
    assert sweep.high > limit
    page = look(write_page(story, tmp_path / "page.html").as_uri())
    slider = page.get_by_role("slider", name="crank_angle")
    page.evaluate("v => lab.explorer.move(0, v)", sweep.home)
    assert page.locator(".state.ok").count() == 1
    slider.press("Shift+ArrowRight")
    assert page.evaluate("lab.explorer.values[0]") > sweep.home
    page.evaluate("lab.explorer.move(0, 99)")
    assert "no assembly exists with crank_angle higher" in page.locator(".state.error").inner_text()
    assert page.locator("#stage.impossible").count() == 1
    page.evaluate("v => lab.explorer.move(0, v)", float(limit) - 1e-7)
    assert "Near a singularity" in page.locator(".state.warning").inner_text()
    slider.press("Home")
    assert page.locator("#stage.impossible").count() == 0


def test_a_parameter_takes_the_page_to_another_exact_mechanism(look: Callable[..., Any], tmp_path: Path) -> None:
    """Rocker angles of the variants are those of the closed form, loops closed; a value without a mechanism says why."""
    from mechlab.analytic.fourbar import solve

    story = api.explore("fourbar", vary={"crank": (0.08, 0.1, 0.12), "ground": (0.3, 0.9)})
    assert story.explore is not None
    page = look(write_page(story, tmp_path / "page.html").as_uri(), width=900, height=600)
    for k, crank in enumerate((0.08, 0.1, 0.12)):
        page.evaluate("k => lab.explorer.pick(0, k)", k)
        for angle in (-1.3, 0.4, 2.2):
            page.evaluate("v => lab.explorer.move(0, v)", angle)
            pose = np.array(page.evaluate("lab.pose('rocker')"))
            expected = float(solve(crank, 0.3, 0.25, 0.3, angle, mode=1).rocker_angle)
            assert np.arctan2(pose[2, 0], pose[0, 0]) == pytest.approx(np.angle(np.exp(1j * expected)), abs=1e-6)
            assert page.evaluate("lab.explorer.gap()") < 1e-6 * story.explore.size
    slider = page.get_by_role("slider", name="parameter ground")
    slider.fill("1")
    assert "No mechanism here" in page.locator(".state.error").inner_text()
    assert "0.9 m" in page.locator(".state.error").inner_text()
    slider.fill("0")
    assert page.locator(".state.ok").count() == 1
    assert page.errors == []


def test_the_free_body_of_a_part(look: Callable[..., Any], tmp_path: Path) -> None:
    """The arrows on the coupler are its loads at a sample: those that it exerts itself are turned round."""
    story = api.explore("fourbar", vary={})
    assert story.explore is not None
    sweep = story.explore.sweeps[0]
    page = look(write_page(story, tmp_path / "page.html").as_uri(), width=900, height=600)
    page.locator("#free-body").select_option("on coupler")
    k = 40
    page.evaluate("v => lab.explorer.move(0, v)", float(sweep.values[k]))
    seen = page.evaluate("lab.arrows.map(a => [a.name, a.size, a.tip.toArray(), a.group.position.toArray()])")
    wanted = {x.name: x.vectors[k] * (1 if x.on == "coupler" else -1) for x in sweep.loads if "coupler" in (x.on, x.by)}
    assert {name for name, *_ in seen} == set(wanted) == {"pin", "coupler_joint", "weight of coupler"}
    for name, size, tip, start in seen:
        assert size == pytest.approx(np.linalg.norm(wanted[name]), rel=1e-5)  # 32 bits in the page
        along = np.array(tip) - np.array(start)
        np.testing.assert_allclose(
            along / np.linalg.norm(along), wanted[name] / np.linalg.norm(wanted[name]), atol=1e-5
        )
    assert "moving steadily at 6.283 rad/s" in page.locator(".forces").inner_text()
    page.locator("#free-body").select_option("none")
    assert page.evaluate("lab.arrows.length") == 0


def test_the_blend_is_of_the_fifth_degree() -> None:
    """The weights reproduce any polynomial of degree 5 in the arc, at the arc where the drive has its value."""
    story = api.explore("fourbar", vary={})
    assert story.explore is not None
    sweep = story.explore.sweeps[0]
    for value in np.linspace(sweep.values[0], sweep.values[-1], 17):
        first, weights = blend_weights(sweep, float(value))
        place, samples = sweep.place(float(value)), slice(first, first + 6)
        assert weights @ sweep.values[samples] == pytest.approx(value, abs=1e-12)
        for power in range(6):
            assert weights @ sweep.arc[samples] ** power == pytest.approx(place**power, rel=1e-9, abs=1e-9)
