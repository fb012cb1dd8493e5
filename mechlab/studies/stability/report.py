"""A stability study as one line, as text (maps of letters, sentences), and as files: the data, and a picture of each map with a panel
for each method: timestep to the right, outcomes as colours, limits of theory."""

from __future__ import annotations

import json
import math
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.files import whole_folder, write
from mechlab.results import line_of, save_result, text_of
from mechlab.studies.picture_style import cell_borders, new_figure, open_frame, save_figure
from mechlab.studies.stability.data import MethodPanel, RunOutcome, Stability, StabilityMap, Theory

BLOWN = frozenset({RunOutcome.BLOWN_UP})
BAD = frozenset({RunOutcome.BLOWN_UP, RunOutcome.WRONG, RunOutcome.DRIFTING, RunOutcome.REFUSED})

VALUE_NAMES = {
    "error": "error / how far it moves",
    "energy": "energy astray / energy turned over",
    "gap": "open rows, rad or m",
}
"""Measure of a plan -> name of the measured value."""


def sentences(made: StabilityMap, remark: str = "") -> tuple[str, ...]:
    """Sentences on a map: for stiffness first theory against measurement, then each method, then the remark."""
    row = nominal_row(made)
    out = []
    if made.kind == "stiffness":
        out += [s for t in made.theory for name in t.methods if (s := _boundary(made, t, name, row))]
    out += [_summary(made, p, row) for p in made.panels]
    if remark:
        out.append(f"{remark[0].upper()}{remark[1:]}.")
    return tuple(out)


def nominal_row(made: StabilityMap) -> int:
    """Index of the row closest to the nominal value of y; the last row where y has no nominal value."""
    if made.y.nominal is None:
        return len(made.y.values) - 1
    nominal = made.y.nominal
    return min(range(len(made.y.values)), key=lambda k: abs(made.y.values[k] - nominal))


def _boundary(made: StabilityMap, theory: Theory, name: str, row: int) -> str:
    panel = made.panel(name)
    good, bad = panel.limit(row, made.x.values, BLOWN)
    limit = theory.x[row]
    if good == 0.0 and math.isinf(bad):
        return ""
    where = (
        f"between {_s(good)} and {_s(bad)}"
        if good and math.isfinite(bad)
        else f"below {_s(bad)}"
        if not good
        else f"above {_s(good)}"
    )
    return f"{name} blows up above {theory.formula} = {_s(limit)} as given; measured {where}."


def _summary(made: StabilityMap, panel: MethodPanel, row: int) -> str:
    """A sentence: the timesteps up to which a method is right, in the nominal row and in the first and last rows."""
    run = [c for r in panel.cells for c in r if c.outcome not in (RunOutcome.NOT_RUN, RunOutcome.REFUSED)]
    if not run:
        return f"{panel.method}: nothing could be run ({_reason(panel)})."
    right = sum(c.outcome is RunOutcome.RIGHT for c in run)
    blown = sum(c.outcome is RunOutcome.BLOWN_UP for c in run)
    if right == len(run):
        return f"{panel.method} is right in all {right} runs."
    if right == 0:
        best = min((c.value for c in run if math.isfinite(c.value)), default=math.nan)
        tail = f", blown up in {blown}" if blown else ""
        return f"{panel.method} is right in none of {len(run)} runs{tail}; the best is off by {best:.2g}."
    rows = sorted({0, row, len(made.y.values) - 1})
    limits = ", ".join(f"{_s(panel.limit(k, made.x.values, BAD)[0])} at {_y(made, k)}" for k in rows)
    return f"{panel.method} is right in {right} of {len(run)} runs and blown up in {blown}: up to {limits}."


def _reason(panel: MethodPanel) -> str:
    reasons = [c.reason for r in panel.cells for c in r if c.reason]
    return reasons[0] if reasons else "no reason given"


def _y(made: StabilityMap, row: int) -> str:
    unit = f" {made.y.unit}" if made.y.unit else ""
    return f"{made.y.values[row]:.3g}{unit}"


def _s(h: float) -> str:
    """A timestep in words."""
    if h == 0.0:
        return "no timestep tried"
    if math.isinf(h):
        return "every timestep tried"
    return f"{1e3 * h:.3g} ms"


LETTERS = {
    RunOutcome.RIGHT: "o", RunOutcome.DRIFTING: "~", RunOutcome.WRONG: "w", RunOutcome.BLOWN_UP: "X", RunOutcome.REFUSED: "-",
    RunOutcome.NOT_RUN: ".",
}  # fmt: skip


