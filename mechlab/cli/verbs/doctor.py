"""`mechlab doctor FILE`: what is wrong, or will go wrong, with anybody's MJCF or URDF, and settings to paste."""

from __future__ import annotations

import argparse

from mechlab.cli.arguments import one_name, refuse_values
from mechlab.cli.output import Result
from mechlab.values import Value

POSITIONALS = "FILE"


def add_options(parser: argparse.ArgumentParser) -> None:
    """This verb has no options of its own."""


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """The diagnosis; exit code 3 when results of the file as it is cannot be trusted."""
    name = one_name(names, "doctor")
    refuse_values(values, "doctor")
    from mechlab import api

    return api.doctor(name)
