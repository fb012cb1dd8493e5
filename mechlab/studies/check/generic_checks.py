"""Checks for any Mechanism: numpy, Pinocchio and MuJoCo must agree in kinematics, dynamics and constraint rows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechlab.experiment.entry import Check, CheckResult, Entry
from mechlab.kit.witness import room
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, integrate
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import in_unit_of_length
from mechlab.mechanism.statics import passive_force
from mechlab.mechanism.structure import null_space, rank, sample_poses


def generic_checks(entry: Entry) -> tuple[Check, ...]:
    """G1 poses, G2 mass matrix, G3 forces, G4 closure, G5 constraint Jacobian, G6 motions that the constraint rows
    allow.

    Each check covers every fidelity that has a Mechanism.
    """

    def of_each(measure: Callable[[Mechanism], CheckResult]) -> Callable[[Any], CheckResult]:
        return lambda p: _together({f: measure(entry.build(p, f)) for f in entry.fidelities if f != "kinematic"})

    def in_own_unit(measure: Callable[[Mechanism], CheckResult]) -> Callable[[Any], CheckResult]:
        """Measure with the mechanism's length scale as unit of length: tolerances are set for bodies of size 1."""
        return of_each(lambda m: measure(m if m.length_scale == 1.0 else in_unit_of_length(m, m.length_scale)))

    three = "three implementations"
    return (
        Check("G1", "poses of bodies and frames at assembled poses", in_own_unit(_poses), three),
        Check("G2", "mass matrix", of_each(_mass), three),
        Check("G3", "velocity, gravity and passive terms", of_each(_bias), three),
        Check("G4", "closure of the reference pose", in_own_unit(_closure), "zero by definition"),
        Check("G5", "constraint Jacobian against finite differences", in_own_unit(_jacobian), "central differences"),
        Check("G6", "motions that the constraint rows allow", in_own_unit(_allowed), three),
    )


def _together(found: dict[str, CheckResult]) -> CheckResult:
    """The measurements of all fidelities as one result: values concatenated, notes joined."""
    if len(found) == 1:
        return next(iter(found.values()))
    witnesses = list(next(iter(found.values())).values)
    values = {w: np.concatenate([np.ravel(x.values[w]) for x in found.values()]) for w in witnesses}
    first = next(iter(found.values()))
    expected = None if first.expected is None else np.zeros(next(iter(values.values())).shape)
    notes = "; ".join(f"{f}: {x.note}" for f, x in found.items())
    return CheckResult(values, first.tolerance, expected, notes)


def _states(m: Mechanism) -> list[tuple[Array, Array]]:
    rng = np.random.default_rng(3)
    return [(q, rng.standard_normal(m.nv)) for q in sample_poses(m, count=3)]


def _engines(m: Mechanism, q: Array, v: Array) -> dict[str, tuple[Array, Array, Array]]:
    """Poses of bodies and frames, mass matrix, bias force (gravity, velocity and passive terms) by numpy, Pinocchio, MuJoCo."""
    tree = TreeKinematics(m, q, v)
    solve, simulate = room("pinocchio"), room("mujoco")
    kin = solve.PinKinematics(m, q, v)
    plant = solve.PinPlant(m, q, v)
    from mechlab.engines.mujoco.model import passive

    model, data = simulate.to_mujoco(m)
    passive(
        model
    )  # a drive is no part of the tree, though MuJoCo counts the damping of its servo among the passive forces
    view = simulate.MujocoMap(m, model)
    data.qpos[:] = view.engine_coordinates(q)
    data.qvel[:] = view.engine_rates(data.qpos, v)
    import mujoco

    mujoco.mj_forward(model, data)
    engine = simulate.MujocoPlant(m, model, data, view)
    names = [b.name for b in m.bodies]
    turns = np.array([[*data.xmat[view.body(n)], *data.xpos[view.body(n)]] for n in names])
    sites = np.array([data.site_xpos[view.site(f.name)] for f in m.frames])
    return {
        "numpy": (_places(m, tree), tree.mass_matrix(), tree.bias_force() - passive_force(tree)),
        "pinocchio": (_places(m, kin), plant.mass_matrix(), plant.bias()),
        "mujoco": (np.concatenate([turns.ravel(), sites.ravel()]), engine.mass_matrix(), engine.bias()),
    }


def _places(m: Mechanism, kin: Any) -> Array:
    """Rotations and origins of all bodies, then the points of all frames."""
    poses = [kin.pose(b.name) for b in m.bodies]
    points = [kin.pose(f.body)[1] + kin.pose(f.body)[0] @ f.placement.translation for f in m.frames]
    return np.concatenate([np.ravel([[*r.ravel(), *p] for r, p in poses]), np.ravel(points)])


