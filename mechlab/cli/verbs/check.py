"""`mechlab check [NAME ...]`: every check with its witnesses."""

from __future__ import annotations

import argparse

from mechlab.cli.output import Result
from mechlab.values import Value

POSITIONALS = "[NAME ...] [key=value ...]"


def add_options(parser: argparse.ArgumentParser) -> None:
    """This verb has no options of its own."""


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """The checks of the named mechanisms, or of all; exit code 3 if one fails."""
    from mechlab import api

    return api.check(names, values)
