"""The gallery as static files; a simulation on the live page; the warning before MuJoCo's own viewer."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mechlab import api
from mechlab.errors import EngineMissing, MechlabError
from mechlab.experiment.recording import Recording
from mechlab.viewer import Story, studio
from mechlab.viewer.gallery import Exhibit, write_gallery
from mechlab.viewer.live import serve
from mechlab.viewer.streaming import stream


def png() -> bytes:
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(np.full((30, 40, 3), 200, np.uint8)).save(buffer, format="png")
    return buffer.getvalue()


def test_the_gallery_links_what_exists_and_loads_nothing(tmp_path: Path) -> None:
    exhibits = [
        Exhibit("a", "A <b>", "One & only.", png(), "<h3>sheet</h3>", True),
        Exhibit("b", "B", "Two.", png(), "<h3>sheet</h3>", False),
    ]
    index = write_gallery(exhibits, tmp_path)
    text = index.read_text(encoding="utf-8")
    links = re.findall(r'href="([^"]+)"', text)
    assert links[:4] == ["a/explore.html", "a/explore.html", "a/run.html", "a/sheet.html"]
    assert links[4:] == ["b/run.html", "b/run.html", "b/sheet.html"]
    assert "A &lt;b&gt;" in text and "One &amp; only." in text and "<b>" not in text
    assert "default-src 'none'" in text
    for path in (index, tmp_path / "a" / "sheet.html"):
        assert not re.findall(r"""src\s*=\s*["'](?!data:)|https?://|@@""", path.read_text(encoding="utf-8"))
    assert (tmp_path / "b" / "picture.png").read_bytes() == png()


@pytest.mark.browser
def test_the_gallery_is_searched_and_has_families(tmp_path: Path, browser: Any) -> None:
    exhibits = [
        Exhibit(n, t, s, png(), "", False, "", f)
        for n, t, s, f in (("a", "Watt's linkage", "Goes straight.", "straight-line"), ("b", "Delta", "A robot.", "parallel-robot"))
    ]
    page = browser.new_page()
    wrong: list[str] = []
    page.on("console", lambda m: wrong.append(m.text) if m.type == "error" else None)
    page.goto(write_gallery(exhibits, tmp_path).as_uri())
    assert page.locator("nav a").all_inner_texts() == ["Straight line 1", "Parallel robot 1"]
    page.fill("#search", "ROBOT delta")
    assert [page.locator("article").nth(k).is_visible() for k in (0, 1)] == [False, True]
    assert not page.locator("section").nth(0).is_visible() and page.locator("#found").inner_text() == "1 of 2"
    page.fill("#search", "")
    assert page.locator("article").nth(0).is_visible() and not wrong


def test_several_mechanisms_are_made_at_once_and_stand_in_their_order(tmp_path: Path) -> None:
    """The files of two processes are those that one makes."""
    names, told = ["planetary", "pendulum"], []
    models = Path(__file__).parents[2] / "models"
    together = Path(api.gallery(tmp_path / "both", names, models=models, progress=told.append).files["gallery"])
    alone = Path(api.gallery(tmp_path / "one", names[:1], models=models).files["gallery"])
    text = together.read_text(encoding="utf-8")
    assert 0 < text.index('href="planetary/run.html"') < text.index('href="pendulum/run.html"')
    assert {"1 of 2", "2 of 2"} == {line.split(":")[0].strip() for line in told}
    for page in ("run.html", "explore.html", "sheet.html"):
        first, second = ((index.parent / "planetary" / page).read_bytes() for index in (together, alone))
        assert first == second
    assert {"picture.png", "run.html", "sheet.html"} <= {p.name for p in (together.parent / "pendulum").iterdir()}


def test_a_name_that_does_not_exist_stops_the_gallery_before_it_begins(tmp_path: Path) -> None:
    with pytest.raises(MechlabError, match="pendulam"):
        api.gallery(tmp_path / "site", ["pendulum", "pendulam"])
    assert list(tmp_path.iterdir()) == []


def test_a_running_simulation_is_streamed_and_then_told() -> None:
    """The pictures are those of the run: each equals a pose of the recorded motion in between, and the crank turns on."""
    design, seen = api.load("fourbar"), []
    told: list[Recording] = []

    def tell(recording: Recording) -> Story:
        told.append(recording)
        return api.story(recording)

    with serve(api.story("fourbar"), quiet=True) as server:
        show = server.update
        server.update = lambda poses, *q: (seen.append(np.array(poses)), show(poses, *q))  # type: ignore[assignment,func-returns-value,method-assign]
        stream(server, design, tell, speed=4.0).join(60.0)
    assert len(told) == 1 and told[0].health.trusted
    assert len(seen) >= 2
    crank = api.story("fourbar").bodies.index("crank")
    angles = np.unwrap([np.arctan2(p[crank, 2, 0], p[crank, 0, 0]) for p in seen])
    assert np.all(np.diff(angles) > 0)
    recorded = told[0].channel("crank_angle")
    assert recorded[0] - 1e-6 <= angles[0] and angles[-1] <= recorded[-1] + 1e-6


def test_a_stream_ends_with_its_server() -> None:
    with serve(api.story("fourbar"), quiet=True) as server:
        thread = stream(server, api.load("fourbar"), api.story, speed=0.05)
    thread.join(10.0)
    assert not thread.is_alive()


def test_studio_warns_before_it_opens_a_port(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mujoco.studio")
    launcher, protocol, app = studio._studio_modules()
    opened: list[Any] = []

    def run(config: Any, **how: Any) -> None:
        opened.append((capsys.readouterr().err, how["model"].nq))

    monkeypatch.setattr(launcher, "run", run)
    api.studio("fourbar")
    assert opened[0][1] == 3
    assert "ALL network interfaces, without a password" in opened[0][0]


def test_an_old_mujoco_is_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> Any:
        raise ImportError(name)

    monkeypatch.setattr(studio.importlib, "import_module", missing)
    with pytest.raises(EngineMissing, match=r"mujoco>=4\.0"):
        studio._studio_modules()
