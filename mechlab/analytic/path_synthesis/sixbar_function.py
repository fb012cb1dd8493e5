"""Function generators with six bars: Stephenson's third chain, its output driven by a coupler point.

With the coupler point P of a four-bar (crank 1) at the crank angles of the points, the output pivot G and the output angles psi counted
from an unknown beginning, the link of length l demands

    |G + z e^(i psi) - P|^2 = l^2,    z = r e^(i g0)

which for given four-bar, P and G is linear in z and r^2 - l^2: so each of many random ones gets the output that suits it best. The best of
them are moved, in eleven unknowns, until the largest error of the output angle is least, with transmission angles and bars as constraints.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechlab.analytic.function_generation import FunctionTask
from mechlab.analytic.path_synthesis.atlas import shapes
from mechlab.analytic.path_synthesis.curves import COUPLER, LINK, Array, Complex, points
from mechlab.analytic.path_synthesis.minimax import least_largest
from mechlab.analytic.path_synthesis.sixbar import ARM, NUMBERS, PIVOT, ROD, Sixbar, SixbarPoints
from mechlab.lazy_dataclass import dataclass
from mechlab.progress import counted, part, silent

DRAWN = 60_000
"""Random six-bars to begin with."""
COARSE, FINE, DENSE = 13, 61, 401
"""Places of the range in the search, in the last steps, and in the end, where the function is known between the points."""
TRIED, REFINED = 30, 6
ROUNDS = 12, 60
"""Six-bars that are moved a few rounds, and those that are moved to the end."""
FOURBAR_NUMBERS = (COUPLER, LINK, 4, 10, 11)
STEPHENSON = Sixbar()


@dataclass(frozen=True)
class FunctionSixbar:
    """Bars in cranks, pivots O = 0 and D = ground on the x axis; coupler point and pivot G; modes; angles of crank and output where the
    scales begin [rad]; errors (n,) of the output angle at the points and the largest over the range [rad] (NaN where the function between
    the points is not known); least transmission angle over the range [rad]; whether the crank turns fully."""

    coupler: float
    rocker: float
    ground: float
    point: complex
    pivot: complex
    link: float
    output: float
    mode: int
    side: int
    first: float
    first_out: float
    errors: Array
    range_error: float
    least_transmission_angle: float
    crank_turns: bool
    defect: str = ""


def function_sixbars(
    task: FunctionTask, seed: int = 0, progress: Callable[[int, int], None] = silent
) -> tuple[FunctionSixbar, ...]:
    """Six-bars whose output follows the function, that of the least largest error first; the scales begin where it suits, and the linkage
    may be turned as a whole. seed: of the random ones; progress hears (done, total)."""
    turned, wanted = _places(task, FINE)

    def model(x: Array, mode: int) -> tuple[Array, Array]:
        error, found = _errors(x, np.full(len(x), mode), turned, wanted)
        size = np.log(_bars(x))
        even = np.log(task.ratio) - np.ptp(size, axis=1)
        far = np.log(2.0 * task.ratio) - np.log(np.abs(np.column_stack([x[:, 3] + 1j * x[:, 4], x[:, 6] + 1j * x[:, 7]]))).max(axis=1)
        return error, np.column_stack([np.min(found.margin, axis=1) - np.sin(task.least), even, far])

    def moved(x: Array, mode: int, rounds: int) -> tuple[float, Array, int]:
        row, value = least_largest(lambda rows: model(rows, mode), x, rounds)
        return value, row, mode

    begun = counted(_starts(task, np.random.default_rng(seed)), part(progress, 10, 60))
    first = sorted((moved(x, mode, ROUNDS[0]) for x, mode in begun), key=lambda v: v[0])
    refined = counted(first[:REFINED], part(progress, 60, 100))
    out = list[FunctionSixbar]()
    for value, x, mode in sorted((moved(x, mode, ROUNDS[1]) for _, x, mode in refined), key=lambda v: v[0]):
        if np.isfinite(value) and np.min(model(x[None], mode)[1]) > -1e-6:
            f = _found(task, x, mode)
            if np.isfinite(f.least_transmission_angle) and all(abs(f.coupler - o.coupler) > 1e-3 * f.coupler for o in out):
                out.append(f)
    return tuple(out)


def _places(task: FunctionTask, count: int) -> tuple[Array, Array]:
    """Input and wanted output: even places of the range where the function is known, else the points."""
    if task.wanted is None:
        return task.turned, task.output
    turned = np.linspace(0.0, task.turn, count)
    return turned, task.wanted(turned)


def _rows(x: Array) -> Array:
    """Rows (k, 18) of `sixbar` from the unknowns (k, 11): b, c, d, p, first, G, link, output, first_out."""
    rows = np.zeros((len(x), NUMBERS))
    rows[:, 2] = 1.0
    rows[:, FOURBAR_NUMBERS] = x[:, :5]
    rows[:, [PIVOT, PIVOT + 1, ROD, ARM]] = x[:, 6:10]
    return rows


def _bars(x: Array) -> Array:
    return np.column_stack([np.ones(len(x)), np.abs(x[:, :3]), np.abs(x[:, 8:10])])


def _errors(x: Array, mode: Array, turned: Array, wanted: Array) -> tuple[Array, SixbarPoints]:
    """Errors (k, n) of the output angle, and the points."""
    found = STEPHENSON.points(_rows(x), mode, x[:, 5, None] + turned)
    end = found.base.point + x[:, 8, None] * found.turn
    out = np.angle(end - found.pivot)
    return np.angle(np.exp(1j * (out - x[:, 10, None] - wanted))), found


def _starts(task: FunctionTask, rng: np.random.Generator) -> list[tuple[Array, int]]:
    """The best of the random ones, of unlike bars, with their modes."""
    turned, wanted = _places(task, COARSE)
    b, c, d = shapes()[rng.integers(len(shapes()), size=DRAWN)].T
    first, mode = rng.uniform(-np.pi, np.pi, DRAWN), np.where(rng.uniform(size=DRAWN) < 0.5, 1, -1)
    p = b * rng.uniform(0.3, 2.0, DRAWN) * np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, DRAWN))
    pivot = np.maximum(b, d) * rng.uniform(0.3, 2.0, DRAWN) * np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, DRAWN))
    none = np.zeros(DRAWN)
    x = np.column_stack([b, c, d, p.real, p.imag, first, pivot.real, pivot.imag, none, none, none])
    at = points(_rows(x)[:, :12], mode, 0.0, first[:, None] + turned)
    fine = np.min(np.abs(at.margin), axis=1) > np.sin(task.least)
    x, mode, way = x[fine], mode[fine], pivot[fine, None] - at.point[fine]
    x[:, 8:11] = _outputs(way, wanted)
    # the side of the joint from the way P -> G, at the first place
    end = way[:, 0] + x[:, 9] * np.exp(1j * (x[:, 10] + wanted[0]))
    side = np.where(np.imag(np.conj(way[:, 0]) * end) >= 0.0, 1, -1)
    both = mode + 2 * side
    error, found = _errors(x, both, turned, wanted)
    size = _bars(x)
    fine = (np.min(found.margin, axis=1) > 0.8 * np.sin(task.least)) & (size.max(axis=1) < task.ratio * size.min(axis=1))
    worst = np.where(fine, np.max(np.abs(error), axis=1), np.inf)
    chosen = list[int]()
    for k in np.argsort(worst):
        if len(chosen) == TRIED or not np.isfinite(worst[k]):
            break
        if all(np.max(np.abs(np.log(size[k] / size[o]))) > 0.3 for o in chosen):
            chosen.append(int(k))
    return [(x[k], int(both[k])) for k in chosen]


def _outputs(way: Complex, wanted: Array) -> Array:
    """Link, output and first_out (k, 3) of least squares of the closure, from the ways P -> G (k, n); NaN where there is none."""
    turn = np.exp(1j * wanted) * np.conj(way)
    table = np.stack([np.ones(turn.shape), 2.0 * turn.real, -2.0 * turn.imag], axis=-1)
    flat = np.swapaxes(table, 1, 2)
    right = -(way.real**2 + way.imag**2)
    k, x, y = np.linalg.solve(flat @ table + 1e-12 * np.eye(3), flat @ right[..., None])[..., 0].T
    arm = np.hypot(x, y)
    with np.errstate(invalid="ignore"):
        return np.column_stack([np.sqrt(arm * arm - k), arm, np.arctan2(y, x)])


def _found(task: FunctionTask, x: Array, mode: int) -> FunctionSixbar:
    side = int(np.sign(mode))
    errors, modes = _errors(x[None], np.array([mode]), task.turned, task.output)[0][0], np.array([mode])
    turned, wanted = _places(task, DENSE)
    over, _ = _errors(x[None], modes, turned, wanted)
    way = _errors(x[None], modes, np.linspace(0.0, task.turn, DENSE), np.zeros(DENSE))[1].margin
    round_ = _errors(x[None], modes, np.linspace(0.0, 2.0 * np.pi, DENSE), np.zeros(DENSE))[1].margin
    return FunctionSixbar(
        float(x[0]), float(x[1]), float(x[2]), complex(x[3], x[4]), complex(x[6], x[7]), float(x[8]), float(x[9]), mode - 2 * side, side,
        float(x[5]), float(x[10]), errors, float(np.max(np.abs(over))) if task.wanted else float("nan"),
        float(np.arcsin(np.clip(np.min(way), 0.0, 1.0))) if np.all(np.isfinite(way)) else float("nan"), bool(np.all(np.isfinite(round_))),
    )  # fmt: skip
