"""Derivatives of many outputs by one input, from differences with Richardson extrapolation; and solutions within
tolerances.

The solutions within tolerances are computed at both ends of each input and at corners of the tolerance box.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

ALL = 5
"""Up to this number of inputs with an effect, all 2^n corners are solved; beyond it, only the worst corners to first
order."""
NAMED = 4
"""Largest number of points without an answer that a message names."""

Move = tuple[tuple[str, int], ...]
"""Inputs at an end of their tolerance: (name, -1 or 1), ...; all others are at their nominal values."""


@dataclass(frozen=True)
class ToleranceCorners:
    """Solutions at ends and corners of the tolerance box. worst: answer -> largest |change| [unit of the answer];
    missing: points without an answer, in words; whole: True when all corners of the inputs with an effect were solved;
    solved: number of points."""

    worst: Mapping[str, Array]
    missing: tuple[str, ...]
    whole: bool
    solved: int


def corners(
    widths: Mapping[str, float],
    slopes: Mapping[str, Mapping[str, Array]],
    change: Callable[[Mapping[str, float]], Mapping[str, Array]],
) -> ToleranceCorners:
    """Solve at the ends of the box +-widths.

    slopes: answer -> input -> derivative, of which only the signs are used; change(input -> step): answer -> its change
    (NaN where there is no answer). Corners at an end that alone has no answer are not tried.
    """
    found: dict[Move, Mapping[str, Array]] = {}

    def at(move: Move) -> Mapping[str, Array]:
        if move not in found:
            found[move] = change({name: side * widths[name] for name, side in move})
        return found[move]

    ends = {(name, side): at(((name, side),)) for name in widths for side in (-1, 1)}
    active = [n for n in widths if any(np.any(x != 0.0) for s in (-1, 1) for x in ends[n, s].values())]
    whole = len(active) <= ALL
    if whole:
        moves = [tuple(zip(active, sides, strict=True)) for sides in itertools.product((-1, 1), repeat=len(active))]
    else:
        moves = [m for row in slopes.values() for m in _steepest(row, active)]
    for move in dict.fromkeys(moves):
        if move and not any(_gone(ends[end]) for end in move):
            at(move)
    sizes: dict[str, list[Array]] = {}
    for answers in found.values():
        for name, value in answers.items():
            sizes.setdefault(name, []).append(np.abs(value))
    worst = {n: np.nan_to_num(np.fmax.reduce(many)) for n, many in sizes.items()}
    missing = tuple(_words(move, widths) for move, answers in found.items() if _gone(answers))
    return ToleranceCorners(worst, missing, whole, len(found))


def _steepest(row: Mapping[str, Array], active: Sequence[str]) -> list[Move]:
    """The two corners where an answer is smallest and largest to first order; for an array, its steepest entry by each
    input."""
    signs = {}
    for name in active:
        slope = np.ravel(np.asarray(row.get(name, 0.0), dtype=float))
        steepest = slope[int(np.argmax(np.abs(np.nan_to_num(slope))))]
        signs[name] = 1 if steepest >= 0.0 else -1
    return [tuple((n, s * side) for n, s in signs.items()) for side in (-1, 1)]


def _gone(answers: Mapping[str, Array]) -> bool:
    return any(np.any(np.isnan(x)) for x in answers.values())


def _words(move: Move, widths: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {'plus' if side > 0 else 'less'} {widths[name]:.4g}" for name, side in move)


FIRST = 0.005
"""First step, relative to the input's size."""
LEVELS = 6
"""Number of steps; each is half of the one before."""
SHRINK = (1.0, 0.1, 0.01)
"""Factors of the first step, tried in turn until both sides of the input have outputs."""
ENOUGH = 1e-9
"""Relative error at which no smaller step is tried."""
NOISE = 1e-13
"""Changes of an output below this share of max(1, |output|) are rounding."""


@dataclass(frozen=True)
class Slope:
    """Derivatives (n,) and their estimated errors (n,); NaN where there is no output next to the input. sides: 2 for
    central differences, 1 where only one side has outputs, 0 where neither has."""

    value: Array
    error: Array
    sides: int


def slope(change: Callable[[float], Array], size: float, outputs: Array) -> Slope:
    """Derivatives at 0 of change(d) (n,), the outputs at input + d less those at the input (NaN where there is no
    output).

    size: of the input. outputs (n,): values at the input. Where the first step changes no output, the derivatives are
    0.

    Ridders' scheme: D(h) = (f(h) - f(-h)) / (2h) at h, h/2, ...; a tableau of extrapolations removes h^2, h^4, ... For
    each output the entry that differs least from its neighbours is taken, and that difference is its error. Where one
    side has no outputs: (4 f(h) - f(2h)) / (2h), with error terms h^2, h^3, ... Source: Ridders 1982.
    """
    floor = NOISE * np.maximum(1.0, np.abs(outputs))
    for share in SHRINK:
        h = FIRST * share * size
        up = change(h)
        if not np.any(up):  # NaN counts as a change
            return Slope(np.zeros(len(up)), np.zeros(len(up)), 2)
        down = change(-h)
        here = np.isfinite(up) & np.isfinite(down)
        if here.all():
            return _ridders(_central(change, (up, down)), h, 2, floor)
    one = [s for s, x in ((1.0, up), (-1.0, down)) if np.isfinite(x).sum() > here.sum()]
    if one:
        return _ridders(_one_sided(change, one[0]), FIRST * SHRINK[-1] * size, 1, floor)
    if here.any():
        return _ridders(_central(change, (up, down)), h, 2, floor)
    return Slope(np.full(len(up), np.nan), np.full(len(up), np.nan), 0)


def _central(change: Callable[[float], Array], first: tuple[Array, Array]) -> Callable[[float, int], Array]:
    def quotient(h: float, level: int) -> Array:
        up, down = first if level == 0 else (change(h), change(-h))
        return (up - down) / (2.0 * h)

    return quotient


def _one_sided(change: Callable[[float], Array], side: float) -> Callable[[float, int], Array]:
    return lambda h, level: (4.0 * change(side * h) - change(2.0 * side * h)) / (2.0 * side * h)


def _ridders(quotient: Callable[[float, int], Array], first: float, sides: int, floor: Array) -> Slope:
    row = [quotient(first, 0)]
    best = row[0]
    error = np.where(best == 0.0, 0.0, np.abs(best))
    for level in range(1, LEVELS):
        if np.all((error <= ENOUGH * np.abs(best)) | (error * first / 2.0**level <= floor) | np.isnan(best)):
            break
        new = [quotient(first / 2.0**level, level)]
        for k, old in enumerate(row):
            order = 2 * (k + 1) if sides == 2 else k + 2
            new.append(new[k] + (new[k] - old) / (2.0**order - 1.0))
            doubt = np.maximum(np.abs(new[k + 1] - new[k]), np.abs(new[k + 1] - old))
            better = doubt < error
            best, error = np.where(better, new[k + 1], best), np.where(better, doubt, error)
        row = new
    return Slope(np.asarray(best), np.asarray(error), sides)
