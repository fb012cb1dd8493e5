"""`mechlab view NAME` or `mechlab view run.npz`: the lab page, or a file of it."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechlab.cli.arguments import one_name
from mechlab.cli.output import Result
from mechlab.values import Value

POSITIONALS = "NAME|run.npz [key=value ...]"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    parser.add_argument(
        "--html", metavar="F", help="write one page that works offline, instead of a live page"
    )
    parser.add_argument("--png", metavar="F", help="write a picture, instead of a live page")
    parser.add_argument("--host", metavar="H", default="127.0.0.1", help="address of the live page (default: this machine only)")


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """A live page on this machine, or the files asked for."""
    target = one_name(names, "view")
    files = {kind: Path(path) for kind in ("html", "png") if (path := getattr(options, kind)) is not None}
    from mechlab import api

    return api.view(target, values, html=files.get("html"), png=files.get("png"), host=options.host)
