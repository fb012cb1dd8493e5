"""The figures of the sources: which of them a user asks for, and their pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.entry import Entry
from mechlab.experiment.figure import Curve, Drawing, Panel, SourceFigure
from mechlab.files import unfinished
from mechlab.lazy_dataclass import dataclass
from mechlab.studies.picture_style import fewer_colors, new_figure, open_frame

SUFFIXES = (".png", ".svg", ".pdf", ".gif")
FRAMES, FRAME_TIME = 32, 90
"""Pictures of a film (.gif), and how long each of them is shown [ms]."""
ALL = "all"
"""The name that stands for every figure."""
HEADERS = ("read from the figure", "printed", "ours", "unit")
COLORS = ("#0072b2", "#d55e00", "#009e73", "#a64d79", "#3b3b3b", "#b58900")
"""Colours that colour-blind people can tell apart."""
PRINTED, INK, FAINT = "#c1121f", "#1b2330", "#5b6470"
LOOKS: dict[str, dict[str, Any]] = {
    "solid": {"lw": 1.3}, "thick": {"lw": 2.4}, "thin": {"lw": 0.6}, "dashed": {"lw": 1.3, "ls": (0, (5, 3))},
    "dotted": {"lw": 1.3, "ls": (0, (1, 2))}, "dots": {"ls": "", "marker": ".", "ms": 2.2}, "crosses": {"ls": "", "marker": "x", "ms": 6.0},
    "rings": {"ls": "", "marker": "o", "mfc": "none", "ms": 8.0},
}  # fmt: skip
WIDTH, HEIGHT, DPI = 10.0, 4.8, 100
"""Size of a picture [inch] with one row of panels, and its pixels per inch: legible on a sheet without a click."""
FEW_COLORS, MOST_BYTES = (192, 96, 64, 40), 60_000
"""Colours of a .png: as many as keep it below so many bytes, at least the last number."""


@dataclass(frozen=True)
class Drawn:
    """A figure that was computed: of which mechanism, what it holds, and its file, if one was written."""

    mechanism: str
    figure: SourceFigure
    drawing: Drawing
    file: str = ""

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form, with the readings."""
        readings = [{"what": r.what, "printed": r.printed, "ours": r.ours, "unit": r.unit} for r in self.drawing.readings]
        return described(self.mechanism, self.figure) | {"readings": readings} | ({"file": self.file} if self.file else {})


def described(mechanism: str, figure: SourceFigure) -> dict[str, Any]:
    """A figure that was not computed, in JSON-able form."""
    return {
        "mechanism": mechanism, "name": figure.name, "shows": figure.shows, "source": figure.source.label, "claims": list(figure.claims),
    }  # fmt: skip


def figures_of(entries: Sequence[Entry], name: str) -> list[tuple[Entry, SourceFigure]]:
    """The figures that `name` asks for: a figure as printed, its number, or "all". Raises MechlabError where there is none."""
    exist = [(e, f) for e in entries for f in e.figures]
    chosen = [(e, f) for e, f in exist if name == ALL or f.is_called(name)]
    if not exist:
        raise MechlabError(f"figure: {', '.join(e.name for e in entries)} has no figures of a source; `mechlab claims` lists those of all.")
    if not chosen:
        raise unknown("figure", name, [f"{e.name}: {f.name}" for e, f in exist])
    return chosen


def make_figures(entries: Sequence[Entry], name: str, out: str | Path | None = None) -> list[Drawn]:
    """Compute the figures that `name` asks for, and draw them: one into a file (.png, .svg, .pdf; .gif: its film), or each into the
    folder `out`.

    Raises MechlabError for an unknown name, for another suffix, for several figures into one file, and for a film of a figure in which
    nothing moves.
    """
    chosen = figures_of(entries, name)
    target = None if out is None else Path(out)
    if target is not None and target.suffix:
        checked_suffix(target)
        if len(chosen) > 1:
            names = ", ".join(f"{e.name}: {f.name}" for e, f in chosen)
            raise MechlabError(f"out: {target} is one file for {len(chosen)} figures ({names}); name one of them, or a folder.")
    made = []
    for entry, figure in chosen:
        drawing, file = figure.draw(), target
        if target is not None and not target.suffix:
            file = target / f"{entry.name}_{figure.stem}.png"
        made.append(Drawn(entry.name, figure, drawing, str(write_picture(figure, drawing, file)) if file else ""))
    return made


def checked_suffix(path: Path) -> None:
    """Raises MechlabError for a file that is no picture of a known kind."""
    if path.suffix.lower() not in SUFFIXES:
        raise MechlabError(f"figure {path}: expected a name that ends in {', '.join(SUFFIXES)}.")


