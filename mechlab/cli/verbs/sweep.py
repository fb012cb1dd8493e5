"""`mechlab sweep NAME --portrait KIND`: many initial states or loads at once, as arrays and a figure."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechlab.cli.arguments import one_name
from mechlab.cli.output import Result
from mechlab.errors import UsageError
from mechlab.values import Value

POSITIONALS = "NAME [key=value or key=lo:hi:n ...]"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    parser.add_argument(
        "--portrait", metavar="KIND", help="phase, poincare, exact, bifurcation, where a mechanism has them"
    )
    parser.add_argument("-o", dest="out", metavar="DIR", help="folder for the arrays (.npz) and the figure (.png)")


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """The portrait: ranges, notes, files."""
    name = one_name(names, "sweep")
    if options.portrait is None:
        raise UsageError(f"say what to sweep for: mechlab sweep {name} --portrait KIND.")
    from mechlab import api

    return api.portrait(name, options.portrait, values, None if options.out is None else Path(options.out))
