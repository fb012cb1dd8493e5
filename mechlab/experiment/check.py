"""Checks and claims as data: what is measured, what is expected, what a source says, and the verdict."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Measured:
    """What the witnesses of a check found. `values` witness -> number or array; `expected` the truth they are held to,
    or None when they are held to each other; `tolerance` absolute. The check passes when all agree."""

    values: dict[str, Any]
    tolerance: float
    expected: Any = None
    note: str = ""

    @property
    def difference(self) -> float:
        """Largest absolute difference; infinite when a value is missing, not finite, or of another shape."""
        if not self.values or (self.expected is None and len(self.values) < 2):
            return float("inf")
        arrays = {k: np.asarray(v, dtype=float) for k, v in self.values.items()}
        reference = np.asarray(self.expected, dtype=float) if self.expected is not None else next(iter(arrays.values()))
        worst = 0.0
        for array in arrays.values():
            if array.shape != reference.shape or not np.all(np.isfinite(array)):
                return float("inf")
            worst = max(worst, float(np.max(np.abs(array - reference), initial=0.0)))
        return worst

    @property
    def passed(self) -> bool:
        """True when the difference is within the tolerance."""
        return self.difference <= self.tolerance


@dataclass(frozen=True)
class Check:
    """A named check of a mechanism: `run(parameters) -> Measured`. `source` says where the expected value comes from."""

    id: str
    text: str
    run: Callable[[Any], Measured]
    source: str = ""
    slow: bool = False


class Verdict(Enum):
    """The verdict on a printed statement."""

    HOLDS = "holds"
    HOLDS_ONLY_IF = "holds only if"
    MISPRINT = "misprint, correct is"
    FAILS = "fails"
    CANNOT = "cannot be checked"


@dataclass(frozen=True)
class Finding:
    """What testing a claim gave: numbers by witness, the verdict, and its completion in words."""

    computed: dict[str, Any]
    verdict: Verdict
    because: str = ""

    @property
    def sentence(self) -> str:
        """The verdict as a sentence."""
        if not self.because:
            return self.verdict.value
        joint = " " if self.verdict in (Verdict.HOLDS_ONLY_IF, Verdict.MISPRINT) else ": "
        return f"{self.verdict.value}{joint}{self.because}"


@dataclass(frozen=True)
class Claim:
    """A printed statement of a source. `printed` is the number or sentence as printed; `test()` computes it anew."""

    id: str
    where: str
    text: str
    printed: Any
    test: Callable[[], Finding]
    source: str = ""
    tags: tuple[str, ...] = field(default=())