def write_picture(figure: SourceFigure, drawing: Drawing, path: Path) -> Path:
    """Draw a figure into a file, in the format of its suffix; .gif: its film. Raises MechlabError where there is none."""
    import matplotlib

    if path.suffix.lower() == ".gif":
        return _write_film(figure, path)
    with matplotlib.rc_context({"svg.hashsalt": "mechlab", "font.size": 10, "text.color": INK, "path.simplify_threshold": 0.5}):
        picture = _picture(figure, drawing)
        with unfinished(path) as temporary:
            picture.savefig(temporary, metadata={"Date": None} if path.suffix == ".svg" else None)
            if path.suffix == ".png":
                _keep_small(temporary)
    return path


def _write_film(figure: SourceFigure, path: Path) -> Path:
    import matplotlib
    from PIL import Image

    if figure.film is None:
        raise MechlabError(f"figure {path}: nothing moves in {figure.name}; expected a name that ends in {', '.join(SUFFIXES[:-1])}.")
    frames = []
    with matplotlib.rc_context({"font.size": 10, "text.color": INK}):
        for k in range(FRAMES):
            picture = _picture(figure, figure.film((k + 0.5) / FRAMES))
            picture.canvas.draw()
            frames.append(Image.fromarray(np.asarray(picture.canvas.buffer_rgba())).convert("RGB").quantize(FEW_COLORS[-1]))
    with unfinished(path) as temporary:
        frames[0].save(temporary, format="GIF", save_all=True, append_images=frames[1:], duration=FRAME_TIME, loop=0, optimize=True)
    return path


def _keep_small(picture: Path) -> None:
    for colors in FEW_COLORS:
        fewer_colors(picture, colors)
        if picture.stat().st_size < MOST_BYTES:
            return