def _collect(m: Mechanism, k: int) -> dict[str, list[Array]]:
    out: dict[str, list[Array]] = {"numpy": [], "pinocchio": [], "mujoco": []}
    for q, v in _states(m):
        for name, values in _engines(m, q, v).items():
            out[name].append(values[k])
    return out


def _relative(said: dict[str, list[Array]], tolerance: float, note: str, least: float = 1e-12) -> CheckResult:
    scale = max(least, max(float(np.max(np.abs(x), initial=0.0)) for x in said["numpy"]))
    return CheckResult(
        {k: np.array(v) / scale for k, v in said.items()},
        tolerance,
        note=f"{note}, relative to the largest entry {scale:.3g}",
    )


def _poses(m: Mechanism) -> CheckResult:
    return _relative(_collect(m, 0), 1e-12, "rotations, origins, points")


def _mass(m: Mechanism) -> CheckResult:
    return _relative(_collect(m, 1), 1e-12, "mass matrix with shafts")


def _bias(m: Mechanism) -> CheckResult:
    # A stiff spring, 1e6 N/m, turns the rounding of a length, 1e-16 m, into 1e-10 of small inertia forces.
    # Wheels on fixed axes have none: then the inertia forces at 1 rad/s2 are the measure.
    inertia = max(float(np.max(np.abs(x), initial=0.0)) for x in _collect(m, 1)["numpy"])
    return _relative(_collect(m, 2), 1e-9, "h(q, v) at random rates", inertia)


def _closure(m: Mechanism) -> CheckResult:
    constraints = ConstraintSet(m)
    said = {
        "numpy": float(np.max(np.abs(constraints.residual(TreeKinematics(m))), initial=0.0)),
        "pinocchio": float(np.max(np.abs(constraints.residual(room("pinocchio").PinKinematics(m))), initial=0.0)),
    }
    _, data = room("mujoco").to_mujoco(m)
    import mujoco

    rows = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    said["mujoco"] = float(np.max(np.abs(data.efc_pos[rows]), initial=0.0))
    return CheckResult(said, 1e-12, 0.0, "largest residual of loops and relations [m, rad]")


def _jacobian(m: Mechanism) -> CheckResult:
    constraints, tree = ConstraintSet(m), TreeKinematics(m)
    analytic, differences, step = [], [], 1e-6
    for q, v in _states(m):
        analytic.append(constraints.jacobian(tree.set(q)) @ v)
        ahead, behind = integrate(m, q, step * v), integrate(m, q, -step * v)
        gap = constraints.residual(tree.set(ahead)) - constraints.residual(tree.set(behind))
        differences.append(gap / (2 * step))
    # Central differences of step 1e-6: truncation 1e-12, rounding 1e-10.
    return CheckResult(
        {"formula": np.array(analytic), "differences": np.array(differences)}, 1e-7, note="J v at random rates"
    )


def _allowed(m: Mechanism) -> CheckResult:
    """Degrees of freedom by the rank of each implementation's rows, and the largest residual of those rows under a
    motion that our rows allow. Equal ranks and no residual mean that the rows span the same space."""
    simulate = room("mujoco")
    constraints, tree = ConstraintSet(m), TreeKinematics(m)
    said: dict[str, list[float]] = {"numpy": [], "pinocchio": [], "mujoco": []}
    for q, v in _states(m):
        ours = constraints.jacobian(tree.set(q))
        basis = null_space(ours)
        free = basis @ (basis.T @ v)
        free /= max(float(np.linalg.norm(free)), 1e-12)
        theirs = constraints.jacobian(room("pinocchio").PinKinematics(m, q, v))
        model, data = simulate.to_mujoco(m)
        view = simulate.MujocoMap(m, model)
        data.qpos[:] = view.engine_coordinates(q)
        moved = view.engine_rates(data.qpos, free)
        import mujoco

        from mechlab.engines.mujoco.model import equality_jacobian

        mujoco.mj_fwdPosition(model, data)
        rows = equality_jacobian(model, data)
        said["numpy"] += [m.nv - rank(ours), float(np.max(np.abs(ours @ free), initial=0.0))]
        said["pinocchio"] += [m.nv - rank(theirs), float(np.max(np.abs(theirs @ free), initial=0.0))]
        said["mujoco"] += [model.nv - rank(rows), float(np.max(np.abs(rows @ moved), initial=0.0))]
    return CheckResult({k: np.array(x) for k, x in said.items()}, 1e-8, note="freedoms, and violation by a free motion")
