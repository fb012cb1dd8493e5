"""`mechlab solve NAME key=value ...`: give some quantities, get the others from each witness."""

from __future__ import annotations

import argparse

from mechlab.cli.arguments import one_name
from mechlab.cli.output import Result
from mechlab.values import Value

POSITIONALS = "NAME|toolpath key=value ..."


def add_options(parser: argparse.ArgumentParser) -> None:
    """This verb has no options of its own."""


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """The answers of the witnesses and their largest difference."""
    name = one_name(names, "solve")
    from mechlab import api

    return api.solve_values(name, values)
