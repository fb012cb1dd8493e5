"""`mechlab claims [NAME ...]`: the ledger of printed claims."""

from __future__ import annotations

import argparse

from mechlab.cli.arguments import refuse_values
from mechlab.cli.output import Result
from mechlab.values import Value

POSITIONALS = "[NAME ...]"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    parser.add_argument(
        "--figure", metavar="FILE", help="draw the verdict (.png, .svg, .pdf), for one mechanism with a figure"
    )


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """What the sources of the named mechanisms, or of all, print, and the verdict on each."""
    refuse_values(values, "claims")
    from mechlab import api

    return api.claims(names, figure=options.figure)
