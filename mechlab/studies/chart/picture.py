"""The picture of a chart: CPU time against error, both logarithmic, with a sentence above it and a label beside each line.

The band in which an engine's defaults stay is red, the recommended point has a ring, published times are stars on the axis.
"""

from __future__ import annotations

import io
import math
import textwrap
from pathlib import Path
from typing import Any

from mechlab.files import write
from mechlab.studies.chart.advice import final_error, flat_methods, headline, with_prefix
from mechlab.studies.chart.data import Chart, ChartPoint
from mechlab.studies.chart.lines import FAINT, INK, RED, SIZE, draw_labels, line_label, line_style
from mechlab.studies.picture_style import new_figure, open_frame

NOTE = 0.13
"""Height of three lines of text, relative to that of the axes."""
LINE, LETTER, LETTERS = 0.025, 0.0068, 40
"""Height of a line below the axes and width of a letter beside them, relative to the figure; letters for which there is room."""
GOLD, BROWN = "#b8860b", "#7a5a00"


def draw_flat_band(axes: Any, chart: Chart) -> None:
    """The band in which an engine's defaults stay, with words on it, when they do not converge."""
    found = flat_methods(chart)
    if not found:
        return
    last = [points[-1].error for points in found.values()]
    axes.axhspan(min(last) / 1.6, max(last) * 1.6, color=RED, alpha=0.10, zorder=0, lw=0)
    names = ", ".join(n.removeprefix("MuJoCo ").split(",")[0] for n in found)
    whose = "The file's own settings" if any("as in the file" in n for n in found) else "MuJoCo's defaults"
    soft = "dry friction creeps" if chart.notes and "friction" in chart.notes[0] else "the loops are springs"
    still = f"still {final_error(found, chart.unit)} wrong at {1e3 * min(points[-1].step for points in found.values()):.2g} ms"
    words = f"{whose} ({names}):\n{still}, because {soft};\na smaller step simulates the wrong mechanism more precisely"
    axes.text(
        0.012, 0.99, words, transform=axes.transAxes, color=RED, fontsize=10.2, linespacing=1.25, va="top", zorder=6
    )


def draw_recommended(axes: Any, chart: Chart) -> None:
    """A ring around the recommended point; its text stands to the lower left, where only better points could lie."""
    p = chart.recommendation.point
    if p.error <= 0:
        return
    axes.plot([p.cpu_s], [p.error], "o", ms=15, mfc="none", mec=INK, mew=1.6, zorder=5)
    control = f"{1e3 * p.step:.3g} ms" if p.control == "step" else f"tolerance {p.step:.0e}"
    cost = f"{with_prefix(p.error, chart.unit)} in {with_prefix(p.cpu_s, 's')} of CPU"
    words = f"{p.method.replace(', ', ',' + chr(10), 1)}, {control}:\n{cost}"
    _, y = (axes.transData + axes.transAxes.inverted()).transform((p.cpu_s, p.error))
    axes.annotate(
        ("recommended: " if chart.recommendation.met else "the best, not good enough: ") + words,
        (p.cpu_s, p.error),
        xytext=(0.014, max(y - 0.09, 0.14)),
        textcoords="axes fraction",
        fontsize=SIZE,
        color=INK,
        va="top",
        linespacing=1.25,
        arrowprops={"arrowstyle": "-", "color": INK, "lw": 0.8, "shrinkB": 8, "relpos": (0.5, 1.0)},
        zorder=6,
    )


def draw_published(axes: Any, chart: Chart) -> None:
    """Published CPU times as stars on the time axis: their sources print no error."""
    for x in chart.published:
        axes.axvline(x.cpu_s, color=GOLD, lw=0.9, ls=":", zorder=1)
        axes.plot([x.cpu_s], [axes.get_ylim()[0]], "*", ms=17, color=GOLD, clip_on=False, zorder=6)
        place = (axes.transData + axes.transAxes.inverted()).transform((x.cpu_s, 1.0))[0]
        left = place > 0.5
        axes.annotate(
            f"{x.program} on {x.machine}:\n{with_prefix(x.cpu_s, 's', 3)} printed, no error printed",
            (x.cpu_s, 0.0),
            xycoords=("data", "axes fraction"),
            xytext=(-12 if left else 12, 5),
            textcoords="offset points",
            ha="right" if left else "left",
            fontsize=SIZE,
            color=BROWN,
            linespacing=1.25,
            bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1.0},
            zorder=6,
        )


def draw(chart: Chart, path: Path) -> Path:
    """Write the picture; the suffix of the path says whether SVG or PNG."""
    return write(path, picture(chart, path.suffix[1:]))


def picture(chart: Chart, kind: str) -> bytes:
    """The picture as "svg" or "png"; the SVG of one chart is the same every time."""
    import matplotlib

    out = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "mechlab"}):
        figure = new_figure(11.0, 7.0)
        lines = {name: [p for p in chart.points if p.method == name] for name in _names(chart)}
        foot = _foot(chart, [n for n, points in lines.items() if not any(_drawn(p) for p in points)])
        low = 0.145 + LINE * max(0, len(foot) - 3)
        longest = max(len(line_label(name, points)) for name, points in lines.items())
        axes = figure.add_axes((0.085, low, 0.60 - LETTER * max(0, longest - LETTERS), 0.82 - low))
        _frame(chart, figure, axes)
        for name, points in lines.items():
            _line(axes, name, points)
        front = [p for p in chart.front if p.error > 0]
        x, y = [p.cpu_s for p in front], [p.error for p in front]
        axes.plot(x, y, color=INK, lw=7.0, alpha=0.13, zorder=1, solid_capstyle="round")
        draw_flat_band(axes, chart)
        draw_recommended(axes, chart)
        draw_published(axes, chart)
        _labels(axes, chart, lines)
        figure.text(0.022, 0.012, "\n".join(foot), fontsize=8.8, color=FAINT, va="bottom", linespacing=1.3)
        figure.savefig(out, format=kind, metadata={"Date": None} if kind == "svg" else None)
    return out.getvalue()


