"""`mechlab view NAME` or `mechlab view run.npz`: the lab page, a film, a table, or the gallery of all mechanisms."""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

from mechlab.cli.arguments import one_name, refuse_values, split_tokens
from mechlab.cli.output import Result, stage_printer
from mechlab.errors import UsageError
from mechlab.values import Range, Value

POSITIONALS = "NAME|run.npz [key=value ...]"
FILES = ("html", "png", "glb", "mp4", "csv")


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    add = parser.add_argument
    add("--html", metavar="F", help="write one page that works offline, instead of a live page")
    add("--png", metavar="F", help="write a picture")
    add("--glb", metavar="F", help="write an animated model (glTF) that any 3-D viewer plays")
    add("--mp4", metavar="F", help="write a film (needs ffmpeg or the package imageio-ffmpeg)")
    add("--csv", metavar="F", help="write all channels as a table")
    add("--against", metavar="run.npz", help="compare with a second run: its ghost, its curves")
    add("--explore", action="store_true", help="with --html: sliders for the drives instead of a run")
    add("--vary", metavar="KEY=LO:HI:N", action="append", default=[],
        help="with --explore: a slider for this parameter too (twice for two); none: --vary none")  # fmt: skip
    add("--studio", action="store_true", help="MuJoCo's own web viewer, whose port is open to the whole network")
    add("--catalog", action="store_true", help="with --html DIR: a gallery of all mechanisms, for any static host")
    add("--host", metavar="H", default="127.0.0.1", help="address of the live page (default: this machine only)")


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """A live page on this machine, or the files asked for."""
    if options.catalog:
        if options.html is None:
            raise UsageError("--catalog needs --html DIR, the folder for the gallery.")
        refuse_values(values, "view --catalog")
        from mechlab import api

        return api.gallery(Path(options.html), names, progress=stage_printer(options.json))
    target = one_name(names, "view")
    files = {kind: Path(path) for kind in FILES if (path := getattr(options, kind)) is not None}
    more: dict[str, Any] = {kind: path for kind, path in files.items() if kind not in ("html", "png")}
    if options.against is not None:
        more["against"] = options.against
    if options.explore:
        more["explorable"] = True
    if options.vary:
        if not options.explore:
            raise UsageError("--vary needs --explore: it adds a slider to the page of the drives.")
        more["vary"] = {} if options.vary == ["none"] else ranges(options.vary)
    from mechlab import api

    if options.studio:
        return api.studio(target, values)
    if options.explore and "html" not in files:
        raise UsageError("--explore needs --html F, the page to write.")
    with film_bar("mp4" in files) as progress:
        if "mp4" in files:
            more["progress"] = progress
        return api.view(target, values, html=files.get("html"), png=files.get("png"), host=options.host, **more)


def ranges(tokens: list[str]) -> dict[str, Range | tuple[float, ...]]:
    """KEY=LO:HI:N or KEY=a,b,c of --vary; raises UsageError for anything else."""
    found: dict[str, Range | tuple[float, ...]] = {}
    for key, value in split_tokens(tokens)[1].items():
        if isinstance(value, Range):
            found[key] = value
        elif isinstance(value, tuple) and not any(isinstance(x, str) for x in value):
            found[key] = tuple(float(x) if isinstance(x, Fraction) else x for x in value if not isinstance(x, str))
        else:
            raise UsageError(f"--vary {key}: expected a range such as {key}=80mm:120mm:9, or a list of values.")
    if len(found) < len(tokens):
        raise UsageError("--vary: expected KEY=LO:HI:N, for example --vary crank=80mm:120mm:9.")
    return found


@contextlib.contextmanager
def film_bar(wanted: bool) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on a terminal's stderr; elsewhere nothing."""
    if not wanted or sys.stderr is None or not sys.stderr.isatty():
        yield lambda done, total: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("film", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
