"""Which straight line is straightest? Every linkage of the family along its stated path, at equal straightness and at equal stroke."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mechlab.experiment.entry import Entry
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.tree import reference_poses
from mechlab.studies.compare.measures import EXACT, bars, longest, stretches
from mechlab.studies.compare.result import Column, Comparison, Panel, Row
from mechlab.studies.cycle.cycle import run_cycle

FAMILY = "straight-line"
POINTS = 96
"""Steps of the drive along the path; the stretches begin and end at them."""
SHARE = 1e-3
"""Straightness at which strokes are compared: width of the strip over its length."""
HALF = 0.5
"""Stroke at which straightness is compared, in longest bars."""
POINT = {"hart": "R", "kempe": "V2"}
"""The point that goes straight where it is not called P."""
FINEST = 1e-7

COLUMNS = (
    Column("stroke", f"straight to {SHARE:g}", "longest bar", f"longest stroke inside a strip {SHARE:g} of its length wide, over the "
           "longest bar (over the side of the box around the path where there are gears or no plane)", 1),
    Column("deviation", "deviation at a stroke of half a bar", "of the stroke", "width of the narrowest strip around a stroke of half the "
           "longest bar, over that stroke; none where the path is shorter", -1),
    Column("evenness", "least over mean speed", "", "speed of the point at an even drive on the straight stroke: least over mean; 0 where "
           "it reverses. By virtual work it is the mean over the largest force that the drive can give there", 1),
    Column("transmission_angle_deg", "least transmission angle", "deg", "on the straight stroke, of the pin that closes the last loop of "
           "bars; 90 is best, below 30 it is usually avoided", 1),
    Column("bar_ratio", "longest : shortest bar", "", "of the pins of each bar, ground and point included", -1),
    Column("bodies", "bodies", "", "bars, blocks and wheels, and the ground"),
)  # fmt: skip
TEXT = (
    "A strip is laid around every stretch of the path of the point that should go straight; its width over its length is the deviation. "
    "So all linkages are compared alike, whatever their size and their path: how long a stroke is straight to a thousandth, and how "
    "straight a stroke of half the longest bar is.",
    "An exact linkage has a deviation of 0 along its whole path: inversors (Peaucellier, Hart), the isosceles slider-crank (Scott "
    "Russell), the wheel in a ring of twice its size (Cardan), and Sarrus' hinges, which need space; in the chart these are upright "
    "lines. The others touch the line several times, as Chebyshev asked. Each moves along the path that its entry states.",
)


def straight_lines(entries: Iterable[Entry]) -> Comparison:
    """The comparison of all entries that have a path with one drive and the point."""
    rows, curves, skipped = [], {}, []
    for entry in entries:
        point = POINT.get(entry.name, "P")
        p = entry.parameters()
        m = entry.build(p, list(entry.fidelities)[-1])
        path = {} if entry.path is None else entry.path(p)
        if len(path) != 1 or point not in {f.name for f in m.frames}:
            skipped.append(entry.name)
            continue
        row, curve = _measured(entry, m, point, next(iter(path.items())))
        rows.append(row)
        curves[entry.title] = curve
    rows.sort(key=lambda r: -(r.values["stroke"] or 0.0))
    panel = Panel(
        "How straight is how long a stroke?", "stroke [longest bar]", "least deviation [of the stroke]",
        {r.title: curves[r.title] for r in rows}, log="y",
    )  # fmt: skip
    return Comparison("straight-line", "Which straight line is straightest?", TEXT, COLUMNS, tuple(rows), (panel,), tuple(skipped))


def _measured(entry: Entry, m: Mechanism, point: str, way: tuple[str, tuple[float, float]]) -> tuple[Row, tuple[Array, Array]]:
    drive, span = way
    cycle = run_cycle(m, drive=drive, span=span, points=POINTS)
    places = np.column_stack([cycle[f"{point}_{x}"] for x in "xyz"])
    width, length = stretches(places)
    frame = next(f for f in m.frames if f.name == point)
    rotation, origin = reference_poses(m.bodies)[frame.body]
    lengths = bars(m, {frame.body: rotation @ np.asarray(frame.placement.translation) + origin})
    size = max(lengths) if lengths else float(np.ptp(places, axis=0).max())
    best = longest(width, length, SHARE)
    values: dict[str, float | None] = dict.fromkeys(c.key for c in COLUMNS)
    values["bodies"] = float(len(m.bodies) + 1)
    if lengths:
        values["bar_ratio"] = max(lengths) / min(lengths)
    with np.errstate(invalid="ignore"):
        enough = np.where(length >= HALF * size, width / length, np.inf)
    if np.isfinite(enough).any() and enough.min() < np.inf:
        values["deviation"] = float(np.nanmin(enough))
    if best is not None:
        i, j = best
        values["stroke"] = float(length[best] / size)
        values["evenness"] = _evenness(cycle[drive], places, i, j)
        values["transmission_angle_deg"] = _angle(cycle.columns, i, j)
    row = Row(entry.name, entry.title, values, difference=max(cycle.witnesses.values(), default=0.0))
    return row, _frontier(width / length, length / size)


def _evenness(phi: Array, places: Array, i: int, j: int) -> float:
    """Least over mean speed along the chord, by the spline through the places."""
    from scipy.interpolate import CubicSpline

    chord = (places[j] - places[i]) / np.linalg.norm(places[j] - places[i])
    along = CubicSpline(phi, places @ chord)
    fine = np.linspace(phi[i], phi[j], 400)
    speed = along(fine, 1)
    return float(max(0.0, speed.min() / ((along(phi[j]) - along(phi[i])) / (phi[j] - phi[i]))))


def _angle(columns: dict[str, Array], i: int, j: int) -> float | None:
    """The least transmission angle [deg] between two points, of the last loop that has one."""
    names = [n for n in columns if n.endswith("_transmission_angle")]
    found = columns[names[-1]][i : j + 1] if names else np.array([np.nan])
    return None if np.isnan(found).all() else float(np.degrees(np.nanmin(found)))


def _frontier(deviation: Array, stroke: Array) -> tuple[Array, Array]:
    """Longest stroke for each deviation, from FINEST on; deviations at rounding level count as exact. It ends with
    the path; an exact line goes all the way up."""
    levels = np.geomspace(FINEST, 1.0, 57)
    known = np.isfinite(deviation)
    bent, long = np.where(deviation[known] <= EXACT, 0.0, deviation[known]), stroke[known]
    reach = np.array([long[bent <= x].max(initial=0.0) for x in levels])
    last = len(levels) if bent[long.argmax()] == 0.0 else int(np.argmax(reach >= long.max())) + 1
    drawn = (reach > 0.0) & (np.arange(len(levels)) < last)
    return reach[drawn], levels[drawn]