def _names(chart: Chart) -> list[str]:
    return list(dict.fromkeys(p.method for p in chart.points))


def _drawn(p: ChartPoint) -> bool:
    return p.ok and p.error > 0


def _frame(chart: Chart, figure: Any, axes: Any) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axes.set_xscale("log")
    axes.set_yscale("log")
    target = chart.recommendation.target
    shown = [p for p in chart.points if _drawn(p)]
    errors, times = [p.error for p in shown] + [target], [p.cpu_s for p in shown] + [x.cpu_s for x in chart.published]
    low, high = max(min(errors) / (60.0 if chart.published else 8.0), 1e-15), 4.0 * max(errors)
    if flat_methods(chart):  # the words on their band stand above all points
        high *= (high / low) ** (NOTE / (1.0 - NOTE))
    axes.set_ylim(low, high)
    axes.set_xlim(min(times) / 1.6, max(times) * 1.5)
    for axis, unit, (low, high) in ((axes.xaxis, "s", axes.get_xlim()), (axes.yaxis, chart.unit, axes.get_ylim())):
        between = (1.0, 2.0, 5.0) if high < 60.0 * low else (1.0,)
        axis.set_major_locator(LogLocator(10.0, subs=between, numticks=12))
        axis.set_major_formatter(FuncFormatter(lambda v, _, unit=unit: with_prefix(v, unit, 1)))
        axis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("CPU time of stepping (one thread, median)", fontsize=11, color=INK)
    axes.text(
        -0.095,
        1.025,
        f"largest error of {', '.join(chart.tracked[:3])}",
        transform=axes.transAxes,
        fontsize=11,
        color=INK,
    )
    axes.tick_params(labelsize=10, colors=INK)
    axes.grid(True, which="major", color="#e3e6ea", lw=0.8)
    open_frame(axes)
    axes.axhline(target, color=INK, lw=0.9, ls=(0, (5, 4)), zorder=1)
    right = _free_end(axes, shown, target)
    axes.annotate(
        f"target {with_prefix(target, chart.unit, 1)}",
        (1.0 if right else 0.0, target),
        xycoords=("axes fraction", "data"),
        xytext=(-4 if right else 4, 4),
        textcoords="offset points",
        ha="right" if right else "left",
        fontsize=SIZE,
        color=INK,
        bbox={"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 0.5},
    )
    sentence, color = headline(chart), RED if flat_methods(chart) else INK
    figure.text(0.022, 0.957, chart.title, fontsize=11.5, weight="bold", color=FAINT)
    figure.text(0.022, 0.912, sentence, fontsize=min(18.0, 18.0 * 70 / len(sentence)), weight="bold", color=color)
    words = f"{chart.duration:g} s simulated, scene {chart.scene}. Lower left is better. Each line: one method, from large to small steps."
    figure.text(0.022, 0.876, words, fontsize=10.5, color=FAINT)


def _free_end(axes: Any, shown: list[ChartPoint], target: float) -> bool:
    """True where the right end of the target line has fewer points above it than the left one."""
    to_axes = axes.transData + axes.transAxes.inverted()
    level = to_axes.transform((1.0, target))[1]
    near = [x for x, y in (to_axes.transform((p.cpu_s, p.error)) for p in shown) if -0.01 < y - level < 0.05]
    return sum(x > 0.8 for x in near) < sum(x < 0.2 for x in near)


def _foot(chart: Chart, lost: list[str]) -> list[str]:
    """The lines below the picture: meaning of the signs, methods that are not drawn, the reference of the errors, cautions on peers."""
    engines = ", ".join(f"{n} {chart.versions[n]}" for n in ("mujoco", "pin") if n in chart.versions)
    signs = "Grey: nothing is better in both. × 25 ms: diverges at that step and above."
    if lost:
        signs += f" Not drawn, diverged or over the budget: {', '.join(lost)}."
    reference = chart.reference.split(";")[0]
    cautions = () if chart.peers is None else chart.peers.notes
    return [
        *textwrap.wrap(signs, 165),
        f"Held against: {reference}. {engines}.",
        *(x for c in cautions for x in textwrap.wrap(c, 165)),
    ]


def _line(axes: Any, name: str, points: list[ChartPoint]) -> None:
    """A line that breaks where a run is missing."""
    x = [p.cpu_s if _drawn(p) else math.nan for p in points]
    y = [p.error if _drawn(p) else math.nan for p in points]
    axes.plot(x, y, zorder=3, **line_style(name))


def _labels(axes: Any, chart: Chart, lines: dict[str, list[ChartPoint]]) -> None:
    """The name of each line at its end; flat defaults are named together in their band."""
    together = flat_methods(chart)
    entries = []
    for name, points in lines.items():
        shown = [p for p in points if _drawn(p)]
        if shown and name not in together:
            end = min(shown, key=lambda p: p.step)
            entries.append((line_label(name, points), end.cpu_s, end.error, line_style(name)))
    draw_labels(axes, entries)
