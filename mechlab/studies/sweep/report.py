"""A sweep as one line and as text: ranges of the quantities, reasons of the gaps, files."""

from __future__ import annotations

import re
from collections import Counter

import numpy as np

from mechlab.results import line_of, text_of
from mechlab.studies.sweep.request import METHODS
from mechlab.studies.sweep.result import SweepResult
from mechlab.tables import number, table


@line_of.register
def _(result: SweepResult) -> str:
    return f"Sweep of {result.request.name}: {result.message}"


@text_of.register
def _(result: SweepResult) -> str:
    """Least and largest value of each quantity with their points; gaps and their reasons; files."""
    r = result.request
    axes = " x ".join(f"{a.key} ({len(a.values)})" for a in r.axes)
    rows = []
    for k, q in enumerate(r.quantities):
        x = result.flat[:, k]
        if not np.isfinite(x).any():
            rows.append([q.label, q.unit, "-", "", "-", ""])
            continue
        low, high = int(np.nanargmin(x)), int(np.nanargmax(x))
        rows.append([q.label, q.unit, number(x[low], 7), _where(result, low), number(x[high], 7), _where(result, high)])
    lines = [f"{r.name}: {axes}, {r.count} points; {METHODS[r.method]}"]
    if result.evaluated < r.count:
        lines.append(f"{r.count - result.evaluated} points were kept from before, {result.evaluated} computed now")
    lines += [table(["quantity", "unit", "least", "at", "largest", "at"], rows), result.message]
    lines += _common_reasons(result)
    lines += [f"{k}: {v}" for k, v in result.files.items()]
    return "\n".join([*lines, *(f"warning: {w}" for w in result.warnings)])


def _where(result: SweepResult, point: int) -> str:
    index = np.unravel_index(point, tuple(len(a.values) for a in result.request.work))
    at = {a.key: a.coordinates[int(i)] for a, i in zip(result.request.work, index, strict=True)}
    return ", ".join(f"{a.key} {x if isinstance(x := at[a.key], str) else number(x, 6)}" for a in result.request.axes)


def _common_reasons(result: SweepResult) -> list[str]:
    """The most frequent reasons of gaps with a point of each; reasons that differ in numbers alone count as one."""
    first: dict[str, int] = {}
    times: Counter[str] = Counter()
    for point, text in result.reasons.items():
        kind = NUMBER.sub("#", text)
        first.setdefault(kind, point)
        times[kind] += 1
    lines = [
        f"  {n} x, as at {_where(result, first[kind])}: {result.reasons[first[kind]]}"
        for kind, n in times.most_common(REASONS_SHOWN)
    ]
    return lines + ([f"  and {len(times) - REASONS_SHOWN} other reasons"] if len(times) > REASONS_SHOWN else [])


NUMBER = re.compile(r"-?\d[\d.]*(?:e[+-]?\d+)?")


REASONS_SHOWN = 5
"""Number of reasons of gaps in the text."""
