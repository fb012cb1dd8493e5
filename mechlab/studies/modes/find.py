"""A third witness where there is one freedom: J phi'' - Q(phi, phi') = 0 along the closed path, J the generalised inertia.

Modes made visible: a recording that swings through the modes one after another, closed at every instant.

The modes of a design, from Pinocchio, MuJoCo and, where there is one freedom, the generalised inertia of the path.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechlab.engines.own.one_freedom import OneFreedom
from mechlab.engines.protocol import WITNESSES, engine
from mechlab.errors import EngineMissing, MechlabError, NoSolution, Untrustworthy
from mechlab.experiment.acting import acting, what_acts
from mechlab.experiment.laws import Law, applied_force
from mechlab.experiment.parameters import describe
from mechlab.experiment.recording import Finding, Health, Recording, basic_channels
from mechlab.experiment.scene import Scene, Settings, initial_pose
from mechlab.lab.design import Design, with_extra
from mechlab.lab.fidelity.choose import chosen_scene
from mechlab.lab.run import versions
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics, integrate
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import newton
from mechlab.mechanism.structure import structure
from mechlab.studies.modes.eigen import OSCILLATING, RIGID, UNSTABLE, Dynamics, Linear, Mode, linear, modes
from mechlab.studies.modes.equilibrium import laws_at_rest, settle
from mechlab.studies.modes.result import ModesResult, Witness

STEP = 1e-3


@dataclass(frozen=True)
class _Balance:
    """Along the path at phi: inertia J, push Q, its slopes in phi and phi', tangent u (nv,), coordinates q (nq,)."""

    inertia: float
    push: float
    stiffness: float
    damping: float
    u: Array
    q: Array


