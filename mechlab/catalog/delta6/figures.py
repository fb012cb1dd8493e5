"""Figures 8 to 11 of the thesis abstract: the workspace, and the controlled motion of the head. Those of chapter 5 stand in
`figures_mesh`."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.bibliography import THESIS
from mechlab.catalog.delta6.figures_mesh import MESH_FIGURES
from mechlab.catalog.delta6.parameters import ANGLES, SOURCE
from mechlab.experiment.figure import Curve, Drawing, Mark, Panel, Reading, SourceFigure
from mechlab.mechanism.geometry import Array

BENDS = (90.0, 60.0, 45.0)
"""Limits of the cardan joints [deg]: none as in the source, and two that joints have."""
GRID = 0.01
"""Printed step of the grid of nodes [m]."""


def _heights(x: Array, y: Array, bend: float) -> Array:
    """(..., 3) heights of the rods over positions in the plane [m]; NaN where a rod does not reach or a cardan bends more."""
    h2 = closed.squared_heights(SOURCE.geometry, np.stack(np.broadcast_arrays(x, y, 0.0 * x), axis=-1))
    least = (SOURCE.rod_length * math.cos(math.radians(bend))) ** 2
    good = h2.min(axis=-1, keepdims=True) >= max(least, 0.0)
    return np.asarray(np.sqrt(np.where(good, h2, np.nan)))


def figure_8() -> Drawing:
    """Nodes that count in a view from above, and the space between the ends of the slides in a section y = 0."""
    nodes = np.arange(-20, 21) * GRID
    x, y = (a.ravel() for a in np.meshgrid(nodes, nodes))
    above, section, counts = [], [], []
    fine = np.linspace(-0.2, 0.2, 401)
    for k, bend in enumerate(BENDS):
        inside = np.isfinite(_heights(x, y, bend)[:, 0])
        counts.append(int(np.count_nonzero(inside)))
        label = "all rods reach, as in the source" if bend == 90.0 else f"cardans bend up to {bend:g} deg"
        above.append(Curve(x[inside], y[inside], f"{label}: {counts[-1]} nodes", "dots", k))
        tops = _heights(fine, 0.0 * fine, bend) + SOURCE.platform_height + SOURCE.slider_height
        low, high = SOURCE.slider_min - tops.min(axis=-1), SOURCE.slider_max - tops.max(axis=-1)
        with np.errstate(invalid="ignore"):
            space = high >= low
        edge_x, edge_z = (np.concatenate([a[space], b[space][::-1], a[space][:1]]) for a, b in ((fine, fine), (low, high)))
        section.append(Curve(edge_x, edge_z, label, "thick" if k == 0 else "solid", k))
    panels = (
        Panel("nodes (x, y) at the printed step of 0.01 m", "x of O [m]", "y of O [m]", tuple(above), equal=True),
        Panel(f"section y = 0, sliders {SOURCE.slider_min:g} to {SOURCE.slider_max:g} m (ours: none are printed)", "x of O [m]",
              "z of O [m]", tuple(section)),
    )  # fmt: skip
    farthest = float(np.abs(np.concatenate([np.asarray(above[0].x), np.asarray(above[0].y)])).max())
    readings = (
        Reading("half the edge of the searched cube; the farthest node in x or y", 1.0, farthest, "m"),
        Reading("nodes (x, y) for bends up to 90, 60 and 45 deg", "unreadable", counts),
    )
    return Drawing(panels, readings, "The source does not limit the bend of its cardan joints; nothing but the grid is printed in numbers.")


DURATION, SAMPLES = 3.0, 901
PRINTED_9 = (-0.2, 0.0, 0.2, 0.4)
"""Numbers on the axis of the angles in figure 9 [rad]."""
ORDERS = {"velocity 240, position 480, as printed": (240.0, 480.0), "exchanged": (480.0, 240.0)}
RATE_MARKS = dict(zip(ANGLES, closed.SOURCE_START_RATES.tolist(), strict=True))


def controlled(t: Array, order: str = "velocity 240, position 480, as printed") -> tuple[Array, Array]:
    """(n, 3) angles of the head under ideal control from the printed initial state, and their rates; order: a key of ORDERS."""
    wanted = closed.source_targets(t)
    e = closed.error_response(t[:, None], closed.SOURCE_START_ERRORS, closed.SOURCE_START_ERROR_RATES, *ORDERS[order])
    return wanted.angles + e.error, wanted.rates + e.error_rate


def figure_9() -> Drawing:
    """Angles over time with both orders of the gains."""
    t = np.linspace(0.0, DURATION, SAMPLES)
    wanted, panels, readings = closed.source_targets(t).angles, [], []
    for order in ORDERS:
        angles = controlled(t, order)[0]
        curves = tuple(
            c for k, n in enumerate(ANGLES)
            for c in (Curve(t, wanted[:, k], "" if k else "wanted", "dotted", 4), Curve(t, angles[:, k], n, "thick", k))
        )  # fmt: skip
        panels.append(Panel(f"gains: {order}", "t [s]", "angles [rad]", curves, printed_y=PRINTED_9, y_range=(-0.25, 0.5)))
        ends = [float(angles.min()), float(angles.max())]
        readings.append(Reading(f"ends of the printed axis and of the curves, gains {order}", (-0.2, 0.4), ends, "rad"))
    text = "With the gains exchanged gamma rises above the largest number on the printed axis and stays off the lowest for long."
    return Drawing(tuple(panels), tuple(readings), text)


def figure_10() -> Drawing:
    """Rates over time, and their first instants, where the control takes the initial errors out."""
    panels = []
    for end in (DURATION, 0.04):
        t = np.linspace(0.0, end, SAMPLES)
        rates, wanted = controlled(t)[1], closed.source_targets(t).rates
        curves = tuple(
            c for k, n in enumerate(ANGLES)
            for c in (Curve(t, wanted[:, k], "" if k else "wanted", "dotted", 4), Curve(t, rates[:, k], f"{n}'", "thick", k))
        )  # fmt: skip
        marks = tuple(Mark(f"{n}' = {v:g}" if end < 1.0 else "", x=0.0, y=v) for n, v in RATE_MARKS.items())
        panels.append(Panel(f"the first {end:g} s", "t [s]", "rates [rad/s]", curves, marks))
    start = controlled(np.zeros(1))[1][0]
    readings = (Reading("alpha', beta', gamma' at t = 0", list(RATE_MARKS.values()), start.tolist(), "rad/s"),)
    return Drawing(tuple(panels), readings, "No number on the axes of this figure is readable.")


def figure_11() -> Drawing:
    """Phase paths of the three angles."""
    t = np.concatenate([np.linspace(0.0, 0.05, 200, endpoint=False), np.linspace(0.05, 2.0 * DURATION, SAMPLES)])
    angles, rates = controlled(t)
    wanted = closed.source_targets(np.linspace(0.0, 0.4 * math.pi, 201))
    panels = []
    for k, n in enumerate(ANGLES):
        start = Mark("start", float(closed.SOURCE_START_ANGLES[k]), float(closed.SOURCE_START_RATES[k]))
        curves = (
            Curve(angles[:, k], rates[:, k], "controlled", "solid", k),
            Curve(wanted.angles[:, k], wanted.rates[:, k], "wanted", "dotted", 4),
        )
        marks = (start, Mark("0.15", x=0.15)) if n == "alpha" else (start,)
        panels.append(Panel(n, f"{n} [rad]", f"{n}' [rad/s]", curves, marks))
    ends = [float(angles[:, 0].min()), float(angles[:, 0].max())]
    readings = (Reading("number on the axis of alpha, its sign unreadable; ends of the path", 0.15, ends, "rad"),)
    return Drawing(tuple(panels), readings, columns=3)


FIGURES = (
    SourceFigure("figure 8", "The workspace: grid nodes that all rods and sliders reach.", THESIS, figure_8, claims=("C23", "C24")),
    SourceFigure("figure 9", "Angles of the output link under control, and what is wanted.", THESIS, figure_9,
                 claims=("C34", "C35", "C56")),
    SourceFigure("figure 10", "Rates of the output link under control, and what is wanted.", THESIS, figure_10, claims=("C34", "C36")),
    SourceFigure("figure 11", "Phase paths of the output link under control.", THESIS, figure_11, claims=("C36", "C37", "C57")),
    *MESH_FIGURES,
)  # fmt: skip
