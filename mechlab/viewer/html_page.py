"""The lab page: a Story as one HTML file that needs no server, no network and no installation.

`variations` solves further designs, one parameter at a time, which the page can then show. `framed` puts the page into
a notebook.
"""

from __future__ import annotations

import base64
import html
import importlib.util
import json
import os
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.errors import EngineMissing, MechlabError
from mechlab.experiment.parameters import describe
from mechlab.files import write
from mechlab.lab.design import Design, design
from mechlab.values import Range, in_unit
from mechlab.viewer.pack import pack
from mechlab.viewer.story import Story, Variation

MOST_KEYS, COUNT, MOST_COUNT = 2, 9, 41
SPREAD = 0.2
"""A parameter is varied by this share of its value either way, unless a range is given."""


def variations(
    d: Design, vary: Mapping[str, Range | Sequence[float] | None], story: Story, tell: Callable[[Design], Story]
) -> tuple[Variation, ...]:
    """Variants of a design whose own exploration is `story`. vary: key -> range, values, or None (+-SPREAD).

    tell(design) -> the Story of a variant. A value without a mechanism becomes the sentence that says why. Raises
    MechlabError for a parameter that is not a number, and for more than two.
    """
    if len(vary) > MOST_KEYS:
        raise MechlabError(
            f"{d.name}: {len(vary)} parameters to vary; expected at most {MOST_KEYS}: {', '.join(vary)}."
        )
    known = {i.name: i for i in describe(d.entry.parameters)}
    out = []
    for key, asked in vary.items():
        if key not in known or known[key].kind not in ("number", "integer"):
            numbers = [n for n, i in known.items() if i.kind in ("number", "integer")]
            what = f"is a {known[key].kind}" if key in known else "does not exist"
            raise MechlabError(f"{d.name}: parameter {key} {what}; can be varied: {', '.join(numbers) or 'none'}.")
        own = float(getattr(d.parameters, key))
        values = _values(d.name, key, own, in_unit(f"{d.name}: {key}", asked, known[key].unit))
        home = int(np.argmin(np.abs(values - own)))
        stories = [story if k == home else _variant(d, key, float(x), story, tell) for k, x in enumerate(values)]
        values[home] = own
        out.append(Variation(key, known[key].unit, tuple(map(float, values)), home, tuple(stories)))
    return tuple(out)


def _values(name: str, key: str, own: float, asked: Range | Sequence[float] | None) -> np.ndarray:
    """Increasing values, the design's own among them."""
    if isinstance(asked, Range):
        found = np.array(asked.points(COUNT))
    elif asked is not None:
        found = np.array([float(x) for x in asked])
    else:
        found = own * np.linspace(1.0 - SPREAD, 1.0 + SPREAD, COUNT)
    found = np.unique(found[~np.isclose(found, own, rtol=1e-9)])
    found = np.unique(np.append(found, own))
    if not 2 <= len(found) <= MOST_COUNT:
        raise MechlabError(f"{name}: {key} has {len(found)} values to vary over; expected 2 to {MOST_COUNT}.")
    return found


def _variant(d: Design, key: str, value: float, story: Story, tell: Callable[[Design], Story]) -> Story | str:
    try:
        other = tell(design(d.entry, dict(d.given) | {key: value}))
    except MechlabError as error:
        return str(error)
    if other.bodies != story.bodies or other.explore is None or story.explore is None:
        return f"with {key} = {value:g} the mechanism has other parts"
    if other.explore.drives != story.explore.drives:
        return f"with {key} = {value:g} the mechanism is driven otherwise"
    return replace(other, explore=replace(other.explore, reach=None))


STYLES = ("page.css", "inspect.css", "hand.css", "edit.css")
SOLVER = (
    "solver/tree.js", "solver/model.js", "solver/closure.js", "solver/factors.js", "solver/structure.js", "solver/holds.js",
    "solver/manifold.js", "solver/walk.js", "solver/follow.js", "solver/pull.js", "solver/pose_solver.js",
)  # fmt: skip
"""Scripts of the solver, which need no page: together they also run in Node."""
GEOMETRY = (
    "vectors.js", "edit/rotations.js", "edit/rebase.js", "edit/document_text.js", "edit/attached.js", "edit/plane.js", "edit/reassemble.js",
    "edit/gears.js", "edit/numbers.js", "edit/reproduce.js", "edit/outlines.js",
)  # fmt: skip
"""Scripts that edit a model document; with SOLVER they also run in Node."""
EDITING = ("edit/typed.js", "edit/solids.js", "edit/edit_table.js", "edit/handles.js", "edit/editor.js")
"""Scripts of the page's edit mode."""
BY_HAND = (
    "quantity.js", "history.js", "mobility.js", "forces.js", "ray.js", "rubber.js", "grab.js", "drives.js", "hand.js",
    "free_body.js", "coupler_curves.js", "reach.js", "explore.js",
)  # fmt: skip
"""Scripts for moving the mechanism by hand."""
SCRIPTS = (
    *SOLVER, *GEOMETRY,
    "util.js", "words.js", "knots.js", "motion.js", "quality.js", "stage.js", "traces.js", "arrows.js",
    "labels.js", "before.js", "show.js", *EDITING, *BY_HAND,
    "pick.js", "visibility.js", "readings.js", "card.js", "follow.js",
    "caps.js", "section.js", "measure.js", "features.js", "measuring.js", "inspect.js", "springs.js", "projection.js",
    "camera.js", "player.js", "timewindow.js", "curves.js", "plots.js", "channels.js", "clips.js", "field.js",
    "panel.js", "live.js", "replace.js", "address.js", "main.js",
)  # fmt: skip
"""Scripts of the page, in their order there."""


