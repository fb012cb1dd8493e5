"""The plots of a Story and the paths of its points as one SVG, for sheets and print."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.files import write
from mechlab.view.arrays import Array
from mechlab.view.story import Story

# The curves of the page: colour-blind-safe, told apart by their dashes too.
CURVES = (
    ("#0072b2", "-"),
    ("#d55e00", (0, (7, 3))),
    ("#009e73", (0, (2, 2))),
    ("#a64d79", (0, (9, 3, 2, 3))),
    ("#3b3b3b", (0, (1, 1.5))),
    ("#b58900", (0, (12, 4))),
)
MOST_PLOTS = 3
INK, FAINT = "#1b2330", "#5b6470"
STYLE: Any = {
    "svg.hashsalt": "mechlab",
    "font.size": 10,
    "text.color": INK,
    "axes.edgecolor": FAINT,
    "path.simplify_threshold": 0.5,
}


def motion_svg(story: Story) -> str:
    """Up to three plots over time, and beside them the paths of named points in the plane in which they move most.

    The same for one story every time. Raises MechlabError for a story without motion or without anything to plot.
    """
    import matplotlib
    from matplotlib.figure import Figure

    plots = [p for p in story.plots if not (story.traces and p.title == "points")][:MOST_PLOTS]
    if len(story.t) < 2 or not (plots or story.traces):
        raise MechlabError(f"{story.title}: there is no motion to plot; expected a run with channels or named points.")
    rows = max(len(plots), 1)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.6, max(1.9 * rows + 0.5, 3.6)), layout="constrained", facecolor="white")
        both = bool(plots) and bool(story.traces)
        grid = figure.add_gridspec(rows, 2 if both else 1, width_ratios=(1.9, 1.0) if both else None)
        first: Any = None
        for k, plot in enumerate(plots):
            axes = first = figure.add_subplot(grid[k, 0], sharex=first)
            for (name, values), (color, dash) in zip(plot.series.items(), CURVES, strict=False):
                axes.plot(story.t, values, color=color, ls=dash, lw=1.5, label=name)
            axes.set_title(f"{plot.title} [{plot.unit}]" if plot.unit else plot.title, fontsize=10.5, loc="left")
            _sober(axes)
            axes.margins(x=0.0)
            axes.tick_params(labelbottom=k == len(plots) - 1)
            axes.legend(fontsize=9, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.04), handlelength=2.4)
        if plots:
            first.set_xlabel("time [s]")
        if story.traces:
            _paths(figure.add_subplot(grid[:, -1]), dict(story.traces))
        out = io.StringIO()
        figure.savefig(out, format="svg", metadata={"Date": None}, bbox_inches="tight", pad_inches=0.08)
    return out.getvalue()


def write_motion_svg(story: Story, path: Path) -> Path:
    """Write `motion_svg` to a file, whole or not at all."""
    return write(path, motion_svg(story))


def _sober(axes: Any) -> None:
    axes.grid(True, color="#e3e6ea", lw=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=9, colors=FAINT)


def _paths(axes: Any, traces: dict[str, Array]) -> None:
    """Paths in the two world directions in which they extend most, with a dot where each begins."""
    extent = np.max([np.ptp(points, axis=0) for points in traces.values()], axis=0)
    across, up = sorted(np.argsort(-extent, kind="stable")[:2])
    for (name, points), (color, dash) in zip(traces.items(), CURVES, strict=False):
        axes.plot(points[:, across], points[:, up], color=color, ls=dash, lw=1.5, label=name)
        axes.plot(points[0, across], points[0, up], "o", color=color, ms=5)
    axes.set_aspect("equal", adjustable="box", anchor="N")
    axes.set_title("paths of points", fontsize=10.5, loc="left")
    axes.set_xlabel(f"{'xyz'[across]} [m]")
    axes.set_ylabel(f"{'xyz'[up]} [m]")
    if float(extent[up]) < 0.35 * float(extent[across]):  # a flat path in a flat box shows nothing but its box
        middle, half = sum(axes.get_ylim()) / 2.0, 0.175 * float(extent[across])
        axes.set_ylim(middle - half, middle + half)
    axes.legend(
        fontsize=9,
        frameon=False,
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        borderaxespad=4.4,
        ncols=2,
        handlelength=2.2,
    )
    _sober(axes)
