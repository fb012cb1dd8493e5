"""What a block gives: numbers, how each point went, and sentences for those that went wrong."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mechlab.errors import EngineMissing, MechlabError, user_fault
from mechlab.mechanism.geometry import Array

GOOD, BAD_INPUT, UNTRUSTED, NO_SOLUTION = 0, 1, 3, 4
"""How a point went; the numbers are those of exit codes."""
LONGEST = 300
"""Characters of a sentence that are kept."""


@dataclass
class Block:
    """values (m, quantities), NaN where there is none; outcomes (m,); reasons: point in the block -> sentence."""

    values: Array
    outcomes: np.ndarray
    reasons: dict[int, str]

    @classmethod
    def empty(cls, points: int, quantities: int) -> Block:
        """All gaps without reason."""
        return cls(np.full((points, quantities), np.nan), np.zeros(points, dtype=np.int8), {})

    def gap(self, points: Any, outcome: int, reason: str) -> None:
        """Points (an index or indices) have no numbers, and why."""
        self.outcomes[points] = outcome
        sentence = " ".join(reason.split())
        short = sentence if len(sentence) <= LONGEST else f"{sentence[: LONGEST - 3]}..."
        self.reasons |= dict.fromkeys(np.atleast_1d(points).tolist(), short)

    def failed(self, points: Any, cause: BaseException) -> None:
        """Points that raised. A missing engine is nothing that other points could do better: it is raised again."""
        if isinstance(cause, EngineMissing):
            raise cause
        if isinstance(cause, MechlabError):
            self.gap(points, cause.exit_code, str(cause))
        elif (fault := user_fault(cause)) is not None:
            self.gap(points, BAD_INPUT, fault)
        else:
            self.gap(points, UNTRUSTED, f"internal error: {type(cause).__name__}: {cause}")
