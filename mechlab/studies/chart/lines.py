"""The lines of the picture of a chart: colour and marker of each method, and labels beside the lines that do not overlap."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechlab.studies.chart.data import DIVERGED, ChartPoint

INK, FAINT, RED = "#1b2330", "#5b6470", "#c1121f"
SIZE = 9.6
"""Size of the letters [pt]."""

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
    "OpenSim Runge-Kutta 3": ("#c026d3", "p"),
    "Exudyn generalized-alpha, full Newton": ("#7c2d12", "<"),
    "Exudyn trapezoidal, full Newton": ("#fbbf24", "<"),
    "Exudyn generalized-alpha, planar bodies": ("#dc2626", "<"),
    "Exudyn generalized-alpha, planar bodies, full Newton": ("#991b1b", "<"),
    "Exudyn trapezoidal, planar bodies": ("#facc15", "<"),
    "Exudyn trapezoidal, planar bodies, full Newton": ("#a16207", "<"),
    "mujoco-warp RK4": ("#4d7c0f", "d"),
    "mujoco-warp implicitfast": ("#a3e635", "d"),
    "Kamino LOX": ("#475569", "H"),
    "Kamino DVI": ("#94a3b8", "H"),
}


def line_style(name: str) -> dict[str, Any]:
    """Colour, marker and dashes of the line of a method; an engine's defaults are red and dotted."""
    if name.startswith("MuJoCo "):
        color, marker = STYLES.get(name.removeprefix("MuJoCo ").split(",")[0], ("#000000", "o"))
        if "defaults" in name or "as in the file" in name:
            return {"color": RED, "marker": marker, "ls": (0, (1, 1.5)), "mfc": "white", "ms": 6, "lw": 1.2}
        return {"color": color, "marker": marker, "ls": "-", "ms": 5.5, "lw": 1.6}
    color, marker = OTHERS.get(name, ("#555555", "."))
    return {"color": color, "marker": marker, "ls": "--" if "own" in name else "-", "ms": 6, "lw": 1.6}


def line_label(name: str, points: Sequence[ChartPoint]) -> str:
    """The name of the method and, where some of its runs diverge, the smallest step or tolerance at which they do."""
    lost = [p.step for p in points if p.status == DIVERGED]
    if not lost:
        return name
    where = f"{1e3 * min(lost):.3g} ms" if points[0].control == "step" else f"tol. {min(lost):.0e}"
    return f"{name}  × {where}"


def spaced_apart(wanted: Sequence[float], low: float, high: float, gap: float) -> list[float]:
    """Places closest to the wanted ones (least squares), in the same order, at least `gap` apart and within low..high.

    Where they do not fit, they are equally spaced. Method: isotonic regression by pooling adjacent violators.
    """
    n = len(wanted)
    if n == 0:
        return []
    if gap * (n - 1) >= high - low:
        return list(np.linspace(low, high, n)) if n > 1 else [float(np.clip(wanted[0], low, high))]
    order = np.argsort(wanted, kind="stable")
    blocks: list[list[float]] = []  # mean of (wanted - k gap), count
    for k, i in enumerate(order):
        blocks.append([float(wanted[i]) - k * gap, 1.0])
        while len(blocks) > 1 and blocks[-2][0] > blocks[-1][0]:
            mean, count = blocks.pop()
            blocks[-1] = [
                (blocks[-1][0] * blocks[-1][1] + mean * count) / (blocks[-1][1] + count),
                blocks[-1][1] + count,
            ]
    flat = np.concatenate([np.full(int(count), mean) for mean, count in blocks])
    placed = np.clip(flat, low, high - (n - 1) * gap) + gap * np.arange(n)
    out = np.empty(n)
    out[order] = placed
    return [float(y) for y in out]


def draw_labels(axes: Any, entries: Sequence[tuple[str, float, float, dict[str, Any]]]) -> None:
    """A label right of the axes for each (text, x, y of the end of its line, style), joined to it by a thin line."""
    to_axes = axes.transData + axes.transAxes.inverted()
    ends = [to_axes.transform((x, y)) for _, x, y, _ in entries]
    height = axes.figure.get_size_inches()[1] * axes.get_position().height * 72.0
    places = spaced_apart([float(e[1]) for e in ends], 0.0, 1.0, 1.45 * SIZE / height)
    for (text, x, y, style), place in zip(entries, places, strict=True):
        color = style["color"]
        axes.annotate(
            "",
            (x, y),
            xytext=(1.018, place),
            textcoords="axes fraction",
            arrowprops={"arrowstyle": "-", "color": color, "lw": 0.7, "alpha": 0.45, "shrinkA": 0, "shrinkB": 3},
            annotation_clip=False,
            zorder=2,
        )
        shape = {k: style[k] for k in ("color", "marker", "mfc") if k in style}
        axes.plot([1.026], [place], transform=axes.transAxes, clip_on=False, ms=6, ls="", zorder=7, **shape)
        axes.text(1.038, place, text, transform=axes.transAxes, fontsize=SIZE, color=INK, va="center", clip_on=False)
