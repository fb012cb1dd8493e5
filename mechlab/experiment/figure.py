"""A figure of a source as data: our curves, and what the source prints in it. `mechlab.studies.check.figures` draws it.

    def loops() -> Drawing:
        loop = Panel("loop at 150 rad/s", "beta [rad]", "beta' [rad/s]", (Curve(beta, rate, "shooting", "thick"),),
                     marks=(Mark("printed maximum", y=20.0),), printed_x=(-0.1, 0.08), printed_y=(-10.0, 20.0))
        return Drawing((loop,), (Reading("largest beta' on the printed axis", 20.0, rate.max(), "rad/s"),))

    FIGURES = (SourceFigure("figure 7", "Periodic motions by formula and by integration.", ALYUKOV, loops, claims=("M14",)),)

An Entry lists them as `figures`; `mechlab claims NAME --figure 7 -o FILE` and the sheet of the mechanism show them.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.publication import Publication
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

STYLES = ("solid", "thick", "thin", "dashed", "dotted", "dots", "crosses", "rings")
"""How a curve looks: lines; `dots`, `crosses` and `rings` are points without a line."""
COLORS = 6
"""Number of colours that a curve can ask for by its index."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Points x, y (n,) of a line, or several lines x, y (lines, n) under one label; NaN interrupts a line.

    color: index below COLORS; None: the next colour of the panel. Raises MechlabError for an unknown style, for shapes that do not fit
    and for a curve without a finite point.
    """

    x: ArrayLike
    y: ArrayLike
    label: str = ""
    style: str = "solid"
    color: int | None = None

    def __post_init__(self) -> None:
        if self.style not in STYLES:
            raise unknown(f"curve {self.label!r}: style", self.style, STYLES)
        if self.color is not None and not 0 <= self.color < COLORS:
            raise MechlabError(f"curve {self.label!r}: color: expected an index from 0 to {COLORS - 1}, got {self.color}.")
        x, y = np.shape(self.x), np.shape(self.y)
        if x != y or len(x) not in (1, 2):
            raise MechlabError(f"curve {self.label!r}: x and y must both be (n,) or (lines, n), got {x} and {y}.")
        if not np.any(np.isfinite(np.asarray(self.x, float)) & np.isfinite(np.asarray(self.y, float))):
            raise MechlabError(f"curve {self.label!r} has no finite point.")

    @property
    def lines(self) -> tuple[Array, Array]:
        """x and y as (lines, n)."""
        return np.atleast_2d(np.asarray(self.x, dtype=float)), np.atleast_2d(np.asarray(self.y, dtype=float))


@dataclass(frozen=True)
class Mark:
    """What the source prints at a place: a point (x, y), or a line where only x or only y is given."""

    text: str
    x: float | None = None
    y: float | None = None

    def __post_init__(self) -> None:
        if self.x is None and self.y is None:
            raise MechlabError(f"mark {self.text!r}: give x, y or both.")


@dataclass(frozen=True)
class Note:
    """Our remark at a point (x, y); with `to`, an arrow goes there."""

    text: str
    x: float
    y: float
    to: tuple[float, float] | None = None


@dataclass(frozen=True)
class Panel:
    """One pair of axes. x, y: what is on them, with the unit in brackets.

    printed_x, printed_y: the numbers that the source prints along its axes; they are drawn as ticks, and where both are given,
    the window between the outermost of them as a frame. x_range, y_range: what is shown (default: all).
    equal: one scale for both axes; log: "", "x", "y" or "xy".
    """

    title: str
    x: str
    y: str
    curves: tuple[Curve, ...]
    marks: tuple[Mark, ...] = ()
    notes: tuple[Note, ...] = ()
    printed_x: tuple[float, ...] = ()
    printed_y: tuple[float, ...] = ()
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    equal: bool = False
    log: str = ""


@dataclass(frozen=True)
class Reading:
    """A number, or several, that the source prints, and ours; `printed` may say in words that it is unreadable."""

    what: str
    printed: Any
    ours: Any
    unit: str = ""


@dataclass(frozen=True)
class Drawing:
    """What a figure shows: its panels, at most `columns` in a row, the readings that stand below it, and a sentence on it."""

    panels: tuple[Panel, ...]
    readings: tuple[Reading, ...] = ()
    text: str = ""
    columns: int = 2


@dataclass(frozen=True)
class SourceFigure:
    """A figure of a source. name: as printed, "figure 7"; draw() computes it; claims: ids of the claims that are about it.

    film(phase): the same in motion, its drawing at a share 0 <= phase < 1 of the motion; None where nothing moves.
    """

    name: str
    shows: str
    source: Publication
    draw: Callable[[], Drawing]
    claims: tuple[str, ...] = ()
    film: Callable[[float], Drawing] | None = None

    @property
    def stem(self) -> str:
        """The name as the beginning of a file name: "figures 2 and 3" is figures_2_and_3."""
        return re.sub(r"\W+", "_", self.name.lower()).strip("_")

    def is_called(self, name: str) -> bool:
        """Whether a user means this one by `name`: "7", "figure 7" and "figure_7" do."""
        wanted = re.sub(r"\W+", "_", name.lower()).strip("_")
        return wanted in (self.stem, self.stem.partition("_")[2])
