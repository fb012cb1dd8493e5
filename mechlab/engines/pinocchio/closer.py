"""The closure equations of a mechanism with given targets on Pinocchio: residual, Jacobian, assembly mode."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.pinocchio.constraints import PinConstraints
from mechlab.engines.pinocchio.kinematics import PinKinematics
from mechlab.engines.pinocchio.quantities import Quantities, interpolate
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.followed_mode import same_sign
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kept import LastKept
from mechlab.mechanism.kinematics import integrate
from mechlab.mechanism.many_rows import NewtonSteps, held_rows
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.structure import generic, independent_rows, rows_repeat

NEAR = 0.05
"""Moves smaller than this [rad or m] stay in one assembly mode."""


class Closer:
    """The closure equations of a mechanism with given targets; keeps its workspace for many solutions."""

    def __init__(self, mechanism: Mechanism, names: Sequence[str]) -> None:
        self.mechanism = mechanism
        self.kin = PinKinematics(mechanism)
        self.constraints = PinConstraints(self.kin)
        self.quantities = Quantities(self.kin, list(names))
        self.names = tuple(names)

    def evaluate(self, q: Array, targets: Sequence[ArrayLike]) -> tuple[Array, Array]:
        """(m,) residual and (m, nv) Jacobian of closure and targets."""
        self.kin.set(q)
        residual, jacobian, _ = self.constraints.evaluate()
        if not self.names:
            return residual, jacobian
        off = self.quantities.differences(targets)
        return np.concatenate([residual, off]), np.concatenate([jacobian, self.quantities.jacobian()])

    def residual(self, q: Array, targets: Sequence[ArrayLike]) -> Array:
        """(m,) the residual of `evaluate`."""
        self.kin.set(q)
        residual = self.constraints.residual()
        return np.concatenate([residual, self.quantities.differences(targets)]) if self.names else residual

    def start(self, q: Array) -> Array:
        """The coordinates in which the equations are solved: q (nq,) itself."""
        return q

    coordinates = start

    @cached_property
    def newton_steps(self) -> NewtonSteps:
        """The steps of these equations, from the rows at a generic pose."""
        return NewtonSteps(self._rows(generic(self.mechanism)[0]), held_rows(self.mechanism, self.names), len(self.constraints))

    def values(self, q: Array) -> list[Array | float]:
        """Present values of the targets."""
        self.kin.set(q)
        return [self.quantities.value(i) for i in self.quantities.items]

    def same_mode(self, before: Array, after: Array) -> bool:
        """False when the determinant of [closure; targets; local freedoms] has another sign at two poses: between them
        lies a position where two modes meet. True too when the sign cannot tell (the matrix is not square)."""
        if float(np.max(np.abs(before - after), initial=0.0)) < NEAR:
            return True
        if not rows_repeat(self.mechanism):
            a, b = self._mode(before), self._mode(after)
            return a == 0.0 or b == 0.0 or a == b
        self.kin.set(after)
        there = self.constraints.evaluate()[1].copy()
        self.kin.set(before)
        here = self.constraints.evaluate()[1]
        return same_sign(here, there, np.concatenate([self.quantities.jacobian(), self._local]))

    def _mode(self, q: Array) -> float:
        self.kin.set(q)
        jacobian = self.constraints.evaluate()[1]
        matrix = np.concatenate([jacobian[self._independent], self.quantities.jacobian(), self._local])
        if matrix.shape[0] != matrix.shape[1]:
            return 0.0
        sign, size = np.linalg.slogdet(matrix)
        return float(sign) if size > -60 else 0.0

    @cached_property
    def _independent(self) -> list[int]:
        return independent_rows(self.mechanism, ConstraintSet(self.mechanism))

    @cached_property
    def _local(self) -> Array:
        """Rows that hold the local freedoms, where the targets do not."""
        return held_rows(self.mechanism, self.names)

    def smallest(self, q: Array) -> float:
        """Smallest singular value of the equations at q that is not zero everywhere: 0 at a singular position.

        Rows are scaled by their size at a generic pose, because at a singular q a row itself may vanish.
        """
        scale, rank = self._generic
        if not rank:
            return 1.0
        return float(np.linalg.svd(self._rows(q) / scale, compute_uv=False)[rank - 1])

    @cached_property
    def _generic(self) -> tuple[Array, int]:
        """(m, 1) largest size of each row, and largest rank, at the reference and a generic pose near it."""
        matrices = [self._rows(x) for x in (self.mechanism.reference(), generic(self.mechanism)[0])]
        norms = np.max([np.linalg.norm(x, axis=1) for x in matrices], axis=0)
        scale = np.where(norms > 1e-12, norms, 1.0)[:, None]
        values = [np.linalg.svd(x / scale, compute_uv=False) for x in matrices if x.size]
        return scale, max((int(np.count_nonzero(x > 1e-9 * x[0])) for x in values), default=0)

    def _rows(self, q: Array) -> Array:
        self.kin.set(q)
        return np.concatenate([self.constraints.evaluate()[1], self.quantities.jacobian()])

    def row_names(self) -> list[str]:
        """A name for each residual."""
        return list(self.constraints.rows) + [i.name for i in self.quantities.items for _ in range(i.rows)]

    def step(self, q: Array, dv: Array) -> Array:
        """q moved by dv."""
        return integrate(self.mechanism, q, dv)


_KEPT = LastKept()


def kept_closer(mechanism: Mechanism, names: tuple[str, ...]) -> Closer:
    """A Closer for these targets; the last few of each thread are kept, by identity of the mechanism."""
    return _KEPT.get(Closer, mechanism, names)


def path(
    closer: Closer, begin: Sequence[Array | float], targets: Sequence[ArrayLike]
) -> Callable[[Array, float], tuple[Array, Array]]:
    """Equations r(q, s) on the way from the values `begin` (s = 0) to the targets (s = 1)."""
    items = closer.quantities.items

    def evaluate(x: Array, s: float) -> tuple[Array, Array]:
        wanted = [interpolate(i, a, b, s) for i, a, b in zip(items, begin, targets, strict=True)]
        return closer.evaluate(x, wanted)

    return evaluate
