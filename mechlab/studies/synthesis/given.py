"""The keys of a synthesis task, converted and checked on access."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import MechlabError
from mechlab.experiment.entry import Entry
from mechlab.mechanism.parts import as_fraction
from mechlab.progress import silent
from mechlab.values import Range

MOST_TEETH = 2000
SMALLEST, LARGEST = 1e-6, 1e5
"""Extent of points that are given [m]; beyond, the engines' closures of what is found end in rounding."""


class Given:
    """The given values of a task, converted and checked on access. find: a catalog name -> its entry, by which what was found is built;
    progress: hears (done, total) of the work."""

    def __init__(
        self, task: str, values: Mapping[str, Any], find: Callable[[str], Entry], progress: Callable[[int, int], None] = silent
    ) -> None:
        self.task, self.values, self.find, self.progress = task, values, find, progress

    def refuse(self, key: str, expected: str) -> MechlabError:
        """The error for a value that is no good."""
        return MechlabError(f"synthesize {self.task}: {key}: expected {expected}, got {self.values.get(key)!r}.")

    def _raw(self, key: str, default: Any, what: str) -> Any:
        if key in self.values:
            return self.values[key]
        if default is None:
            raise MechlabError(f"synthesize {self.task}: {key} is missing; give {key}={what}.")
        return default

    def number(self, key: str, unit: str, default: float | None = None) -> float:
        """A finite number in its unit."""
        value = self._raw(key, default, f"a number [{unit}]" if unit else "a number")
        written = getattr(value, "unit", unit)
        try:
            out = float(value)
        except (TypeError, ValueError):
            raise MechlabError(f"synthesize {self.task}: {key}: expected a number, got {value!r}.") from None
        if written != unit or not math.isfinite(out):
            raise MechlabError(f"synthesize {self.task}: {key}: expected a finite number [{unit}], got {value!r}.")
        return out

    def within(self, key: str, unit: str, default: float, low: float, high: float) -> float:
        """A number from low to high."""
        value = self.number(key, unit, default)
        if not low <= value <= high:
            raise MechlabError(f"synthesize {self.task}: {key}: expected {low:g} to {high:g} {unit}".rstrip() + f", got {value:g}.")
        return value

    def one_of(self, key: str, words: tuple[str, ...]) -> str:
        """One of the words, by default the first."""
        value = self.values.get(key, words[0])
        if value not in words:
            raise self.refuse(key, " or ".join(words))
        return str(value)

    def six_bar(self) -> bool:
        """Whether chain=six-bar is asked for; by default it is four-bar."""
        return self.one_of("chain", ("four-bar", "six-bar")) == "six-bar"

    def numbers(self, key: str, unit: str, low: int, high: int) -> list[float]:
        """A list of `low` to `high` finite numbers."""
        value = self._raw(key, None, "a,b,c ...")
        items = list(value.points()) if isinstance(value, Range) else list(value) if hasattr(value, "__iter__") else [value]
        if not low <= len(items) <= high or isinstance(value, str):
            many = f"{low}" if low == high else f"{low} to {high}"
            in_unit = f" [{unit}]" if unit else ""
            got = repr(value) if isinstance(value, str) else len(items)
            raise MechlabError(f"synthesize {self.task}: {key}: expected {many} numbers{in_unit}, got {got}.")
        return [Given(self.task, {key: x}, self.find).number(key, unit) for x in items]

    def extent(self, places: NDArray[np.complex128]) -> float:
        """Twice the largest distance of a place (n,) from the middle of all [m], of a size that the engines follow."""
        out = 2.0 * float(np.max(np.abs(places - places.mean())))
        if 0.0 < out and not SMALLEST <= out <= LARGEST:
            raise MechlabError(
                f"synthesize {self.task}: x, y: the points extend over {out:.3g} m; an engine leads what is found, from {SMALLEST:g} to "
                f"{LARGEST:g} m. Are the lengths in metres?"
            )
        return out

    def ratio(self, key: str) -> Fraction:
        """An exact ratio."""
        return as_fraction(self._raw(key, None, "a ratio such as 6 or 17/3"), f"synthesize {self.task}: {key}")

    def integer(self, key: str, default: int | None, low: int, high: int) -> int:
        """A whole number from low to high."""
        value = self.number(key, "", default)
        if value != int(value) or not low <= value <= high:
            raise MechlabError(
                f"synthesize {self.task}: {key}: expected a whole number from {low} to {high}, got {value:g}."
            )
        return int(value)

    def teeth(self, key: str, default: range) -> tuple[int, ...]:
        """Tooth counts of a number, a list, low:high (every whole number), or low:high:n (n evenly spaced numbers).

        Raises MechlabError for a count that is not a whole number from 1 to MOST_TEETH.
        """
        value = self._raw(key, default, "low:high")
        if isinstance(value, Range):
            low, high = self._whole(key, value.low), self._whole(key, value.high)
            if low > high:
                raise MechlabError(f"synthesize {self.task}: {key}: expected low:high with low <= high, got {value}.")
            return tuple(range(low, high + 1) if value.count is None else (self._whole(key, x) for x in value.points()))
        many = value if hasattr(value, "__iter__") and not isinstance(value, str) else (value,)
        return tuple(self._whole(key, x) for x in many)

    def _whole(self, key: str, value: Any) -> int:
        try:
            out = float(value)
        except (TypeError, ValueError):
            out = math.nan
        if not (1 <= out <= MOST_TEETH and out == int(out)):
            raise MechlabError(
                f"synthesize {self.task}: {key}: expected whole numbers of teeth from 1 to {MOST_TEETH}, got {value!r}."
            )
        return int(out)
