"""What tolerances really make of the answers: true solutions at the ends of the inputs and at the corners of their box."""

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
class Corners:
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
) -> Corners:
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
    return Corners(worst, missing, whole, len(found))


def _steepest(row: Mapping[str, Array], active: Sequence[str]) -> list[Move]:
    """The two corners where an answer is largest and smallest to first order (of arrays: where that is most)."""
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
