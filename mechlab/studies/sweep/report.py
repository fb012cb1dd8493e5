"""A sweep as one line, as text (ranges of the quantities, reasons of the gaps, files) and as a picture: lines over one axis, a
colour map over two; points without a number are marked as gaps."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.geometry import Array
from mechlab.results import line_of, text_of
from mechlab.studies.named.number import NamedNumber
from mechlab.studies.picture_style import cell_borders, new_figure, open_frame, save_figure
from mechlab.studies.sweep.request import METHODS, SweepAxis
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
    if result.errors:
        units = {q.label: q.unit for q in r.quantities}
        off = ", ".join(f"{k} by {x:.2g} {units[k]}".rstrip() for k, x in result.errors.items())
        lines.append(f"single precision may be off: {off}")
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


MOST_PANELS, COLUMNS = 16, 4
SUFFIXES = (".png", ".svg", ".pdf")
INK, GAP = "#23527c", "#d9d9d9"


def refuse_picture(result_axes: int, quantities: int, path: Path) -> None:
    """Raise MechlabError for what cannot be drawn, before anything is computed."""
    if path.suffix.lower() not in SUFFIXES:
        raise MechlabError(f"--plot {path}: expected a file name that ends in {', '.join(SUFFIXES)}.")
    if result_axes > 2:
        raise MechlabError(
            f"--plot draws one or two axes, this sweep has {result_axes}; fix some, or plot the dataset (-o)."
        )
    if quantities > MOST_PANELS:
        raise MechlabError(
            f"--plot draws up to {MOST_PANELS} quantities, these are {quantities}; choose with --quantity."
        )


def draw(result: SweepResult, path: Path) -> Path:
    """Write the picture in the format of the suffix."""
    r = result.request
    refuse_picture(len(r.axes), len(r.quantities), path)
    columns = min(COLUMNS, len(r.quantities))
    rows = -(-len(r.quantities) // columns)
    figure = new_figure(1.0 + 4.4 * columns, 1.1 + 3.3 * rows, layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).flat
    for axes, quantity in zip(panels, r.quantities, strict=False):
        values = result[quantity.label]
        axes.set_title(_label(quantity.label, quantity.unit), fontsize=10, loc="left")
        axes.tick_params(labelsize=8.5)
        if len(r.axes) == 1:
            _line(axes, r.axes[0], values, result.outcome)
        else:
            _map(figure, axes, r.axes, values, quantity)
    for axes in list(panels):
        axes.set_visible(False)
    gaps = " (grey: gaps)" if len(r.axes) == 2 and np.isnan(result.flat).any() else ""
    figure.suptitle(f"{r.name}: {result.message.split(';')[0]}{gaps}", fontsize=11.5, x=0.01, ha="left", weight="bold")
    return save_figure(figure, path)


def _label(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _ticks(axis: SweepAxis) -> np.ndarray:
    return np.arange(len(axis.values)) if axis.is_text else np.asarray(axis.coordinates)


def _line(axes: Any, axis: SweepAxis, values: Array, outcome: np.ndarray) -> None:
    x = _ticks(axis)
    marker = "o" if len(x) <= 60 else ""
    axes.plot(x, values, color=INK, marker=marker, markersize=3, linewidth=1.4)
    missing = np.isnan(values)
    if missing.any():
        axes.plot(x[missing], np.zeros(int(missing.sum())), "|", color="#b0402a", markersize=9, clip_on=False,
                  transform=axes.get_xaxis_transform(), label="gap")  # fmt: skip
        axes.legend(fontsize=8, frameon=False)
    axes.set_xlabel(_label(axis.key, axis.unit), fontsize=9)
    axes.grid(True, linewidth=0.3)
    if axis.is_text:
        axes.set_xticks(x, [str(v) for v in axis.values])
    open_frame(axes)


def _map(figure: Any, axes: Any, both: tuple[SweepAxis, ...], values: Array, quantity: NamedNumber) -> None:
    x, y = (cell_borders(_ticks(a)) for a in both)
    axes.set_facecolor(GAP)
    finite = values[np.isfinite(values)]
    signed = finite.size and finite.min() < 0.0 < finite.max()
    reach = float(np.abs(finite).max()) if signed else None
    scale = {"vmin": -reach, "vmax": reach, "cmap": "RdBu_r"} if reach else {"cmap": "viridis"}
    drawn = axes.pcolormesh(x, y, np.ma.masked_invalid(values.T), rasterized=True, **scale)
    if finite.size:
        figure.colorbar(drawn, ax=axes, pad=0.02)
    axes.set_xlabel(_label(both[0].key, both[0].unit), fontsize=9)
    axes.set_ylabel(_label(both[1].key, both[1].unit), fontsize=9)
    for axis, put in zip(both, (axes.set_xticks, axes.set_yticks), strict=True):
        if axis.is_text:
            put(_ticks(axis), [str(v) for v in axis.values])
