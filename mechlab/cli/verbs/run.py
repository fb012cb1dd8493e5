"""`mechlab run NAME -o DIR`: the whole pipeline."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechlab.cli.arguments import one_name
from mechlab.cli.output import Result, stage_printer
from mechlab.values import Value

POSITIONALS = "NAME [key=value ...]"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    parser.add_argument("-o", dest="out", metavar="DIR", default="out", help="folder for the results (default: out)")


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """Generate, check, simulate the default scene, make the page."""
    name = one_name(names, "run")
    progress = stage_printer(options.json)
    progress(f"{name}: the whole pipeline, into {options.out}")  # before the engines load, which takes a second

    from mechlab import api

    return api.run(name, values, out=Path(options.out), progress=progress)
