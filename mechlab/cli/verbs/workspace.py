"""`mechlab workspace NAME [key=value ...]`: where a mechanism can be, counted on a grid."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from mechlab.cli.arguments import one_name, split_tokens
from mechlab.cli.output import Result
from mechlab.cli.progress import bar
from mechlab.errors import UsageError
from mechlab.values import Value

POSITIONALS = "NAME [key=value or key=lo:hi:n ...]"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    add = parser.add_argument
    add("--against", metavar="key=value,...", help="a second design, on the same grid: what both have, and each alone")
    add("--witness", metavar="W", help="who is asked at every node: analytic, pinocchio, mujoco")
    add("--stl", metavar="F", help="the surface as STL")
    add("--glb", metavar="F", help="the surface as GLB")
    add("--html", metavar="F", help="a page with the mechanism in its workspace")
    add("-o", dest="out", metavar="FILE.npz", help="the maps (dexterity, margins) as arrays")


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """Nodes, volume, clauses, maps, comparison, files."""
    name = one_name(names, "workspace")
    against = None if options.against is None else changes(options.against)
    files = {k: Path(f) for k in ("stl", "glb", "html") if (f := getattr(options, k)) is not None}
    from mechlab import api

    with bar("workspace") as progress:
        return api.workspace(
            name, values, against=against, witness=options.witness, progress=progress,
            maps=None if options.out is None else Path(options.out), **files,
        )  # fmt: skip


def changes(text: str) -> dict[str, Value]:
    """`a=1,b=2,3` as values: a comma before `key=` begins the next one. Raises UsageError for anything else."""
    stray, values = split_tokens(re.split(r",(?=\s*\w+\s*=)", text))
    if stray or not values:
        raise UsageError(f"--against: expected key=value,..., got {text!r}.")
    return values
