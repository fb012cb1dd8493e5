"""What a motion found as a whole, not step by step, can be asked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from mechlab.mechanism.geometry import Array


@dataclass(frozen=True)
class States:
    """q, v, a (n, nv) at asked times; a where it was asked for."""

    q: Array
    v: Array
    a: Array | None


class Motion(Protocol):
    """A motion at any times of its scene."""

    def states(self, t: Array, accelerations: bool = False) -> States:
        """The motion at times t (n,)."""
        ...

    def cruder(self) -> Motion:
        """The same motion as less work, or other rounding, gives it: what the error is estimated from."""
        ...
