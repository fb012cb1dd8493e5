"""Drive force and reactions along a cycle, by Pinocchio; and the same by MuJoCo at a few positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.study.witness import room

PARTS = ("fx", "fy", "fz", "mx", "my", "mz")
COMPARED = 9


@dataclass(frozen=True)
class ReactionTable:
    """columns name -> (n,), their units; `forces` loop or joint -> (n, 6) force and moment; `drive` (n,)."""

    columns: dict[str, Array]
    units: dict[str, str]
    forces: dict[str, Array]
    drive: Array


def reactions(m: Mechanism, drive: str, accel: float, q: Array, v: Array, load: Array) -> ReactionTable:
    """Force of the drive and the wrenches of loops (on body b) and joints (on the body from its parent, about the
    joint), world axes, of the motion q (n, nq), v (n, nv) under the constant load (nv,)."""
    solve = room("pinocchio")
    plant = solve.PinPlant(m)
    names = [x.name for x in m.loops] + [j.name for j in m.joints]
    forces = {n: np.zeros((len(q), 6)) for n in names}
    loads: dict[str, Array] = {r.name: np.zeros(len(q)) for r in m.relations}
    driving = np.zeros(len(q))
    for k in range(len(q)):
        found = solve.inverse_dynamics(plant, q[k], v[k], {drive: accel}, [drive], load)
        driving[k] = found.drive_forces[drive]
        for name, wrench in (found.loops | found.joints).items():
            if name in forces:
                forces[name][k] = np.concatenate([wrench.force, wrench.moment])
        for name, value in found.loads.items():
            loads[name][k] = value
    slides = {j.name for j in m.joints if j.kind == "prismatic"}
    columns = {f"{drive}_force": driving}
    units = {f"{drive}_force": "N" if drive in slides else "N m"}
    for relation in m.relations:
        columns[f"{relation.name}_load"] = loads[relation.name]
        units[f"{relation.name}_load"] = "N" if relation.coefficients[0][0] in slides else "N m"
    for name, table in forces.items():
        key = name if f"{name}_fx" not in columns else f"{name}_joint"
        for k, part in enumerate(PARTS):
            columns[f"{key}_{part}"] = table[:, k]
            units[f"{key}_{part}"] = "N" if k < 3 else "N m"
        columns[f"{key}_reaction"] = np.linalg.norm(table[:, :3], axis=1)
        units[f"{key}_reaction"] = "N"
    return ReactionTable(columns, units, forces, driving)


def witness_difference(
    m: Mechanism, drive: str, accel: float, q: Array, v: Array, load: Array, found: ReactionTable
) -> float:
    """Largest difference of drive force, loop forces and joint wrenches [N, N m] to those of MuJoCo, at nine positions.

    Of a body with several joints the last is compared. Raises MechlabError where MuJoCo cannot say.
    """
    room("mujoco")
    from mechlab.simulate.inverse import InverseDynamics

    engine = InverseDynamics(m)
    worst = 0.0
    for k in np.unique(np.linspace(0, len(q) - 1, COMPARED).astype(int)):
        said = engine.solve(q[k], v[k], drive, accel, load)
        gaps = [abs(said.drive_force - found.drive[k])]
        gaps += [float(np.max(np.abs(f - found.forces[n][k, :3]))) for n, f in said.loops.items()]
        gaps += [float(np.max(np.abs(w - found.forces[n][k]))) for n, w in said.joints.items()]
        worst = max(worst, *gaps)
    return worst
