"""The bounds of the ratio in the paper on planetary synthesis, as printed and corrected, over (t2, i)."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import planetary_synthesis as closed_form
from mechlab.catalog.bibliography import PLANETARY
from mechlab.experiment.figure import Curve, Drawing, Mark, Note, Panel, Reading, SourceFigure

T2 = np.linspace(0.8, 1.2, 401)
BLUE, RED, TEAL, BLACK = 0, 1, 2, 4


def bounds() -> Drawing:
    """(9) for three planets; (11) where it turns into an upper bound."""
    s, place = math.sin(math.pi / 3.0), (1.0, 1.0, 1.1, 3)
    printed, ours = (float(closed_form.ratio_bound_2(*place, printed=flag)) for flag in (True, False))
    direct = _largest(*place)
    return Drawing(
        (_nine(), _eleven()),
        (
            Reading("1 / sin(pi / 3), the bound (10) of t2", 1.15, 1.0 / s),
            Reading("(9) at t2 = 1.1 (y = t1 = 1, three planets): formula as printed, corrected", printed, ours),
            Reading("largest ratio there that (8) itself admits", printed, direct),
        ),
        "Crosses: pairs (t2, i) at which the planets 2 (left), 3 (right) of neighbouring rays are clear by (8) itself.",
    )


def _largest(y: float, t1: float, t2: float, planets: int) -> float:
    """The largest ratio of a fine raster at which the planets 2 are clear."""
    i = np.linspace(2.0, 60.0, 580_001)
    return float(i[closed_form.neighbours_direct(i, y, t1, t2, planets)[0]].max())


def _clear(y: float, t1: float, planets: int, which: int, top: float) -> Curve:
    t2, i = (x.ravel() for x in np.meshgrid(np.linspace(0.8, 1.2, 17), np.linspace(2.0, top, 15)))
    fits = closed_form.neighbours_direct(i, y, t1, t2, planets)[which] & closed_form.exists(i, y, t1, t2)
    return Curve(np.where(fits, t2, np.nan), i, "clear by (8)", "crosses", BLACK)


def _nine() -> Panel:
    y, t1, k = 1.0, 1.0, 3
    printed, true = (closed_form.ratio_bound_2(y, t1, T2, k, printed=flag) for flag in (True, False))
    return Panel(
        "(9): y = 1, t1 = 1, three planets", "t2", "ratio i",
        (_clear(y, t1, k, 0, 30.0), Curve(T2, np.where((printed > 0) & (printed < 60), printed, np.nan), "(9) as printed", "dashed", RED),
         Curve(T2, true, "(9), denominator t2 (1 - s)", "thick", BLUE), Curve(T2, (1.0 + T2) / T2, "(7)", "solid", TEAL)),
        (Mark("(10): 1.15", 1.15),),
        (Note("admitted by the print,\nbut the planets meet", 0.87, 25.5, (1.06, 18.0)),), y_range=(-3.0, 31.0),
    )  # fmt: skip


def _eleven() -> Panel:
    y, t1, k = 3.0, 0.8, 4
    bound, upper = closed_form.ratio_bound_3(y, t1, T2, k)
    shown = np.where(np.abs(bound) < 60.0, bound, np.nan)
    return Panel(
        "(11): y = 3, t1 = 0.8, four planets", "t2", "ratio i",
        (_clear(y, t1, k, 1, 30.0), Curve(T2, np.where(upper, np.nan, shown), "(11), a lower bound", "solid", BLUE),
         Curve(T2, np.where(upper, shown, np.nan), "the same, now an upper bound", "thick", RED),
         Curve(T2, (1.0 + T2) / T2, "(7)", "solid", TEAL)),
        (), (Note("the print takes i above the curve,\nwhere the planets 3 meet", 1.015, 24.0, (1.1, 14.0)),), y_range=(-20.0, 31.0),
    )  # fmt: skip


FIGURES = (
    SourceFigure(
        "inequalities (9) and (11)", "The bounds of the ratio that leave neighbouring planets clear, as printed and corrected, over t2.",
        PLANETARY, bounds, ("Y2", "Y3", "Y4"),
    ),
)  # fmt: skip
