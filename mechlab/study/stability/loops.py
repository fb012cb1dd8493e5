"""Maps of mechanisms with loops: mass ratio, distance to a singular position, redundancy, softness of the rows."""

from __future__ import annotations

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism import Mechanism
from mechlab.mechanism.parts import GROUND, Loop
from mechlab.mechanism.structure import structure
from mechlab.study.methods import Method, Problem
from mechlab.study.stability.data import Axis, Theory
from mechlab.study.stability.plan import Case, Plan, steps_of, usual_methods
from mechlab.study.stability.tuned import tuned
from mechlab.study.stability.vary import scale_mass

MASSES = (1e-4, 1e-2, 1.0, 1e1, 1e2, 1e3, 1e4)
CAP = 1e-4
"""1 - d of MuJoCo's rows is never smaller (mjMAXIMP)."""


def ancestors(mechanism: Mechanism, body: str) -> list[str]:
    """The body and its parents up to the ground, without it."""
    parent = {b.name: b.parent for b in mechanism.bodies}
    out = []
    while body != GROUND:
        out.append(body)
        body = parent[body]
    return out


def loop_bodies(mechanism: Mechanism, loop: Loop) -> list[str]:
    """Bodies around a loop, in order."""
    a, b = ancestors(mechanism, loop.body_a), ancestors(mechanism, loop.body_b)
    return [x for x in a if x not in b] + [x for x in reversed(b) if x not in a]


def plan_mass_ratio(case: Case) -> Plan | str:
    """The part in the middle of the longest loop ever lighter and heavier; the energy that goes astray."""
    m = case.mechanism
    if not m.loops:
        return "it has no loops: the mass ratio of a tree is no difficulty"
    around = max((loop_bodies(m, x) for x in m.loops), key=len)
    heavy = [n for n in around if m.body(n).inertia.mass > 0]
    if not heavy:
        return "the bodies around its loops have no mass"
    body = heavy[len(heavy) // 2]
    case = case.free
    duration = case.scene.duration

    def problem(y: float) -> Problem:
        return case.problem(scale_mass(m, body, y), None, duration)

    text = f"mass of {body} ({m.body(body).inertia.mass:.3g} kg) times this"
    return Plan(
        "mass-ratio", "timestep and mass ratio", Axis("mass / as given", "", MASSES, text, 1.0), problem,
        usual_methods(case), steps_of(duration), "energy", 1e-3, 1e-1, remark=case.remark,
    )  # fmt: skip


def plan_redundancy(case: Case) -> Plan | str:
    """Rows that repeat each other, with more and less regularisation."""
    m = case.mechanism
    redundant = structure(m).redundant if m.loops or m.relations else ()
    if not redundant:
        return "none of its constraint rows repeats others"
    case = case.free
    duration = case.scene.duration

    def tune(way: Method, y: float) -> Method:
        if way.engine == "mujoco":
            return tuned(way, impedance=1.0 - y)
        if not _takes_mu(case):
            raise MechlabError("here Pinocchio's rows are solved by least squares: nothing to regularise")
        return tuned(way, mu=y)

    def theory(shown: tuple[Method, ...]) -> tuple[Theory, ...]:
        names = tuple(w.name for w in shown if w.engine == "mujoco")
        steps = steps_of(duration)
        line = Theory("MuJoCo goes no lower", "1 - d = 1e-4", (steps[0], steps[-1]), (CAP, CAP), names)
        return (line,) if names else ()

    names = ["MuJoCo RK4, hard", "MuJoCo implicitfast, hard", "MuJoCo discrete, hard"]
    if _takes_mu(case):
        names += [
            "Pinocchio semi-implicit Euler",
            "Pinocchio RK4, soft stabilisation",
            "Pinocchio RK4, stiff stabilisation",
        ]
    values = (1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 0.5)
    text = f"MuJoCo: 1 - impedance; Pinocchio: mu. Redundant: {', '.join(r.row for r in redundant[:3])}"
    return Plan(
        "redundancy", "timestep and regularisation", Axis("regularisation", "", values, text, 1e-4),
        lambda y: case.problem(duration=duration), case.methods(*names), steps_of(duration), tune=tune, theory=theory, remark=case.remark,
    )  # fmt: skip


def _takes_mu(case: Case) -> bool:
    try:
        from mechlab.solve.trace import fits
    except ImportError:
        return False
    return bool(case.mechanism.loops) and fits(case.mechanism, case.scene.laws)


def plan_softness(case: Case) -> Plan | str:
    """The time constant of MuJoCo's rows against the timestep: below 2 h the engine takes 2 h (refsafe)."""
    m = case.mechanism
    if not m.loops and not m.relations:
        return "it has no loops and no gear relations: no soft rows"
    case = case.free
    duration = case.scene.duration
    steps = steps_of(duration)
    values = tuple(float(x) for x in np.geomspace(steps[0], 4.0 * steps[-1], 6))

    def theory(shown: tuple[Method, ...]) -> tuple[Theory, ...]:
        names = tuple(w.name for w in shown if w.engine == "mujoco" and w.integrator != "discrete")
        ends = (steps[0], steps[-1])
        return (
            Theory("below it the engine takes 2 h (refsafe)", "tc = 2 h", ends, tuple(2.0 * h for h in ends), names),
        )

    names = [f"MuJoCo {i}, hard" for i in ("RK4", "implicitfast", "Euler", "discrete")]
    chosen = tuple(w for w in case.methods(*names) if w.engine == "mujoco")
    if not chosen:
        return "softness is MuJoCo's: none of the methods asked for has it"
    axis = Axis("time constant of the rows", "s", values, "tc of solref, impedance .9999", 0.02)
    return Plan(
        "softness", "timestep and softness of the rows", axis, lambda y: case.problem(duration=duration), chosen, steps,
        tune=lambda way, y: tuned(way, time_constant=y), theory=theory, remark=case.remark,
    )  # fmt: skip
