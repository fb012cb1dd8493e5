"""Checks that any Mechanism can be put to: three independent implementations of kinematics and dynamics must agree."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechlab.experiment.check import Check, Measured
from mechlab.experiment.entry import Entry
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, integrate
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import sample_poses
from mechlab.study.witness import room


def generic_checks(entry: Entry) -> tuple[Check, ...]:
    """G1 poses, G2 mass matrix, G3 bias force, G4 closure, G5 constraint Jacobian, for the default fidelity of an entry."""

    def mechanism(p: Any) -> Mechanism:
        return entry.build(p, entry.default_fidelity)

    return (
        Check("G1", "poses of all bodies at assembled poses", lambda p: _poses(mechanism(p)), "three implementations"),
        Check("G2", "mass matrix", lambda p: _mass(mechanism(p)), "three implementations"),
        Check("G3", "velocity and gravity terms", lambda p: _bias(mechanism(p)), "three implementations"),
        Check("G4", "closure of the reference pose", lambda p: _closure(mechanism(p)), "zero by definition"),
        Check(
            "G5",
            "constraint Jacobian against finite differences",
            lambda p: _jacobian(mechanism(p)),
            "central differences",
        ),
    )


def _states(m: Mechanism) -> list[tuple[Array, Array]]:
    rng = np.random.default_rng(3)
    return [(q, rng.standard_normal(m.nv)) for q in sample_poses(m, count=3)]


def _engines(m: Mechanism, q: Array, v: Array) -> dict[str, tuple[Array, Array, Array]]:
    """Body origins, mass matrix, bias force (gravity and velocity terms) by numpy, Pinocchio and MuJoCo."""
    tree = TreeKinematics(m, q, v)
    solve, simulate = room("pinocchio"), room("mujoco")
    kin = solve.PinKinematics(m, q, v)
    plant = solve.PinPlant(m, q, v)
    model, data = simulate.to_mujoco(m)
    view = simulate.MujocoMap(m, model)
    data.qpos[:] = view.engine_coordinates(q)
    data.qvel[:] = view.engine_rates(data.qpos, v)
    import mujoco

    mujoco.mj_forward(model, data)
    engine = simulate.MujocoPlant(m, model, data, view)
    names = [b.name for b in m.bodies]
    passive = _passive(tree)
    return {
        "numpy": (np.array([tree.pose(n)[1] for n in names]), tree.mass_matrix(), tree.bias_force()),
        "pinocchio": (np.array([kin.pose(n)[1] for n in names]), plant.mass_matrix(), plant.bias() + passive),
        "mujoco": (np.array([data.xpos[view.body(n)] for n in names]), engine.mass_matrix(), engine.bias() + passive),
    }


def _passive(tree: TreeKinematics) -> Array:
    from mechlab.mechanism.statics import passive_force

    return passive_force(tree)


def _collect(m: Mechanism, k: int) -> dict[str, list[Array]]:
    out: dict[str, list[Array]] = {"numpy": [], "pinocchio": [], "mujoco": []}
    for q, v in _states(m):
        for name, values in _engines(m, q, v).items():
            out[name].append(values[k])
    return out


def _relative(said: dict[str, list[Array]], tolerance: float, note: str) -> Measured:
    scale = max(1e-12, max(float(np.max(np.abs(x), initial=0.0)) for x in said["numpy"]))
    return Measured(
        {k: np.array(v) / scale for k, v in said.items()},
        tolerance,
        note=f"{note}, relative to the largest entry {scale:.3g}",
    )


def _poses(m: Mechanism) -> Measured:
    return _relative(_collect(m, 0), 1e-12, "body origins")


def _mass(m: Mechanism) -> Measured:
    return _relative(_collect(m, 1), 1e-12, "mass matrix with shafts")


def _bias(m: Mechanism) -> Measured:
    return _relative(_collect(m, 2), 1e-11, "h(q, v) at random rates")


def _closure(m: Mechanism) -> Measured:
    constraints = ConstraintSet(m)
    said = {
        "numpy": float(np.max(np.abs(constraints.residual(TreeKinematics(m))), initial=0.0)),
        "pinocchio": float(np.max(np.abs(constraints.residual(room("pinocchio").PinKinematics(m))), initial=0.0)),
    }
    _, data = room("mujoco").to_mujoco(m)
    import mujoco

    rows = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    said["mujoco"] = float(np.max(np.abs(data.efc_pos[rows]), initial=0.0))
    return Measured(said, 1e-12, 0.0, "largest residual of loops and relations [m, rad]")


def _jacobian(m: Mechanism) -> Measured:
    constraints, tree = ConstraintSet(m), TreeKinematics(m)
    analytic, differences, step = [], [], 1e-6
    for q, v in _states(m):
        analytic.append(constraints.jacobian(tree.set(q)) @ v)
        ahead, behind = integrate(m, q, step * v), integrate(m, q, -step * v)
        gap = constraints.residual(tree.set(ahead)) - constraints.residual(tree.set(behind))
        differences.append(gap / (2 * step))
    # Central differences of step 1e-6: truncation 1e-12, rounding 1e-10.
    return Measured(
        {"formula": np.array(analytic), "differences": np.array(differences)}, 1e-7, note="J v at random rates"
    )
