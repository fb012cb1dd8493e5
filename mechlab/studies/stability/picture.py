"""The picture of a stability map: a panel for each method, timestep to the right, outcomes as colours, theoretical
limits."""

from __future__ import annotations

import math
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from mechlab.studies.picture_style import cell_borders, new_figure, open_frame, save_figure
from mechlab.studies.stability.data import MethodPanel, RunOutcome, Stability, StabilityMap

LOOKS: dict[RunOutcome, tuple[str, str]] = {
    RunOutcome.RIGHT: ("#2c7fb8", ""),
    RunOutcome.DRIFTING: ("#a6d5e8", ""),
    RunOutcome.WRONG: ("#fdb863", "."),
    RunOutcome.BLOWN_UP: ("#7f2704", "x"),
    RunOutcome.REFUSED: ("#d9d9d9", "-"),
    RunOutcome.NOT_RUN: ("#ffffff", ""),
}
"""Colour and mark of an outcome. From blue over orange to dark brown the colours differ without red and green, and in
lightness."""


COLUMNS = 3


def draw(found: Stability, made: StabilityMap, path: Path) -> Path:
    """Write the picture of one map; the suffix of the path says whether PNG or SVG."""

    count = max(1, len(made.panels))
    columns = min(COLUMNS, count)
    rows = math.ceil(count / columns)
    width, height = 4.1 * columns + 0.9, 3.15 * rows + 2.3
    figure = new_figure(width, height, 120)
    left, bottom = 0.85 / width, 1.25 / height
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True, gridspec_kw={
        "left": left, "right": 1.0 - 0.2 / width, "bottom": bottom, "top": 1.0 - 1.35 / height, "wspace": 0.08, "hspace": 0.24,
    })  # fmt: skip
    for k, axes in enumerate(grid.flat):
        if k >= len(made.panels):
            axes.set_visible(False)
            continue
        _panel(axes, made, made.panels[k])
        if k + columns >= len(made.panels):
            axes.set_xlabel("timestep, ms", fontsize=9.5)
            axes.tick_params(labelbottom=True)
        if k % columns == 0:
            unit = f", {made.y.unit}" if made.y.unit else ""
            axes.set_ylabel(f"{made.y.name}{unit}", fontsize=9.5)
    _words(figure, found, made, left, height)
    _legend(figure, made, left, height)
    return save_figure(figure, path)


def _panel(axes: Any, made: StabilityMap, panel: MethodPanel) -> None:
    from matplotlib.colors import ListedColormap

    order = list(LOOKS)
    codes = np.array([[order.index(c.outcome) for c in row] for row in panel.cells])
    x, y = 1e3 * cell_borders(made.x.values, made.x.log), cell_borders(made.y.values, made.y.log)
    axes.pcolormesh(x, y, codes, cmap=ListedColormap([LOOKS[o][0] for o in order]), vmin=-0.5, vmax=len(order) - 0.5,
                    edgecolors="white", linewidth=0.6)  # fmt: skip
    axes.set_xscale("log" if made.x.log else "linear")
    axes.set_yscale("log" if made.y.log else "linear")
    for outcome, (_, mark) in LOOKS.items():
        if mark:
            where = [(1e3 * h, v) for v, row in zip(made.y.values, panel.cells, strict=True)
                     for h, c in zip(made.x.values, row, strict=True) if c.outcome is outcome]  # fmt: skip
            color = (
                "#f5c9a8" if outcome is RunOutcome.BLOWN_UP else "#7a5a2b" if outcome is RunOutcome.WRONG else "#777777"
            )
            shape = "_" if mark == "-" else mark
            axes.plot([p[0] for p in where], [p[1] for p in where], shape, color=color, ms=3.2, mew=0.8)
    _theory(axes, made, panel, x, y)
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(y[0], y[-1])
    axes.set_title(panel.method, fontsize=10, loc="left", weight="bold")
    axes.tick_params(labelsize=8.5)
    open_frame(axes)


def _theory(axes: Any, made: StabilityMap, panel: MethodPanel, x: np.ndarray, y: np.ndarray) -> None:
    """Draw the theoretical boundaries of a method with their formulas; the label says where a line lies outside the
    panel."""
    from matplotlib.patheffects import withStroke

    outline = [withStroke(linewidth=3.0, foreground="white")]
    for line in (t for t in made.theory if panel.method in t.methods):
        h = 1e3 * np.array(line.x)
        axes.plot(h, line.y, color="#111111", lw=1.8, zorder=4, path_effects=outline)
        seen = (h > x[0]) & (h < x[-1]) & (np.array(line.y) >= y[0]) & (np.array(line.y) <= y[-1])
        inside = bool(np.any(seen)) or bool(np.ptp(line.x) > 0 and min(h) < x[-1] and max(h) > x[0])
        label = f"theory: {line.formula}" if inside else f"theory: {line.formula}, outside"
        axes.text(0.03, 0.05, label, transform=axes.transAxes, fontsize=8.3, color="#111111", zorder=6,
                  bbox={"facecolor": "white", "alpha": 0.88, "edgecolor": "none", "pad": 1.8})  # fmt: skip


def _words(figure: Any, found: Stability, made: StabilityMap, left: float, height: float) -> None:
    figure.text(left, 1.0 - 0.36 / height, f"{found.title}: {made.title}", fontsize=14, weight="bold")
    about = f"Rows: {made.y.text}. Scene {found.scene}, {made.duration:.3g} s simulated, fidelity {made.fidelity}."
    wide = int(figure.get_figwidth() * 12.5)
    figure.text(left, 1.0 - 0.48 / height, fill(about, wide), fontsize=9, color="#444444", va="top", linespacing=1.25)
    engines = ", ".join(f"{n} {found.versions[n]}" for n in ("mujoco", "pin") if n in found.versions)
    figure.text(left, 0.1 / height, engines, fontsize=7.5, color="#777777")


def _legend(figure: Any, made: StabilityMap, left: float, height: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    present = {c.outcome for p in made.panels for row in p.cells for c in row}
    words = {
        RunOutcome.RIGHT: f"stable and right (up to {made.right:g})", RunOutcome.DRIFTING: f"drifting (up to {made.wrong:g})",
        RunOutcome.WRONG: "wrong", RunOutcome.BLOWN_UP: "blown up", RunOutcome.REFUSED: "refused", RunOutcome.NOT_RUN: "not run",
    }  # fmt: skip
    handles: list[Any] = [
        Patch(facecolor=LOOKS[o][0], edgecolor="#999999", label=words[o]) for o in LOOKS if o in present
    ]
    if made.theory:
        handles.append(Line2D([], [], color="#111111", lw=1.8, label="boundary of theory"))
    figure.legend(handles=handles, loc="lower left", bbox_to_anchor=(left, 0.27 / height), ncol=4, fontsize=8.5, frameon=False,
                  title=f"{made.value_name}:", title_fontsize=8.5, alignment="left", borderaxespad=0.0)  # fmt: skip
