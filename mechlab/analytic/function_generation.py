"""Function generation: four-bars whose output angle follows the input angle as a function demands (Freudenstein 1955).

With the pivots a distance 1 apart, input a at the angle f, output c at the angle g and coupler b:

    K1 cos g - K2 cos f + K3 = cos(f - g),    K1 = 1 / a,  K2 = 1 / c,  K3 = (1 - b^2 + a^2 + c^2) / (2 a c)

which is linear in K1, K2, K3. The angles at which the scales of input and output begin are two more unknowns where they are not given: as
many precision points as unknowns (three to five) are met exactly, more in the least squares of the output angle and, where the function
is known between them, so that its largest error is least; what fewer leave open is chosen by the error over the range. A negative a or c
is a bar of that length half a turn on.

The equation, its extension to five unknowns and the spacing are Freudenstein's (Approximate Synthesis of Four-Bar Linkages, Trans. ASME
77, 1955) and of Hartenberg and Denavit (Kinematic Synthesis of Linkages, 1964); solver and choice among what is left open are our own.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, minimize

from mechlab.analytic import fourbar
from mechlab.analytic.function_closure import output, output_slopes, side_of
from mechlab.analytic.path_synthesis.minimax import least_largest
from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass
from mechlab.progress import counted, silent

Array = NDArray[np.float64]
SCAN = 72
"""Angles at which the beginning of a scale is tried where both are free; with one free, five times as many."""
DENSE = 181
"""Input angles at which the error over the range is taken."""
REFINED = 12
"""Candidates that are refined."""
EVENED = 3
"""Best of the least squares whose largest error over the range is then made least."""
SAME = 1e-12
"""Largest difference between input and output angle [rad] of a function that is the input itself."""
EXACT = 1e-9
"""Largest error at the precision points [rad] of an exact solution."""


@dataclass(frozen=True)
class FunctionTask:
    """What is wanted. turned, output: angles (n,) of input and output at the points, counted from the beginning of their scales [rad].
    first, first_out: where the scales begin [rad], None where that is free. wanted: output angle from input angle, both on their scales
    (arrays), known where the function is, or None. turn: input range. least: smallest transmission angle [rad]; ratio: longest bar to
    shortest. Raises MechlabError for fewer than three points, or two with the same input."""

    turned: Array
    output: Array
    turn: float
    first: float | None = None
    first_out: float | None = None
    wanted: Callable[[Array], Array] | None = None
    least: float = 0.0
    ratio: float = 10.0

    def __post_init__(self) -> None:
        if len(self.turned) < 3 or not np.all(np.isfinite(self.turned)) or not np.all(np.isfinite(self.output)):
            raise MechlabError(f"function generation: expected at least 3 finite points, got {len(self.turned)}.")
        if np.any(np.diff(np.sort(self.turned)) <= 1e-12):
            raise MechlabError("function generation: two points have the same input.")

    @property
    def free(self) -> tuple[bool, bool]:
        """Which beginnings of the scales are unknown."""
        return self.first is None, self.first_out is None

    @property
    def unknowns(self) -> int:
        """Three bar ratios and the free beginnings."""
        return 3 + sum(self.free)

    @property
    def range(self) -> Array:
        """Input angles (DENSE,) over the range, from its beginning."""
        return np.linspace(0.0, self.turn, DENSE)


@dataclass(frozen=True)
class FunctionFourbar:
    """Bars [ground 1], angles first and first_out of the bars where the scales begin [rad], mode as of `fourbar.solve`. errors (n,) of the
    output angle at the points, largest error over the range [rad] (NaN where the function between the points is not known), least
    transmission angle over the range; crank_turns: the input turns fully; defect: "" or "branch"."""

    crank: float
    coupler: float
    rocker: float
    mode: int
    first: float
    first_out: float
    errors: Array
    range_error: float
    least_transmission_angle: float
    crank_turns: bool
    defect: str


def chebyshev_points(low: float, high: float, count: int) -> Array:
    """Chebyshev's spacing (count,): the points between which the error of an exact interpolation is nearly even."""
    return 0.5 * (low + high) - 0.5 * (high - low) * np.cos((np.arange(count) + 0.5) * np.pi / count)


