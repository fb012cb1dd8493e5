"""Bodies carried by a link: their origin, and their direction as an arrow of a given length, as one curve with exact derivatives.

    P,    L e^(i s / L) v

v is the direction of the link that carries the point P (`curves`, `sixbar`), s / L the angle of the body against it, L the arm by which an
error of angle counts. A row has one number more than that of its linkage, s, a length as the others are.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.path_synthesis.curves import Array, Complex, LinkCurve, Traced
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Positions:
    """Points (..., n, 2) of a body: its origin and its arrow; what its linkage does."""

    base: Traced
    point: Complex
    turn: Complex
    margin: Array


@dataclass(frozen=True)
class GuidedBody:
    """Bodies on the links of a kind of linkage as a `Curve`. arm: L [m]."""

    base: LinkCurve
    arm: float

    @property
    def lengths(self) -> tuple[int, ...]:
        """Those of the linkage."""
        return self.base.lengths

    @property
    def pivots(self) -> tuple[int, ...]:
        """Those of the linkage."""
        return self.base.pivots

    def scaled(self, scale: float) -> GuidedBody:
        """The linkage with an arm in its scale."""
        return GuidedBody(self.base, scale * self.arm)

    @property
    def ratio(self) -> float:
        """That of the linkage."""
        return self.base.ratio

    @cached_property
    def free(self) -> NDArray[np.int_]:
        """Those of the linkage, and s."""
        return np.append(self.base.free, -1)

    def points(self, x: Array, mode: Array, t: Array) -> Positions:
        """Rows (..., m + 1), modes (...), crank angles (..., n) -> the points; NaN where a linkage does not assemble."""
        found = self.base.points(x[..., :-1], mode, t)
        arrow = self.arm * np.exp(1j * x[..., -1, None] / self.arm) * found.turn
        return Positions(found, np.stack([found.point, arrow], axis=-1), found.turn, found.margin)

    def slopes(self, x: Array, found: Any, t: Array) -> tuple[Complex, Complex]:
        """Derivatives by the numbers of a row, (..., n, 2, m + 1), and by the crank angle, (..., n, 2)."""
        by_size, by_angle = self.base.slopes(x[..., :-1], found.base, t)
        _, spin, _, spin_rate = self.base.spins(x[..., :-1], found.base, t)
        arrow = found.point[..., 1]
        out = np.zeros((*by_angle.shape, 2, x.shape[-1]), dtype=complex)
        out[..., 0, :-1] = by_size
        out[..., 1, :-1] = (1j * arrow)[..., None] * spin
        out[..., 1, -1] = 1j * arrow / self.arm
        return out, np.stack([by_angle, 1j * arrow * spin_rate], axis=-1)

    def widest(self, x: Array) -> Array:
        """That of the linkage."""
        return self.base.widest(x[..., :-1])

    def aligned(self, rows: Array, modes: Array, t: Array, arrows: Complex) -> Array:
        """Rows (k, m + 1) of linkages (k, m): s by least squares at crank angles (k, n), for arrows (n,) that are wanted."""
        turn = self.base.points(rows, modes, t).turn
        return np.column_stack([rows, self.arm * np.angle(turn.conj() @ arrows)])


def missed_arrows(turn: Complex, arrows: Complex) -> Array:
    """Sum of squares (...) that arrows (n,) leave when a body is fixed to a link with the directions (..., n) as it suits them best."""
    square = np.abs(arrows) ** 2
    return np.asarray(2.0 * (np.sum(square) - np.sqrt(square[0]) * np.abs(turn.conj() @ arrows)))
