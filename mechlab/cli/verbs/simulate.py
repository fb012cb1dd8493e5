"""`mechlab simulate NAME`: run a scene."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechlab.cli.arguments import one_name
from mechlab.cli.output import Result
from mechlab.values import Value, parse_number

POSITIONALS = "NAME [key=value ...]"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    parser.add_argument("--scene", metavar="S", help="name of a scene; `mechlab show NAME` lists them")
    parser.add_argument("--duration", metavar="T", help="simulated time [s]")
    step = parser.add_mutually_exclusive_group()
    step.add_argument("--timestep", metavar="H", help="timestep [s]")
    step.add_argument(
        "--max-error",
        metavar="E",
        help="tolerated error [m or rad] of what the scene tracks; engine, method, step and constraint settings are chosen, and every "
        "channel states its own error",
    )
    parser.add_argument("--engine", metavar="E", help="mujoco, pinocchio, hybrid, one_freedom, analytic")
    parser.add_argument("--order-check", action="store_true", help="measure the order of the error in the timestep")
    parser.add_argument(
        "--fidelity", metavar="F", help="level of fidelity: minimal, parts, full, or auto: the cheapest that answers"
    )
    parser.add_argument("--at", metavar="T,...", help="times at which to sample the channels [s]")
    parser.add_argument("-o", dest="out", metavar="FILE.npz", help="file for the recording")


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """A recording with its health and cost; saved where -o says, also when it is not to be trusted."""
    name = one_name(names, "simulate")
    duration = None if options.duration is None else parse_number("--duration", options.duration, "s")
    timestep = None if options.timestep is None else parse_number("--timestep", options.timestep, "s")
    max_error = None if options.max_error is None else parse_number("--max-error", options.max_error, "m", "rad")
    at = None if options.at is None else tuple(parse_number("--at", text, "s") for text in options.at.split(","))
    from mechlab import api

    result = api.simulate_values(
        name,
        values,
        scene=options.scene,
        duration=duration,
        timestep=timestep,
        max_error=max_error,
        engine=options.engine,
        fidelity=options.fidelity,
        at=at,
        order_check=options.order_check,
    )
    if options.out is not None:
        result.save(Path(options.out))
    return result
