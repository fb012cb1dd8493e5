"""`mechlab optimize NAME [key=lo:hi ...]`: the best parameters for a goal; the front of two goals."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechlab.cli.arguments import one_name
from mechlab.cli.output import Result
from mechlab.cli.progress import bar
from mechlab.errors import UsageError
from mechlab.values import Value

POSITIONALS = "NAME [key=lo:hi or key=value ...]"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    add = parser.add_argument
    add("--maximize", metavar="Q", help="a quantity: a parameter, an answer, reach, volume, cycle.peak.COLUMN, ...")
    add("--minimize", metavar="Q", help="a quantity")
    add("--subject", metavar="Q>=v,Q<=v", help="constraints; quote them for the shell")
    add("--front", metavar="Q2", help="the front against a second goal: Q2, max:Q2 or min:Q2")
    add(
        "--evaluations",
        metavar="N",
        help="designs of the global search, at least 40 and 24 a variable; the refinement of the best adds to them",
    )
    add("--seed", metavar="N", default="0", help="another seed, another search; the same seed, the same answer")
    add("-o", dest="out", metavar="DIR", help="folder for optimum.json, and front.csv, front.png, front.svg")


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """The best design beside the start; what holds it; the front; files."""
    name = one_name(names, "optimize")
    if options.maximize is not None and options.minimize is not None:
        raise UsageError("give one goal, --maximize or --minimize; a second one is --front.")
    evaluations = None if options.evaluations is None else _whole("--evaluations", options.evaluations, 1)
    seed = _whole("--seed", options.seed, 0)
    from mechlab import api

    with bar("optimize") as progress:
        return api.optimize(
            name, values, maximize=options.maximize, minimize=options.minimize, subject=options.subject or (),
            front=options.front, evaluations=evaluations, seed=seed, progress=progress,
            out=None if options.out is None else Path(options.out),
        )  # fmt: skip


def _whole(option: str, text: str, low: int) -> int:
    if not text.isascii() or not text.isdigit() or len(text) > 9 or int(text) < low:
        raise UsageError(f"{option} takes a whole number of at least {low}, got {text!r}.")
    return int(text)
