"""The closed differential as Pinocchio and MuJoCo know it: mass matrix and constraint rows of their own, and what follows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mechlab.catalog.closed_differential.build import MESHES, build
from mechlab.catalog.closed_differential.parameters import Parameters
from mechlab.errors import NoSolution
from mechlab.kit.witness import room
from mechlab.mechanism import ConstraintSet, Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import null_space

ENGINES = ("pinocchio", "mujoco")
SPEEDS = {
    "w_H1": "H1", "w_H2": "H2", "w1": "block_14", "w3": "block_36", "w2": "planet_2_spin", "w5": "planet_5_spin",
}  # fmt: skip
"""Names of speeds -> joint or shaft."""


@dataclass(frozen=True)
class Machine:
    """Mass matrix (nv, nv) and rows (relations, nv) of an engine at rest in the reference pose; both are constant."""

    engine: str
    mechanism: Mechanism
    mass: Array
    rows: Array

    def row(self, speed: str) -> Array:
        """(nv,) coefficients of a speed by its short name, or of a joint or shaft."""
        return self.mechanism.row(SPEEDS.get(speed, speed))

    @property
    def free(self) -> Array:
        """(nv, freedoms) basis of the motions that the rows allow."""
        return null_space(self.rows)

    def rates(self, given: Mapping[str, float]) -> Array:
        """(nv,) rates from as many given speeds as freedoms; raises NoSolution when they do not fix the motion."""
        return self.fit(np.array([self.row(name) for name in given]), np.array(list(given.values()), dtype=float))

    def fit(self, rows: Array, values: Array) -> Array:
        """(nv,) allowed rates with rows @ rates = values."""
        reduced = rows @ self.free
        if reduced.shape[0] != reduced.shape[1] or np.linalg.cond(reduced) > 1e10:
            raise NoSolution(f"{self.mechanism.name}: these quantities do not fix the two freedoms of the train.")
        return np.asarray(self.free @ np.linalg.solve(reduced, values))

    def applied(self, **moments: float) -> Array:
        """(nv,) generalised force of moments on speeds or joints or shafts by name."""
        return np.asarray(sum((f * self.row(name) for name, f in moments.items()), np.zeros(self.mechanism.nv)))

    def accelerations(self, applied: Array) -> Array:
        """(nv,) accelerations under a generalised force (nv,)."""
        free = self.free
        return np.asarray(free @ np.linalg.solve(free.T @ self.mass @ free, free.T @ applied))

    def balance(self, applied: Array, holders: Sequence[str]) -> tuple[Array, dict[str, float]]:
        """Moments (holders,) that keep the train in equilibrium, and the load of each relation by name."""
        rows = np.array([self.row(name) for name in holders])
        matrix = np.vstack([rows, self.rows]).T
        found = np.linalg.lstsq(matrix, -applied, rcond=1e-12)[0]
        loads = found[len(rows) :].tolist()
        return found[: len(rows)], dict(zip([r.name for r in self.mechanism.relations], loads, strict=True))

    def loads(self, applied: Array, accelerations: Array) -> dict[str, float]:
        """Load of each relation in an accelerated motion: M a = applied + J^T load."""
        found = np.linalg.lstsq(self.rows.T, self.mass @ accelerations - applied, rcond=1e-12)[0]
        return dict(zip([r.name for r in self.mechanism.relations], found.tolist(), strict=True))


def mesh_sums(loads: Mapping[str, float]) -> dict[str, float]:
    """Moments on the wheels 1, 3, 4, 6 from all planets: `MESHES` -> sum of the loads."""
    return {mesh: sum(f for name, f in loads.items() if name.startswith(f"{mesh}_")) for mesh in MESHES}


@lru_cache(maxsize=64)
def machine(engine: str, p: Parameters, fidelity: str) -> Machine:
    """The machine of an engine; raises EngineMissing when it is not installed."""
    m = build(p, fidelity)
    if engine == "pinocchio":
        plant = room(engine).PinPlant(m)
        order = [plant.constraints.slices[r.name].start for r in m.relations]
        return Machine(engine, m, plant.mass_matrix().copy(), plant.jacobian()[order].copy())
    simulate = room(engine)
    model, data = simulate.to_mujoco(m)
    view = simulate.MujocoMap(m, model)
    plant = simulate.MujocoPlant(m, model, data, view)
    order = [view.equalities[r.name][0] for r in m.relations]
    ranks = np.argsort(np.argsort(order)) if order else np.zeros(0, dtype=int)
    return Machine(engine, m, plant.mass_matrix().copy(), plant.jacobian()[ranks].copy())


def numpy_machine(p: Parameters, fidelity: str) -> Machine:
    """The same from the numpy tree, for the checks and the predicted lag."""
    from mechlab.mechanism import TreeKinematics

    m = build(p, fidelity)
    tree = TreeKinematics(m)
    return Machine("numpy", m, tree.mass_matrix(), ConstraintSet(m).jacobian(tree))
