"""The picture of a chart: CPU time against error, both logarithmic. It speaks for itself: a sentence above it, words beside
each line, and what an engine's defaults do in red."""

from __future__ import annotations

import io
import math
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechlab.files import write
from mechlab.studies.chart.advice import flat_methods, headline, quantity
from mechlab.studies.chart.labels import FAINT, INK, RED, SIZE, beside, flat, label, published, recommended

if TYPE_CHECKING:
    from mechlab.studies.chart.data import Chart, ChartPoint

STYLES: dict[str, tuple[str, str]] = {
    "Euler": ("#d97706", "s"),
    "implicitfast": ("#0891b2", "D"),
    "implicit": ("#4f7cac", "v"),
    "RK4": ("#1d4ed8", "o"),
    "discrete": ("#7c3aed", "P"),
}
OTHERS: dict[str, tuple[str, str]] = {
    "Pinocchio semi-implicit Euler": ("#86a83b", "v"),
    "Pinocchio RK4, soft stabilisation": ("#15803d", "^"),
    "Pinocchio RK4, stiff stabilisation": ("#4ade80", "^"),
    "Pinocchio DOP853": ("#064e3b", "h"),
    "one freedom RK4": ("#be185d", "o"),
    "one freedom DOP853": ("#831843", "h"),
    "Pinocchio semi-implicit Euler, friction by tanh": ("#86a83b", "v"),
    "Pinocchio RK4, friction by tanh": ("#15803d", "^"),
    "Pinocchio RK4, friction by sign": ("#db2777", "*"),
    "Pinocchio DOP853, friction by sign": ("#9d174d", "*"),
    "hybrid DOP853": ("#78350f", "h"),
    "own equations, scipy DOP853": ("#444444", "X"),
    "own equations, scipy Radau": ("#999999", "X"),
    "Exudyn generalized-alpha": ("#b45309", "<"),
    "Exudyn trapezoidal": ("#f59e0b", "<"),
    "Exudyn RK44": ("#92400e", "<"),
    "Exudyn RK67": ("#451a03", "<"),
    "Exudyn DOPRI5": ("#d6a35c", "<"),
    "Drake discrete SAP": ("#0f766e", ">"),
    "Drake RK3": ("#14b8a6", ">"),
    "Drake RK5": ("#134e4a", ">"),
    "Drake Radau3": ("#5eead4", ">"),
    "OpenSim Runge-Kutta-Merson": ("#a21caf", "p"),
    "OpenSim Runge-Kutta-Fehlberg": ("#e879f9", "p"),
    "OpenSim CPodes": ("#701a75", "p"),
}


def draw(chart: Chart, path: Path) -> Path:
    """Write the picture; the suffix of the path says whether SVG or PNG."""
    return write(path, picture(chart, path.suffix[1:]))


