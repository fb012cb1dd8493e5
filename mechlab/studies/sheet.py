"""The sheet of a mechanism as markdown, models/NAME/README.md: what it is, its checks and its claims."""

from __future__ import annotations

from collections.abc import Sequence

from mechlab.lab.design import Design
from mechlab.lab.sheet import parameter_rows
from mechlab.mechanism.structure import structure
from mechlab.studies.check.check import CheckReport
from mechlab.studies.check.claims import ClaimReport
from mechlab.studies.check.figures import HEADERS as READ
from mechlab.studies.check.figures import Drawn
from mechlab.studies.outside import HEADERS, OutsideNumber
from mechlab.tables import markdown, number

CHARTED = ("andrews", "bricard", "flyball", "fourbar", "n_fourbar")
"""Mechanisms whose chart is kept in assets/; `mechlab chart NAME -o assets/chart_NAME.svg` makes it."""


def model_sheet(design: Design, checks: CheckReport, claims: ClaimReport, figures: Sequence[Drawn], picture: str, motion: str) -> str:
    """The README of models/NAME as markdown: picture, summary, freedoms, parameters, formulas, scenes, checks, figures of the
    sources, claims.

    figures: computed; each has its picture as STEM.png. picture, motion: file names of the picture and of the plots of the default scene.
    """
    entry = design.entry
    lines = [f"# {entry.title}", "", f"![{entry.title}]({picture})", "", entry.summary, ""]
    for label, said in (("Use", entry.use), ("Origin", entry.origin), ("Chain", entry.chain)):
        if said:
            lines += [f"{label}: {said.rstrip('.')}.", ""]
    lines += ["## Degrees of freedom", ""]
    rows = []
    for level, text in entry.fidelities.items():
        if level == "kinematic":
            rows.append((level, text, "-", "-", "-"))
            continue
        m = design.mechanism(level)
        found = structure(m)
        local = f" = {found.mobility} + {len(found.idle)} local" if found.idle else ""
        rows.append(
            (
                level,
                text,
                str(len(m.bodies)),
                f"{found.nv} / {found.rows} (rank {found.rank})",
                f"{found.freedoms}{local}",
            )
        )
    lines += [markdown(("fidelity", "what it is", "bodies", "coordinates / rows", "freedoms"), rows), ""]
    lines += ["## Parameters", "", markdown(*parameter_rows(design)), ""]
    if entry.formulas:
        lines += ["## Formulas", "", entry.formulas, ""]
    if entry.sources:
        lines += [f"Sources: {'; '.join(entry.sources)}.", ""]
    scenes = tuple((n, r.text) for n, r in entry.scenes.items())
    lines += ["## Scenes", "", markdown(("scene", "what happens"), scenes), ""]
    shown = design.default_scene
    lines += [f"The scene {shown}:", "", f"![Plots of the scene {shown}]({motion})", ""]
    if entry.name in CHARTED:
        drawn = f"../../assets/chart_{entry.name}.svg"
        lines += ["## Speed against accuracy", "", f"![What each method costs and how wrong it is]({drawn})", ""]
        lines += [f"Made by `mechlab chart {entry.name} -o assets/chart_{entry.name}.svg`.", ""]
    if entry.outside:
        measured = {o.check.text: o.measured for o in checks.outcomes}
        numbers = [OutsideNumber(x, made) for x in entry.outside if (made := measured[x.text]) is not None]
        lines += ["## Numbers from outside", "", markdown(HEADERS, [x.row for x in numbers]), ""]
    outcome = []
    for o in checks.outcomes:
        witnesses = ", ".join(o.measured.values) if o.measured else "-"
        limit = number(o.measured.tolerance if o.measured else None, 2)
        outcome.append((o.check.id, o.check.text, witnesses, limit, o.verdict))
    lines += ["## Checks", "", markdown(("check", "what", "witnesses", "tolerance", "verdict"), outcome), ""]
    if figures:
        lines += ["## Figures of the sources", ""]
        for x in figures:
            lines += _figure_lines(x)
    if claims.items:
        rows = [(c.id, f"{c.source.label}, {c.where}", c.text, number(c.printed, 5), f.sentence) for _, c, f in claims.items]
        lines += [
            "## Claims of the source",
            "",
            markdown(("claim", "where", "what it says", "printed", "verdict"), rows),
            "",
        ]
    return "\n".join(lines).rstrip() + "\n"


def _figure_lines(drawn: Drawn) -> list[str]:
    """A figure of a source: its picture and what is read from it."""
    figure, readings = drawn.figure, drawn.drawing.readings
    told = f" Claims: {', '.join(figure.claims)}." if figure.claims else ""
    lines = [f"### {figure.name[:1].upper()}{figure.name[1:]}", "", f"{figure.shows}{told}", "", f"![{figure.name}]({figure.stem}.png)", ""]
    if drawn.drawing.text:
        lines += [drawn.drawing.text, ""]
    if readings:
        rows = [(r.what, number(r.printed, 5), number(r.ours, 5), r.unit) for r in readings]
        lines += [markdown(READ, rows), ""]
    return lines
