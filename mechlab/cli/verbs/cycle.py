"""`mechlab cycle NAME`: one turn of the drive."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechlab.cli.arguments import one_name
from mechlab.cli.output import Result
from mechlab.errors import MechlabError, UsageError
from mechlab.values import Value, parse_number

POSITIONALS = "NAME [key=value ...]"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    parser.add_argument(
        "--drive",
        metavar="X",
        help="joint or shaft that is driven (default: that of the drive, else the first that turns fully)",
    )
    parser.add_argument("--output", metavar="X", help="joint whose load the transmission angle is about")
    parser.add_argument("--points", metavar="N", help="number of steps (default: 72)")
    parser.add_argument(
        "--span", metavar="LO,HI", help="range of the drive (default: a turn, or what the limits allow)"
    )
    parser.add_argument("--fidelity", metavar="F", help="level of fidelity: minimal, parts, full")
    parser.add_argument("-o", dest="out", metavar="FILE", help="table .csv, charts .svg or curves .dxf")


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """Positions, rates, accelerations, drive force, reactions, shaking force, transmission, curves; saved where -o says."""
    name = one_name(names, "cycle")
    if options.points is not None and not str(options.points).isdigit():
        raise UsageError(f"--points takes a whole number, got {options.points!r}.")
    span = None
    if options.span is not None:
        ends = options.span.split(",")
        if len(ends) != 2:
            raise UsageError(f"--span takes two numbers LO,HI, got {options.span!r}.")
        span = (_number(ends[0]), _number(ends[1]))
    from mechlab import api

    result = api.cycle(
        name,
        values,
        drive=options.drive,
        output=options.output,
        points=None if options.points is None else int(options.points),
        span=span,
        fidelity=options.fidelity,
    )
    if options.out is not None:
        result.save(Path(options.out))
    return result


def _number(text: str) -> float:
    """An angle or a length."""
    try:
        return parse_number("--span", text, "rad")
    except MechlabError:
        return parse_number("--span", text, "m")
