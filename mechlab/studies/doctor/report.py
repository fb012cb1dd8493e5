"""A diagnosis as one line and as text: the structure, the findings by severity, the settings to paste."""

from __future__ import annotations

from mechlab.mechanism.structure import FREEDOMS
from mechlab.results import line_of, text_of
from mechlab.studies.doctor.case import Diagnosis
from mechlab.tables import counted, number


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


SHOWN = 12
NOTES = 4
"""Remarks on the reading of a file that are printed; the rest is counted."""
