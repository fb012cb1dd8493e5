"""A diagnosis as one line and as text: the structure, the findings by severity, the settings to paste."""

from __future__ import annotations

import json
from pathlib import Path

from mechlab.files import write, write_formats
from mechlab.mechanism.structure import FREEDOMS
from mechlab.results import line_of, save_result, text_of
from mechlab.studies.doctor.audit import Audit
from mechlab.studies.doctor.audit_page import audit_page
from mechlab.studies.doctor.case import Diagnosis
from mechlab.studies.doctor.cure import Cure
from mechlab.tables import counted, number, table


@line_of.register
def _(diagnosis: Diagnosis) -> str:
    return f"Diagnosis of {diagnosis.message}"


@text_of.register
def _(diagnosis: Diagnosis) -> str:
    """The structure, the findings by severity, the settings to paste."""
    lines = [f"{diagnosis.name} ({diagnosis.kind})"]
    if diagnosis.freedoms is not None:
        lines.append(
            f"  {counted(diagnosis.coordinates or 0, 'coordinate')}, {counted(diagnosis.rows or 0, 'constraint row')}: "
            f"{counted(diagnosis.freedoms, *FREEDOMS)}"
        )
    if diagnosis.idle:
        lines.append(f"  local freedoms: {', '.join(diagnosis.idle)}")
    if diagnosis.redundant:
        lines.append(f"  {len(diagnosis.redundant)} redundant rows:")
        lines += [f"    {x.sentence}" for x in diagnosis.redundant[:SHOWN]]
        if len(diagnosis.redundant) > SHOWN:
            lines.append(f"    and {len(diagnosis.redundant) - SHOWN} more (--json lists all)")
        if diagnosis.kind != "URDF":
            lines.append("    (rows of MuJoCo, in the axes of the world)")
    if diagnosis.gap is not None:
        lines.append(f"  largest gap at the start: {number(diagnosis.gap)} m or rad")
    lines += ["", "findings" if diagnosis.findings else "no findings"]
    for f in diagnosis.findings:
        lines.append(f"  {f.severity:8s}{f.name}: {f.sentence}{f' So: {f.consequence}' if f.consequence and f.severity != 'note' else ''}")
        lines += [f"          {row}" for row in f.paste.splitlines()]
    lines += [f"  note    {n}" for n in diagnosis.notes[:NOTES]]
    if len(diagnosis.notes) > NOTES:
        lines.append(f"  note    and {len(diagnosis.notes) - NOTES} more remarks on reading it (--json lists all)")
    lines += [f"  not examined: {n}" for n in diagnosis.not_examined]
    if diagnosis.file is not None and diagnosis.file.left_out:
        lines += ["", "not in the mechanism that mechlab reads of it", *(f"  {x.sentence}" for x in diagnosis.file.left_out)]
    if diagnosis.paste:
        lines += ["", "to paste", *(f"  {row}" for row in diagnosis.paste.splitlines())]
    lines += [
        "",
        diagnosis.message
        if diagnosis.exit_code == 0
        else f"{diagnosis.name}: do not trust results of this file as it is.",
    ]
    return "\n".join(lines)


@line_of.register
def _(cure: Cure) -> str:
    return f"Cure of {cure.message}"


@text_of.register
def _(cure: Cure) -> str:
    """What was changed, what a run gained, what is left."""
    lines = [f"{cure.name}: {cure.before.verdict}", "", "changed" if cure.changes else "nothing changed"]
    lines += [f"  {x}" for x in cure.changes]
    duration = "" if cure.before.run is None else f", {cure.before.run.duration:.3g} s each"
    rows = [(n, _number(a), _number(b), _factor(a, b), u) for n, u, a, b in cure.gains() if a is not None or b is not None]
    if rows and cure.changes:
        head = ("", "before", "after", "factor", "unit")
        lines += ["", f"runs of both files against hard loops, a quarter of the step and a better integrator{duration}"]
        lines += [f"  {row}" for row in table(head, rows).splitlines()]
    if cure.cured:
        lines += ["", f"cured: {', '.join(cure.cured)}"]
    left = [f for f in cure.after.findings if f.severity != "note"]
    lines += ["", "left", *(f"  {f.severity:8s}{f.name}: {f.sentence}" for f in left)] if left else []
    return "\n".join([*lines, "", f"{cure.path}: {cure.after.verdict}"])


@line_of.register
def _(audit: Audit) -> str:
    return f"Audit of {audit.message}"


@text_of.register
def _(audit: Audit) -> str:
    """A table, a row a file, the gravest first."""
    head = ("model", "kind", "bodies", "freedoms", "loops", "read", "verdict", "gravest finding", "CPU s", "licence")
    rows = [
        (
            r.name, r.kind, *("-" if x is None else x for x in (r.bodies, r.freedoms, r.loops)), r.read, r.verdict,
            r.worst[1] or "-", number(r.seconds, 2), r.licence or "-",
        )
        for r in audit.rows
    ]  # fmt: skip
    lines = [table(head, rows), "", audit.message]
    lines += [f"wrote {', '.join(audit.paths)}"] if audit.paths else []
    return "\n".join(lines)


@save_result.register
def _(audit: Audit, path: Path) -> dict[str, Path]:
    """audit.html and audit.json into a folder, or one of them."""

    def write_one(to: Path) -> None:
        page = to.suffix == ".html"
        write(to, audit_page(audit) if page else f"{json.dumps(audit.to_dict(), indent=1)}\n")

    return write_formats("an audit", path, "audit", (".html", ".json"), write_one)


def _number(value: float | None) -> str:
    return "-" if value is None else number(value)


def _factor(before: float | None, after: float | None) -> str:
    return "" if not before or not after else f"{before / after:.3g}"


SHOWN = 12
NOTES = 4
"""Remarks on the reading of a file that are printed; the rest is counted."""
