"""Rates, accelerations and forces of a witness at its state, from its own mass matrix and constraint rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mechlab.catalog.delta6.witnesses import Witness
from mechlab.experiment.laws import drive_forces
from mechlab.mechanism.geometry import Array


def response(witness: Witness, given: Sequence[str]) -> Array:
    """(nv, k) rates of everything per unit rate of each joint or shaft in `given`, by the constraint Jacobian.

    The smallest rates where local freedoms remain.
    """
    jacobian = witness.jacobian()
    rows = np.array([witness.mechanism.row(name) for name in given])
    right = np.vstack([np.zeros((len(jacobian), len(rows))), np.eye(len(rows))])
    return np.asarray(np.linalg.lstsq(np.vstack([jacobian, rows]), right, rcond=1e-11)[0])


def accelerations(witness: Witness, given: Sequence[str], values: ArrayLike) -> Array:
    """(nv,) accelerations that keep the constraints and give the joints or shafts in `given` theirs."""
    rows = np.array([witness.mechanism.row(name) for name in given])
    matrix = np.vstack([witness.jacobian(), rows])
    right = np.concatenate([-witness.constraint_bias(), np.asarray(values, dtype=float)])
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-11)[0])


def forces(witness: Witness, given: Sequence[str], values: ArrayLike, drives: tuple[str, ...]) -> Array:
    """(drives,) forces that give the joints or shafts in `given` these accelerations in the present state."""
    rows = np.array([witness.mechanism.row(name) for name in given])
    return drive_forces(witness, rows, np.asarray(values, dtype=float), drives)
