"""The picture of a chart: CPU time against error, both logarithmic; what an engine's defaults do is said in the picture."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mechlab.study.chart import Chart, Point

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
RED = "#c1121f"


def draw(chart: Chart, path: Path) -> Path:
    """Write the picture; the suffix of the path says whether SVG or PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 7.0), dpi=130, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.075, 0.1, 0.60, 0.755))
    shown = [p for p in chart.points if p.ok and p.error > 0]
    _frame(chart, figure, axes, shown)
    names = list(dict.fromkeys(p.method for p in chart.points))
    for name in names:
        _line(axes, name, [p for p in chart.points if p.method == name])
    front = [p for p in chart.front if p.error > 0]
    axes.plot(
        [p.cpu_s for p in front],
        [p.error for p in front],
        color="#111111",
        lw=6.0,
        alpha=0.12,
        zorder=1,
        solid_capstyle="round",
        label="Pareto front",
    )
    _defaults(axes, chart, shown)
    _recommended(axes, chart)
    _published(axes, chart)
    axes.legend(loc="upper left", bbox_to_anchor=(1.015, 1.012), fontsize=7.6, frameon=False, handlelength=3.0)
    metadata = {"Date": None} if path.suffix == ".svg" else None
    figure.savefig(path, metadata=metadata)
    return path


def _frame(chart: Chart, figure: Any, axes: Any, shown: list[Point]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    target = chart.recommendation.target
    low, high = min([p.error for p in shown] + [target]), max([p.error for p in shown] + [target])
    axes.set_ylim(max(low / 5.0, 1e-15), high * 30.0)
    axes.set_xlabel("CPU time of stepping, s (one thread, median)", fontsize=10)
    axes.set_ylabel(f"largest error of {', '.join(chart.tracked[:3])}, {chart.unit}", fontsize=10)
    axes.grid(True, which="major", color="#e3e6ea", lw=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.axhline(target, color="#111111", lw=0.9, ls=(0, (5, 4)), zorder=1)
    axes.annotate(
        f"target {target:g} {chart.unit}",
        (1.0, target),
        xycoords=("axes fraction", "data"),
        xytext=(-2, 4),
        textcoords="offset points",
        fontsize=8.5,
        ha="right",
    )
    figure.text(0.075, 0.945, f"{chart.title}: speed against accuracy", fontsize=16, weight="bold")
    figure.text(
        0.075,
        0.905,
        f"{chart.duration:g} s simulated. Lower left is better. Each line: one method, ever smaller steps.",
        fontsize=10.5,
        color="#444444",
    )
    engines = ", ".join(f"{n} {chart.versions[n]}" for n in ("mujoco", "pin") if n in chart.versions)
    words = f"Reference: {chart.reference}. {engines}."
    figure.text(0.075, 0.012, words, fontsize=6.8, color="#666666")


def _style(name: str) -> dict[str, Any]:
    if name.startswith("MuJoCo "):
        color, marker = STYLES.get(name.removeprefix("MuJoCo ").split(",")[0], ("#000000", "o"))
        if "defaults" in name or "as in the file" in name:
            return {"color": RED, "marker": marker, "ls": (0, (1, 1.5)), "mfc": "white", "ms": 6, "lw": 1.2}
        return {"color": color, "marker": marker, "ls": "-", "ms": 5.5, "lw": 1.6}
    color, marker = OTHERS.get(name, ("#555555", "."))
    return {"color": color, "marker": marker, "ls": "--" if "own" in name else "-", "ms": 6, "lw": 1.6}


def _line(axes: Any, name: str, points: list[Point]) -> None:
    """A line that breaks where a run is missing."""
    x = [p.cpu_s if p.ok and p.error > 0 else math.nan for p in points]
    y = [p.error if p.ok and p.error > 0 else math.nan for p in points]
    axes.plot(x, y, label=_label(name, points), zorder=3, **_style(name))


def _label(name: str, points: list[Point]) -> str:
    """The method, and from which step on it diverges: what is missing is said, not dropped."""
    lost = [p.step for p in points if p.status == "diverged"]
    if not lost:
        return name
    where = f"{1e3 * min(lost):.3g} ms" if points[0].control == "step" else f"tolerance {min(lost):.0e}"
    return f"{name}\n    (x diverges from {where})"


def _defaults(axes: Any, chart: Chart, shown: list[Point]) -> None:
    """The band in which MuJoCo's defaults stay, with words on it, when they do not converge."""
    if not chart.notes:
        return
    from mechlab.study.chart import is_flat

    names = {p.method for p in shown if p.default}
    flat = [
        p
        for n in names
        for p in shown
        if p.method == n and is_flat([x for x in shown if x.method == n], chart.recommendation.target)
    ]
    if not flat:
        return
    low, high = min(p.error for p in flat), max(p.error for p in flat)
    axes.axhspan(low / 1.5, high * 1.5, color=RED, alpha=0.09, zorder=0, lw=0)
    middle = math.sqrt(low * high)
    size = f"{middle:.2g} {chart.unit}"
    smallest, largest = min(p.step for p in flat), max(p.step for p in flat)
    soft = "friction rows creep" if "friction" in chart.notes[0] else "its loops are springs"
    axes.text(
        0.015,
        0.985,
        "MuJoCo's DEFAULTS DO NOT CONVERGE",
        transform=axes.transAxes,
        color=RED,
        fontsize=13.5,
        weight="bold",
        va="top",
    )
    axes.text(
        0.015,
        0.945,
        f"about {size} wrong at {1e3 * largest:.3g} ms and still at {1e3 * smallest:.2g} ms: "
        f"{soft}, smaller steps do not stiffen them",
        transform=axes.transAxes,
        color=RED,
        fontsize=9,
        va="top",
    )


def _recommended(axes: Any, chart: Chart) -> None:
    p = chart.recommendation.point
    if p.error <= 0:
        return
    axes.plot([p.cpu_s], [p.error], "o", ms=15, mfc="none", mec="#111111", mew=1.6, zorder=5, label="recommended")


def _published(axes: Any, chart: Chart) -> None:
    """Stars on the axis: their sources print a time, but no error."""
    for x in chart.published:
        axes.axvline(x.cpu_s, color="#8a6d1f", lw=0.8, ls=":", zorder=1)
        axes.plot(
            [x.cpu_s],
            [axes.get_ylim()[0]],
            "*",
            ms=15,
            color="#b8860b",
            clip_on=False,
            zorder=6,
            label=f"{x.program},\n{x.machine}: time only,\nno error published",
        )
