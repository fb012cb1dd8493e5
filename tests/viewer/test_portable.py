"""What leaves the page: animated GLB, film, table."""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
import struct
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mechlab import api
from mechlab.errors import EngineMissing, MechlabError
from mechlab.viewer import Story, film, glb, picture
from mechlab.viewer.framing import STEP_LIMIT, tempo
from mechlab.viewer.from_recording import recording_to_csv


class Glb:
    """A small reader, written from the glTF 2.0 specification and not from the writer."""

    def __init__(self, data: bytes) -> None:
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON" and size % 4 == 0
        self.json: dict[str, Any] = json.loads(data[20 : 20 + size])
        binary, kind = struct.unpack_from("<I4s", data, 20 + size)
        assert kind == b"BIN\0" and 28 + size + binary == length
        self.binary = data[28 + size :]

    def read(self, index: int) -> np.ndarray:
        accessor = self.json["accessors"][index]
        view = self.json["bufferViews"][accessor["bufferView"]]
        kind = {5126: "<f4", 5123: "<u2", 5125: "<u4"}[accessor["componentType"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        array = np.frombuffer(self.binary, kind, accessor["count"] * width, view["byteOffset"])
        return array.reshape(-1, width)


@pytest.fixture(scope="module")
def model(story: Story) -> Glb:
    return Glb(glb.story_to_glb(story))


def test_the_animation_is_the_recording(model: Glb, story: Story) -> None:
    """Each body's node carries its recorded poses, to the 32 bits of the format (0.2 m, unit quaternions: 2e-7)."""
    nodes, animation = model.json["nodes"], model.json["animations"][0]
    seen = set()
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        k = story.bodies.index(nodes[channel["target"]["node"]]["name"])
        np.testing.assert_allclose(model.read(sampler["input"])[:, 0], story.t, rtol=1e-7)
        values = model.read(sampler["output"]).astype(float)
        seen.add((k, channel["target"]["path"]))
        if channel["target"]["path"] == "translation":
            np.testing.assert_allclose(values, story.poses[:, k, :3, 3], atol=2e-7)
        else:
            assert np.all(np.einsum("ij,ij->i", values[1:], values[:-1]) > 0), (
                "a sign that jumps turns the long way round"
            )
            np.testing.assert_allclose(Rotation.from_quat(values).as_matrix(), story.poses[:, k, :3, :3], atol=5e-7)
    assert seen == {(1, "translation"), (1, "rotation"), (2, "translation"), (2, "rotation")}


def test_z_is_turned_up_once_and_colours_are_linear(model: Glb) -> None:
    root = model.json["nodes"][model.json["scenes"][0]["nodes"][0]]
    np.testing.assert_allclose(Rotation.from_quat(root["rotation"]).apply([0, 0, 1]), [0, 1, 0], atol=1e-12)
    colours = [m["pbrMetallicRoughness"]["baseColorFactor"] for m in model.json["materials"]]
    # sRGB 0.4 is linear 0.13287 (IEC 61966-2-1)
    assert any(c == pytest.approx([0.010023, 0.132868, 0.603827, 1.0], abs=1e-5) for c in colours)
    assert [
        m.get("alphaMode") for m in model.json["materials"] if m["pbrMetallicRoughness"]["baseColorFactor"][3] < 1
    ] == ["BLEND"] * 2


@pytest.mark.skipif(
    not os.environ.get("GLTF_VALIDATOR"), reason="GLTF_VALIDATOR names no folder with npm's gltf-validator"
)
def test_the_validator_has_nothing_to_say(story: Story, tmp_path: Path) -> None:
    path = glb.write_glb(story, tmp_path / "model.glb")
    code = (
        "require(process.argv[1]).validateBytes(new Uint8Array(require('fs').readFileSync(process.argv[2])))"
        ".then(r => console.log(r.issues.numErrors, r.issues.numWarnings))"
    )
    folder = os.path.join(os.environ["GLTF_VALIDATOR"], "node_modules", "gltf-validator")
    done = subprocess.run(["node", "-e", code, folder, str(path)], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["0", "0"]


def test_every_channel_is_in_the_table_bit_for_bit() -> None:
    recording = api.simulate("fourbar", duration=0.05)
    rows = list(csv.reader(io.StringIO(recording_to_csv(recording))))
    assert rows[0][:2] == ["t [s]", "crank_angle [rad]"]
    assert [h.rsplit(" [", 1)[0] for h in rows[0][1:]] == list(recording.channels)
    numbers = np.array(rows[1:], dtype=float)
    np.testing.assert_array_equal(numbers[:, 0], recording.t)
    for k, values in enumerate(recording.channels.values()):
        np.testing.assert_array_equal(numbers[:, k + 1], values)


def test_a_film_needs_ffmpeg_and_says_how_to_get_it(
    story: Story, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)

    def missing(name: str) -> Any:
        raise ImportError(name)

    monkeypatch.setattr(film.importlib, "import_module", missing)
    with pytest.raises(EngineMissing, match="mechanism-lab\\[film\\].*system package ffmpeg"):
        film.write_mp4(story, tmp_path / "film.mp4")
    assert list(tmp_path.iterdir()) == []


def test_a_film_is_refused_for_what_cannot_be_one(
    story: Story, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(film, "find_ffmpeg", lambda: "ffmpeg")
    with pytest.raises(MechlabError, match="must be even"):
        film.write_mp4(story, tmp_path / "x.mp4", size=(321, 240))
    with pytest.raises(MechlabError, match="limit is 3600: give a higher speed"):
        film.write_mp4(story, tmp_path / "x.mp4", speed=1e-3)
    with pytest.raises(MechlabError, match="does not move"):
        film.write_mp4(api.story("fourbar"), tmp_path / "x.mp4")


def test_what_the_encoder_gets_are_the_frames(story: Story, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stand-in for ffmpeg keeps the raw frames: as many as the length asks for, moving, of the right size."""
    pytest.importorskip("mujoco")
    try:
        picture._open_context(16, 16).free()
    except EngineMissing as error:
        pytest.skip(str(error))
    encoder = tmp_path / "encoder"
    encoder.write_text('#!/bin/sh\nfor last; do :; done\ncat > "$last"\n')
    encoder.chmod(0o755)
    monkeypatch.setattr(film, "find_ffmpeg", lambda: str(encoder))
    told: list[tuple[int, int]] = []
    path = film.write_mp4(
        story, tmp_path / "f.mp4", size=(96, 64), fps=2, speed=1.0, progress=lambda *x: told.append(x)
    )
    frames = np.frombuffer(path.read_bytes(), np.uint8).reshape(-1, 64, 96, 3)
    assert len(frames) == 9 == len(told)
    assert told[-1] == (9, 9)
    assert np.any(frames[0] != frames[4])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["encoder", "f.mp4"]


def test_an_encoder_that_fails_is_quoted(story: Story, tmp_path: Path) -> None:
    encoder = tmp_path / "encoder"
    encoder.write_text("#!/bin/sh\necho no such codec >&2\nexit 3\n")
    encoder.chmod(0o755)
    frames = [np.zeros((64, 96, 3), np.uint8)] * 50
    with pytest.raises(MechlabError, match="code 3: no such codec"):
        film._encode(str(encoder), frames, tmp_path / "f.mp4", (96, 64), 2)
    assert [p.name for p in tmp_path.iterdir()] == ["encoder"]


def test_teeth_never_seem_to_run_backwards(story: Story) -> None:
    """At the chosen speed a gear advances less than half a pitch from one picture to the next."""
    assert tempo(story).speed == 1.0
    for rate in (30.0, 100.0, 1600.0):
        pace = tempo(replace(story, tooth_rate=rate))
        assert rate * pace.speed / 60.0 <= STEP_LIMIT < 0.5
        assert (pace.speed < 1.0) == (rate > 18.0)
        assert "backwards" in pace.sentence