def function_fourbars(task: FunctionTask, progress: Callable[[int, int], None] = silent) -> tuple[FunctionFourbar, ...]:
    """The four-bars that were found, the best first: those without a defect in the order of their error over the range, or, where the
    function is known at the points alone, exact ones in that of their transmission angle, others in that of their largest error.
    progress hears (done, total)."""
    begun = counted(_begun(task), progress)
    same = _parallelograms(task)
    if len(task.turned) > task.unknowns:
        rows = [_least_squares(task, x) for x in begun]
        rows += [_evened(task, x) for x in sorted(rows, key=lambda x: float(_worst(task, x[None])[0]))[:EVENED] if task.wanted]
    elif len(task.turned) > 3:
        rows = [y for x in begun if (y := _exact(task, x)) is not None]
    else:
        rows = [_chosen(task, x) for x in begun] if any(task.free) else list(begun)
    return _different([f for x in [*rows, *same] if (f := _fourbar(task, x)) is not None], task)


def bars(task: FunctionTask, first: Array, first_out: Array) -> tuple[Array, Array]:
    """Least squares of Freudenstein's equation at beginnings (k,): a, b^2, c as (k, 3), and the squares that are left (k,)."""
    f, g = first[:, None] + task.turned, first_out[:, None] + task.output
    table, right = np.stack([np.cos(g), -np.cos(f), np.ones_like(f)], axis=-1), np.cos(f - g)
    q, r = np.linalg.qr(table)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (np.swapaxes(q, 1, 2) @ right[..., None])[..., 0]
        singular = np.min(np.abs(np.diagonal(r, axis1=1, axis2=2)), axis=1) < 1e-9
        r[singular] = np.eye(3)
        k1, k2, k3 = np.linalg.solve(r, along[..., None])[..., 0].T
        a, c = 1.0 / k1, 1.0 / k2
        left = np.sum(right**2, axis=1) - np.sum(along**2, axis=1)
        found = np.column_stack([a, 1.0 + a * a + c * c - 2.0 * a * c * k3, c])
    found[singular] = np.nan
    return found, left


def _begun(task: FunctionTask) -> list[Array]:
    """Candidates (a, b, c, first, first_out), signed bars: the best of a scan of the free beginnings."""
    many = SCAN if all(task.free) else 5 * SCAN
    around = np.linspace(-np.pi, np.pi, many, endpoint=False)
    f, g = (x.ravel() for x in np.meshgrid(
        around if task.first is None else [task.first], around if task.first_out is None else [task.first_out], indexing="ij"))  # fmt: skip
    found, left = bars(task, f, g)
    with np.errstate(invalid="ignore"):
        good = np.all(np.isfinite(found), axis=1) & (found[:, 1] > 0.0)
    x = np.column_stack([found[:, 0], np.sqrt(np.where(good, found[:, 1], 1.0)), found[:, 2], f, g])[good]
    if not len(x):
        return []
    size, left = np.abs(np.column_stack([x[:, :3], np.ones(len(x))])), left[good]
    even = size.max(axis=1) < 3.0 * task.ratio * size.min(axis=1)
    if np.any(even):
        x, left = x[even], left[even]
    worst = _worst(task, x)
    # of the scan, the best by the error and the best by the equation: near a root the error may still be large
    order = np.concatenate([np.argsort(worst)[: 2 * REFINED], np.argsort(left)[: 6 * REFINED] if len(task.turned) > 3 else []]).astype(int)
    return [x[k] for k in dict.fromkeys(order.tolist())]


def _parallelograms(task: FunctionTask) -> list[Array]:
    """Where the output is to turn as the input does: parallelograms. With f = g their equation holds for every crank, and Freudenstein's
    three unknowns are not determined; the crank is half the ground bar, and free beginnings keep the range clear of the flat poses."""
    wanted = task.range if task.wanted is None else task.wanted(task.range)
    if np.max(np.abs(np.concatenate([task.output - task.turned, wanted - task.range]))) > SAME:
        return []
    given = [x for x in (task.first, task.first_out) if x is not None]
    if len(given) == 2 and abs(np.sin(0.5 * (given[0] - given[1]))) > SAME:
        return []
    first = given[0] if given else 0.5 * (np.pi - task.turn)
    return [np.array([0.5, 1.0, 0.5, first, first])]