def story_to_html(story: Story) -> str:
    """The page as text. Raises EngineMissing where meshcat, whose viewer the page contains, is not installed."""
    return page_of(*packed_story(story))


def packed_story(story: Story, effort: int = 9) -> tuple[dict[str, Any], str]:
    """The document of a story (`pack`) for a page without server, and its block, compressed (`effort`: 1 to 9), in base64."""
    document, block = pack(story)
    return document | {"live": None, "controls": []}, base64.b64encode(zlib.compress(block, effort)).decode("ascii")


def page_of(document: Mapping[str, Any], block: str, connect: str = "data:") -> str:
    """The page of a packed story. `connect`: addresses that its security policy allows. Raises like `story_to_html`."""
    parts = {
        "title": html.escape(document["title"]),
        "connect": html.escape(connect),
        "style": "\n".join(asset(name) for name in STYLES),
        "viewer": packed_viewer(),
        "licences": viewer_licences().replace("<", "&lt;"),
        "story": json.dumps(document, ensure_ascii=False, allow_nan=False).replace("<", "\\u003c"),
        "block": block,
        "script": "\n".join(asset(name) for name in SCRIPTS).replace("</script", "<\\/script"),
    }
    # One pass over the template: a text that looks like a placeholder is never replaced itself.
    pieces = asset("page.html").split("@@")
    return "".join(parts[piece] if i % 2 else piece for i, piece in enumerate(pieces))


def write_page(story: Story, path: str | os.PathLike[str]) -> Path:
    """Writes the page to `path`, whole or not at all, and returns the path. Raises like `story_to_html`, and
    CannotWrite."""
    return write(path, story_to_html(story))


FRAME_HEIGHT = 640
"""Height of the frame of a page in a notebook [px]."""
MOST_BYTES_FRAMED = 6_000_000
"""Largest page in a notebook [bytes]: it keeps every page that it shows in its file."""


def framed(page: str, title: str, height: int = FRAME_HEIGHT, limit: int = MOST_BYTES_FRAMED) -> str:
    """A page inside a notebook: an iframe with the page as its source document, cut off from the notebook around it.

    Sandboxed: the page may run its scripts and offer downloads; it reaches neither the notebook nor
    its origin. Raises MechlabError for a page larger than `limit` bytes.
    """
    size = len(page.encode("utf-8"))
    if size > limit:
        raise MechlabError(
            f"it has {size / 1e6:.1f} MB, more than the {limit / 1e6:.1f} MB that a notebook should keep; "
            'try mechlab.view(recording, html="run.html") and open that file.'
        )
    return (
        f'<iframe title="{html.escape(title)}" srcdoc="{html.escape(page)}" sandbox="allow-scripts allow-downloads" '
        f'style="width:100%;height:{height:d}px;border:1px solid #d5dae0;border-radius:6px"></iframe>'
    )


@cache
def asset(name: str) -> str:
    """The text of a file in the folder page."""
    return (files("mechlab.viewer") / "page" / name).read_text(encoding="utf-8")


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
    """The JavaScript of meshcat's viewer, with three.js in it."""
    return (_viewer_folder() / "dist" / "main.min.js").read_text(encoding="utf-8")


@cache
def packed_viewer() -> str:
    """The viewer's code as the page carries it: a third of its size, zlib-compressed, in base64."""
    return base64.b64encode(zlib.compress(viewer_script().encode("utf-8"), 9)).decode("ascii")


@cache
def viewer_licences() -> str:
    """The licence texts that the page must contain along with the viewer's code."""
    folder = _viewer_folder()
    names = (
        folder / "LICENSE",
        folder / "dist" / "main.min.js.LICENSE.txt",
        folder / "dist" / "main.min.js.THIRD_PARTY_LICENSES.json",
    )
    return "\n\n".join(path.read_text(encoding="utf-8") for path in names if path.is_file())
