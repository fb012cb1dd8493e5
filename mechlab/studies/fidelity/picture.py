"""The picture of the fidelities: CPU time against error, and a grid of what each of them answers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mechlab.experiment.scene import NEEDS
from mechlab.studies.fidelity.result import Fidelities
from mechlab.studies.picture_style import new_figure, open_frame, save_figure

LEAST_DRAWN = 1e-12
"""Where errors that are zero are drawn [m or rad]."""
COLORS = ("#0891b2", "#d97706", "#7c3aed", "#15803d", "#be185d")


def draw(table: Fidelities, path: Path) -> Path:
    """Write the picture; the suffix of the path says whether SVG or PNG."""
    from matplotlib.ticker import NullFormatter

    figure = new_figure(10.0, 5.6)
    axes = figure.add_axes((0.09, 0.13, 0.47, 0.66))
    shown = [x for x in table.levels if x.cost.get("cpu_s_per_s")]
    costs = [float(x.cost["cpu_s_per_s"] or 0.0) for x in shown]
    errors = [max(x.error or 0.0, LEAST_DRAWN) for x in shown]
    axes.set_xscale("log")
    axes.set_yscale("log")
    for k, (x, cost, error) in enumerate(zip(shown, costs, errors, strict=True)):
        color = COLORS[k % len(COLORS)]
        axes.plot([cost], [error], "o", ms=13, color=color, zorder=3)
        if x.fidelity == table.chosen:
            axes.plot([cost], [error], "o", ms=23, mfc="none", mec="#111111", mew=1.6, zorder=4)
        zero = "" if x.error else " (the reference)"
        shift, align = (-14, "right") if k % 2 else (14, "left")
        axes.annotate(
            x.fidelity + zero, (cost, error), xytext=(shift, 8), textcoords="offset points", ha=align, fontsize=10.5
        )
    axes.axhline(table.tolerance, color="#111111", lw=0.9, ls=(0, (5, 4)))
    axes.text(
        0.01,
        table.tolerance * 1.3,
        f"tolerance {table.tolerance:g} m or rad",
        transform=axes.get_yaxis_transform(),
        fontsize=8.5,
    )
    if costs:
        axes.set_xlim(min(costs) / 6.0, max(costs) * 6.0)
        axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(LEAST_DRAWN / 5.0, 20.0 * max([table.tolerance, *errors]))
    axes.set_xlabel("CPU seconds per simulated second", fontsize=10)
    axes.set_ylabel("error against the richest, m or rad", fontsize=10)
    axes.grid(True, which="major", color="#e3e6ea", lw=0.8)
    open_frame(axes)
    _answers(figure, table)
    figure.text(0.09, 0.92, f"{table.title}: how much model?", fontsize=15, weight="bold")
    figure.text(
        0.09,
        0.865,
        f"scene {table.scene}, {table.duration:.3g} s; ringed: taken by fidelity auto",
        fontsize=10,
        color="#444444",
    )
    return save_figure(figure, path, metadata={"Date": None} if path.suffix == ".svg" else None)


def _answers(figure: Any, table: Fidelities) -> None:
    """A grid of what each fidelity answers."""
    grid = figure.add_axes((0.66, 0.13, 0.32, 0.66))
    grid.set_axis_off()
    rows = list(table.levels)
    grid.set_xlim(-0.5, len(rows) - 0.5)
    grid.set_ylim(len(NEEDS) + 1.4, -0.8)
    for k, x in enumerate(rows):
        bold = "bold" if x.fidelity == table.chosen else "normal"
        grid.text(k, -0.4, x.fidelity, ha="center", fontsize=10, weight=bold)
        for i, need in enumerate(NEEDS):
            can = need in x.answers
            grid.plot([k], [i + 0.3], "o", ms=11, color="#15803d" if can else "#e3e6ea")
        grid.text(
            k,
            len(NEEDS) + 0.4,
            "" if x.coordinates is None else f"{x.coordinates} coord.\n{x.rows} rows",
            ha="center",
            va="top",
            fontsize=8.5,
        )
    for i, need in enumerate(NEEDS):
        wanted = "bold" if need in table.needs else "normal"
        grid.text(-0.55, i + 0.3, need.replace("_", " "), ha="right", va="center", fontsize=9.5, weight=wanted)
