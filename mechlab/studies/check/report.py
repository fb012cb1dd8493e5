"""Checks and claims as one line, text and HTML."""

from __future__ import annotations

from mechlab.results import html_of, line_of, text_of
from mechlab.studies.check.check import CheckReport
from mechlab.studies.check.claims import ClaimReport
from mechlab.studies.check.figures import HEADERS as FIGURE_HEADERS
from mechlab.studies.check.figures import Drawn
from mechlab.tables import counted, html_sheet, number, table

HEADERS = ("mechanism", "check", "verdict", "difference", "tolerance", "what", "witnesses")


@line_of.register
def _(report: CheckReport) -> str:
    return f"Checks: {report.message}"


@text_of.register
def _(report: CheckReport) -> str:
    """A table and a sentence."""
    return table(HEADERS, _rows(report)) + f"\n\n{report.message}."


@html_of.register
def _(report: CheckReport) -> str:
    return html_sheet("", [f"{report.message}."], {"": (HEADERS, _rows(report))})


def _rows(report: CheckReport) -> list[list[str]]:
    """A row for each check, under HEADERS."""
    rows = []
    for o in report.outcomes:
        m = o.measured
        numbers = [number(m.difference if m else None), number(m.tolerance if m else None)]
        witnesses = ", ".join(m.values) if m else ""
        rows.append([o.mechanism, o.check.id, o.verdict, *numbers, o.check.text, witnesses or o.error or o.missing])
    return rows


@line_of.register
def _(report: ClaimReport) -> str:
    return f"{counted(len(report.items), 'claim')}: {_counts(report)}" if report.items else "no claims of a source"


@text_of.register
def _(report: ClaimReport) -> str:
    """A block for each claim, the sources, and the counts."""
    blocks = []
    for mechanism, claim, finding in report.items:
        rows = [["printed", number(claim.printed, 6)]] + [[k, number(v, 6)] for k, v in finding.computed.items()]
        head = f"{mechanism} {claim.id} ({claim.source.label}, {claim.where})\n{claim.text}"
        blocks.append(f"{head}\n{table(['who', 'says'], rows)}\n=> {finding.sentence}")
    sources = "\n".join(f"{p.label}: {p.citation}" for p in report.publications)
    blocks += [f"Sources\n{sources}"] if sources else []
    drawn = [_figure_text(x) for x in report.figures]
    if report.available and not drawn:
        names = ", ".join(f"{m} {f.name}" for m, f in report.available)
        drawn = [f"Figures of the sources: {names}. --figure N -o FILE draws one."]
    told = [f"warning: {w}" for w in report.warnings]
    counts = f"{counted(len(report.items), 'claim')}: {_counts(report)}."
    if not report.items:
        counts = "No claims of a source; `mechlab claims` lists those of all entries."
    return "\n\n".join([*blocks, counts, *drawn, *told])


def _figure_text(drawn: Drawn) -> str:
    """A figure as text: what it shows, what is read from it, its file."""
    rows = [[r.what, number(r.printed, 6), number(r.ours, 6), r.unit] for r in drawn.drawing.readings]
    read = [table(FIGURE_HEADERS, rows)] if rows else []
    return "\n".join([f"{drawn.mechanism} {drawn.figure.name}: {drawn.figure.shows}", *read, *([drawn.file] if drawn.file else [])])


def _counts(report: ClaimReport) -> str:
    """How many claims got which verdict, by its first words."""
    return ", ".join(f"{n} {name.partition(',')[0]}" for name, n in report.counts.items() if n)