def _errors(task: FunctionTask, x: Array, turned: Array, wanted: Array) -> Array:
    """Errors (k, m) of the output angle on the side of the first point."""
    side = side_of(x, x[:, 3] + task.turned[0], x[:, 4] + task.output[0])
    found = output(x, x[:, 3, None] + turned, side)
    return np.angle(np.exp(1j * (found - x[:, 4, None] - wanted)))


def _slopes(task: FunctionTask, x: Array) -> Array:
    """Derivatives (n, 5) of the errors at the points by a candidate (5,); 0 where it does not assemble."""
    reached = x[4] + task.output + _errors(task, x[None], task.turned, task.output)[0]
    out = output_slopes(x, x[3] + task.turned, reached) - np.array([0.0, 0.0, 0.0, 0.0, 1.0])
    return np.where(np.all(np.isfinite(out), axis=1)[:, None], out, 0.0)


def _worst(task: FunctionTask, x: Array) -> Array:
    """What candidates (k, 5) are chosen by: the largest error, and what transmission angle and bars lack."""
    at = (task.range, task.wanted(task.range)) if task.wanted else (task.turned, task.output)
    error = np.max(np.abs(_errors(task, x, *at)), axis=1)
    lack = np.maximum(0.0, task.least - _transmission(task, x))
    size = np.abs(np.column_stack([x[:, :3], np.ones(len(x))]))
    shape = np.maximum(0.0, np.log(size.max(axis=1) / size.min(axis=1) / task.ratio))
    value = error + 0.1 * (lack + shape) + (0.0 if task.wanted else 1e-3 * (np.pi - _transmission(task, x)))
    return np.where(np.isfinite(value), value, 1e3)


def _transmission(task: FunctionTask, x: Array) -> Array:
    """Least angle (k,) between coupler and output over the range, to 90 degrees."""
    square = np.abs(1.0 - x[:, 0, None] * np.exp(1j * (x[:, 3, None] + task.range))) ** 2
    cosine = (x[:, 1, None] ** 2 + x[:, 2, None] ** 2 - square) / (2.0 * x[:, 1, None] * np.abs(x[:, 2, None]))
    return np.arccos(np.clip(np.max(np.abs(cosine), axis=1), 0.0, 1.0))


def _with(task: FunctionTask, z: Array) -> tuple[Array, Array]:
    """Beginnings (1,), (1,) of the scales from the free ones."""
    free = iter(z)
    f = next(free) if task.first is None else task.first
    g = next(free) if task.first_out is None else task.first_out
    return np.array([f]), np.array([g])


def _row(task: FunctionTask, z: Array) -> Array | None:
    f, g = _with(task, z)
    found, _ = bars(task, f, g)
    if not np.all(np.isfinite(found)) or found[0, 1] <= 0.0:
        return None
    return np.array([found[0, 0], np.sqrt(found[0, 1]), found[0, 2], f[0], g[0]])


def _chosen(task: FunctionTask, x: Array) -> Array:
    """Three points: the free beginnings for which the error is least."""

    def cost(z: Array) -> float:
        row = _row(task, z)
        return 1e3 if row is None else float(_worst(task, row[None])[0])

    start = x[3:][list(task.free)]
    found = minimize(cost, start, method="Nelder-Mead", options={"maxfev": 160, "xatol": 1e-7, "fatol": 1e-12})
    row = _row(task, found.x)
    return x if row is None else row


def _exact(task: FunctionTask, x: Array) -> Array | None:
    """Four or five points: Newton's method on bars and beginnings; what four points leave open stays as it was."""
    held = 0 if len(task.turned) == task.unknowns else 1
    free = list(task.free)
    start = x[3:][free]

    def gap(z: Array) -> Array:
        f, g = _with(task, np.concatenate([start[:held], z]))
        i, o = f + task.turned, g + task.output
        table = np.column_stack([np.cos(o), -np.cos(i), np.ones_like(i), np.cos(i - o)])
        # the right side lies in the span of the columns: what is left of it, in a fixed basis of three rows
        k = np.linalg.lstsq(table[:3, :3], table[:3, 3], rcond=None)[0]
        return np.asarray(table[3:, :3] @ k - table[3:, 3])

    with np.errstate(all="ignore"):
        try:
            found = least_squares(gap, start[held:], xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=40)
        except (ValueError, np.linalg.LinAlgError):
            return None
    if np.max(np.abs(found.fun)) > 1e-10:
        return None
    return _row(task, np.concatenate([start[:held], found.x]))


