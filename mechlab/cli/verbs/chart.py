"""`mechlab chart NAME`: speed against accuracy of every method on a scene; also of any MJCF file."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechlab.cli.arguments import one_name
from mechlab.cli.output import Result
from mechlab.errors import UsageError
from mechlab.values import Value, parse_number

POSITIONALS = "NAME [key=value ...]"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    parser.add_argument("--scene", metavar="S", help="name of a scene; `mechlab show NAME` lists them")
    parser.add_argument("--duration", metavar="T", help="simulated time [s]")
    parser.add_argument("--target", metavar="E", help="error that the recommended setting must meet [m or rad]")
    parser.add_argument("--fidelity", metavar="F", help="level of fidelity")
    parser.add_argument(
        "--fidelities", action="store_true", help="the fidelities side by side: what each answers, its error, its cost"
    )
    parser.add_argument(
        "--needs", metavar="N,...", help="with --fidelities: poses, drive_forces, tooth_loads, reactions"
    )
    parser.add_argument(
        "--peers", action="store_true", help="beside Exudyn, Drake and OpenSim, and what --max-error costs against them"
    )
    parser.add_argument(
        "-o", dest="out", metavar="PATH", help="a .svg, .png, .csv or .json file, or a folder for all of them"
    )


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """The chart, its Pareto front and the recommended setting; saved where -o says."""
    name = one_name(names, "chart")
    duration = None if options.duration is None else parse_number("--duration", options.duration, "s")
    target = None if options.target is None else parse_number("--target", options.target, "m", "rad")
    from mechlab import api

    if options.fidelities:
        if options.peers:
            raise UsageError("--peers compares engines, --fidelities models: leave out one of them.")
        if options.target is not None or options.fidelity is not None:
            raise UsageError(
                "--fidelities shows every fidelity within the scene's tolerance: leave out --target and --fidelity."
            )
        needs = None if options.needs is None else tuple(options.needs.split(","))
        table = api.fidelities(name, values, scene=options.scene, duration=duration, needs=needs)
        if options.out is not None:
            table.save(Path(options.out))
        return table
    if options.needs is not None:
        raise UsageError("--needs belongs to --fidelities.")
    result = api.chart(
        name,
        values,
        scene=options.scene,
        duration=duration,
        target=target,
        fidelity=options.fidelity,
        peers=options.peers,
    )
    if options.out is not None:
        result.save(Path(options.out))
    return result
