"""Pages that are read off the product: every public name, every verb with its options, every mechanism of the catalog."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from sphinx.application import Sphinx

import mechlab
from mechlab import api
from mechlab.cli.options import ENTRY, parser_of, routes_of
from mechlab.cli.verbs import VERBS

GROUPS = {
    "verbs": ("Functions, one a verb", ("mechlab.api",)),
    "building": ("Mechanisms: building and parts", ("mechlab.mechanism", "mechlab.mechanism.parts", "mechlab.shapes")),
    "scenes": (
        "Scenes, laws, settings",
        (
            "mechlab.experiment.scene", "mechlab.experiment.laws", "mechlab.experiment.motion", "mechlab.experiment.parameters",
            "mechlab.lab.own_mechanism",
        ),
    ),
    "results": (
        "Answers, recordings, designs",
        (
            "mechlab.experiment.question", "mechlab.experiment.recording", "mechlab.experiment.entry", "mechlab.lab.design",
            "mechlab.experiment.model_file", "mechlab.values", "mechlab.errors",
        ),
    ),
    "tracking": ("Tracking: tasks and limits", ("mechlab.studies.track.tasks", "mechlab.studies.track.result")),
    "files": ("Files: reading and writing", ("mechlab.formats", "mechlab.formats.exports")),
}  # fmt: skip
"""Page -> title and the modules whose public names stand there; a name whose module is in none of them stops the build."""


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx looks for its sources; make plain docstrings readable for it."""
    app.connect("config-inited", lambda app, config: write_pages(Path(app.srcdir) / "reference" / "generated", config.with_gallery))
    app.connect("autodoc-process-docstring", lambda app, what, name, obj, options, lines: _plain(lines))
    return {"parallel_read_safe": True}


def write_pages(folder: Path, with_gallery: bool) -> None:
    """All generated pages; with_gallery: those of the mechanisms are linked. Raises SystemExit where a public name would stand on none."""
    folder.mkdir(parents=True, exist_ok=True)
    homes = mechlab._HOMES
    listed = [home for _, modules in GROUPS.values() for home in modules]
    if lost := sorted({*homes} - {*listed}):
        raise SystemExit(f"docs/_ext/reference.py: public names of {', '.join(lost)} stand on no page.")
    for page, (title, modules) in GROUPS.items():
        names = sorted((n for home in modules for n in homes.get(home, ())), key=str.lower)
        write_if_new(folder / f"{page}.rst", "\n".join(_api_page(title, names)))
    os.environ["COLUMNS"] = "96"  # what fits a page
    write_if_new(folder / "commands.md", "\n".join(_command_page()))
    write_if_new(folder / "catalog.md", "\n".join(_catalog_page(with_gallery)))
    write_if_new(folder / "benchmarks.md", (folder.parents[2] / "assets" / "benchmarks.md").read_text(encoding="utf-8"))


def write_if_new(path: Path, text: str) -> None:
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def _api_page(title: str, names: list[str]) -> Iterator[str]:
    yield from (title, "=" * len(title), "", ".. currentmodule:: mechlab", "")
    for name in names:
        thing = getattr(mechlab, name)
        if isinstance(thing, type):
            yield from (f".. autoclass:: {name}", "   :members:", "")
        elif callable(thing) and hasattr(thing, "__code__"):
            yield from (f".. autofunction:: {name}", "")
        else:
            yield from (f".. py:data:: {name}", "", f"   `{thing!r}`", "")


def _command_page() -> Iterator[str]:
    yield from ("# Commands", "", "`mechlab VERB NAME key=value ... [options]`. Read off the command line itself.", "")
    for name, verb in VERBS.items():
        help_text = parser_of(name, verb, routes_of(name, verb, api)).format_help().rstrip()
        yield from (f"## {name}", "", f"{verb.text[0].upper()}{verb.text[1:]}.", "", "```text", help_text, "```", "")


def _catalog_page(with_gallery: bool) -> Iterator[str]:
    rows = api.list_entries().to_dict()["mechanisms"]
    yield from ("# All mechanisms", "", f"{len(rows)} mechanisms. `mechlab list --family F --search WORDS` finds them in the terminal.", "")
    gallery = "../../gallery"  # no page of Sphinx, so the links are written in HTML
    if with_gallery:
        yield from (f'<a href="{gallery}/index.html">The gallery</a> shows them moving, each with pages to watch, move and measure it.', "")
    families: dict[str, list[dict[str, str]]] = {}
    for row in rows:
        families.setdefault(row["family"], []).append(row)
    for family, members in sorted(families.items()):
        yield from (f"## {family}", "", "| name | what it is |", "|---|---|")
        for m in members:
            shown = f"<a href=\"{gallery}/{m['name']}/run.html\">`{m['name']}`</a>" if with_gallery else f"`{m['name']}`"
            yield f"| {shown} | {m['title']}. {m['summary']} |"
        yield ""


def _plain(lines: list[str]) -> None:
    """Docstrings are plain text: what reStructuredText would read as markup is escaped, the entries below "Options:" become a list."""
    out: list[str] = []
    options = code = False
    for line in lines:
        if line.strip().startswith(">>>"):
            code = True
        elif not line.strip():
            code = False
        if code:
            out.append(line)
        elif line.strip() == "Options:":
            options = True
            out += ["", "Options:", ""]
        elif options and line.startswith("    ") and (found := ENTRY.fullmatch(line.strip())):
            value = f" = {found[2]}" if found[2] else ""
            out.append(f"- `{found[1]}{value}`: {_escaped(found[3])}")
        elif options and line.startswith("    "):
            out.append(f"  {_escaped(line.strip())}")
        else:
            options = options and not line.strip()
            indent = len(line) - len(line.lstrip())
            if out and out[-1].strip() and line.strip() and indent != len(out[-1]) - len(out[-1].lstrip()):
                out.append("")
            out.append(line[:indent] + _escaped(line.lstrip()))
    lines[:] = out


def _escaped(text: str) -> str:
    """The text with markup escaped outside of backticks."""
    parts = re.split(r"(`[^`]*`)", text)
    return "".join(p if k % 2 else re.sub(r"([*|\\]|(?<=\w)_(?=\W|$))", r"\\\1", p) for k, p in enumerate(parts))
