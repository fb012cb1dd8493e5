"""Phase portraits: vectorized integration of thousands of initial states, Poincare sections, curves; arrays and
figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError, Untrustworthy, unknown
from mechlab.files import unfinished, whole_folder
from mechlab.integrate import RK4, integrate_fixed
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.results import Shown, html_of, line_of, text_of
from mechlab.tables import html_sheet, table

Slope = Callable[[float, Array], Array]
MOST_LINES = 48
"""Largest number of curves in a figure; of more curves, evenly chosen ones are drawn."""
HEADERS = ("array", "unit", "least", "largest", "shape")


@dataclass(frozen=True)
class Portrait:
    """A portrait. `x`, `y`: names of the two drawn arrays, each (curves, points); `marks`: points instead of lines.

    `arrays`: all computed arrays in SI; `notes`: method and accuracy.
    """

    kind: str
    title: str
    x: str
    y: str
    arrays: Mapping[str, Array]
    units: Mapping[str, str] = field(default_factory=dict)
    marks: bool = False
    notes: tuple[str, ...] = ()

    @property
    def shape(self) -> tuple[int, int]:
        """Number of curves, and of points on each."""
        size = np.atleast_2d(self.arrays[self.y]).shape
        return size[0], size[1]


def flow(slope: Slope, start: ArrayLike, duration: float, timestep: float, samples: int = 101) -> tuple[Array, Array]:
    """Times (m,) [s] and states (m, ..., n) from initial states (..., n), all integrated together by RK4.

    The step is at most `timestep` and divides the time between two samples. Raises Untrustworthy when any state stops
    being finite.
    """
    if not duration > 0 or not timestep > 0 or samples < 2:
        raise MechlabError(
            f"portrait: expected duration, timestep > 0 and 2 samples or more, got {duration}, {timestep}, {samples}."
        )
    stride = max(1, int(np.ceil(duration / (samples - 1) / timestep - 1e-9)))
    steps = stride * (samples - 1)
    y = np.asfortranarray(start, dtype=float)  # each state variable of all motions is contiguous: twice as fast
    out = np.empty((samples, *y.shape))

    def keep(k: int, t: float, state: Array) -> None:
        if k % stride == 0:
            out[k // stride] = state

    done = integrate_fixed(RK4, slope, 0.0, y, duration / steps, steps, keep)
    if not done.complete:
        raise Untrustworthy(f"portrait: {done.reason}; try a smaller timestep or initial states that stay bounded.")
    return np.linspace(0.0, duration, samples), out


def section(slope: Slope, start: ArrayLike, period: float, turns: int, steps: int) -> Array:
    """(turns + 1, ..., n) states of a flow each time its independent variable has grown by `period`: a Poincare map.

    RK4 takes `steps` steps in each period, so that every section is at the end of a step, without interpolation.
    """
    return flow(slope, start, period * turns, period / steps, turns + 1)[1]


def estimated_error(slope: Slope, start: ArrayLike, duration: float, timestep: float, few: int = 20) -> float:
    """Estimated largest error of `flow` at the end: 16/15 of the change with half the step (Richardson), over about
    `few` of the initial states."""
    y = np.asarray(start, dtype=float)
    y = y[:: max(1, len(y) // few)]
    coarse, fine = (flow(slope, y, duration, h, 2)[1][-1] for h in (timestep, 0.5 * timestep))
    return float(np.max(np.abs(coarse - fine))) * 16.0 / 15.0


def grid(axes: Mapping[str, ArrayLike]) -> dict[str, Array]:
    """Every combination of the values on the axes: name -> (points,)."""
    meshes = np.meshgrid(*(np.atleast_1d(np.asarray(v, dtype=float)) for v in axes.values()), indexing="ij")
    return {name: m.ravel() for name, m in zip(axes, meshes, strict=True)}


def options(given: Mapping[str, Any], **known: Any) -> dict[str, Any]:
    """The known quantities with the values that were given; raises MechlabError for another, listing them."""
    for key in given:
        if key not in known:
            raise unknown("portrait: quantity", key, known)
    return known | dict(given)


def draw(portrait: Portrait, path: Path) -> Path:
    """Write the figure (.png, .svg or .pdf by its suffix)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    x, y = (np.atleast_2d(portrait.arrays[k]) for k in (portrait.x, portrait.y))
    x = np.broadcast_to(x, y.shape)
    chosen = slice(None, None, max(1, len(y) // MOST_LINES))
    style = {"linestyle": "", "marker": ".", "markersize": 1.5} if portrait.marks else {"linewidth": 0.7}
    axes.plot(x[chosen].T, y[chosen].T, **style)
    axes.set_title(portrait.title)
    for name, put in ((portrait.x, axes.set_xlabel), (portrait.y, axes.set_ylabel)):
        put(f"{name} [{portrait.units[name]}]" if portrait.units.get(name) else name)
    axes.grid(True, linewidth=0.3)
    with unfinished(path) as temporary:
        figure.savefig(temporary, dpi=150)
    return path


@dataclass(frozen=True, repr=False)
class PortraitResult(Shown):
    """A portrait and the files it was written to."""

    name: str
    portrait: Portrait
    files: Mapping[str, Path] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    exit_code: int = 0

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form: ranges of the arrays; the arrays themselves are in the file."""
        p = self.portrait
        curves, points = p.shape
        return {
            "portrait": p.kind, "title": p.title, "x": p.x, "y": p.y, "curves": curves, "points": points,
            "ranges": {k: _range(v) for k, v in p.arrays.items()}, "files": {k: str(v) for k, v in self.files.items()},
            "notes": list(p.notes), "warnings": list(self.warnings), "message": p.title, "status": "answered",
        }  # fmt: skip

    def rows(self) -> list[tuple[str, ...]]:
        """Range and shape of each array, under HEADERS."""
        rows: list[tuple[str, ...]] = []
        for name, values in self.portrait.arrays.items():
            low, high = _range(values)
            size = "x".join(map(str, np.shape(values)))
            rows.append((name, self.portrait.units.get(name, ""), f"{low:.6g}", f"{high:.6g}", size))
        return rows

    @property
    def head(self) -> str:
        """One line: the mechanism, the title, the number of curves and points."""
        curves, points = self.portrait.shape
        return f"{self.name}: {self.portrait.title} ({curves} curves of {points} points)"

    @property
    def sentences(self) -> list[str]:
        """Notes, files, warnings."""
        files = [f"{k}: {v}" for k, v in self.files.items()]
        return [*self.portrait.notes, *files, *(f"warning: {w}" for w in self.warnings)]


@line_of.register
def _(result: PortraitResult) -> str:
    return f"Portrait of {result.head}"


@text_of.register
def _(result: PortraitResult) -> str:
    return "\n".join([result.head, table(HEADERS, result.rows()), *result.sentences])


@html_of.register
def _(result: PortraitResult) -> str:
    return html_sheet("", [result.head, *result.sentences], {"": (HEADERS, result.rows())})


def _range(values: Array) -> tuple[float, float]:
    finite = np.asarray(values)[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else (np.nan, np.nan)


def write(name: str, portrait: Portrait, out: Path | None, warnings: tuple[str, ...] = ()) -> PortraitResult:
    """The result with its files in the folder `out`: NAME-KIND.npz (arrays) and NAME-KIND.png; None: no files."""
    if out is None:
        return PortraitResult(name, portrait, {}, warnings)
    stem = f"{name}-{portrait.kind}"
    with whole_folder(out) as stage:
        np.savez_compressed(stage / f"{stem}.npz", **{k: np.asarray(v) for k, v in portrait.arrays.items()})  # type: ignore[arg-type]
        draw(portrait, stage / f"{stem}.png")
    return PortraitResult(name, portrait, {"arrays": out / f"{stem}.npz", "figure": out / f"{stem}.png"}, warnings)
