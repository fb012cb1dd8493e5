"""A check of several quantities, each with its own limit: differences are told in units of the limit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mechlab.experiment.entry import CheckResult


@dataclass(frozen=True)
class Quantity:
    """One quantity: what each witness says, the truth they are held to (None: the first witness), the absolute limit."""

    what: str
    limit: float
    said: Mapping[str, ArrayLike]
    expected: ArrayLike | None = None

    def differences(self) -> dict[str, float]:
        """Largest absolute difference of each witness; infinite for a value that is missing, not finite, or of another
        shape, and when there is nothing to compare with."""
        if not self.said or (self.expected is None and len(self.said) < 2):
            return dict.fromkeys(self.said or {self.what: 0}, float("inf"))
        first = next(iter(self.said.values()))
        truth = np.asarray(first if self.expected is None else self.expected, dtype=float)
        held = [k for i, k in enumerate(self.said) if i or self.expected is not None]
        return {k: _difference(np.asarray(self.said[k], dtype=float), truth) for k in held}


def _difference(value: np.ndarray, truth: np.ndarray) -> float:
    if value.shape != truth.shape or not np.all(np.isfinite(value)):
        return float("inf")
    return float(np.max(np.abs(value - truth), initial=0.0))


def graded(*quantities: Quantity, note: str = "") -> CheckResult:
    """A CheckResult that passes when every witness keeps every limit. Its values are the worst difference of each witness
    in units of the limit (so the tolerance is 1); its note tells every difference as measured."""
    worst: dict[str, float] = {}
    told = []
    for q in quantities:
        found = q.differences()
        for witness, size in found.items():
            worst[witness] = max(worst.get(witness, 0.0), size / q.limit)
        told.append(f"{q.what}: {', '.join(f'{k} {v:.2g}' for k, v in found.items())} (limit {q.limit:.2g})")
    text = "; ".join(told + ([note] if note else []))
    return CheckResult(worst, 1.0, 0.0, f"differences in units of each limit. {text}")
