"""`mechlab show NAME`: what a mechanism is made of and what it can be asked."""

from __future__ import annotations

import argparse

from mechlab.cli.arguments import one_name
from mechlab.cli.output import Result
from mechlab.values import Value

POSITIONALS = "NAME [key=value ...]"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    parser.add_argument("--fidelity", metavar="F", help="level of fidelity: kinematic, minimal, parts, full")


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """Parameters, bodies, joints, chain, freedoms, redundancies, fidelities, scenes, questions."""
    name = one_name(names, "show")
    from mechlab import api

    return api.show(name, values, fidelity=options.fidelity)
