"""The words in the picture of a chart: its title as a sentence, and a label beside each line instead of a legend.

What a chart marks: the band of defaults that do not converge, the recommended point, times that others published.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mechlab.studies.chart.advice import flat_methods, quantity, settled

if TYPE_CHECKING:
    from mechlab.studies.chart.data import Chart, ChartPoint

INK, FAINT, RED = "#1b2330", "#5b6470", "#c1121f"
SIZE = 9.6


def label(name: str, points: Sequence[ChartPoint]) -> str:
    """The method, and from which step on it diverges: what is missing is said, not dropped."""
    lost = [p.step for p in points if p.status == "diverged"]
    if not lost:
        return name
    where = f"{1e3 * min(lost):.3g} ms" if points[0].control == "step" else f"tol. {min(lost):.0e}"
    return f"{name}  × {where}"


def spread(wanted: Sequence[float], low: float, high: float, gap: float) -> list[float]:
    """Places as near as can be to the wanted ones, in their order, at least `gap` apart and within low..high.

    Where they do not fit, they stand at equal distances. Least squares with an order: pool adjacent violators.
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


def beside(axes: Any, entries: Sequence[tuple[str, float, float, dict[str, Any]]]) -> None:
    """A label right of the axes for each (text, x, y of the end of its line, style), joined to it by a thin line."""
    to_axes = axes.transData + axes.transAxes.inverted()
    ends = [to_axes.transform((x, y)) for _, x, y, _ in entries]
    height = axes.figure.get_size_inches()[1] * axes.get_position().height * 72.0
    places = spread([float(e[1]) for e in ends], 0.0, 1.0, 1.45 * SIZE / height)
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


GOLD, BROWN = "#b8860b", "#7a5a00"


def flat(axes: Any, chart: Chart) -> None:
    """The band in which an engine's defaults stay, with words on it, when they do not converge."""
    found = flat_methods(chart)
    if not found:
        return
    last = [points[-1].error for points in found.values()]
    axes.axhspan(min(last) / 1.6, max(last) * 1.6, color=RED, alpha=0.10, zorder=0, lw=0)
    names = ", ".join(n.removeprefix("MuJoCo ").split(",")[0] for n in found)
    whose = "The file's own settings" if any("as in the file" in n for n in found) else "MuJoCo's defaults"
    soft = "dry friction creeps" if chart.notes and "friction" in chart.notes[0] else "the loops are springs"
    still = (
        f"still {settled(found, chart.unit)} wrong at {1e3 * min(points[-1].step for points in found.values()):.2g} ms"
    )
    words = f"{whose} ({names}):\n{still}, because {soft};\na smaller step simulates the wrong mechanism more precisely"
    axes.text(
        0.012, 0.99, words, transform=axes.transAxes, color=RED, fontsize=10.2, linespacing=1.25, va="top", zorder=6
    )


def recommended(axes: Any, chart: Chart) -> None:
    """A ring around the recommended point; its words stand to the lower left, where no point can be that it does not
    dominate."""
    p = chart.recommendation.point
    if p.error <= 0:
        return
    axes.plot([p.cpu_s], [p.error], "o", ms=15, mfc="none", mec=INK, mew=1.6, zorder=5)
    control = f"{1e3 * p.step:.3g} ms" if p.control == "step" else f"tolerance {p.step:.0e}"
    words = f"{p.method.replace(', ', ',' + chr(10), 1)}, {control}:\n{quantity(p.error, chart.unit)} in {quantity(p.cpu_s, 's')} of CPU"
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


def published(axes: Any, chart: Chart) -> None:
    """Stars on the axis: their sources print a time, but no error."""
    for x in chart.published:
        axes.axvline(x.cpu_s, color=GOLD, lw=0.9, ls=":", zorder=1)
        axes.plot([x.cpu_s], [axes.get_ylim()[0]], "*", ms=17, color=GOLD, clip_on=False, zorder=6)
        place = (axes.transData + axes.transAxes.inverted()).transform((x.cpu_s, 1.0))[0]
        left = place > 0.5
        axes.annotate(
            f"{x.program} on {x.machine}:\n{quantity(x.cpu_s, 's', 3)} printed, no error printed",
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
