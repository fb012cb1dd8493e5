"""The still picture: the right size, something in it, and clear words where it cannot be drawn."""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mechlab.errors import EngineMissing, MechlabError
from mechlab.viewer import Story, from_poses, picture


@pytest.fixture(scope="module", autouse=True)
def drawing() -> None:
    pytest.importorskip("mujoco")
    try:
        picture._open_context(16, 16).free()
    except EngineMissing as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(str(error))


def test_a_picture_shows_the_mechanism_on_white(story: Story, tmp_path: Path) -> None:
    from PIL import Image

    path = picture.write_png(story, tmp_path / "still.png", time=1.0, size=(320, 240), samples=2)
    pixels = np.asarray(Image.open(path))
    assert pixels.shape == (240, 320, 3)
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 200
    assert np.all(pixels[:5, :5] > 225)
    blue = pixels[..., 2].astype(int) - pixels[..., 0]
    assert (blue > 60).sum() > 500


def test_the_time_decides_what_is_seen(story: Story) -> None:
    first, later = (picture.render(story, time, (160, 120), samples=1) for time in (0.0, 2.0))
    assert np.any(first != later)


def test_there_must_be_something_to_draw() -> None:
    with pytest.raises(MechlabError, match="'empty' has no parts"):
        picture.render(from_poses("empty", {}, ()))


def test_without_a_graphics_library_the_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> Any:
        raise ImportError(f"no {name}")

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(EngineMissing, match="libegl1 .*or libosmesa6"):
        picture._open_context(16, 16)
    with pytest.raises(EngineMissing, match="pip install mujoco"):
        picture._engine()