def picture(chart: Chart, kind: str) -> bytes:
    """The picture as "svg" or "png"; the SVG of one chart is the same every time."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    out = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "mechlab"}):
        figure = Figure(figsize=(11.0, 7.0), dpi=130, facecolor="white")
        FigureCanvasAgg(figure)
        axes = figure.add_axes((0.085, 0.145, 0.60, 0.675))
        _frame(chart, figure, axes)
        lines = {name: [p for p in chart.points if p.method == name] for name in _names(chart)}
        for name, points in lines.items():
            _line(axes, name, points)
        front = [p for p in chart.front if p.error > 0]
        x, y = [p.cpu_s for p in front], [p.error for p in front]
        axes.plot(x, y, color=INK, lw=7.0, alpha=0.13, zorder=1, solid_capstyle="round")
        flat(axes, chart)
        recommended(axes, chart)
        published(axes, chart)
        _labels(axes, chart, lines)
        _foot(chart, figure, [n for n, points in lines.items() if not any(_drawn(p) for p in points)])
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
    axes.set_ylim(
        max(min(errors) / (60.0 if chart.published else 8.0), 1e-15),
        max(errors) * (60.0 if flat_methods(chart) else 4.0),
    )
    axes.set_xlim(min(times) / 1.6, max(times) * 1.5)
    for axis, unit, (low, high) in (
        (axes.xaxis, "s", axes.get_xlim()),
        (axes.yaxis, chart.unit, axes.get_ylim()),
    ):
        between = (1.0, 2.0, 5.0) if high < 60.0 * low else (1.0,)
        axis.set_major_locator(LogLocator(10.0, subs=between, numticks=12))
        axis.set_major_formatter(FuncFormatter(lambda v, _, unit=unit: quantity(v, unit, 1)))
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
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.axhline(target, color=INK, lw=0.9, ls=(0, (5, 4)), zorder=1)
    right = _free_end(axes, shown, target)
    axes.annotate(
        f"target {quantity(target, chart.unit, 1)}",
        (1.0 if right else 0.0, target),
        xycoords=("axes fraction", "data"),
        xytext=(-4 if right else 4, 4),
        textcoords="offset points",
        ha="right" if right else "left",
        fontsize=SIZE,
        color=INK,
        bbox={"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 0.5},
    )
    said, color = headline(chart), RED if flat_methods(chart) else INK
    figure.text(0.022, 0.957, chart.title, fontsize=11.5, weight="bold", color=FAINT)
    figure.text(0.022, 0.912, said, fontsize=min(18.0, 18.0 * 70 / len(said)), weight="bold", color=color)
    words = f"{chart.duration:g} s simulated, scene {chart.scene}. Lower left is better. Each line: one method, from large to small steps."
    figure.text(0.022, 0.876, words, fontsize=10.5, color=FAINT)


def _free_end(axes: Any, shown: list[ChartPoint], target: float) -> bool:
    """True where the right end of the target line has fewer points above it than the left one."""
    to_axes = axes.transData + axes.transAxes.inverted()
    level = to_axes.transform((1.0, target))[1]
    near = [x for x, y in (to_axes.transform((p.cpu_s, p.error)) for p in shown) if -0.01 < y - level < 0.05]
    return sum(x > 0.8 for x in near) < sum(x < 0.2 for x in near)


def _foot(chart: Chart, figure: Any, lost: list[str]) -> None:
    """Signs, what did not come through, and what the errors are held against."""
    engines = ", ".join(f"{n} {chart.versions[n]}" for n in ("mujoco", "pin") if n in chart.versions)
    signs = "Grey: nothing is better in both. × 25 ms: diverges at that step and above."
    if lost:
        signs += f" Not drawn, diverged or over the budget: {', '.join(lost)}."
    reference = chart.reference.split(";")[0]
    reference = chart.reference.split(";")[0]
    text = [*textwrap.wrap(signs, 165), f"Held against: {reference}. {engines}."]
    figure.text(0.022, 0.012, "\n".join(text), fontsize=8.8, color=FAINT, va="bottom", linespacing=1.3)


def _style(name: str) -> dict[str, Any]:
    if name.startswith("MuJoCo "):
        color, marker = STYLES.get(name.removeprefix("MuJoCo ").split(",")[0], ("#000000", "o"))
        if "defaults" in name or "as in the file" in name:
            return {"color": RED, "marker": marker, "ls": (0, (1, 1.5)), "mfc": "white", "ms": 6, "lw": 1.2}
        return {"color": color, "marker": marker, "ls": "-", "ms": 5.5, "lw": 1.6}
    color, marker = OTHERS.get(name, ("#555555", "."))
    return {"color": color, "marker": marker, "ls": "--" if "own" in name else "-", "ms": 6, "lw": 1.6}


def _line(axes: Any, name: str, points: list[ChartPoint]) -> None:
    """A line that breaks where a run is missing."""
    x = [p.cpu_s if _drawn(p) else math.nan for p in points]
    y = [p.error if _drawn(p) else math.nan for p in points]
    axes.plot(x, y, zorder=3, **_style(name))


def _labels(axes: Any, chart: Chart, lines: dict[str, list[ChartPoint]]) -> None:
    """The name of each line at its end; flat defaults are named together in their band."""
    together = flat_methods(chart)
    entries = []
    for name, points in lines.items():
        shown = [p for p in points if _drawn(p)]
        if shown and name not in together:
            end = min(shown, key=lambda p: p.step)
            entries.append((label(name, points), end.cpu_s, end.error, _style(name)))
    beside(axes, entries)
