"""Maps of mechanisms with loops: mass ratio, redundant rows, softness of the rows, distance to a singular position.

The length of one link of each loop sets the distance to the singular position. For a mechanism whose drive turns fully,
bisection finds the length at which it no longer does; the rows of the map approach this length. Where the motion itself
passes a singular position (a parallelogram), the rows approach the given length.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from mechlab.engines.own.closed_path import ClosedPath, choose_path
from mechlab.errors import MechlabError
from mechlab.experiment.scene import Scene
from mechlab.lab.methods import Method, Problem
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.parts import GROUND, Loop
from mechlab.mechanism.structure import rank, structure
from mechlab.studies.stability.data import StabilityAxis, Theory
from mechlab.studies.stability.measure import sharp_method
from mechlab.studies.stability.plan import StabilityCase, StabilityPlan, steps_of, usual_methods, with_softness
from mechlab.studies.stability.vary import link_length, scale_mass, shift_loops

MASSES = (1e-4, 1e-2, 1.0, 1e1, 1e2, 1e3, 1e4)
CAP = 1e-4
"""Least value of 1 - d, with impedance d, in MuJoCo (mjMAXIMP)."""


def ancestors(mechanism: Mechanism, body: str) -> list[str]:
    """The body and its ancestors, without the ground."""
    parent = {b.name: b.parent for b in mechanism.bodies}
    out = []
    while body != GROUND:
        out.append(body)
        body = parent[body]
    return out


def loop_bodies(mechanism: Mechanism, loop: Loop) -> list[str]:
    """The bodies around a loop, in order, without the ground."""
    a, b = ancestors(mechanism, loop.body_a), ancestors(mechanism, loop.body_b)
    return [x for x in a if x not in b] + [x for x in reversed(b) if x not in a]


def plan_mass_ratio(case: StabilityCase) -> StabilityPlan | str:
    """The map of the mass ratio: the body in the middle of the longest loop with scaled mass; measured is the energy
    error.

    A text says why there is no map.
    """
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
    return StabilityPlan(
        "mass-ratio", "timestep and mass ratio", StabilityAxis("mass / as given", "", MASSES, text, 1.0), problem,
        usual_methods(case), steps_of(duration), "energy", 1e-3, 1e-1, remark=case.remark,
    )  # fmt: skip


def plan_redundancy(case: StabilityCase) -> StabilityPlan | str:
    """The map of redundant rows: the timestep against the regularization of the rows. A text says why there is no
    map."""
    m = case.mechanism
    redundant = structure(m).redundant if m.is_closed else ()
    if not redundant:
        return "none of its constraint rows repeats others"
    case = case.free
    duration = case.scene.duration

    def tune(way: Method, y: float) -> Method:
        if way.engine == "mujoco":
            return with_softness(way, impedance=1.0 - y)
        if not _takes_mu(case):
            raise MechlabError("here Pinocchio's rows are solved by least squares: nothing to regularize")
        return with_softness(way, mu=y)

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
    return StabilityPlan(
        "redundancy", "timestep and regularization", StabilityAxis("regularisation", "", values, text, 1e-4),
        lambda y: case.problem(duration=duration), case.methods(*names), steps_of(duration), tune=tune, theory=theory, remark=case.remark,
    )  # fmt: skip


def _takes_mu(case: StabilityCase) -> bool:
    try:
        from mechlab.engines.pinocchio.trace import fits
    except ImportError:
        return False
    return bool(case.mechanism.loops) and fits(case.mechanism, case.scene.laws)


def plan_softness(case: StabilityCase) -> StabilityPlan | str:
    """The map of softness: the timestep h against the time constant of MuJoCo's rows. Below 2 h the engine uses 2 h
    (refsafe).

    A text says why there is no map.
    """
    m = case.mechanism
    if not m.is_closed:
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
    axis = StabilityAxis("time constant of the rows", "s", values, "tc of solref, impedance .9999", 0.02)
    return StabilityPlan(
        "softness", "timestep and softness of the rows", axis, lambda y: case.problem(duration=duration), chosen, steps,
        tune=lambda way, y: with_softness(way, time_constant=y), theory=theory, remark=case.remark,
    )  # fmt: skip


DISTANCES = (1e-4, 1e-3, 1e-2, 1e-1)
"""Distances to the singular position, relative to the length that is changed."""
TRIED = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6)
CLOSE = 1e-5
DIVISIONS = (3, 5, 8, 13, 21, 34, 55, 89, 144)
LONGEST = 10.0
HALF_WAY = 0.6
"""Part of the duration that is simulated where the drive turns: in about half a turn the crank passes the line of its
ground link once."""
SINGULAR = 2e-2
SAMPLES = 200


@dataclass(frozen=True)
class SingularLength:
    """Change of length `shift` [m] of the loops at which the mechanism becomes singular; `text`: in words; `turns`:
    True where the drive turns fully up to that length."""

    shift: float
    text: str
    turns: bool


def plan_singular(case: StabilityCase) -> StabilityPlan | str:
    """The map of the distance to a singular position, or a text that says why there is none."""
    m = case.mechanism
    if not m.loops:
        return "it has no loops: a tree has no singular position"
    if structure(m).freedoms != 1:
        return f"it has {structure(m).freedoms} degrees of freedom; a change point is looked for along one"
    length = link_length(m)
    if length == 0.0:
        return "its loops end at the joints of their bodies: no length can be changed"
    prefer = tuple({**case.scene.initial, **case.scene.initial_rates})
    found: SingularLength | str = change_point(m, prefer, length) or _on_the_way(case)
    if isinstance(found, str):
        return found
    duration = min(case.scene.duration, LONGEST) * (HALF_WAY if found.turns else 1.0)
    case = replace(case.free, scene=_first_rate(case.free.scene))
    point, side = found, -1.0 if found.shift >= 0 else 1.0

    def problem(y: float) -> Problem:
        return case.problem(shift_loops(m, point.shift + side * y), None, duration)

    values = tuple(length * x for x in DISTANCES)
    return StabilityPlan(
        "singularity", "timestep and distance to a singular position",
        StabilityAxis("distance to the change point", "m", values, found.text), problem, usual_methods(case),
        steps_of(duration, DIVISIONS), remark=case.remark,
    )  # fmt: skip


def _first_rate(scene: Scene) -> Scene:
    """The scene with its first initial rate alone: it fixes the motion, and others would contradict it at another
    length."""
    return replace(scene, initial_rates=dict(list(scene.initial_rates.items())[:1]))


@lru_cache(maxsize=16)
def change_point(mechanism: Mechanism, prefer: tuple[str, ...], length: float) -> SingularLength | None:
    """The smallest change of length [m] at which the drive no longer turns fully.

    None where the drive does not turn fully as given, or no change tried stops it.
    """

    try:
        path, turn = choose_path(mechanism, None, prefer)
    except MechlabError:
        return None
    if turn is None:
        return None

    def turns(shift: float) -> bool:
        try:
            return ClosedPath(shift_loops(mechanism, shift), path.coordinate).full_turn() is not None
        except MechlabError:
            return False

    for x in TRIED:
        for sign in (1.0, -1.0):
            far = sign * x * length
            if sign * x > -0.9 and not turns(far):
                near = 0.0
                while abs(far - near) > CLOSE * length:
                    middle = 0.5 * (far + near)
                    near, far = (middle, far) if turns(middle) else (near, middle)
                way = "longer" if far > 0 else "shorter"
                text = f"the link that closes each loop {way} by up to {abs(near):.6g} m: there its drive stops turning"
                return SingularLength(near, text, True)
    return None


def _on_the_way(case: StabilityCase) -> SingularLength | str:
    """Zero shift where the scene's motion passes a singular position (its smallest singular value falls below
    SINGULAR); else the reason why there is no map."""
    m = case.mechanism
    problem = Problem(case.design, case.scene, SAMPLES)
    try:
        run = sharp_method(problem).run(problem, 1e-8)
    except MechlabError as error:
        return f"no change point was found: {error}"
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    full = structure(m).rank
    least = min(_smallest(constraints.jacobian(tree.set(q)), full) for q in run.q)
    if least > SINGULAR:
        return f"no change of length that was tried stops its drive, and its motion keeps away from singular positions ({least:.2g})"
    return SingularLength(
        0.0, "links that close the loops shorter by this; as given its motion passes a singular position", False
    )


def _smallest(jacobian: np.ndarray, full: int) -> float:
    """The `full`-th singular value relative to the first; where it vanishes, the rank of the rows falls."""
    values = np.linalg.svd(jacobian, compute_uv=False)
    return float(values[full - 1] / values[0]) if rank(jacobian) >= full else 0.0
