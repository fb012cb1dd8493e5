"""What a timed run gives: states at evenly spaced output times, and the CPU time of stepping alone."""

from __future__ import annotations

from dataclasses import dataclass

from mechlab.mechanism.geometry import Array


@dataclass(frozen=True)
class Trace:
    """q (n, nq), v (n, nv) of the mechanism at the first n of the output times; cpu_s: process CPU time of stepping,
    setting up excluded; `reason`: why it ended early, empty when it reached the end; `evaluations` of the equations of
    motion, 0 where the engine does not count them."""

    q: Array
    v: Array
    cpu_s: float
    steps: int
    reason: str = ""
    evaluations: int = 0

    @property
    def complete(self) -> bool:
        """True when the end was reached."""
        return not self.reason
