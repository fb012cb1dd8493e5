"""The fidelities as one line, as a table, and as files: picture and data."""

from __future__ import annotations

import json
from pathlib import Path

from mechlab.files import write, write_formats
from mechlab.results import line_of, save_result, text_of
from mechlab.studies.fidelity.picture import draw
from mechlab.studies.fidelity.result import Fidelities
from mechlab.tables import number, table

FORMATS = (".svg", ".png", ".json")


@line_of.register
def _(fidelities: Fidelities) -> str:
    return f"Fidelities of {fidelities.name}, scene {fidelities.scene}: {fidelities.sentence}"


@text_of.register
def _(fidelities: Fidelities) -> str:
    cut = "" if fidelities.duration >= fidelities.full_duration else f" of {fidelities.full_duration:g} s"
    heads = [
        "fidelity",
        "freedoms",
        "coordinates",
        "rows",
        "answers",
        "error [m or rad]",
        "told to",
        "drive forces",
        "CPU s per s",
        "steps/s",
        "status",
    ]
    rows = [[x.fidelity, number(x.freedoms), number(x.coordinates), number(x.rows), ", ".join(n.replace("_", " ") for n in x.answers),
             number(x.error), number(x.resolution), percent(x.force_error), number(x.cost.get("cpu_s_per_s")),
             number(x.cost.get("steps_per_s")),
             x.status] for x in fidelities.levels]  # fmt: skip
    lines = [
        f"{fidelities.name}, scene {fidelities.scene}, {fidelities.duration:.4g} s{cut}: the fidelities side by side",
        f"needed: {', '.join(n.replace('_', ' ') for n in fidelities.needs)}, within {fidelities.tolerance:g} m or rad",
        "",
        table(heads, rows),
        "errors against the richest fidelity: largest difference of any joint, shaft or frame that both name, samples",
        "closed again; told to: below that it cannot be told from the softness of the engine's rows; drive forces: mean square",
        *(f"{x.fidelity}: {x.exact}" for x in fidelities.levels if x.exact and x.error is not None),
        "",
        fidelities.sentence,
    ]
    return "\n".join(lines)


def percent(share: float | None) -> str:
    """A share as a percentage."""
    return "-" if share is None else f"{100 * share:.2g} %"


@save_result.register
def _(fidelities: Fidelities, path: Path) -> dict[str, Path]:
    """Write the picture or the data, by the suffix; into a folder (a path without one) all of them."""
    stem = f"fidelities_{fidelities.name}"
    return write_formats("fidelities", path, stem, FORMATS, lambda one: _write(fidelities, one))


def _write(fidelities: Fidelities, path: Path) -> None:
    if path.suffix == ".json":
        write(path, json.dumps(fidelities.to_dict(), indent=1))
    else:
        draw(fidelities, path)