def one_freedom_modes(mechanism: Mechanism, laws: tuple[Law, ...], q: Array) -> tuple[Array, tuple[Mode, ...]]:
    """Coordinates (nq,) of the rest reached downhill from q, and its one mode: omega^2 = V''(phi) / J(phi).

    Raises NoSolution where the path ends or no rest is found, MechlabError for other than one freedom.
    """
    path = OneFreedom(mechanism, laws, q)
    phi, load, last = path.path.start.phi, 0.0, np.inf
    for _ in range(300):
        now = _balance(path, phi)
        load = max(load, abs(now.push), abs(now.stiffness))
        if abs(now.push) <= 1e-15 * load or (abs(now.push) < 1e-9 * load and abs(now.push) >= 0.5 * last):
            linear = Linear(
                now.u[:, None] / np.sqrt(now.inertia), np.array([[now.damping / now.inertia]]),
                np.array([[now.stiffness / now.inertia]]), np.zeros(1), load, load,
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
    (q1, *_), (q2, *_), (q3, *_), (q4, *_) = (push(phi + k * h, 0.0) for k in (1, -1, 2, -2))
    now, inertia, u, q = push(phi, 0.0)
    damping = (push(phi, -h)[0] - push(phi, h)[0]) / (2 * h)
    return _Balance(inertia, now, -(8 * (q1 - q2) - q3 + q4) / (12 * h), damping, u, q)


SECONDS, SWINGS, FRAMES = 4.0, 4, 80
"""Each mode: seconds, swings within them, frames."""
LARGEST_TURN, LARGEST_SHIFT = 0.35, 0.12
"""Amplitude: no joint turns farther [rad], no centre of mass moves farther [sizes of the mechanism]."""
MOST = 8


def mode_motion(result: ModesResult, chosen: Sequence[int] = ()) -> Recording:
    """A Recording of the chosen modes (numbers from 1; default: the slowest that are not rigid, at most eight).

    Each swings q = rest + a w(t) Re(shape exp(i phase(t))), w = sin^2 over its seconds, and is closed again by assembly. The
    tempo is the page's, not the mode's; the findings say which is which. Raises MechlabError for a number that does not exist.
    """
    numbers = list(chosen) or _default(result.modes)
    for k in numbers:
        if not 1 <= k <= len(result.modes):
            raise MechlabError(f"{result.name}: mode {k} does not exist; modes are numbered 1 to {len(result.modes)}.")
    m = result.mechanism
    amplitudes, q, findings = {}, [result.q], []
    total = len(numbers) * FRAMES + 1
    t = np.linspace(0.0, max(1, len(numbers)) * SECONDS, total)
    for place, k in enumerate(numbers):
        mode = result.modes[k - 1]
        size = _amplitude(m, result.q, np.real(mode.shape))
        s = np.arange(1, FRAMES + 1) / FRAMES
        envelope = size * np.sin(math.pi * s) ** 2
        turns = SWINGS if mode.kind == OSCILLATING else 1
        swing = envelope[:, None] * np.real(mode.shape * np.exp(2j * math.pi * turns * s)[:, None])
        q += [_closed(m, integrate(m, result.q, x)) for x in swing]
        wave = np.zeros(total)
        wave[place * FRAMES + 1 : (place + 1) * FRAMES + 1] = envelope * np.cos(2 * math.pi * turns * s)
        amplitudes[f"mode_{k}"] = wave
        findings.append(_finding(k, mode, place * SECONDS))
    poses = np.array(q if numbers else [result.q])
    v = np.zeros((len(poses), m.nv))
    channels, units = basic_channels(m, poses, v)
    return Recording(
        m, t, poses, v, channels | amplitudes, units | dict.fromkeys(amplitudes, ""), Health(tuple(findings)),
        settings=Settings(engine="analytic"), scene=f"modes about {result.scene}", name=result.name, fidelity=result.fidelity,
        parameters=dict(result.parameters), versions=dict(result.versions),
    )  # fmt: skip


def _default(found: tuple[Mode, ...]) -> list[int]:
    lively = [k for k, m in enumerate(found, 1) if m.kind != RIGID]
    return (lively or list(range(1, len(found) + 1)))[:MOST]


def _finding(k: int, mode: Mode, start: float) -> Finding:
    what = f"{mode.frequency_hz:.5g} Hz" + (f", damping {mode.damping:.3g}" if mode.damping else "")
    if mode.kind == UNSTABLE:
        what = f"grows with {mode.growth:.4g} 1/s"
    elif mode.kind == RIGID:
        what = "no stiffness"
    text = f"{start:g} to {start + SECONDS:g} s: mode {k}, {mode.kind}, {what}; tempo and size are of the picture"
    severity = "warning" if mode.kind == UNSTABLE else "ok"
    return Finding(f"mode_{k}", mode.omega, 0.0, "rad/s", severity, text)


def _amplitude(m: Mechanism, q: Array, shape: Array) -> float:
    """Factor of the shape that is large enough to see and small enough to be a small motion."""
    points = _centres(m, q)
    size = float(np.max(np.ptp(np.vstack([points, np.zeros((1, 3))]), axis=0))) or 1.0
    h = 1e-4
    moved = float(np.max(np.linalg.norm(_centres(m, integrate(m, q, h * shape)) - points, axis=1))) / h
    slides = [m.v_slice[j.name].start for j in m.joints if j.kind == "prismatic"]
    turn = float(np.max(np.abs(np.delete(shape, slides)), initial=0.0))
    limits = [
        LARGEST_SHIFT * size / moved if moved > 1e-9 else math.inf,
        LARGEST_TURN / turn if turn > 1e-9 else math.inf,
    ]
    least = min(limits)
    return least if math.isfinite(least) else 1.0


def _centres(m: Mechanism, q: Array) -> Array:
    tree = TreeKinematics(m, q)
    out = []
    for body in m.bodies:
        rotation, origin = tree.pose(body.name)
        out += [origin, origin + rotation @ np.array(body.inertia.com)]
    return np.array(out)


def _closed(m: Mechanism, q: Array) -> Array:
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    if not len(constraints):
        return q
    found = newton(
        lambda x: (constraints.residual(tree.set(x)), constraints.jacobian(tree)), lambda x, dv: integrate(m, x, dv), q
    )
    return found.q


REFERENCE = "the reference pose"


def find_modes(
    design: Design,
    scene: str | None = None,
    fidelity: str | None = None,
    extra: Mapping[str, float] | None = None,
    free: bool = False,
) -> ModesResult:
    """Equilibrium and modes of a design.

    Without a scene the drives hold their targets from the reference pose; with one what acts in it, from its start. free:
    neither; weight, springs and dampers alone. extra: X_0 (start of the search), X_force (constant loads). Raises
    NoSolution for a motion that does not rest or a start without equilibrium near, MechlabError for bad input.
    """
    lived = design if scene is None else design.for_scene(scene)
    m, made, laws, notes = _situation(lived, scene, fidelity, dict(extra or {}), free)
    start = initial_pose(m, made.initial, f"{m.name}, {made.name}")
    rough = [*(j.name for j in m.joints if j.friction), *(s.name for s in m.shafts if s.friction)]
    if rough:
        notes = (*notes, f"dry friction of {', '.join(rough)} is left out: where it sticks nothing swings at all")
    witnesses: dict[str, Witness] = {}
    for witness in WITNESSES:
        witnesses[witness] = _ask(lambda witness=witness: _engine(witness, m, laws, start))  # type: ignore[misc]
    if structure(m).freedoms == 1:
        witnesses["one_freedom"] = _ask(lambda: _one_freedom(m, laws, start))
    parameters = {i.name: getattr(lived.parameters, i.name) for i in describe(lived.entry.parameters)}
    acts = what_acts(m, replace(made, laws=laws))
    return ModesResult(lived.name, m, made.name, made.fidelity, witnesses, notes, parameters, versions(), acts)


def _situation(
    design: Design, scene: str | None, fidelity: str | None, extra: dict[str, float], free: bool
) -> tuple[Mechanism, Scene, tuple[Law, ...], tuple[str, ...]]:
    """The mechanism, the start, what acts, and notes."""
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


def _ask(work: Callable[[], Witness]) -> Witness:
    """A witness that is not installed, or has no path, says so; other errors are the user's."""
    try:
        return work()
    except EngineMissing as error:
        return Witness(cannot=str(error))


def _engine(witness: str, m: Mechanism, laws: tuple[Law, ...], q: Array) -> Witness:
    dynamics: Dynamics = engine(witness).small_motions(m, laws)
    rest = settle(dynamics, q)
    found = linear(dynamics, rest.x)
    freedoms, here = structure(m).freedoms, found.basis.shape[1]
    if here != freedoms:
        raise Untrustworthy(
            f"{m.name}: the equilibrium is a singular position: {here} freedoms by linearisation, {freedoms} in truth. Small motions "
            "about it are not linear; give another start (X_0=...)."
        )
    return Witness(dynamics.coordinates(rest.x), rest.residual, modes(found, dynamics.rates))


def _one_freedom(m: Mechanism, laws: tuple[Law, ...], q: Array) -> Witness:
    try:
        rest, found = one_freedom_modes(m, laws, q)
    except (NoSolution, MechlabError) as error:
        return Witness(cannot=str(error))
    return Witness(np.asarray(rest), 0.0, found)


__all__: list[Any] = ["find_modes"]
