"""Dwells from straight lines: six-bars whose output is a slotted lever, at rest while the coupler point runs along its slot.

Where the coupler point P of a crank-rocker goes straight, a lever that turns about a point Q of that line and guides P in its slot does
not turn: its angle is that of the way from Q to P. The straightest of the atlas (`straight`) get a pivot on their line, as far away as the
swing allows, and all sizes are then moved until the largest deviation of the lever from its rest is least, with swing, transmission angle,
sizes and the clearance of pivot and slide as constraints.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechlab.analytic.path_synthesis.curves import Array, Complex
from mechlab.analytic.path_synthesis.dwell import FINE, TURN, coupler_point
from mechlab.analytic.path_synthesis.minimax import least_largest
from mechlab.analytic.path_synthesis.straight import straight_starts, turning
from mechlab.lazy_dataclass import dataclass
from mechlab.progress import counted, part, silent

BEYOND = np.geomspace(1.0, 10.0, 24)
"""Distances of the pivot from the end of the straight part that are tried, in clearances."""
TRIED, REFINED = 24, 6
"""Straight lines that get a pivot and are moved a few rounds; those that are refined to the end."""
ROUNDS = 10, 60
"""Rounds of the first search and of the last."""
FULL = 2.0 * np.pi * np.arange(TURN) / TURN
"""Crank angles of a turn [rad]."""


@dataclass(frozen=True)
class SlottedDwell:
    """Bars in cranks as of a crank-rocker with coupler point p; pivot Q of the lever, seen from the pivot of the crank in the axes of the
    ground; first: crank angle where the dwell begins. deviation: width of the strip of angles in which the lever rests [rad]; its swing
    [rad]; the least transmission angle of the crank-rocker [rad]; slot: nearest and farthest distance of P from Q; longest bar."""

    coupler: float
    rocker: float
    ground: float
    point: complex
    pivot: complex
    first: float
    deviation: float
    swing: float
    least_transmission_angle: float
    slot: tuple[float, float]
    longest: float


def slotted_dwells(
    angle: float, swing: float, size: float, least: float, clearance: float = 1.0, progress: Callable[[int, int], None] = silent
) -> tuple[SlottedDwell, ...]:
    """Six-bars whose slotted lever rests for a crank angle [rad] and swings by at least `swing` [rad], the stillest first.

    size: longest bar, the lever included, in cranks; least: smallest transmission angle [rad]; clearance: least distance of the slide from
    the pivot of the lever, in cranks; progress hears (done, total).
    """

    def model(x: Array) -> tuple[Array, Array]:
        rest = np.angle(slot(x, x[:, 5, None] + np.linspace(-0.5, 0.5, FINE) * angle)) - x[:, 8, None]
        around = slot(x, np.broadcast_to(FULL, (len(x), TURN)))
        clear, short = np.min(np.abs(around), axis=1) / clearance - 1.0, 1.0 - _longest(x, around) / size
        return np.angle(np.exp(1j * rest)), np.column_stack([turning(x, least), _swing(around) - swing, clear, short])

    def moved(x: Array, rounds: int) -> tuple[float, Array]:
        found, value = least_largest(model, x, rounds)
        return value, found

    lines = straight_starts(angle, np.inf, least, TRIED, part(progress, 0, 20))
    begun = [x for line in lines for x in _pivoted(line, angle, swing, size, clearance)]
    first = sorted((moved(x, ROUNDS[0]) for x in counted(begun, part(progress, 20, 65))), key=lambda v: v[0])
    out = list[SlottedDwell]()
    for value, x in (moved(x, ROUNDS[1]) for _, x in counted(first[:REFINED], part(progress, 65, 100))):
        if np.isfinite(value) and np.min(model(x[None])[1]) > -1e-6:
            found = _found(x, angle)
            if all(abs(found.deviation / o.deviation - 1.0) > 1e-3 or abs(found.ground - o.ground) > 1e-2 for o in out):
                out.append(found)
    return tuple(sorted(out, key=lambda f: f.deviation))


def slot(x: Array, t: Array) -> Complex:
    """From the pivot Q to P (k, n), in cranks, of rows (b, c, d, p, middle, Q, rest) at crank angles (k, n)."""
    return np.asarray(coupler_point(x, t) - (x[:, 6] + 1j * x[:, 7])[:, None])


def _swing(around: Complex) -> Array:
    """Range of the lever's angle (k,) over a turn of the crank."""
    return np.asarray(np.ptp(np.unwrap(np.angle(around), axis=1), axis=1))


def _longest(x: Array, around: Complex) -> Array:
    p, q = x[:, 3] + 1j * x[:, 4], x[:, 6] + 1j * x[:, 7]
    lengths = [x[:, :3], np.abs(p)[:, None], np.abs(p - x[:, 0])[:, None], np.abs(q)[:, None], np.abs(around)]
    return np.asarray(np.max(np.column_stack(lengths), axis=1))


def _pivoted(line: Array, angle: float, swing: float, size: float, clearance: float) -> list[Array]:
    """Rows (9,) with the pivot beyond either end of a straight part, as far away as the swing allows."""
    middle, direction = line[5], line[6]
    along = (coupler_point(line[None], middle + np.linspace(-0.5, 0.5, FINE)[None] * angle)[0] * np.exp(-1j * direction)).real
    out = list[Array]()
    for end, way in ((np.min(along), -1.0), (np.max(along), 1.0)):
        q = (end + way * clearance * BEYOND + 1j * line[7]) * np.exp(1j * direction)
        towards = np.full(len(q), direction + (np.pi if way > 0.0 else 0.0))
        x = np.column_stack([np.repeat(line[None, :6], len(q), axis=0), q.real, q.imag, towards])
        around = slot(x, np.broadcast_to(FULL, (len(x), TURN)))
        # a lever that turns round with P rests nowhere near its swing; its pivot lies inside the coupler curve
        turns = np.abs(np.sum(np.angle(np.roll(around, -1, axis=1) / around), axis=1)) > 1.0
        lack = np.maximum(0.0, swing - _swing(around)) + np.maximum(0.0, _longest(x, around) / size - 1.0)
        lack += np.maximum(0.0, clearance - np.min(np.abs(around), axis=1))
        lack[turns] = np.inf
        # of those that lack nothing the farthest, else the one that lacks least
        k = int(np.flatnonzero(lack == np.min(lack))[-1])
        if np.isfinite(lack[k]):
            out.append(x[k])
    return out


def _found(x: Array, angle: float) -> SlottedDwell:
    rest = np.unwrap(np.angle(slot(x[None], x[None, 5, None] + np.linspace(-0.5, 0.5, 10 * FINE) * angle)[0]))
    around = slot(x[None], np.linspace(0.0, 2.0 * np.pi, 10 * TURN)[None])
    least, reach = float(np.arccos(np.max(1.0 - turning(x, 0.0)))), np.abs(around)
    return SlottedDwell(
        float(x[0]), float(x[1]), float(x[2]), complex(x[3], x[4]), complex(x[6], x[7]), float(x[5] - 0.5 * angle), float(np.ptp(rest)),
        float(_swing(around)[0]), least, (float(np.min(reach)), float(np.max(reach))), float(_longest(x[None], around)[0]),
    )  # fmt: skip
