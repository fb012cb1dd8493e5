"""Recordings as coordinates and rates: the polynomials, the rates, the choice of knots, and the page that draws them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from mechlab import api, catalog
from mechlab.api.pages import run_story
from mechlab.engines.protocol import engine
from mechlab.experiment.recording import Recording
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute, spherical
from mechlab.viewer import knots, write_page
from mechlab.viewer.from_recording import placed


def test_the_polynomials_are_those_of_scipy() -> None:
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.random(12))
    q, rates = rng.normal(size=(12, 4)), rng.normal(size=(12, 4))
    times = np.concatenate([rng.uniform(t[0], t[-1], 300), t])
    np.testing.assert_allclose(
        knots.hermite(t, q, rates, times), CubicHermiteSpline(t, q, rates)(times), rtol=0, atol=1e-12
    )


def ball(length: float = 0.3) -> Mechanism:
    """A bar on a ball joint, and another one that hangs from it."""
    b = Builder("ball")
    heavy = Inertia(mass=0.1, com=(0.5 * length, 0.0, 0.0), tensor=(1e-4, 4e-4, 4e-4, 0.0, 0.0, 0.0))
    b.body("upper", spherical("ball"), inertia=heavy)
    b.body("lower", revolute("hinge", "y"), parent="upper", at=(length, 0.0, 0.0), inertia=heavy)
    return b.build()


def test_rates_of_quaternions_move_them_as_the_body_turns() -> None:
    """q + q' h is the pose after turning by omega h about axes of the body, to the second order (Rodrigues)."""
    m, rng = ball(), np.random.default_rng(4)
    q = rng.normal(size=(5, m.nq))
    q[:, :4] /= np.linalg.norm(q[:, :4], axis=1, keepdims=True)
    v, h = rng.normal(size=(5, m.nv)), 1e-6
    moved = q + h * knots.coordinate_rates(m, q, v)
    names, before, _ = placed(m, q)
    after = placed(m, moved)[1]
    k = names.index("upper")
    turned = np.einsum("nji,njk->nik", before[:, k, :3, :3], after[:, k, :3, :3])
    seen = np.stack([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]], axis=1) / h
    np.testing.assert_allclose(seen, v[:, :3], atol=1e-5)  # h |omega|^2


def dense(name: str, duration: float, count: int) -> Recording:
    """A run of the default scene with `count` samples, by the engine itself."""
    design = api.load(name)
    recording = api.simulate(name, duration=min(duration, 0.1))
    scene = replace(design.scene(), duration=duration)
    times = np.linspace(0.0, duration, count)
    made = engine("mujoco").run(recording.mechanism, scene, recording.settings, times)
    return replace(made, name=name, scene=recording.scene, fidelity=recording.fidelity, parameters=recording.parameters)


@cache
def swinging() -> Recording:
    return dense("delta6", 1.0, 1001)


def test_rates_of_what_is_drawn_are_those_of_the_motion() -> None:
    """Of the 49 coordinates of the full delta, from 15 recorded ones: against differences of the fourth order over 1 ms."""
    recording = swinging()
    entry = catalog.entry("delta6")
    drawn = partial(entry.expand, entry.parameters())  # type: ignore[arg-type]
    q, rates = drawn(recording)[1], knots.drawn_rates(recording, drawn)
    h = recording.t[1] - recording.t[0]
    differences = (q[:-4] - 8 * q[1:-3] + 8 * q[3:-1] - q[4:]) / (12 * h)
    late = recording.t[2:-2] > 0.1  # the servos have settled: before, the fifth derivatives are large
    # MuJoCo's soft rows push within a step of 1 ms, so that its positions are not quite the integral of its rates: 3e-5.
    np.testing.assert_allclose(rates[2:-2][late], differences[late], atol=1e-4)
    assert np.abs(rates).max() > 1.0


def poses_between(story: Any, q: np.ndarray, every: np.ndarray) -> float:
    """Largest difference of a pose of the drawn mechanism at coordinates q and as the knots have it, at samples `every`."""
    true, shown = placed(story.model, q)[1], placed(story.model, story.knots.at(every))[1]
    return float(np.abs(true - shown)[..., :3, 3].max())


def test_all_recorded_times_are_shown_within_the_stated_error() -> None:
    recording = swinging()
    story = run_story(recording)
    assert story.knots is not None and story.model is not None
    entry = catalog.entry("delta6")
    q = entry.expand(entry.parameters(), recording)[1]  # type: ignore[misc]
    assert poses_between(story, q, recording.t) <= story.knots.error < 1e-6
    assert len(story.knots.t) < 0.3 * len(recording.t)
    assert set(story.knots.t) <= set(recording.t)
    assert f"Shows the {len(recording.t)} recorded times within" in story.playback