@line_of.register
def _(found: Stability) -> str:
    return f"Stability of {found.name}, scene {found.scene}: {', '.join(m.kind for m in found.maps) or 'no map'}"


@text_of.register
def _(found: Stability) -> str:
    """Every map as rows of letters, with its sentences."""
    legend = ", ".join(f"{letter} {o.value}" for o, letter in LETTERS.items())
    lines = [f"{found.name}, scene {found.scene}: where methods fail", f"what acts: {found.acts}", legend]
    for made in found.maps:
        lines += ["", *_map(made)]
    lines += ["", *(f"no map {kind}: {why}" for kind, why in found.without.items())]
    lines += [f"{found.cpu_s:.1f} s of CPU"]
    return "\n".join(lines)


def _map(made: StabilityMap) -> list[str]:
    steps = made.x.values
    unit = f" [{made.y.unit}]" if made.y.unit else ""
    head = f"{made.kind}: timestep {1e3 * steps[0]:.3g} to {1e3 * steps[-1]:.3g} ms (left to right), {made.duration:.3g} s simulated"
    lines = [
        head,
        f"rows: {made.y.name}{unit}: {made.y.text}",
        f"{made.value_name}: o up to {made.right:g}, ~ up to {made.wrong:g}",
    ]
    for panel in made.panels:
        lines.append(f"  {panel.method}")
        for y, row in reversed(list(zip(made.y.values, panel.cells, strict=True))):
            lines.append(f"    {y:10.3g}  {' '.join(LETTERS[c.outcome] for c in row)}")
    lines += [f"  not shown: {name} ({why})" for name, why in made.skipped.items()]
    return lines + [f"  {s}" for s in made.sentences]


@save_result.register
def _(found: Stability, folder: Path) -> dict[str, Path]:
    """Write stability_NAME.json and stability_NAME_KIND.png for each map into a folder.

    Raises MechlabError for a path that is a file.
    """
    if folder.suffix or folder.is_file():
        raise MechlabError(f"stability: -o takes a folder, got {folder}; it gets a .json and a .png for each map.")
    names = {"json": f"stability_{found.name}.json"}
    names |= {made.kind: f"stability_{found.name}_{made.kind}.png" for made in found.maps}
    with whole_folder(folder) as stage:
        write(stage / names["json"], json.dumps(found.to_dict(), indent=1, allow_nan=False))
        for made in found.maps:
            draw(found, made, stage / names[made.kind])
    return {kind: folder / name for kind, name in names.items()}


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
        _draw_panel(axes, made, made.panels[k])
        if k + columns >= len(made.panels):
            axes.set_xlabel("timestep, ms", fontsize=9.5)
            axes.tick_params(labelbottom=True)
        if k % columns == 0:
            unit = f", {made.y.unit}" if made.y.unit else ""
            axes.set_ylabel(f"{made.y.name}{unit}", fontsize=9.5)
    _draw_words(figure, found, made, left, height)
    _draw_legend(figure, made, left, height)
    return save_figure(figure, path)


def _draw_panel(axes: Any, made: StabilityMap, panel: MethodPanel) -> None:
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
    _draw_theory(axes, made, panel, x, y)
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(y[0], y[-1])
    axes.set_title(panel.method, fontsize=10, loc="left", weight="bold")
    axes.tick_params(labelsize=8.5)
    open_frame(axes)


def _draw_theory(axes: Any, made: StabilityMap, panel: MethodPanel, x: np.ndarray, y: np.ndarray) -> None:
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


def _draw_words(figure: Any, found: Stability, made: StabilityMap, left: float, height: float) -> None:
    figure.text(left, 1.0 - 0.36 / height, f"{found.title}: {made.title}", fontsize=14, weight="bold")
    about = f"Rows: {made.y.text}. Scene {found.scene}, {made.duration:.3g} s simulated, fidelity {made.fidelity}."
    wide = int(figure.get_figwidth() * 12.5)
    figure.text(left, 1.0 - 0.48 / height, fill(about, wide), fontsize=9, color="#444444", va="top", linespacing=1.25)
    engines = ", ".join(f"{n} {found.versions[n]}" for n in ("mujoco", "pin") if n in found.versions)
    figure.text(left, 0.1 / height, engines, fontsize=7.5, color="#777777")


def _draw_legend(figure: Any, made: StabilityMap, left: float, height: float) -> None:
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
