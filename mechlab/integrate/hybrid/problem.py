"""What is integrated: equations with dry friction, as functions of time, state and the modes of the friction elements."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Modes = tuple[int, ...]
"""One number for each friction element: +1 or -1 sliding that way, 0 stuck."""


class RoughProblem(Protocol):
    """Equations with dry friction: functions of (t, state) and the modes only."""

    limits: Array
    """(k,) largest friction forces, > 0."""
    rates: Array
    """(k, n) rows: the rate of element i is rates[i] @ y."""

    def slope(self, t: float, y: Array, modes: Modes) -> Array:
        """(n,) dy/dt in these modes."""
        ...

    def holding(self, t: float, y: Array, modes: Modes) -> Array:
        """(k,) friction forces: of stuck elements what keeps them still, of the others -mode limit."""
        ...

    def settle(self, t: float, y: Array, modes: Modes) -> Array:
        """The state with the rates of stuck elements exactly zero."""
        ...
