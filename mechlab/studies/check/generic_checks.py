"""Checks for any Mechanism: numpy, Pinocchio and MuJoCo must agree in kinematics, dynamics and constraint rows."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from mechlab.engines.protocol import IMPLEMENTATIONS, engine
from mechlab.engines.state import EngineState
from mechlab.experiment.entry import Check, CheckResult, Entry
from mechlab.kit.path_motion import kept
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, integrate
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import in_unit_of_length
from mechlab.mechanism.structure import null_space, rank, sample_poses


def generic_checks(entry: Entry) -> tuple[Check, ...]:
    """G1 poses, G2 mass matrix, G3 forces, G4 closure, G5 constraint Jacobian, G6 motions that the constraint rows
    allow.

    Each check covers every fidelity that has a Mechanism. Raises MechlabError for a file that no Mechanism holds.
    """
    if entry.file is not None and entry.file.unheld:
        entry.build(entry.parameters(), entry.default_fidelity)  # raises: it says why

    def built(p: Any) -> dict[str, _Sampled]:
        return {f: _Sampled(entry.build(p, f)) for f in entry.fidelities if f != "kinematic"}

    def of_each(measure: Callable[[_Sampled], CheckResult]) -> Callable[[Any], CheckResult]:
        return lambda p: _together({f: measure(x) for f, x in kept(built, p, built).items()})

    def in_own_unit(measure: Callable[[_Sampled], CheckResult]) -> Callable[[Any], CheckResult]:
        return of_each(lambda x: measure(x.in_own_unit))

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


class _Sampled:
    """A mechanism and its states that several checks look at."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self._by: dict[str, list[EngineState]] = {}

    @cached_property
    def in_own_unit(self) -> _Sampled:
        """With the mechanism's length scale as unit of length: tolerances are set for bodies of size 1."""
        m = self.mechanism
        return self if m.length_scale == 1.0 else _Sampled(in_unit_of_length(m, m.length_scale))

    @cached_property
    def states(self) -> list[tuple[Array, Array]]:
        """Assembled poses with random rates."""
        rng = np.random.default_rng(3)
        return [(q, rng.standard_normal(self.mechanism.nv)) for q in sample_poses(self.mechanism, count=3)]

    def by(self, name: str) -> list[EngineState]:
        """An implementation's state at each of `states`."""
        if name not in self._by:
            self._by[name] = [engine(name).state(self.mechanism, q, v) for q, v in self.states]
        return self._by[name]


def _collect(x: _Sampled, number: Callable[[EngineState], Array]) -> dict[str, list[Array]]:
    """A number of every implementation's state, at each of `states`."""
    return {name: [number(state) for state in x.by(name)] for name in IMPLEMENTATIONS}


def _relative(values: dict[str, list[Array]], tolerance: float, note: str, least: float = 1e-12) -> CheckResult:
    scale = max(least, max(float(np.max(np.abs(x), initial=0.0)) for x in values["numpy"]))
    return CheckResult(
        {k: np.array(v) / scale for k, v in values.items()},
        tolerance,
        note=f"{note}, relative to the largest entry {scale:.3g}",
    )


def _poses(of: _Sampled) -> CheckResult:
    return _relative(_collect(of, lambda x: x.placement), 1e-12, "rotations, origins, points")


def _mass(of: _Sampled) -> CheckResult:
    return _relative(_collect(of, lambda x: x.mass_matrix), 1e-12, "mass matrix with shafts")


def _bias(of: _Sampled) -> CheckResult:
    # A stiff spring, 1e6 N/m, turns the rounding of a length, 1e-16 m, into 1e-10 of small inertia forces.
    # Wheels on fixed axes have none: then the inertia forces at 1 rad/s2 are the measure.
    inertia = max(float(np.max(np.abs(x.mass_matrix), initial=0.0)) for x in of.by("numpy"))
    return _relative(_collect(of, lambda x: x.bias), 1e-9, "h(q, v) at random rates", inertia)


def _closure(of: _Sampled) -> CheckResult:
    m = of.mechanism
    open_by = {
        name: float(np.max(np.abs(engine(name).placed(m, m.reference(), np.zeros(m.nv)).closing()[0]), initial=0.0))
        for name in IMPLEMENTATIONS
    }
    return CheckResult(open_by, 1e-12, 0.0, "largest residual of loops and relations [m, rad]")


def _jacobian(of: _Sampled) -> CheckResult:
    m = of.mechanism
    constraints, tree = ConstraintSet(m), TreeKinematics(m)
    analytic, differences, step = [], [], 1e-6
    for q, v in of.states:
        analytic.append(constraints.jacobian(tree.set(q)) @ v)
        ahead, behind = integrate(m, q, step * v), integrate(m, q, -step * v)
        gap = constraints.residual(tree.set(ahead)) - constraints.residual(tree.set(behind))
        differences.append(gap / (2 * step))
    # Central differences of step 1e-6: truncation 1e-12, rounding 1e-10.
    return CheckResult(
        {"formula": np.array(analytic), "differences": np.array(differences)}, 1e-7, note="J v at random rates"
    )


def _allowed(of: _Sampled) -> CheckResult:
    """Degrees of freedom by the rank of each implementation's rows, and the largest residual of those rows under a
    motion that our rows allow. Equal ranks and no residual mean that the rows span the same space."""
    m = of.mechanism
    constraints, tree = ConstraintSet(m), TreeKinematics(m)
    found: dict[str, list[float]] = {name: [] for name in IMPLEMENTATIONS}
    for q, v in of.states:
        basis = null_space(constraints.jacobian(tree.set(q)))
        free = basis @ (basis.T @ v)
        free /= max(float(np.linalg.norm(free)), 1e-12)
        for name, numbers in found.items():
            _, rows, rates = engine(name).placed(m, q, free).closing()
            numbers += [len(rates) - rank(rows), float(np.max(np.abs(rows @ rates), initial=0.0))]
    return CheckResult(
        {k: np.array(x) for k, x in found.items()}, 1e-8, note="freedoms, and violation by a free motion"
    )
