"""`mechlab list`: the catalog."""

from __future__ import annotations

import argparse

from mechlab.cli.arguments import refuse_values
from mechlab.cli.output import Result
from mechlab.errors import UsageError
from mechlab.values import Value

POSITIONALS = ""


def add_options(parser: argparse.ArgumentParser) -> None:
    """This verb has no options of its own."""


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """The entries of the catalog."""
    refuse_values(values, "list")
    if names:
        raise UsageError(f"mechlab list takes no NAME. More on one mechanism: mechlab show {names[0]}.")
    from mechlab import api

    return api.list_entries()
