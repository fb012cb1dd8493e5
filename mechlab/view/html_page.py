"""The lab page: a Story as one HTML file that needs no server, no network and no installation."""

from __future__ import annotations

import base64
import html
import importlib.util
import json
import os
import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path

from mechlab.errors import EngineMissing
from mechlab.files import write
from mechlab.view.pack import pack
from mechlab.view.story import Story

STYLES = ("page.css",)
SCRIPTS = (
    "util.js",
    "motion.js",
    "stage.js",
    "traces.js",
    "arrows.js",
    "labels.js",
    "show.js",
    "sweep.js",
    "explore.js",
    "camera.js",
    "player.js",
    "plots.js",
    "panel.js",
    "live.js",
    "main.js",
)


def story_to_html(
    story: Story, *, live: bool = False, connect: str = "data:", controls: Sequence[Mapping[str, str]] = ()
) -> str:
    """The page as text. `live` makes it listen to the server that serves it; `connect` is what its policy
    lets it connect to; `controls` are the parameters that a live page can change.

    Raises EngineMissing where meshcat, whose viewer the page contains, is not installed.
    """
    document, block = pack(story)
    document["live"], document["controls"] = live, list(controls)
    parts = {
        "title": html.escape(story.title),
        "connect": html.escape(connect),
        "style": "\n".join(asset(name) for name in STYLES),
        "viewer": viewer_script(),
        "licences": viewer_licences().replace("<", "&lt;"),
        "story": json.dumps(document, ensure_ascii=False, allow_nan=False).replace("<", "\\u003c"),
        "block": base64.b64encode(zlib.compress(block, 9)).decode("ascii"),
        "script": "\n".join(asset(name) for name in SCRIPTS).replace("</script", "<\\/script"),
    }
    # One pass over the template: a text that looks like a placeholder is never replaced itself.
    pieces = asset("page.html").split("@@")
    return "".join(parts[piece] if i % 2 else piece for i, piece in enumerate(pieces))


def write_page(story: Story, path: str | os.PathLike[str]) -> Path:
    """Writes the page to `path`, whole or not at all, and returns the path. Raises like `story_to_html`, and
    CannotWrite."""
    return write(path, story_to_html(story))


@cache
def asset(name: str) -> str:
    """The text of a file in the folder page."""
    return (files("mechlab.view") / "page" / name).read_text(encoding="utf-8")


def _viewer_folder() -> Path:
    # The folder is found without importing meshcat, whose import loads ZMQ and a web server that a file does
    # not need.
    spec = importlib.util.find_spec("meshcat")
    if spec is None or not spec.submodule_search_locations:
        raise EngineMissing(
            "The page contains the viewer of meshcat, which is not installed. Try: pip install meshcat==0.3.2"
        )
    folder = Path(next(iter(spec.submodule_search_locations))) / "viewer"
    if not (folder / "dist" / "main.min.js").is_file():
        raise EngineMissing(
            f"meshcat is installed without its viewer ({folder / 'dist' / 'main.min.js'} is missing). "
            "Try: pip install --force-reinstall meshcat==0.3.2"
        )
    return folder


@cache
def viewer_script() -> str:
    """The JavaScript of meshcat's viewer, with three.js in it, safe to stand inside a script element."""
    return (_viewer_folder() / "dist" / "main.min.js").read_text(encoding="utf-8").replace("</script", "<\\/script")


@cache
def viewer_licences() -> str:
    """The licence texts that must travel with the viewer's code."""
    folder = _viewer_folder()
    names = (
        folder / "LICENSE",
        folder / "dist" / "main.min.js.LICENSE.txt",
        folder / "dist" / "main.min.js.THIRD_PARTY_LICENSES.json",
    )
    return "\n\n".join(path.read_text(encoding="utf-8") for path in names if path.is_file())
