"""The modes of a design, from Pinocchio, from MuJoCo and, with one freedom, from the generalized inertia along its path."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from mechlab.engines.own.one_freedom import OneFreedom
from mechlab.engines.protocol import WITNESSES, engine
from mechlab.errors import EngineMissing, MechlabError, NoSolution, Untrustworthy
from mechlab.experiment.acting import acting, what_acts
from mechlab.experiment.laws import Law, applied_force
from mechlab.experiment.scene import Scene, initial_pose
from mechlab.lab.design import Design, with_extra
from mechlab.lab.fidelity.choose import chosen_scene
from mechlab.lab.single_run import versions
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.structure import step_size, structure
from mechlab.studies.modes.eigen import KINKED, Dynamics, LinearMotion, VibrationMode, linear, modes
from mechlab.studies.modes.equilibrium import laws_at_rest, settle
from mechlab.studies.modes.falling import refuse_falling
from mechlab.studies.modes.result import ModesResult, ModesWitness
from mechlab.studies.named.number import parameter_values

STEP = 1e-3


@dataclass(frozen=True)
class _Balance:
    """At phi on the path: inertia J, generalized force Q, stiffness -dQ/dphi, damping -dQ/dphi', tangent u (nv,), q
    (nq,)."""

    inertia: float
    push: float
    stiffness: float
    doubt: float
    damping: float
    u: Array
    q: Array


def one_freedom_modes(mechanism: Mechanism, laws: tuple[Law, ...], q: Array) -> tuple[Array, tuple[VibrationMode, ...]]:
    """Equilibrium (nq,) reached by descent from q, and its one mode: omega^2 = V''(phi) / J(phi).

    Raises NoSolution where the path ends or no equilibrium is found, MechlabError unless there is one degree of
    freedom.
    """
    path = OneFreedom(mechanism, laws, q)
    phi, load, last = path.path.start.phi, 0.0, np.inf
    for _ in range(300):
        now = _balance(path, phi)
        load = max(load, abs(now.push), abs(now.stiffness))
        if abs(now.push) <= 1e-15 * load or (abs(now.push) < 1e-9 * load and abs(now.push) >= 0.5 * last):
            linear = LinearMotion(
                now.u[:, None] / np.sqrt(now.inertia), np.array([[now.damping / now.inertia]]),
                np.array([[now.stiffness / now.inertia]]), np.zeros(1), load, load, np.array([[now.doubt / now.inertia]]),
            )  # fmt: skip
            return now.q, modes(linear, lambda x: x)
        last = abs(now.push)
        step = now.push / max(abs(now.stiffness), 1e-9 * load)
        phi += float(np.clip(step, -0.3, 0.3)) / max(1.0, float(np.max(np.abs(now.u))))
    raise NoSolution(f"no rest along {path.coordinate}: {last:.3g} stays unbalanced")


def _balance(path: OneFreedom, phi: float) -> _Balance:
    def push(at: float, rate: float) -> tuple[float, float, Array, Array]:
        q, u, _, (inertia, _, weight, damping) = path.split(path.columns(at))
        path.plant.move(0.0, q, u, rate)
        force = applied_force(path.mechanism, path.laws, 0.0, path.plant)[0]
        return float(force @ u) + float(weight) + float(damping) * rate, float(inertia), u, q

    h = STEP
    near, middle, far = (push(phi + k * h, 0.0)[0] - push(phi - k * h, 0.0)[0] for k in (1, 2, 4))
    now, inertia, u, q = push(phi, 0.0)
    damping = (push(phi, -h)[0] - push(phi, h)[0]) / (2 * h)
    slope, wide = (8 * near - middle) / (12 * h), (8 * middle - far) / (24 * h)
    return _Balance(inertia, now, -slope, _doubt(slope, wide), damping, u, q)


def _doubt(slope: float, wide: float) -> float:
    """Error of the difference quotient D(h) of fourth order, given D(2h): (D(h) - D(2h)) / 15 of a smooth force, but the whole of the
    difference where that is no longer small, as across a kink of a curve, where the quotient is of first order."""
    gap = abs(slope - wide)
    return gap if gap > KINKED * abs(slope) else gap / 15


REFERENCE = "the reference pose"


def find_modes(
    design: Design,
    scene: str | None = None,
    fidelity: str | None = None,
    extra: Mapping[str, float] | None = None,
    free: bool = False,
) -> ModesResult:
    """Equilibrium and modes of a design.

    Without a scene the search starts at the reference pose and the drives hold their targets; with a scene it starts at
    the scene's start under the scene's laws. Rests need not stand alone (a joint whose axis is vertical rests anywhere): each
    further witness starts at the rest of the one before, and stays there if its own forces balance too. free: only weight,
    springs and dampers act. extra: X_0
    (start of the search), X_force (constant loads). Raises NoSolution for laws that leave no rest or a start that leads
    to no equilibrium, MechlabError for bad input.
    """
    chosen = design if scene is None else design.for_scene(scene)
    m, made, laws, notes = _situation(chosen, scene, fidelity, dict(extra or {}), free)
    start = initial_pose(m, made.initial, f"{m.name}, {made.name}")
    rough = [*(j.name for j in m.joints if j.friction), *(s.name for s in m.shafts if s.friction)]
    if rough:
        notes = (*notes, f"dry friction of {', '.join(rough)} is left out: where it sticks nothing swings at all")
    witnesses: dict[str, ModesWitness] = {}
    for witness in WITNESSES:
        found = _engine(witness, m, laws, start, soft_stay=any(not w.cannot for w in witnesses.values()))
        witnesses[witness], start = found, start if found.cannot else found.q
    if structure(m).freedoms == 1:
        witnesses["one_freedom"] = _one_freedom(m, laws, start)
    notes = (*notes, *_kinks(m, start))
    parameters = parameter_values(chosen)
    acts = what_acts(m, replace(made, laws=laws))
    return ModesResult(chosen.name, m, made.name, made.fidelity, witnesses, notes, parameters, versions(), acts)


def _kinks(m: Mechanism, q: Array) -> Iterator[str]:
    """A note for each curve whose second derivative jumps at the rest q (nq,), to the reach of the difference quotients."""
    for relation in m.curves:
        curve, x = relation.curve, float(m.value(relation.input, q))
        period = curve.period if curve.rise is not None else math.inf
        for knot in curve.jumps:
            way = abs(curve.folded(x) - knot)
            if min(way, period - way) < 4 * STEP * step_size(m):
                yield (
                    f"the second derivative of {relation.name} jumps at {relation.input} = {x + 0.0:.4g}: each side has a stiffness of its "
                    "own, and small motions across are not linear; these modes are those of the mean of both"
                )
                break


def _situation(
    design: Design, scene: str | None, fidelity: str | None, extra: dict[str, float], free: bool
) -> tuple[Mechanism, Scene, tuple[Law, ...], tuple[str, ...]]:
    """The mechanism, the scene with the start, the laws that act, and notes."""
    moving = [k for k in extra if k.endswith("_rate_0")]
    if moving:
        raise MechlabError(
            f"{design.name}: {moving[0]}: modes are about a rest; give X_0 (where to look) and X_force (constant loads)."
        )
    if scene is not None:
        made = chosen_scene(design, scene, fidelity, None, extra)
        m = design.mechanism(made.fidelity)
        laws, notes = laws_at_rest(m, made)
        return m, made, () if free else laws, notes
    m = design.mechanism(fidelity)
    still = Scene(REFERENCE, design.fidelity(fidelity), 1.0, drives="free" if free else "hold")
    made = with_extra(design, acting(m, still), extra)
    return m, made, *laws_at_rest(m, made)


def _engine(witness: str, m: Mechanism, laws: tuple[Law, ...], q: Array, soft_stay: bool) -> ModesWitness:
    """The result of an engine; the reason where it is not installed."""
    try:
        dynamics: Dynamics = engine(witness).small_motions(m, laws)
    except EngineMissing as error:
        return ModesWitness(cannot=str(error))
    refuse_falling(dynamics, q)
    rest = settle(dynamics, q, soft_stay)
    found = linear(dynamics, rest.x)
    freedoms, here = structure(m).freedoms, found.basis.shape[1]
    if here != freedoms:
        raise Untrustworthy(
            f"{m.name}: the equilibrium is a singular position: {here} freedoms by linearization, {freedoms} in truth. Small motions "
            "about it are not linear; give another start (X_0=...)."
        )
    return ModesWitness(dynamics.coordinates(rest.x), rest.residual, modes(found, dynamics.rates))


def _one_freedom(m: Mechanism, laws: tuple[Law, ...], q: Array) -> ModesWitness:
    try:
        rest, found = one_freedom_modes(m, laws, q)
    except (NoSolution, MechlabError) as error:
        return ModesWitness(cannot=str(error))
    return ModesWitness(np.asarray(rest), 0.0, found)
