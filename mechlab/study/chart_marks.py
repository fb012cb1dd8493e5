"""What a chart marks: the band of defaults that do not converge, the recommended point, times that others published."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mechlab.study.chart_labels import INK, RED, SIZE, flat_methods, quantity, settled

if TYPE_CHECKING:
    from mechlab.study.chart_data import Chart

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
