"""`mechlab modes NAME`: equilibrium, eigenfrequencies, damping and mode shapes on the constraint manifold."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechlab.cli.arguments import one_name
from mechlab.cli.output import Result
from mechlab.errors import UsageError
from mechlab.values import Value

POSITIONALS = "NAME [key=value ...]"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    parser.add_argument(
        "--scene",
        metavar="S",
        help="start and laws of a scene (default: the drives hold their targets, from the reference pose)",
    )
    parser.add_argument("--fidelity", metavar="F", help="level of fidelity: minimal, parts, full")
    parser.add_argument(
        "--free", action="store_true", help="neither drives nor laws: weight, springs and dampers alone"
    )
    parser.add_argument("-o", dest="out", metavar="DIR", help="folder for modes.json, modes.npz and modes.html")
    parser.add_argument("--html", metavar="F", help="write a page that swings through the modes")
    parser.add_argument("--mode", metavar="K,...", help="numbers of the modes that the page shows")


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """The modes, and the files asked for."""
    name = one_name(names, "modes")
    only: tuple[int, ...] = ()
    if options.mode is not None:
        if options.html is None and options.out is None:
            raise UsageError("--mode chooses what the page shows: add --html F or -o DIR.")
        texts = options.mode.split(",")
        if not all(t.strip().isdigit() for t in texts):
            raise UsageError(f"--mode takes whole numbers K,..., got {options.mode!r}.")
        only = tuple(int(t) for t in texts)
    from mechlab import api

    return api.modes(
        name,
        values,
        scene=options.scene,
        fidelity=options.fidelity,
        free=options.free,
        out=None if options.out is None else Path(options.out),
        html=None if options.html is None else Path(options.html),
        only=only,
    )
