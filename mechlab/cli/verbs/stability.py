"""`mechlab stability NAME`: maps of where methods fail, by measurement, with the boundaries of theory."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechlab.cli.arguments import one_name
from mechlab.cli.output import Result
from mechlab.errors import UsageError
from mechlab.values import Value, parse_number

POSITIONALS = "NAME [key=value or key=lo:hi:n ...]"
KINDS = "stiffness, mass-ratio, singularity, redundancy, softness, gear-ratio, light-parts, sticking"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    parser.add_argument("--scene", metavar="S", help="name of a scene; `mechlab show NAME` lists them")
    parser.add_argument("--map", dest="kinds", metavar="KIND,...", help=f"only these maps: {KINDS}")
    parser.add_argument("--methods", metavar="A,B", help="methods by name or part of a name, such as RK4,discrete")
    parser.add_argument("--fidelity", metavar="F", help="level of fidelity")
    parser.add_argument(
        "--budget",
        metavar="T",
        help="work to do [s]: about seconds of CPU, counted, so that every machine makes the same map",
    )
    parser.add_argument("-o", dest="out", metavar="DIR", help="folder for the data (.json) and a picture (.png) a map")


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """The maps that the structure of the mechanism calls for; a key=lo:hi:n makes a map over that range."""
    name = one_name(names, "stability")
    budget = None if options.budget is None else parse_number("--budget", options.budget, "s")
    from mechlab import api

    return api.stability(
        name,
        values,
        scene=options.scene,
        kinds=_listed("--map", options.kinds),
        methods=_methods(options.methods),
        fidelity=options.fidelity,
        out=None if options.out is None else Path(options.out),
        budget=budget,
    )


def _listed(option: str, text: str | None) -> tuple[str, ...]:
    """The items of A,B,...; none when the option is not given."""
    if text is None:
        return ()
    items = tuple(x.strip() for x in text.split(","))
    if not all(items):
        raise UsageError(f"{option} takes names with commas between them, got {text!r}.")
    return items


def _methods(text: str | None) -> tuple[str, ...]:
    """Names of methods; a comma with a space behind it belongs to a name such as "MuJoCo RK4, hard"."""
    if text is None:
        return ()
    return tuple(x.replace("\0", ", ") for x in _listed("--methods", text.replace(", ", "\0")))
