"""Checks of epicyclic trains: speeds, reduced masses, runs under constant torques, room between planets, redundant meshes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.planetary_stage import conditions
from mechlab.engines.protocol import engine
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.question import Question
from mechlab.experiment.scene import Settings
from mechlab.kit.checks import EXACT
from mechlab.kit.epicyclic_build import FIDELITIES
from mechlab.kit.epicyclic_motion import Build, ConstantTorques
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import null_space, rank


def speeds_check(
    id: str, questions: Sequence[Question], values: Sequence[float], note: str, tolerance: Callable[[Any], float]
) -> Check:
    """Speeds of all members [rad/s] by all witnesses; each question takes its given speeds from `values` [rad/s]."""

    def run(p: Any) -> CheckResult:
        measured: dict[str, list[float]] = {}
        for question in questions:
            given = dict(zip(question.given, values, strict=True))
            for witness, ask in question.witnesses.items():
                found = ask(p, given).values
                measured.setdefault(witness, []).extend(float(found[k]) for k in question.answers)
        return CheckResult(measured, tolerance(p), note=note)

    return Check(id, "speeds of all members from three witnesses", run, "Willis equation")


def reduced_masses(models: Mapping[str, Mechanism], names: Sequence[str]) -> dict[str, Array]:
    """Model -> mass matrix (n, n) [kg m2], reduced to the speeds of n joints or shafts that determine the motion."""
    out = {}
    for label, m in models.items():
        tree = TreeKinematics(m)
        basis = null_space(ConstraintSet(m).jacobian(tree))
        basis = basis @ np.linalg.inv(np.array([m.row(n) for n in names]) @ basis)
        out[label] = basis.T @ tree.mass_matrix() @ basis
    return out


def final_rates(p: Any, motion: ConstantTorques, member: str) -> dict[str, float]:
    """Rate of a member at the end of the scene [rad/s]: MuJoCo in every fidelity, Pinocchio in the richest."""
    runs = [(Settings(), f) for f in FIDELITIES] + [(EXACT, "full")]
    measured = {}
    for s, f in runs:
        scene = motion.scene(p, f)
        end = engine(s.engine).at_times(motion.build(p, f), scene, s, [scene.duration])
        measured[f"{s.engine} {f}"] = float(end.channel(f"{member}_rate")[-1])
    return measured


def distance(mechanism: Mechanism, one: str, other: str) -> float:
    """Distance [m] between the origins of two bodies in the reference pose."""
    tree = TreeKinematics(mechanism)
    return float(np.linalg.norm(tree.pose(one)[1] - tree.pose(other)[1]))


def inertia_check(
    id: str,
    build: Build,
    members: Sequence[str],
    expected: Callable[[Any], ArrayLike],
    note: str,
    text: str = "inertia of each fidelity against the closed form",
    change: Callable[[Any], Any] = lambda p: p,
) -> Check:
    """Mass matrix in the speeds of members in each fidelity, over the largest entry of the closed form [kg m2]. change: the
    parameters that are looked at."""

    def run(p: Any) -> CheckResult:
        design = change(p)
        truth = np.atleast_2d(np.asarray(expected(design), dtype=float))
        masses = reduced_masses({f: build(design, f) for f in FIDELITIES}, members)
        values = {f: np.squeeze(m / truth.max()) for f, m in masses.items()}
        return CheckResult(values, 1e-12, np.squeeze(truth / truth.max()), note)

    return Check(id, text, run, "Lagrange")


def torque_check(
    id: str,
    motion: ConstantTorques,
    member: str,
    acceleration: Callable[[Any], float],
    relative: bool = False,
) -> Check:
    """Speed of a member [rad/s] after the scene of constant torques in every fidelity, against its acceleration [rad/s2]."""

    def run(p: Any) -> CheckResult:
        found = final_rates(p, motion, member)
        expected = 0.5 * acceleration(p)
        if relative:
            # RK4 is exact for a constant acceleration; soft rows take at most one time constant (2 ms) to take up their slip.
            note = f"{member} speed after 0.5 s, relative to {expected:.6g} rad/s"
            return CheckResult({k: x / expected for k, x in found.items()}, 1e-5, 1.0, note)
        # Softness of MuJoCo's gear rows: slip below 1e-6 rad, its rate well below 1e-4 rad/s; the minimal model has no rows.
        return CheckResult(found, 1e-4, expected, f"{member} speed after 0.5 s under constant torques [rad/s]")

    return Check(id, "run under constant torques against the closed form", run, "Lagrange")


def room_check(
    id: str,
    build: Build,
    pairs: Callable[[Any], Sequence[tuple[str, str, int]]],
    unit: float,
    expected: Callable[[Any], ArrayLike],
    source: str,
    note: str,
) -> Check:
    """Distances of planets as they stand, less their tip radii. pairs: two planets and the sum of their tip radii in units;
    unit: in modules; expected: the closed form in the same units."""

    def run(p: Any) -> CheckResult:
        if p.planets == 1:
            return CheckResult({"drawn": np.zeros(0)}, 1e-9, np.zeros(0), "one planet has no neighbour")
        m = build(p, "full")
        apart = [distance(m, one, other) / (unit * p.module) - tips for one, other, tips in pairs(p)]
        return CheckResult({"drawn": np.squeeze(apart)}, 1e-9, expected(p), note)

    return Check(id, "room between the planets", run, source)


def neighbour_check(id: str, build: Build) -> Check:
    """The room between two planets of a train with one circle of planets; the teeth begin with sun, planet, ring."""

    def pairs(p: Any) -> list[tuple[str, str, int]]:
        return [("planet_1", "planet_2", p.teeth[1] + 2)]

    def expected(p: Any) -> float:
        sun, planet, ring = p.teeth[:3]
        return conditions(sun, planet, ring, p.planets).neighbour_margin

    source, note = "chord of the planet axes", "room between planets [modules]"
    return room_check(id, build, pairs, 1.0, expected, source, note)


def mesh_check(name: str, build: Build, meshes: int, wheels: int) -> Check:
    """A check of the numbers of rows and redundant rows. Each group of planets on one ray has `meshes` and `wheels`.

    The first group makes the train; every further group adds (meshes - wheels) redundant rows, whose loads statics
    cannot determine.
    """

    def run(p: Any) -> CheckResult:
        measured: dict[str, list[int]] = {"numpy": [], "mujoco": []}
        expected: list[int] = []
        for fidelity, rays in (("parts", 1), ("full", int(p.planets))):
            m = build(p, fidelity)
            for who, numbers in measured.items():
                rows = engine(who).state(m, m.reference()).rows
                numbers += [len(rows), len(rows) - rank(rows)]
            expected += [rays * meshes, (rays - 1) * (meshes - wheels)]
        return CheckResult(measured, 0.0, expected, "rows and redundant rows: parts, full")

    return Check(name, "rows of the meshes, and how many repeat others", run, "count of meshes and wheels on a ray")