def test_fewer_bytes_give_a_larger_error_that_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    fine = run_story(swinging())
    monkeypatch.setattr(knots, "MOST_BYTES", 20_000)
    coarse = run_story(swinging())
    assert fine.knots is not None and coarse.knots is not None
    assert coarse.knots.q.nbytes + coarse.knots.rates.nbytes <= 20_000 < fine.knots.q.nbytes
    assert coarse.knots.error > fine.knots.error
    entry = catalog.entry("delta6")
    q = entry.expand(entry.parameters(), swinging())[1]  # type: ignore[misc]
    # The largest distance of a corner of a part is not smaller than that of an origin.
    assert poses_between(coarse, q, swinging().t) <= coarse.knots.error


def test_what_is_between_recorded_times_is_estimated() -> None:
    """Every tenth sample of a run is recorded; the others tell how far off the cubics are: no more than stated."""
    full = dense("fourbar", 1.0, 1001)
    sparse = replace(
        full, t=full.t[::10], q=full.q[::10], v=full.v[::10], channels={n: x[::10] for n, x in full.channels.items()}
    )
    story = run_story(sparse)
    assert story.knots is not None
    settled = full.t > 0.05  # within the first steps the servo jumps: 10 ms do not tell
    assert poses_between(story, full.q[settled], full.t[settled]) <= 2.0 * story.knots.between < 1e-5


def test_a_run_without_rates_is_shown_too() -> None:
    full = dense("fourbar", 1.0, 501)
    story = run_story(replace(full, v=np.zeros_like(full.v)))
    assert story.knots is not None
    assert poses_between(story, full.q, full.t) <= story.knots.error < 1e-6


def test_a_servo_that_starts_on_its_target_is_explained() -> None:
    """The first force is the law's own, k (target - value) + d (rates) + constant part: nothing but the last of them."""
    recording = api.simulate("delta6", duration=0.2)
    m = recording.mechanism
    for name in ("q1", "q2", "q3"):
        law = next(x for x in api.load("delta6").scene().laws if getattr(x, "on", "") == name)
        value, rate = float(m.value(name, recording.q[:1])[0]), float(recording.v[0] @ m.row(name))
        target, target_rate, _ = law.motion.at(0.0)
        force = law.stiffness * (target - value) + law.damping * (target_rate - rate) + law.feedforward
        assert recording.channels[f"{name}_force"][0] == pytest.approx(force, abs=1e-6)
        assert force == pytest.approx(law.feedforward, abs=1e-6)
    assert "At the first sample a servo stands exactly on its target" in run_story(recording).playback
    assert "servo" not in run_story(api.simulate("pendulum", duration=0.2)).playback


@pytest.mark.browser
def test_the_page_shows_the_recorded_poses(look: Callable[..., Any], tmp_path: Path) -> None:
    """0.5 s of the delta at 40 times that were recorded, none of them a knot: 1e-6 of the poses that the engine's states give."""
    check_page(dense("delta6", 0.5, 501), look, tmp_path, 3_000_000, 1e-6)


@pytest.mark.browser
@pytest.mark.slow
def test_a_minute_of_the_delta(look: Callable[..., Any], tmp_path: Path) -> None:
    """60,001 recorded times within 0.1 mm and 6 MB."""
    check_page(dense("delta6", 60.0, 60_001), look, tmp_path, 6_000_000, 1e-4)


def check_page(recording: Recording, look: Callable[..., Any], folder: Path, most_bytes: int, tolerance: float) -> None:
    story = run_story(recording)
    path = write_page(story, folder / "page.html")
    assert path.stat().st_size < most_bytes
    assert story.knots is not None
    entry = catalog.entry(recording.name)
    mechanism, q = entry.expand(entry.parameters(), recording)  # type: ignore[misc]
    between = np.setdiff1d(recording.t, story.knots.t)
    times = np.random.default_rng(7).choice(between, 40, replace=False)
    true = placed(mechanism, q[np.searchsorted(recording.t, times)])[1]
    page = look(path.as_uri())
    assert f"Shows the {len(recording.t)} recorded times" in page.locator("#panel").text_content()
    for k, time in enumerate(times):
        shown = page.evaluate(
            "([t, names]) => { lab.seek(t); return names.map(lab.pose); }", [float(time), list(story.bodies)]
        )
        np.testing.assert_allclose(np.array(shown)[:, :3, 3], true[k, :, :3, 3], atol=tolerance)
    assert page.errors == []
