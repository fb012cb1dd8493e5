"""`mechlab sweep NAME key=lo:hi:n ...`: quantities over ranges; with `--portrait KIND` phase portraits and the like."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import Any

from mechlab.cli.arguments import one_name
from mechlab.cli.output import Result
from mechlab.cli.progress import bar
from mechlab.errors import UsageError
from mechlab.values import Value, parse_number

POSITIONALS = "NAME key=lo:hi:n ... [quantity=a,b]"
OF_SWEEPS = (
    "quantity",
    "witness",
    "scene",
    "engine",
    "fidelity",
    "duration",
    "timestep",
    "plot",
    "scheduler",
    "workers",
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    add = parser.add_argument
    add(
        "--quantity",
        metavar="A,B,...",
        action="append",
        help="answers, channels (final; max(ch), min, mean, rms), checks by id (passed(id)), findings of the health record, trusted",
    )
    add("--witness", metavar="W", help="who answers a question: analytic, pinocchio, mujoco")
    add("--scene", metavar="S", help="scene of the simulations")
    add("--duration", metavar="T", help="simulated time [s]")
    add("--timestep", metavar="H", help="timestep [s]")
    add("--engine", metavar="E", help="mujoco, pinocchio, hybrid, one_freedom, analytic")
    add("--fidelity", metavar="F", help="level of fidelity")
    add("-o", dest="out", metavar="FILE.nc", help="the dataset as netCDF; with --portrait a folder")
    add("--plot", metavar="F", help="picture of a sweep over one or two ranges (.png, .svg, .pdf)")
    add("--resume", action="store_true", help="go on where an interrupted sweep into the same FILE.nc was")
    add("--scheduler", metavar="ADDRESS", help="compute on an existing Dask cluster, such as tcp://host:8786")
    add("--workers", metavar="N", type=int, help="processes on this machine; default: one for each core")
    add("--portrait", metavar="KIND", help="phase, poincare, exact, bifurcation, where a mechanism has them")


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """Ranges of the quantities, gaps with their reasons, files; or a portrait."""
    name = one_name(names, "sweep")
    from mechlab import api

    if options.portrait is not None:
        strange = [f"--{k}" for k in OF_SWEEPS if getattr(options, k) is not None]
        if strange or options.resume:
            raise UsageError(f"--portrait does not go with {', '.join(strange or ['--resume'])}.")
        return api.portrait(name, options.portrait, values, None if options.out is None else Path(options.out))
    asked = list(options.quantity or ())
    if (also := values.get("quantity")) is not None:
        asked += [str(x) for x in also] if isinstance(also, tuple) else [str(also)]
    seconds: dict[str, Any] = {
        k: parse_number(f"--{k}", text, "s")
        for k in ("duration", "timestep")
        if (text := getattr(options, k)) is not None
    }
    words: dict[str, Any] = {
        k: x for k in ("witness", "scene", "engine", "fidelity", "scheduler") if (x := getattr(options, k)) is not None
    }
    with bar(f"sweep {name}") as progress:
        return api.sweep(
            name, {k: v for k, v in values.items() if k != "quantity"}, asked,
            out=None if options.out is None else Path(options.out), plot=None if options.plot is None else Path(options.plot),
            resume=options.resume, workers=options.workers, command=_command(), progress=progress, **seconds, **words,
        )  # fmt: skip


def _command() -> str:
    """What was typed."""
    return shlex.join(["mechlab", *sys.argv[1:]])
