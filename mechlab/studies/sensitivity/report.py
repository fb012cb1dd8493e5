"""Sensitivities as one line and as text: derivatives, tolerances, what was not varied."""

from __future__ import annotations

import numpy as np

from mechlab.results import line_of, text_of
from mechlab.studies.sensitivity.derivatives import ALL
from mechlab.studies.sensitivity.result import SMALLEST, AnswerTolerance, Sensitivity, reasons, size_of
from mechlab.tables import number, table


@line_of.register
def _(found: Sensitivity) -> str:
    return f"Sensitivity: {found.message}"


@text_of.register
def _(found: Sensitivity) -> str:
    """The answers, a table of derivatives, one of tolerances."""
    lines = [found.answers.text(), "", found.message + "."]
    rows, idle = [], set(found.units)
    for answer, row in found.cells.items():
        order = sorted(
            row, key=lambda p: -size_of(row[p].derivative) * (found.widths.get(p, 1.0) if found.widths else 1.0)
        )
        for p in order:
            cell = row[p]
            if not np.any(cell.derivative != 0):
                continue
            idle.discard(p)
            unit = _per(found.answers.units.get(answer, ""), found.units[p])
            says = str(len(cell.witnesses))
            rows.append(
                (answer, p, number(cell.derivative, 9), unit, number(cell.relative, 6), number(cell.error, 2), says)
            )
    if rows:
        lines.append(table(("answer", "input", "derivative", "unit", "relative", "error", "witnesses"), rows))
    if idle and rows:
        lines.append(f"no effect: {', '.join(p for p in found.units if p in idle)}")
    if found.max_difference is not None:
        lines.append(f"largest difference between witnesses: {found.max_difference:.3g} of the whole change")
    if found.spreads:
        given = ", ".join(f"{p} +-{t:.4g}" for p, t in found.widths.items() if p not in idle)
        cells = [
            (
                a,
                found.answers.units.get(a, ""),
                *(number(x, 6) for x in (s.worst_case, s.at_corners, s.root_sum_square)),
                _largest(s),
            )  # fmt: skip
            for a, s in found.spreads.items()
            if np.any(s.worst_case != 0) or np.any(np.asarray(s.at_corners) > SMALLEST)
        ]
        lines += ["", f"tolerances: {given}"]
        heads = ("answer", "unit", "worst case, linear +-", "at corners +-", "root sum square +-", "most of it from")
        lines.append(table(heads, cells))
    if found.box is not None:
        kind = (
            "all ends and corners"
            if found.box.whole
            else f"all ends, and the steepest corners (more than {ALL} inputs matter)"
        )
        lines.append(f"true solutions at {found.box.solved} points of the tolerances: {kind}")
    if found.skipped:
        lines.append(f"not varied: {reasons(found.skipped)}")
    return "\n".join([*lines, *(f"note: {n}" for n in found.notes)])


def _largest(spread: AnswerTolerance) -> str:
    if not spread.shares:
        return "-"
    return max(spread.shares, key=lambda p: size_of(spread.shares[p]))


def _per(top: str, bottom: str) -> str:
    if top == bottom:
        return ""
    return f"{top or '1'}/{f'({bottom})' if ' ' in bottom or '/' in bottom else bottom}" if bottom else top
