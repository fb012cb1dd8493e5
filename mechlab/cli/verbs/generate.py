"""`mechlab generate NAME -o DIR`: model files."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechlab.cli.arguments import one_name, refuse_values
from mechlab.cli.output import Result
from mechlab.errors import UsageError
from mechlab.values import Value

POSITIONALS = "[NAME] [key=value ...] -o DIR"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of this verb."""
    parser.add_argument("-o", dest="out", metavar="DIR", required=True, help="folder for the files")
    parser.add_argument("--fidelity", metavar="F", help="level of fidelity: minimal, parts, full")
    parser.add_argument(
        "--catalog", action="store_true", help="the whole catalog, a folder each, with sheet and picture"
    )


def execute(names: list[str], values: dict[str, Value], options: argparse.Namespace) -> Result:
    """MJCF, scene, URDF, JSON and geometry, each reloaded by its consumer."""
    if options.catalog:
        refuse_values(values, "generate --catalog")
        if options.fidelity is not None:
            raise UsageError("--catalog writes the richest fidelity of each mechanism: leave out --fidelity.")
        from mechlab import api

        return api.generate_catalog(Path(options.out), names)
    name = one_name(names, "generate")
    from mechlab import api

    return api.generate(name, values, out=Path(options.out), fidelity=options.fidelity)
