"""Derivatives of many outputs by one input, by differences and Richardson's extrapolation, and true solutions within tolerances.

The true solutions are at the ends of the inputs and at the corners of their box.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mechlab.mechanism.geometry import Array

ALL = 5
"""So many inputs that matter have all their 2^n corners solved; of more, the ends of each and the worst corners to first order."""
NAMED = 4
"""Ends without an answer that are named."""

Move = tuple[tuple[str, int], ...]
"""Inputs at an end: (name, -1 or 1), ...; the others are at their values."""


@dataclass(frozen=True)
class ToleranceCorners:
    """worst: answer -> largest size of its change [unit of the answer] at any end or corner that has an answer; missing: ends and
    corners without one, in words; whole: whether all corners of the inputs that matter were solved; solved: how many."""

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

    slopes: answer -> input -> derivative, of which the signs are used; change(input -> step): answer -> its true change (NaN
    where it has none). Where one end of an input has no answer, corners with it are not tried.
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
    """The two corners where an answer is largest and smallest to first order (of an array: at its steepest entry)."""
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
"""First step, as a share of the input's size."""
LEVELS = 6
"""Steps: each is half of the one before."""
SHRINK = (1.0, 0.1, 0.01)
"""Factors of the first step: where an output is missing next to the input, both sides are tried again nearer to it."""
ENOUGH = 1e-9
"""Relative error at which no smaller step is tried."""
NOISE = 1e-13
"""Changes of an output that are smaller, as a share of its size (at least 1), are rounding."""


@dataclass(frozen=True)
class Slope:
    """Derivatives (n,) and their estimated errors (n,); NaN where the output is missing next to the input. sides: 2 for
    central differences, 1 where only one side has an answer, 0 where none has."""

    value: Array
    error: Array
    sides: int


def slope(change: Callable[[float], Array], size: float, outputs: Array) -> Slope:
    """Derivatives at 0 of change(d) (n,), the outputs at input + d less those at the input; NaN: no such output.

    size: of the input. outputs (n,): the outputs themselves. An input whose first step changes nothing at all has none.

    Ridders' scheme: D(h) = (f(h) - f(-h)) / (2h) at h, h/2, ...; the tableau of extrapolations removes h^2, h^4, ...; of each
    output the entry is taken that changes least against its neighbours, and that change is the error. Where one side is
    missing, (4 f(h) - f(2h)) / (2h), with errors h^2, h^3, ... Source: Ridders 1982.
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