def _least_squares(task: FunctionTask, x: Array) -> Array:
    """More points than unknowns: the least squares of the output angle."""
    moved = _moved(task)

    def row(z: Array) -> Array:
        out = x.copy()
        out[moved] = z
        return out

    def gap(z: Array) -> Array:
        error = _errors(task, row(z)[None], task.turned, task.output)[0]
        return np.where(np.isfinite(error), error, 1.0)

    found = least_squares(gap, x[moved], lambda z: _slopes(task, row(z))[:, moved], xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=60)
    return row(found.x)


def _evened(task: FunctionTask, x: Array) -> Array:
    """Bars and free beginnings for which the largest error over the range is least, within the transmission angle and the ratio."""
    moved, turned = _moved(task), task.range
    wanted = task.wanted(turned) if task.wanted else turned

    def model(z: Array) -> tuple[Array, Array]:
        rows = np.tile(x, (len(z), 1))
        rows[:, moved] = z
        size = np.log(np.abs(np.column_stack([rows[:, :3], np.ones(len(rows))])))
        even = np.log(task.ratio) - np.ptp(size, axis=1)
        return _errors(task, rows, turned, wanted), np.column_stack([_transmission(task, rows) - task.least, even])

    row = x.copy()
    row[moved] = least_largest(model, x[moved])[0]
    return row


def _moved(task: FunctionTask) -> list[int]:
    """Where the unknowns stand in a candidate."""
    return [0, 1, 2, *(k for k, free in zip((3, 4), task.free, strict=True) if free)]


def _fourbar(task: FunctionTask, x: Array) -> FunctionFourbar | None:
    """The candidate with bars of positive length, and its errors; None where the bars are out of proportion."""
    a, b, c, f, g = float(x[0]), abs(float(x[1])), *(float(v) for v in x[2:])
    sizes = np.abs([a, b, c, 1.0])
    if not np.all(np.isfinite(x)) or sizes.max() > task.ratio * sizes.min():
        return None
    errors = _errors(task, x[None], task.turned, task.output)[0]
    over = _errors(task, x[None], task.range, task.wanted(task.range))[0] if task.wanted else np.array([np.nan])
    # the way through the points on one side of the line A - D: the same branch
    sides = [side_of(x[None], f + p, g + q)[0] for p, q in zip(task.turned, task.output + errors, strict=True)]
    with np.errstate(invalid="ignore"):
        closes = bool(np.all(np.isfinite(output(x[None], f + task.range[None], np.array([sides[0]])))))
    exact = len(task.turned) <= task.unknowns
    jumps = not closes or np.any(~np.isfinite(errors)) or (exact and float(np.max(np.abs(errors))) > 1e-6)
    turn = np.pi * (np.array([a, c]) < 0.0)
    try:
        turns = fourbar.crank_limits(abs(a), b, abs(c), 1.0).full_turn
    except NoSolution:  # one bar is longer than the others together
        return None
    return FunctionFourbar(
        abs(a), b, abs(c), int(sides[0]), float(f + turn[0]), float(g + turn[1]), errors, float(np.max(np.abs(over))),
        float(_transmission(task, x[None])[0]), turns, "branch" if jumps else "",
    )  # fmt: skip


def _different(found: list[FunctionFourbar], task: FunctionTask) -> tuple[FunctionFourbar, ...]:
    def key(f: FunctionFourbar) -> tuple[bool, float]:
        worst = float(np.max(np.abs(f.errors)))
        value = f.range_error if task.wanted else (-f.least_transmission_angle if worst < EXACT else worst)
        return bool(f.defect), value if np.isfinite(value) else np.inf

    out = list[FunctionFourbar]()
    for f in sorted(found, key=key):
        sizes = np.array([f.crank, f.coupler, f.rocker])
        if all(np.max(np.abs(sizes - (o.crank, o.coupler, o.rocker))) > 1e-4 or o.defect != f.defect for o in out):
            out.append(f)
    return tuple(out)
