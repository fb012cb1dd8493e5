"""A Mechanism of gears made ready for its power flow, and a case of it: speeds, torques, losses, read from the given keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mechlab.analytic.power_flow import TrainMesh
from mechlab.errors import MechlabError, NoSolution
from mechlab.mechanism import GROUND, Mechanism
from mechlab.mechanism.angle_basis import AngleBasis, dependent_angles
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.mesh_roles import MeshRoles, mesh_roles
from mechlab.study.design import Design

FORCE, RATE, ETA = "_force", "_rate", "efficiency"


@dataclass(frozen=True)
class Train:
    """A Mechanism of gears, made ready: roles of all meshes, exact null-space basis, members by number."""

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
        """What an external torque may act on without being named: joints on the ground, and whatever is driven."""
        grounded = [j.name for b in self.mechanism.bodies if b.parent == GROUND for j in b.joints]
        return tuple(dict.fromkeys([*grounded, *(d.on for d in self.mechanism.drives)]))


@lru_cache(maxsize=32)
def train(m: Mechanism) -> Train:
    """The train of a Mechanism. Raises MechlabError when its constraints are not all meshes of gears."""
    if not m.relations:
        raise MechlabError(f"{m.name}: it has no gear relations, so there is no power flow to find.")
    basis = dependent_angles(m)
    return Train(m, tuple(mesh_roles(m, r) for r in m.relations), basis)


def geared(design: Design) -> Mechanism:
    """The cheapest fidelity whose meshes are relations. Raises MechlabError when there is none."""
    for level in design.entry.fidelities:
        if level != "kinematic":
            m = design.mechanism(level)
            if m.relations and not m.loops:
                return m
    raise MechlabError(
        f"{design.name}: X_force and efficiency ask for the power flow of a train of gears, and no fidelity of it "
        f"({', '.join(design.entry.fidelities)}) consists of gear relations alone."
    )


@dataclass(frozen=True)
class Case:
    """Joint rates (nv,), mesh efficiencies (m,), given torques, members whose torque is open, members taken as free."""

    rates: Array
    eta: Array
    given: dict[str, float]
    open: tuple[str, ...]
    free: tuple[str, ...]


def case_of(t: Train, given: Mapping[str, float]) -> Case:
    """The case that keys X_rate, X_force, efficiency and MESH_efficiency make. Raises MechlabError for too few of them."""
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
    return Case(rates, eta, forces, tuple(left), free)


def _rates(t: Train, given: Mapping[str, float]) -> Array:
    """(nv,) joint rates from the given ones, exact basis. Raises MechlabError for too few, NoSolution for a contradiction."""
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
