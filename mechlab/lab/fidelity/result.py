"""All fidelities on one scene as data, as JSON, and as a picture of cost against error."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from mechlab.errors import MechlabError
from mechlab.experiment.scene import NEEDS
from mechlab.files import unfinished, whole_folder, write
from mechlab.lab.fidelity.measure import FidelityError
from mechlab.results import Shown

FORMATS = (".svg", ".png", ".json")


@dataclass(frozen=True)
class Level:
    """One fidelity: its size, the needs it answers, and why it does not answer the others.

    error [m or rad]: against the richest, largest at `worst`; force_error, load_error: of drive forces and tooth loads, as shares;
    slip [m or rad]: how far the rows of the engine gave way; resolution: below it the error cannot be told from that; exact: in
    words, where it is an exact reduction; reason: why its run failed.
    """

    fidelity: str
    freedoms: int | None
    coordinates: int | None
    rows: int | None
    answers: tuple[str, ...]
    missing: Mapping[str, str] = field(default_factory=dict)
    error: float | None = None
    worst: str = ""
    force_error: float | None = None
    load_error: float | None = None
    slip: float | None = None
    resolution: float | None = None
    cost: Mapping[str, float | None] = field(default_factory=dict)
    exact: str = ""
    status: str = ""
    reason: str = ""

    def but(self, **changes: Any) -> Level:
        """The same with changes."""
        return replace(self, **changes)

    def as_error(self) -> FidelityError:
        """Its error; infinite where it is not known."""
        poses = float("inf") if self.error is None else self.error
        return FidelityError(poses, self.worst, self.force_error, self.load_error, self.slip or 0.0)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "fidelity": self.fidelity, "freedoms": self.freedoms, "coordinates": self.coordinates, "rows": self.rows,
            "answers": list(self.answers), "cannot": dict(self.missing), "error": self.error, "worst": self.worst,
            "slip": self.slip, "resolution": self.resolution, "force_error": self.force_error, "load_error": self.load_error,
            "exact": self.exact, "cost": dict(self.cost),
            "status": self.status,
        }  # fmt: skip


@dataclass(frozen=True, repr=False)
class Fidelities(Shown):
    """All fidelities on one scene over `duration` [s] of its `full_duration`, and the one to take."""

    name: str
    title: str
    scene: str
    duration: float
    full_duration: float
    needs: tuple[str, ...]
    tolerance: float
    levels: tuple[Level, ...]
    chosen: str | None
    sentence: str
    versions: Mapping[str, str] = field(default_factory=dict)

    @property
    def exit_code(self) -> int:
        """0, or 3 when no fidelity answers what is needed."""
        return 0 if self.chosen else 3

    def level(self, fidelity: str) -> Level:
        """The row of a fidelity; raises KeyError."""
        return {x.fidelity: x for x in self.levels}[fidelity]

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "name": self.name, "scene": self.scene, "duration": self.duration, "scene_duration": self.full_duration,
            "needs": list(self.needs), "tolerance": self.tolerance, "fidelities": [x.to_dict() for x in self.levels],
            "chosen": self.chosen, "sentence": self.sentence, "versions": dict(self.versions),
            "status": "answered" if self.chosen else "no fidelity answers what is needed", "message": self.sentence,
        }  # fmt: skip

    def save(self, path: str | Path) -> dict[str, Path]:
        """Write the picture or the data, by the suffix; into a folder (a path without one) all of them."""
        path = Path(path)
        if path.suffix and path.suffix not in FORMATS:
            raise MechlabError(
                f"fidelities: cannot write {path.name}; formats: {', '.join(FORMATS)}, or a folder for all of them."
            )
        if path.suffix:
            self._write(path)
            return {path.suffix[1:]: path}
        with whole_folder(path) as stage:
            for s in FORMATS:
                self._write(stage / f"fidelities_{self.name}{s}")
        return {s[1:]: path / f"fidelities_{self.name}{s}" for s in FORMATS}

    def _write(self, path: Path) -> None:
        if path.suffix == ".json":
            write(path, json.dumps(self.to_dict(), indent=1))
        else:
            draw(self, path)


LEAST_DRAWN = 1e-12
"""Where errors that are zero are drawn [m or rad]."""
COLORS = ("#0891b2", "#d97706", "#7c3aed", "#15803d", "#be185d")


def draw(table: Fidelities, path: Path) -> Path:
    """Write the picture; the suffix of the path says whether SVG or PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    figure = Figure(figsize=(10.0, 5.6), dpi=130, facecolor="white")
    FigureCanvasAgg(figure)
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
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    _answers(figure, table)
    figure.text(0.09, 0.92, f"{table.title}: how much model?", fontsize=15, weight="bold")
    figure.text(
        0.09,
        0.865,
        f"scene {table.scene}, {table.duration:.3g} s; ringed: taken by fidelity auto",
        fontsize=10,
        color="#444444",
    )
    with unfinished(path) as temporary:
        figure.savefig(temporary, metadata={"Date": None} if path.suffix == ".svg" else None)
    return path


def _answers(figure: object, table: Fidelities) -> None:
    """A grid of what each fidelity answers."""
    grid = figure.add_axes((0.66, 0.13, 0.32, 0.66))  # type: ignore[attr-defined]
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