def _picture(figure: SourceFigure, drawing: Drawing) -> Any:
    columns = min(drawing.columns, len(drawing.panels))
    rows = -(-len(drawing.panels) // columns)
    width = WIDTH if columns > 1 else 0.75 * WIDTH
    picture = new_figure(width, HEIGHT * rows + 0.3, DPI, layout="constrained")
    title = fill(f"{figure.name[:1].upper()}{figure.name[1:]}. {figure.shows}", int(width * 13))
    picture.suptitle(title, fontsize=11, x=0.01, ha="left")
    for axes, panel in zip(picture.subplots(rows, columns, squeeze=False).ravel(), drawing.panels, strict=False):
        _draw_panel(axes, panel, 2 if columns == 1 else 1)
    for axes in picture.axes[len(drawing.panels) :]:
        axes.remove()
    if drawing.text:
        picture.supxlabel(fill(drawing.text, int(width * 15)), fontsize=9, color=FAINT, x=0.01, ha="left")
    points = [
        (axes, mark.text, (mark.x, mark.y))
        for axes, panel in zip(picture.axes, drawing.panels, strict=True)
        for mark in panel.marks
        if mark.x is not None and mark.y is not None
    ]
    if points:
        picture.draw_without_rendering()  # the words below take sides by where the layout puts the curves
    for axes, words, point in points:
        _write_at_point(axes, words, point)
    return picture


def _draw_panel(axes: Any, panel: Panel, columns: int) -> None:
    following = 0
    for curve in panel.curves:
        color = following if curve.color is None else curve.color
        following += curve.color is None
        _draw_curve(axes, curve, COLORS[color % len(COLORS)])
    if "x" in panel.log:
        axes.set_xscale("log")
    if "y" in panel.log:
        axes.set_yscale("log")
    _draw_printed(axes, panel)
    for note in panel.notes:
        arrow = {"arrowprops": {"arrowstyle": "->", "color": FAINT}} if note.to else {}
        _write(axes, note.text, note.to or (note.x, note.y), (note.x, note.y), INK, arrow)
    axes.set_title(panel.title, fontsize=10, loc="left")
    axes.set(xlabel=panel.x, ylabel=panel.y)
    for side in "xy":
        if side not in panel.log:
            axes.locator_params(axis=side, nbins=7)
    if panel.x_range:
        axes.set_xlim(panel.x_range)
    if panel.y_range:
        axes.set_ylim(panel.y_range)
    if panel.equal:
        axes.set_aspect("equal", adjustable="box" if panel.x_range and panel.y_range else "datalim")
    axes.grid(True, color="#e3e6ea", lw=0.6)
    axes.set_axisbelow(True)
    open_frame(axes)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(fontsize=8.5, frameon=False, loc="upper left", bbox_to_anchor=(-0.02, -0.13), ncols=columns)


def _write(axes: Any, words: str, to: tuple[Any, Any], where: tuple[float, float], color: str, how: dict[str, Any]) -> None:
    """Words in front of the curves, which do not move the panel, over their own shape in wider white letters, which hide little of a curve
    (as an effect of the words themselves these would not be text in an .svg)."""
    from matplotlib.patheffects import Stroke

    under = {k: v for k, v in how.items() if k != "arrowprops"}
    put = axes.annotate(words, to, where, fontsize=8.5, color="white", **under)
    put.set(in_layout=False, zorder=4.9, path_effects=[Stroke(linewidth=2.5, foreground="white")])
    axes.annotate(words, to, where, fontsize=8.5, color=color, **how).set(in_layout=False, zorder=5.0)


def _write_at_point(axes: Any, words: str, point: tuple[float, float]) -> None:
    """Words at a printed point, on that of its four sides where they hide least of the curves; right above it where this is equal."""
    pixel = DPI / 72.0
    width, height = pixel * (5.0 * len(words) + 4.0), pixel * 12.0
    middle = axes.transData.transform(point)
    frame = axes.transAxes.transform([(0.0, 0.0), (1.0, 1.0)])
    dense = [np.empty((0, 2))]
    for line in axes.lines:
        corners = line.get_transform().transform(line.get_xydata())
        share = np.linspace(0.0, len(corners) - 1.0, max(len(corners), 500))
        dense.append(np.column_stack([np.interp(share, np.arange(len(corners)), side) for side in corners.T]))
    curves = np.vstack(dense)

    def hidden(side: tuple[int, int]) -> float:
        """Points of curves under the words, and much more where they leave the panel."""
        box = np.sort([middle + pixel * 4.0 * np.array(side), middle + np.array(side) * (width, height)], axis=0)
        outside = np.any(box[0] < frame[0]) or np.any(box[1] > frame[1])
        return float(np.all((curves > box[0]) & (curves < box[1]), axis=1).sum()) + (1e6 if outside else 0.0)

    right, up = min([(1, 1), (-1, 1), (1, -1), (-1, -1)], key=hidden)
    how = {"textcoords": "offset points", "ha": "left" if right > 0 else "right", "va": "bottom" if up > 0 else "top"}
    _write(axes, words, point, (4.0 * right, 4.0 * up), PRINTED, how)


def _draw_curve(axes: Any, curve: Curve, color: str) -> None:
    for k, (x, y) in enumerate(zip(*curve.lines, strict=True)):
        axes.plot(x, y, color=color, label=curve.label if k == 0 and curve.label else None, **LOOKS[curve.style])


def _draw_printed(axes: Any, panel: Panel) -> None:
    """What the source prints, all of it in one color: marks, the ticks of its axes, and the window between the outermost ticks."""
    from matplotlib.patches import Rectangle

    label: str | None = "printed in the source"
    for mark in panel.marks:
        if mark.x is not None and mark.y is not None:
            axes.plot([mark.x], [mark.y], "D", color=PRINTED, ms=5, label=label)
        elif mark.x is not None:
            axes.axvline(mark.x, color=PRINTED, lw=1.0, ls="--", label=label)
        else:
            axes.axhline(mark.y, color=PRINTED, lw=1.0, ls="--", label=label)
        label = None
        where = (mark.x if mark.x is not None else 0.01, mark.y if mark.y is not None else 0.02)
        across = axes.get_yaxis_transform() if mark.x is None else axes.get_xaxis_transform() if mark.y is None else axes.transData
        if across is not axes.transData:
            _write(axes, mark.text, where, (4, 4), PRINTED, {"xycoords": across, "textcoords": "offset points"})
    for ticks, across, marker in (
        (panel.printed_x, axes.get_xaxis_transform(), 2), (panel.printed_y, axes.get_yaxis_transform(), 1),
    ):  # fmt: skip
        if not ticks:
            continue
        low = [0.0] * len(ticks)
        xy = (ticks, low) if marker == 2 else (low, ticks)
        axes.plot(*xy, ls="", marker=marker, ms=9, mew=2.0, color=PRINTED, transform=across, clip_on=False, zorder=4,
                  label="numbers on the printed axes" if marker == 2 or not panel.printed_x else None)  # fmt: skip
    if panel.printed_x and panel.printed_y:
        (left, right), (low_y, high_y) = ((min(t), max(t)) for t in (panel.printed_x, panel.printed_y))
        axes.add_patch(Rectangle((left, low_y), right - left, high_y - low_y, fill=False, ec=PRINTED, lw=0.9, ls=(0, (4, 3))))
