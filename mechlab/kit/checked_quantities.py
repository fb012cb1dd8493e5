"""A check of several quantities, each with its own limit: differences are reported in units of the limit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from mechlab.experiment.entry import CheckResult
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array


@dataclass(frozen=True)
class CheckedQuantity:
    """One quantity with its absolute limit, witness -> value, and the expected value (None: that of the first
    witness)."""

    what: str
    limit: float
    values: Mapping[str, ArrayLike]
    expected: ArrayLike | None = None

    def differences(self) -> dict[str, float]:
        """Witness -> largest absolute difference; infinite for a value that is not finite or of another shape, and when
        there is nothing to compare with."""
        if not self.values or (self.expected is None and len(self.values) < 2):
            return dict.fromkeys(self.values or {self.what: 0}, float("inf"))
        first, *others = self.values
        reference = np.asarray(self.values[first] if self.expected is None else self.expected, dtype=float)
        compared = others if self.expected is None else self.values
        return {k: _difference(np.asarray(self.values[k], dtype=float), reference) for k in compared}


def _difference(value: Array, reference: Array) -> float:
    if value.shape != reference.shape or not np.all(np.isfinite(value)):
        return float("inf")
    return float(np.max(np.abs(value - reference), initial=0.0))


def check_quantities(*quantities: CheckedQuantity, note: str = "") -> CheckResult:
    """A CheckResult that passes when every witness is within every limit. Its values are the largest difference of each
    witness divided by the limit, so its tolerance is 1; its note lists all differences."""
    worst: dict[str, float] = {}
    sentences = []
    for q in quantities:
        found = q.differences()
        for witness, size in found.items():
            worst[witness] = max(worst.get(witness, 0.0), size / q.limit)
        sentences.append(f"{q.what}: {', '.join(f'{k} {v:.2g}' for k, v in found.items())} (limit {q.limit:.2g})")
    text = "; ".join(sentences + ([note] if note else []))
    return CheckResult(worst, 1.0, 0.0, f"differences in units of each limit. {text}")
