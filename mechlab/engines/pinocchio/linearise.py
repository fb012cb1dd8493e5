"""What small motions about a rest need, from Pinocchio: closed poses, forces, constraint rows and mass matrix."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.pinocchio.dynamics import PinPlant
from mechlab.experiment.laws import Law, applied_force
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import integrate
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly, newton


class PinSmallMotions:
    """A mechanism under laws, held still at time 0; implements `mechlab.studies.modes.eigen.Dynamics` on Pinocchio.

    A pose x is the Mechanism's coordinates (nq,); displacements and rates have its nv entries.
    """

    def __init__(self, mechanism: Mechanism, laws: tuple[Law, ...] = ()) -> None:
        self.mechanism, self.laws = mechanism, laws
        self.plant = PinPlant(mechanism)
        self.nv = mechanism.nv

    def pose(self, q: ArrayLike) -> Array:
        """(nq,) the pose of coordinates q (nq,)."""
        return np.array(q, dtype=float)

    def coordinates(self, x: Array) -> Array:
        """(nq,) coordinates of a pose."""
        return x

    def rates(self, basis: Array) -> Array:
        """(nv, k) columns in the order of the Mechanism's rates."""
        return basis

    def moved(self, x: Array, dv: Array) -> Array:
        """The pose after the displacement dv (nv,), not closed again."""
        return integrate(self.mechanism, x, dv)

    def closed(self, x: Array) -> Assembly:
        """The nearest pose in which all loops and relations are closed: Newton with the smallest steps."""
        return newton(lambda q: (self.plant.set(q).residual(), self.plant.jacobian()), self.moved, x)

    def rows(self, x: Array) -> Array:
        """(rows, nv) constraint Jacobian."""
        return self.plant.set(x).jacobian()

    def mass(self, x: Array) -> Array:
        """(nv, nv) mass matrix, armatures and shafts included."""
        return self.plant.set(x).mass_matrix()

    def force(self, x: Array, v: Array | None = None) -> Array:
        """(nv,) g of M a + g = J^T reactions: weight, springs, dampers, velocity terms, less the laws."""
        plant = self.plant.set(x, np.zeros(self.nv) if v is None else v)
        return plant.bias() - applied_force(self.mechanism, self.laws, 0.0, plant)[0]
