"""A chart as one line, text, HTML, and as files: picture, table and data."""

from __future__ import annotations

import base64
import json
import math
from html import escape
from pathlib import Path

from mechlab.files import write, write_formats
from mechlab.results import html_of, line_of, save_result, text_of
from mechlab.studies.chart.advice import headline
from mechlab.studies.chart.data import Chart, ChartPoint, PeerTable
from mechlab.studies.chart.picture import draw, picture
from mechlab.tables import counted, csv_text, html_sheet, number, table

FORMATS = (".svg", ".png", ".csv", ".json")


@line_of.register
def _(chart: Chart) -> str:
    return f"Chart of {chart.name}, scene {chart.scene}, {chart.duration:g} s: {chart.recommendation.sentence}"


@text_of.register
def _(chart: Chart) -> str:
    """Title, reference, every point, front, notes, recommendation, settings to paste."""
    front = set(chart.front)
    heads = ["", "method", "step", "cpu_s", f"error [{chart.unit}]", "e_G", "energy [J]", "gap", "status"]
    rows = [["*" if p in front else "", p.method, _step(p), *(_cell(x) for x in (p.cpu_s, p.error, p.e_g, p.energy, p.gap)),
             p.status if not p.reason else f"{p.status}: {p.reason}"[:60]] for p in chart.points]  # fmt: skip
    lines = [
        f"{chart.name}, scene {chart.scene}, {chart.duration:g} s: speed against accuracy of {', '.join(chart.tracked[:6])}",
        *([f"what acts: {chart.acts}"] if chart.acts else []),
        f"reference: {chart.reference}",
        "",
        table(heads, rows),
        "* on the Pareto front. CPU time of stepping only, one thread, median; same output times for all.",
        *(f"not shown: {name} ({why})" for name, why in chart.skipped.items()),
        *(f"published: {x.program}, {x.cpu_s:g} s on {x.machine}; its error is not published" for x in chart.published),
        "",
        *chart.notes,
        chart.recommendation.sentence,
    ]
    if chart.recommendation.paste:
        lines += ["", chart.recommendation.paste]
    if chart.peers is not None:
        lines += ["", chart.peers.text()]
    return "\n".join(lines)


@html_of.register
def _(chart: Chart) -> str:
    """For a notebook: the picture, what follows from it, and the Pareto front as a table."""
    address = base64.b64encode(picture(chart, "png")).decode("ascii")
    rows = [(p.method, _step(p), _cell(p.cpu_s), _cell(p.error)) for p in chart.front]
    front = (("method", "step", "CPU time [s]", f"error [{chart.unit}]"), rows)
    sentences = [chart.recommendation.sentence, *chart.notes]
    image = f'<img src="data:image/png;base64,{address}" style="max-width:100%" alt="{escape(headline(chart))}">'
    return image + html_sheet("", sentences, {"Nothing is better than these in both": front})


def _step(p: ChartPoint) -> str:
    return f"{1e3 * p.step:.4g} ms" if p.control == "step" else f"tol {p.step:.0e}"


def _cell(value: float) -> str:
    """A number for the table, "-" where it is missing."""
    return "-" if math.isnan(value) else number(value)


def _csv(chart: Chart) -> str:
    """All points, one a line; missing numbers are empty."""
    names = ("method", "step", "control", "cpu_s", "error", "e_G", "energy", "gap", "status", "default", "front")
    front = set(chart.front)
    points = [p.to_dict() | {"front": p in front} for p in chart.points]
    return csv_text([names, *(["" if row[n] is None else row[n] for n in names] for row in points)])


@save_result.register
def _(chart: Chart, path: Path) -> dict[str, Path]:
    """Write the chart: a file of the format of its name, or all formats into a folder (a path without a suffix).

    Raises MechlabError for another format.
    """
    return write_formats("chart", path, f"chart_{chart.name}", FORMATS, lambda one: _write(chart, one))


def _write(chart: Chart, path: Path) -> None:
    if path.suffix == ".csv":
        write(path, _csv(chart))
    elif path.suffix == ".json":
        write(path, json.dumps(chart.to_dict(), indent=1))
    else:
        draw(chart, path)


@line_of.register
def _(peers: PeerTable) -> str:
    return f"Comparison with {', '.join(peers.versions) or 'no other engine'} at {counted(len(peers.rows), 'target')}"


@text_of.register
def _(peers: PeerTable) -> str:
    heads = [f"target [{peers.unit}]", "--max-error: cpu_s", "error", "by", "fastest peer", "cpu_s", "error", "ratio"]
    rows = [
        [
            f"{r.target:.0e}", number(r.ours_cpu_s), number(r.ours_error) + ("" if r.ours_reached else " (not reached)"),
            r.ours_method, r.peer or f"none reaches it in {peers.costly:.2g} s", _cell(r.peer_cpu_s), _cell(r.peer_error),
            _cell(r.ratio),
        ]
        for r in peers.rows
    ]  # fmt: skip
    with_versions = ", ".join(f"{n} {v}" for n, v in peers.versions.items()) or "none installed"
    return "\n".join(
        [
            f"--max-error against the fastest peer at its best setting ({with_versions}):",
            table(heads, rows),
            "CPU time of whole runs without imports. --max-error: from the call to the recording, with probing, checks and channels, "
            "and no model kept from before. Peers: model building, stepping and output; their best setting is given to them.",
            *peers.notes,
        ]
    )
