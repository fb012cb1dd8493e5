"""A fit as one line, as text, as HTML, and as a picture of measured and predicted series."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mechlab.results import html_of, line_of, text_of
from mechlab.studies.fit.result import FitResult
from mechlab.studies.picture_style import new_figure, open_frame, save_figure
from mechlab.tables import counted, html_sheet, number, table

HEADS = ("parameter", "value", "unit", "standard error", "95 % interval", "start")
CHANNEL_HEADS = ("channel", "unit", "values", "residual rms", "noise", "from", "mean", "correlation", "residuals are")
MOST_PANELS = 8
"""Channels that the picture shows."""
BLUE, ORANGE, DARK = "#6aa5dd", "#e07b28", "#22262e"


def heads(found: FitResult) -> Sequence[str]:
    """Heads of the table of parameters."""
    return (*HEADS, *((f"shift by {found.confirmed_by}",) if found.confirmed_by else ()))


def rows(found: FitResult) -> list[Sequence[str]]:
    """A row of the table for each parameter."""
    out: list[Sequence[str]] = []
    for p in found.parameters.values():
        fixed = np.isfinite(p.error)
        span = f"{p.low:.8g} to {p.high:.8g}" if fixed else "not determined"
        shift = ("-" if p.shift is None else f"{p.shift:+.2g}",) if found.confirmed_by else ()
        out.append((p.name, f"{p.value:.8g}", p.unit, number(p.error if fixed else None), span, f"{p.start:.6g}", *shift))
    return out


def channel_rows(found: FitResult) -> list[Sequence[str]]:
    """A row of the table for each channel."""
    out: list[Sequence[str]] = []
    for c in found.channels.values():
        what = [w for w, bad in (("correlated", not c.is_white), ("biased", not c.is_unbiased)) if bad]
        kind = "stated" if c.stated else "residual"
        out.append((
            c.name, c.unit, str(c.count), number(c.rms), number(c.noise), kind, number(c.mean), f"{c.correlation:+.2f}",
            " and ".join(what) or "white, unbiased",
        ))  # fmt: skip
    return out


def sentences(found: FitResult) -> list[str]:
    """Verdict, identifiability, confirmation, notes."""
    of = found.determined
    verdict = "every parameter is determined by the data" if of.all_fixed else "; ".join(of.sentences)
    values = f"singular values {number(of.singular[0])} to {number(of.singular[-1])}"
    out = [f"{verdict[0].upper()}{verdict[1:]}: {values} (condition {number(of.condition)})."]
    by = "the engine" if found.over_time else "the witness"
    ran = f"Fitted by {by} {found.way} in {counted(found.runs, 'evaluation')}; "
    if found.confirmed_by:
        most = max(found.differences.values(), default=0.0)
        ran += f"{found.confirmed_by} predicts the channels within {number(most)} of their noise (rms)."
    else:
        ran += "nothing else computes these channels, so nothing confirms it."
    out.append(ran)
    if found.tried is not None:
        out.append(f"{found.tried.sentence[0].upper()}{found.tried.sentence[1:]}.")
    out += [f"Do not trust it: {fault}." for fault in found.faults if fault not in of.sentences]
    return out + [f"Note: {n}." for n in found.notes]


@line_of.register
def _(found: FitResult) -> str:
    text = f"Fit of {found.message}"
    return text if len(text) < 190 else f"{text[:186]} ..."


@text_of.register
def _(found: FitResult) -> str:
    """Parameters, channels, verdicts."""
    title = f"Fit of {found.base.entry.title} to {found.source}" + (f", scene {found.scene}" if found.scene else "")
    lines = [title, "=" * len(title), table(heads(found), rows(found)), "", table(CHANNEL_HEADS, channel_rows(found)), ""]
    lines += sentences(found)
    if found.files:
        lines += ["", *(f"{kind}: {path}" for kind, path in found.files.items())]
    return "\n".join(lines)


@html_of.register
def _(found: FitResult) -> str:
    tables = {"Parameters": (heads(found), rows(found)), "Channels": (CHANNEL_HEADS, channel_rows(found))}
    return html_sheet(f"Fit of {found.base.entry.title}", sentences(found), tables)


def draw(found: FitResult, path: Path) -> Path:
    """Measured and predicted series, residuals below each."""
    shown = list(found.series.items())[:MOST_PANELS]
    height = 0.9 + 2.3 * len(shown)
    figure = new_figure(9.0, height)
    grid = figure.add_gridspec(
        2 * len(shown), 1, height_ratios=[2, 1] * len(shown), left=0.1, right=0.97, top=1 - 0.55 / height,
        bottom=0.5 / height, hspace=0.28,
    )  # fmt: skip
    name, unit, x = found.first
    for k, (channel, (measured, predicted)) in enumerate(shown):
        c = found.channels[channel]
        upper, lower = figure.add_subplot(grid[2 * k]), figure.add_subplot(grid[2 * k + 1])
        order = np.argsort(x)
        upper.plot(x, measured, ".", color=DARK, ms=6, mew=0, label="measured", zorder=3)
        upper.plot(x[order], predicted[order], "-", color=BLUE, lw=1.4, label="fitted")
        upper.set_ylabel(f"{channel.replace('_', ' ')}\n[{c.unit or '1'}]", fontsize=9)
        left = measured - predicted
        if c.unit == "rad" and not found.over_time:
            left = (left + np.pi) % (2.0 * np.pi) - np.pi
        lower.axhspan(-2.0 * c.noise, 2.0 * c.noise, color="#eef2f7", zorder=0)
        lower.plot(x, left, ".", color=ORANGE, ms=5, mew=0)
        lower.set_ylabel("residual", fontsize=8)
        for axes in (upper, lower):
            open_frame(axes)
            axes.tick_params(labelsize=8)
        upper.tick_params(labelbottom=False)
        lower.tick_params(labelbottom=k == len(shown) - 1)
        if k == 0:
            upper.legend(fontsize=8, frameon=False, loc="best")
    lower.set_xlabel(f"{name.replace('_', ' ')} [{unit}]", fontsize=9)
    title = f"{found.base.entry.title}: fit to {Path(found.source).name}"
    figure.text(0.1, 1 - 0.32 / height, title, fontsize=12, weight="bold")
    return save_figure(figure, path)
