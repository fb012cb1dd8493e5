"""A train of gears: its Mechanism with the roles of all meshes, and the load cases that the keys of a question describe."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from mechlab.analytic.power_flow import TrainMesh
from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.question import Answer
from mechlab.lab.design import Design
from mechlab.lab.gear_trains import ETA, FORCE, RATE
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import GROUND, Mechanism
from mechlab.mechanism.angle_basis import AngleBasis, dependent_angles
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.mesh_roles import MeshRoles, mesh_roles


def train_mechanism(design: Design) -> Mechanism | None:
    """The mechanism at the cheapest fidelity that consists of gear relations alone; None without one."""
    for level in design.entry.fidelities:
        if level != "kinematic":
            m = design.mechanism(level)
            if m.relations and not m.loops and not m.curves:
                return m
    return None


@dataclass(frozen=True)
class GearTrain:
    """A Mechanism of gears, with what its power flow needs: the roles of all meshes, and the exact basis of its rates."""

    mechanism: Mechanism
    roles: tuple[MeshRoles, ...]
    basis: AngleBasis

    @property
    def members(self) -> tuple[str, ...]:
        """Bodies, the ground first."""
        return (GROUND, *(b.name for b in self.mechanism.bodies))

    @property
    def meshes(self) -> tuple[TrainMesh, ...]:
        """The meshes for the closed form."""
        at = {n: k for k, n in enumerate(self.members)}
        return tuple(
            TrainMesh(at[r.a], at[r.b], at[r.carrier], r.alpha, r.beta, r.rate_a, r.rate_b, r.total_a, r.total_b)
            for r in self.roles
        )

    @property
    def terminals(self) -> tuple[str, ...]:
        """Where an external torque may act without being given: joints on the ground, and joints or shafts with a drive."""
        grounded = [j.name for b in self.mechanism.bodies if b.parent == GROUND for j in b.joints]
        return tuple(dict.fromkeys([*grounded, *(d.on for d in self.mechanism.drives)]))


@lru_cache(maxsize=32)
def gear_train(m: Mechanism) -> GearTrain:
    """The train of a Mechanism. Raises MechlabError when its constraints are not all meshes of gears."""
    if not m.relations:
        raise MechlabError(f"{m.name}: it has no gear relations, so there is no power flow to find.")
    basis = dependent_angles(m)
    return GearTrain(m, tuple(mesh_roles(m, r) for r in m.relations), basis)


@dataclass(frozen=True)
class LoadCase:
    """Joint rates (nv,) [rad/s], mesh efficiencies (m,), given torques [N m]; open: members whose torque is to be found; free: members
    on which no torque acts."""

    rates: Array
    eta: Array
    given: dict[str, float]
    open: tuple[str, ...]
    free: tuple[str, ...]


def load_case(t: GearTrain, given: Mapping[str, float]) -> LoadCase:
    """The load case that the keys X_rate, X_force, efficiency and MESH_efficiency describe. Raises MechlabError for too few of them."""
    m = t.mechanism
    forces = {k.removesuffix(FORCE): float(x) for k, x in given.items() if k.endswith(FORCE)}
    rates = _rates(t, {k.removesuffix(RATE): float(x) for k, x in given.items() if k.endswith(RATE)})
    common = float(given.get(ETA, 1.0))
    eta = np.array([float(given.get(f"{r.name}_{ETA}", common)) for r in t.roles])
    if np.any(eta <= 0.0) or np.any(eta > 1.0):
        raise MechlabError(
            f"{m.name}: efficiency: expected numbers above 0 and up to 1, got {sorted(set(eta.tolist()))}."
        )
    if not any(forces.values()):
        raise MechlabError(
            f"{m.name}: give a torque other than 0, for example {t.terminals[0]}{FORCE}=1 [N m]; "
            f"members: {', '.join(m.scalar_names)}."
        )
    count = len(t.basis.independent)
    left = [n for n in t.terminals if n not in forces]
    free: tuple[str, ...] = ()
    if len(left) > count:
        driven = {d.on for d in m.drives}
        kept = [n for n in left if n in driven]
        if not 0 < len(kept) <= count:
            raise MechlabError(
                f"{m.name}: the torques of {', '.join(left)} are open, but {count} can be found. "
                f"Give {', '.join(f'{n}{FORCE}' for n in left)} for some (0 for a member that nothing drives or loads)."
            )
        free, left = tuple(n for n in left if n not in driven), kept
    return LoadCase(rates, eta, forces, tuple(left), free)


def _rates(t: GearTrain, given: Mapping[str, float]) -> Array:
    """(nv,) joint rates from the given ones, by the exact basis. Raises MechlabError for too few of them, NoSolution where they
    contradict each other."""
    m, k = t.mechanism, t.basis.matrix
    rows = np.array([m.row(n) for n in given]).reshape(-1, m.nv) @ k
    count = k.shape[1]
    rank = int(np.linalg.matrix_rank(rows, tol=1e-12)) if len(rows) else 0
    if rank < count:
        raise MechlabError(
            f"{m.name}: {count} speeds fix the train, {rank} given. Give X{RATE} of {count} of: {', '.join(m.scalar_names)} "
            "(0 for a member that is held)."
        )
    wanted = np.array(list(given.values()))
    if len(given) == count and all(n in t.basis.joints for n in given):
        exact = dependent_angles(m, tuple(given))  # a member given as held then stands still to the last digit
        return exact.angles([given[n] for n in exact.independent])
    y = np.linalg.lstsq(rows, wanted, rcond=1e-12)[0]
    gap = np.abs(rows @ y - wanted)
    if gap.max() > 1e-9 * max(1.0, float(np.abs(wanted).max())):
        raise NoSolution(
            f"{m.name}: these speeds contradict the teeth: {list(given)[int(np.argmax(gap))]}{RATE} is missed by "
            f"{gap.max():.3g} rad/s. Give {count} of them."
        )
    return np.asarray(k @ y)


def each_case(given: Mapping[str, Any], ask: Callable[[dict[str, float]], Answer]) -> Answer:
    """The answer to one load case; for arrays of cases (they broadcast) the values alone, without the lists of members and meshes."""
    shape = np.broadcast_shapes(*(np.shape(x) for x in given.values()))
    if not shape:
        return ask({k: float(x) for k, x in given.items()})
    flat = {k: np.broadcast_to(x, shape).ravel() for k, x in given.items()}
    answers = [ask({k: float(x[i]) for k, x in flat.items()}) for i in range(int(np.prod(shape)))]
    keys = [k for k in answers[0].values if all(k in a.values for a in answers)]
    values = {k: np.array([a.values[k] for a in answers]).reshape(shape) for k in keys}
    return Answer(values, answers[0].status, answers[0].notes)
