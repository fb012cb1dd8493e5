"""Measuring: distances and angles against least squares, surfaces of meshes against their making, and both in a real browser."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mechlab import api
from mechlab.mechanism import TreeKinematics
from mechlab.shapes import mesh
from mechlab.shapes.feature_edges import split_at_edges
from mechlab.viewer import write_page
from mechlab.viewer.html_page import asset

ASK = """
const asked = JSON.parse(require("fs").readFileSync(0, "utf8"));
console.log(JSON.stringify(asked.map(([name, ...given]) => ({ measureBetween, surfaceAround })[name](...given))));
"""


def in_node(questions: list[list[Any]]) -> list[Any]:
    node = shutil.which("node") or shutil.which("nodejs")
    if node is None:
        pytest.skip("no node was found on the path: measuring runs in the browser's test alone")
    script = asset("vectors.js") + asset("measure.js") + asset("features.js") + ASK
    done = subprocess.run(
        [node, "-e", script], input=json.dumps(questions), capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout)
    assert isinstance(found, list)
    return found


def random_feature(rng: np.random.Generator, kind: str) -> dict[str, Any]:
    direction = rng.normal(size=3)
    return {"kind": kind, "point": list(rng.normal(size=3)), "direction": list(direction / np.linalg.norm(direction))}


def spanned(feature: dict[str, Any]) -> np.ndarray:
    """Directions (3, k) in which a point of the feature can move."""
    d = np.array(feature["direction"])
    if feature["kind"] == "point":
        return np.zeros((3, 0))
    if feature["kind"] == "axis":
        return d[:, None]
    return np.linalg.svd(d[None])[2][1:].T


@pytest.mark.parametrize("kinds", [("point", "point"), ("axis", "point"), ("face", "point"), ("axis", "axis")])
def test_distances_are_the_least_ones(kinds: tuple[str, str]) -> None:
    rng = np.random.default_rng(4)
    pairs = [(random_feature(rng, kinds[0]), random_feature(rng, kinds[1])) for _ in range(20)]
    answers = in_node([["measureBetween", a, b] for a, b in pairs])
    for (a, b), found in zip(pairs, answers, strict=True):
        gap = np.array(b["point"]) - a["point"]
        ways = np.column_stack([spanned(a), -spanned(b)])
        rest = gap - (ways @ np.linalg.lstsq(ways, gap, rcond=None)[0] if ways.size else 0.0)
        assert found["distance"] == pytest.approx(float(np.linalg.norm(rest)), abs=1e-12)
        np.testing.assert_allclose(np.subtract(found["to"], found["from"]), rest, atol=1e-10)
        if "point" not in kinds:
            angle = float(np.arccos(abs(np.dot(a["direction"], b["direction"]))))
            assert found["angle"] == pytest.approx(angle, abs=1e-9)


def test_lines_and_planes_meet_or_are_parallel() -> None:
    rng = np.random.default_rng(5)
    line, plane, other = random_feature(rng, "axis"), random_feature(rng, "face"), random_feature(rng, "face")
    level = dict(
        line,
        direction=list(
            np.cross(plane["direction"], [1.0, 0, 0]) / np.linalg.norm(np.cross(plane["direction"], [1.0, 0, 0]))
        ),
    )
    beside = dict(other, direction=[-x for x in plane["direction"]])
    meet, parallel, tilted, faces = in_node(
        [
            ["measureBetween", plane, line],
            ["measureBetween", level, plane],
            ["measureBetween", plane, other],
            ["measureBetween", plane, beside],
        ]
    )
    n = np.array(plane["direction"])
    assert meet["distance"] is None and meet["angle"] == pytest.approx(np.arcsin(abs(n @ line["direction"])), abs=1e-12)
    assert tilted["distance"] is None and tilted["angle"] == pytest.approx(
        np.arccos(abs(n @ other["direction"])), abs=1e-12
    )
    assert parallel["distance"] == pytest.approx(abs(n @ np.subtract(line["point"], plane["point"])), abs=1e-12)
    assert parallel["angle"] == pytest.approx(0.0, abs=1e-9)
    assert faces["distance"] == pytest.approx(abs(n @ np.subtract(other["point"], plane["point"])), abs=1e-12)


def test_surfaces_are_what_the_shape_was_made_of() -> None:
    """A link of two bores 0.3 m apart: every face is flat, a bore with its axis and radius, or the outline."""
    size = {"length": 0.3, "width": 0.04, "thickness": 0.01, "bore": 0.012}
    solid = mesh("link", size, ())
    shown = split_at_edges(solid.vertices, solid.faces.astype(np.int64))
    positions, index = shown.vertices.astype(np.float32).ravel().tolist(), shown.faces.ravel().tolist()
    centres = shown.vertices[shown.faces].mean(axis=1)
    found = in_node([["surfaceAround", positions, index, f, centres[f].tolist()] for f in range(len(shown.faces))])
    holes = [s for s in found if s["kind"] == "axis" and s["hole"]]
    radii = {round(s["radius"], 6) for s in holes}
    assert len(radii) == 1
    across = sorted({round(float(np.dot(s["point"], [1, 0, 0])), 5) for s in holes})
    assert len(across) == 2 and across[1] - across[0] == pytest.approx(0.3, abs=1e-5)
    for s in holes:
        assert abs(s["direction"][2]) == pytest.approx(1.0, abs=1e-6) or abs(s["direction"][1]) == pytest.approx(
            1.0, abs=1e-6
        )
    for f, s in enumerate(found):
        a, b, c = shown.vertices[shown.faces[f]]
        normal = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a))
        if s["kind"] == "face":
            np.testing.assert_allclose(s["direction"], normal, atol=1e-4)
    assert sum(s["kind"] == "face" for s in found) > 4
    ball = mesh("sphere", {"radius": 0.1}, ())
    parts = split_at_edges(ball.vertices, ball.faces.astype(np.int64))
    (point,) = in_node(
        [["surfaceAround", parts.vertices.ravel().tolist(), parts.faces.ravel().tolist(), 5, [0.1, 0, 0]]]
    )
    assert point["kind"] == "point"


@pytest.mark.browser
def test_measuring_in_the_page(look: Callable[..., Any], until: Callable[..., None], tmp_path: Any) -> None:
    recording = api.simulate("fourbar")
    page = look(write_page(api.story(recording), tmp_path / "page.html").as_uri(), width=1200, height=800)
    page.get_by_role("button", name="Measure", exact=True).click()
    page.get_by_label("feature 1").select_option(label="point B (crank)")
    page.get_by_label("feature 2").select_option(label="point C (rocker)")
    tree = TreeKinematics(recording.mechanism)
    for time in (0.0, 0.9):  # the coupler is 0.3 m long
        page.evaluate("t => lab.seek(t)", time)
        assert page.evaluate("lab.inspector.measuring.result.distance") == pytest.approx(0.3, abs=2e-6)
    assert "distance 300 mm" in page.locator("#measure .answer").inner_text()
    until(page, "document.querySelector('.label.measure').innerText === '300 mm'")
    page.get_by_label("feature 1").select_option(label="axis of crank_angle (crank)")
    page.get_by_label("feature 2").select_option(label="axis of rocker_angle (rocker)")
    assert page.evaluate("lab.inspector.measuring.result") == {
        "distance": pytest.approx(0.3, abs=1e-6), "from": pytest.approx([0, 0, 0], abs=1e-6),
        "to": pytest.approx([0.3, 0, 0], abs=1e-6), "angle": pytest.approx(0.0, abs=1e-6),
    }  # fmt: skip
    # Picked in the view: the sides of the crank and of the rocker, whose angle is that of the recording.
    k = int(np.abs(recording.t - 0.35).argmin())
    page.evaluate("t => lab.seek(t)", float(recording.t[k]))
    tree.set(recording.q[k])
    page.evaluate("""() => {
        const found = {};
        for (const name of ['crank', 'rocker']) {
            const k = lab.bodies.indexOf(name), mesh = lab.inspector.stage.groups[k].children.find(x => x.isMesh);
            const index = mesh.geometry.index, features = [];
            for (let f = 0; f < index.count / 3; f++) {
                const hit = { body: k, mesh, face: f, point: mesh.position.clone().set(99, 99, 99) };
                const feature = lab.inspector.measuring.featureAt(hit, -999, -999);
                const flat = feature.kind === 'face' && Math.hypot(feature.direction[0], feature.direction[1]) < 0.01;
                if (flat) features.push(feature);
            }
            found[name] = features[0];
        }
        lab.inspector.measuring.take(0, found.crank); lab.inspector.measuring.take(1, found.rocker);
    }""")
    sides = [tree.pose(b)[0][:, 2] for b in ("crank", "rocker")]
    expected = np.arccos(np.clip(abs(sides[0] @ sides[1]), 0, 1))
    assert page.evaluate("lab.inspector.measuring.result.angle") == pytest.approx(expected, abs=1e-4)
    # Clicking near a named point takes it, the third feature begins anew.
    page.evaluate("lab.inspector.measuring.switch(false), lab.inspector.measuring.switch(true)")
    for name in ("B", "C", "middle"):
        spot = page.evaluate(
            """name => { const m = lab.inspector.measuring, f = m.named.find(x => x.name === `point ${name}`);
            return lab.onScreen(m.world(f).point); }""",
            name,
        )
        page.mouse.click(*spot)
    assert page.evaluate("lab.inspector.measuring.features.map(f => f && f.name)") == ["point middle", None]
    page.keyboard.press("Escape")
    assert page.locator("#measure").is_hidden()
