"""`mechlab synthesize TASK key=value ...`: dimensions from wanted properties."""

from __future__ import annotations

import argparse

from mechlab.cli.output import Result
from mechlab.errors import UsageError
from mechlab.values import Value

POSITIONALS = "TASK key=value ..."


def add_options(parser: argparse.ArgumentParser) -> None:
    """This verb has no options of its own."""


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """The solutions of a task, or what is reachable instead."""
    if len(names) != 1:
        raise UsageError(
            f"mechlab synthesize takes one TASK, got {', '.join(names) or 'none'}: planetary, gear_linkage, closed_differential."
        )
    from mechlab import api

    return api.synthesize(names[0], values)
