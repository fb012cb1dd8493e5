"""The page as a file: complete, small, escaped, asking nothing of the network."""

from __future__ import annotations

import base64
import json
import os
import re
import zlib
from pathlib import Path

import numpy as np
import pytest

from mechlab.files import CannotWrite
from mechlab.viewer import Part, Story, drawing_page, from_poses, html_page, story_to_html, write_page


@pytest.fixture(scope="module")
def text(story: Story) -> str:
    return story_to_html(story)


def test_it_loads_nothing(text: str) -> None:
    own = text.replace(html_page.packed_viewer(), "")
    assert not re.findall(r"""(?:src|href|action|poster)\s*=\s*["']?+(?!data:)\S""", own)
    assert not re.findall(r"@import|url\((?!#)|importScripts|fetch\(|XMLHttpRequest", own)
    policy = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', own)
    assert policy == [
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
        "img-src data: blob:; connect-src data:"
    ]


def test_texts_are_escaped(text: str, story: Story) -> None:
    assert "<title>Test &lt;b&gt;rig&lt;/b&gt; &lt;/script&gt;</title>" in text
    document = re.search(r'<script type="application/json" id="story">(.*?)</script>', text, re.S)
    assert document is not None
    assert "<" not in document[1]
    assert json.loads(document[1])["bodies"] == list(story.bodies)


def test_a_text_cannot_stand_in_for_a_part_of_the_page() -> None:
    body = "@@block@@ @@script@@"
    text = story_to_html(from_poses(body, {body: np.eye(4)}, ()))
    assert text.count("@@block@@ @@script@@") == 3


def test_no_two_scripts_declare_the_same_name() -> None:
    """All scripts share one scope: a second function of the same name would silently take the place of the first."""
    declared = [
        name
        for script in html_page.SCRIPTS
        for name in re.findall(r"^(?:async )?(?:function|class|const|let)\s+(\w+)", html_page.asset(script), re.M)
    ]
    assert sorted({name for name in declared if declared.count(name) > 1}) == []
    assert len(declared) > 200


def test_every_script_is_in_the_page_once(text: str) -> None:
    folder = Path(html_page.__file__).parent / "page"
    names = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*.js"))
    assert len(set(html_page.SCRIPTS)) == len(html_page.SCRIPTS)
    assert sorted({*html_page.SCRIPTS, *drawing_page.SCRIPTS, "gallery.js"}) == names  # the gallery is a page of its own
    assert "@@" not in text
    packed = re.search(r'<script type="text/plain" id="viewer">(.*?)</script>', text, re.S)
    assert packed is not None
    assert zlib.decompress(base64.b64decode(packed[1])).decode("utf-8") == html_page.viewer_script()


def test_the_licences_travel_along(text: str) -> None:
    assert "Copyright (c) 2018 Robin Deits" in text
    assert "Three.js Authors" in text


def test_a_large_recording_stays_small() -> None:
    """34 bodies, 201 frames, a gear-sized mesh for every second body: at most 3 MB."""
    rng = np.random.default_rng(1)
    t = np.linspace(0.0, 4.0, 201)
    angle = 2.0 * np.pi * np.arange(288) / 288
    poses, parts = {}, []
    for k in range(34):
        rim = (0.1 + 0.01 * rng.random(288))[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        vertices = np.concatenate([np.c_[rim, 0 * angle], np.c_[rim, 0 * angle + 0.02], [[0, 0, 0], [0, 0, 0.02]]])
        i, j = np.arange(288), np.roll(np.arange(288), -1)
        faces = np.concatenate(
            [
                np.c_[i, j, 288 + j],
                np.c_[i, 288 + j, 288 + i],
                np.c_[0 * i + 576, j, i],
                np.c_[0 * i + 577, 288 + i, 288 + j],
            ]
        )
        turn = np.tile(np.eye(4), (201, 1, 1))
        turn[:, :3, 3] = rng.normal(size=(201, 3))
        poses[f"body{k}"] = turn
        parts += [
            Part(
                f"body{k}",
                "gear",
                vertices if k % 2 else vertices * 0 + parts[0].vertices if parts else vertices,
                faces,
            )
        ]
    assert len(story_to_html(from_poses("large", poses, parts, t=t)).encode()) < 3_000_000


def test_the_file_is_written_whole_or_not_at_all(story: Story, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_page(story, tmp_path / "new folder" / "lab.html")
    assert path.read_text(encoding="utf-8") == story_to_html(story)

    def fail(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(CannotWrite, match="lab.html: disk full"):
        write_page(from_poses("other", {}, ()), path)
    assert [entry.name for entry in path.parent.iterdir()] == ["lab.html"]
    assert "Two " in path.read_text(encoding="utf-8")


def test_the_same_story_gives_the_same_bytes(story: Story) -> None:
    assert story_to_html(story) == story_to_html(story)
