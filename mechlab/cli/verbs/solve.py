"""`mechlab solve NAME key=value ...`: give some quantities, get the others from each witness."""

from __future__ import annotations

import argparse
import re

from mechlab.cli.arguments import one_name, split_tokens
from mechlab.cli.output import Result
from mechlab.cli.progress import bar
from mechlab.errors import UsageError
from mechlab.values import Value

POSITIONALS = "NAME|toolpath key=value ..."


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    add = parser.add_argument
    add(
        "--sensitivity",
        action="store_true",
        help="also the derivative of every answer by every parameter that is a number",
    )
    add(
        "--tolerance",
        metavar="key=t,... or share",
        help="half widths of parameters (or t / p of all): tolerances of the answers",
    )
    add("--of", metavar="key,...", help="only the sensitivity to these parameters")


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """The answers of the witnesses and their largest difference; with --sensitivity what they depend on."""
    name = one_name(names, "solve")
    tolerance = None if options.tolerance is None else tolerances(options.tolerance)
    only = () if options.of is None else tuple(k.strip() for k in options.of.split(","))
    from mechlab import api

    if not options.sensitivity and tolerance is None and not only:
        return api.solve_values(name, values)
    with bar("sensitivity") as progress:
        return api.sensitivity(name, values, tolerance=tolerance, only=only, progress=progress)


def tolerances(text: str) -> dict[str, Value] | float:
    """`a=0.1mm,b=0.2deg` as values, or one number: the share of every parameter. Raises UsageError for anything else."""
    if "=" not in text:
        try:
            return float(text)
        except ValueError:
            raise UsageError(
                f"--tolerance: expected key=half width,..., or one share such as 0.001, got {text!r}."
            ) from None
    stray, values = split_tokens(re.split(r",(?=\s*[\w\[\]]+\s*=)", text))
    if stray or not values:
        raise UsageError(f"--tolerance: expected key=half width,..., got {text!r}.")
    return values
