"""A mechanism at poses that close all its loops: the motions that are left, the way back, the distance from singularity.

It is computed in the size of the mechanism as unit of length, so that 1 rad counts as much as one size.

Distances from singularity, each a singular value at its usual rank, rows divided by their norm at a usual pose:

    closure   of the rows J of loops and relations: 0 where the mechanism gains a freedom or changes its mode
    drives    of [J; rows of the drives]: 0 where it moves with all drives held (parallel singularity)
    targets   of the rows of the targets on the null space of J: 0 where a target cannot be moved (serial singularity)
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mechlab.engines.protocol import available, engine
from mechlab.mechanism.geometry import Array, quaternion_product, quaternion_to_matrix, rotation_log
from mechlab.mechanism.kinematics import integrate
from mechlab.mechanism.length_unit import coordinate_units, in_unit_of_length
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly, newton
from mechlab.mechanism.structure import generic, rank

LEAST_TARGET = 1e-6
"""Singular values of the targets below this count as 0 at a usual pose."""
DIFFERENCE = 1e-6
"""Step of the difference quotient of a distance [1]: its error is about 1e-10."""


def usual_engine() -> str:
    """Pinocchio, or the tree of numpy where it is not installed."""
    return "pinocchio" if not available("pinocchio") else "numpy"


def unit_near(size: float) -> float:
    """The power of two nearest to the size of a mechanism [m], 1 for none: its lengths keep all their digits in that unit."""
    return 2.0 ** round(math.log2(size)) if size > 0 else 1.0


class Closed:
    """A mechanism on its closed poses. `set(q)`, then ask; all lengths in `unit` [m].

    basis (nv, f): orthonormal motions that loops and relations leave; rows (rows, nv): their Jacobian, scaled.
    """

    def __init__(self, mechanism: Mechanism, engine_name: str) -> None:
        self.unit = unit_near(mechanism.size)
        self.m = in_unit_of_length(mechanism, self.unit)
        self.coordinate_units = coordinate_units(mechanism, self.unit)
        self.rate_units = np.array(
            [self.unit if j.kind == "prismatic" else 1.0 for j in mechanism.joints for _ in range(j.nv)]
        )
        self.plant = engine(engine_name).plant(self.m)
        self.usual_pose, usual = generic(self.m)
        sizes = np.linalg.norm(usual, axis=1)
        self._scale = np.where(sizes > 1e-14, sizes, 1.0)[:, None]
        self._rank = rank(usual)
        self._drives = np.array([self.m.row(d.on) for d in self.m.drives]).reshape(-1, self.m.nv)
        self._driven = rank(np.vstack([usual, self._drives]))
        self.target_rows: Callable[[], Array] = lambda: np.zeros((0, self.m.nv))
        self.target_rank = 0
        self.set(self.m.reference())

    @property
    def freedoms(self) -> int:
        """Degrees of freedom at a usual pose."""
        return self.m.nv - self._rank

    @property
    def undriven(self) -> int:
        """Degrees of freedom that are left with all drives held."""
        return self.m.nv - self._driven

    def set(self, q: Array) -> Closed:
        """Move to coordinates q (nq,)."""
        self.q = q
        self.plant.set(q)
        self._decomposition: tuple[Array, Array] | None = None
        return self

    def _svd(self) -> tuple[Array, Array]:
        """Singular values of the scaled rows, and the orthonormal motions, those that are left last."""
        if self._decomposition is None:
            if len(self._scale):
                _, values, right = np.linalg.svd(self.rows)
            else:
                values, right = np.zeros(0), np.eye(self.m.nv)
            self._decomposition = values, right
        return self._decomposition

    @property
    def rows(self) -> Array:
        """(rows, nv) Jacobian of loops and relations, each row of unit size at a usual pose."""
        return self.plant.closing()[1] / self._scale

    @property
    def basis(self) -> Array:
        """(nv, f) orthonormal basis of the motions that loops and relations leave."""
        return self._svd()[1][self._rank :].T

    def close(self, q: Array) -> Assembly:
        """The closed pose nearest to q by Newton, to rounding."""
        if not len(self._scale):
            return newton(lambda x: (np.zeros(0), np.zeros((0, self.m.nv))), self.moved, q)

        def evaluate(x: Array) -> tuple[Array, Array]:
            residual, rows, _ = self.set(x).plant.closing()
            return residual, rows

        return newton(evaluate, self.moved, q)

    @property
    def gap(self) -> float:
        """Largest residual of loops and relations, in sizes of the mechanism and rad."""
        return float(np.max(np.abs(self.plant.closing()[0]), initial=0.0))

    def moved(self, q: Array, dv: Array) -> Array:
        """Coordinates after a displacement dv (nv,)."""
        return integrate(self.m, q, dv)

    def between(self, a: Array, b: Array) -> Array:
        """(nv,) displacement from coordinates a to b: the inverse of `moved`."""
        if self.m.nq == self.m.nv:
            return b - a
        out = np.empty(self.m.nv)
        for joint in self.m.joints:
            qs, vs = self.m.q_slice[joint.name], self.m.v_slice[joint.name]
            if joint.kind == "spherical":
                turn = quaternion_product(a[qs] * [1.0, -1.0, -1.0, -1.0], b[qs])
                out[vs] = rotation_log(quaternion_to_matrix(turn))
            else:
                out[vs] = b[qs] - a[qs]
        return out

    def distance(self, of: str) -> float:
        """Distance from singularity of the present pose, 1 where there are no such rows; see the head of this file."""
        if of == "closure":
            return float(self._svd()[0][self._rank - 1]) if self._rank else 1.0
        if of == "drives":
            if not len(self._drives):
                return 1.0
            values = np.linalg.svd(np.vstack([self.rows, self._drives]), compute_uv=False)
            return float(values[self._driven - 1])
        if not self.target_rank:
            return 1.0
        return float(np.linalg.svd(self.target_rows() @ self.basis, compute_uv=False)[self.target_rank - 1])

    def aim(self, rows: Callable[[], Array]) -> None:
        """Take the function that gives the rows of the targets at the present pose, and learn their usual rank."""
        self.target_rows = rows
        here = self.q
        self.set(self.usual_pose)
        self.target_rank = int(np.sum(np.linalg.svd(rows() @ self.basis, compute_uv=False) > LEAST_TARGET))
        self.set(here)
