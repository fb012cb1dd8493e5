"""The equilibrium of a mechanism at rest, and the laws of a scene in the form that acts on a mechanism at rest.

Newton's method on the constraint manifold finds the pose in which weight, springs, servos and constant loads balance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.laws import DcMotor, Law, applied_force
from mechlab.experiment.scene import Scene
from mechlab.experiment.tree_plant import TreePlant
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.studies.modes.eigen import Dynamics, LinearMotion, linear

STEPPED = ("held_rates",)
"""Kinds of laws that hold a rate by bounded forces: they have no stiffness to linearize."""


def laws_at_rest(m: Mechanism, scene: Scene) -> tuple[tuple[Law, ...], tuple[str, ...]]:
    """The laws of a scene in a form that can be linearized, and sentences on what was changed in them.

    Raises NoSolution for a law whose force changes with time (there is then no rest), MechlabError for a law that
    cannot be linearized.
    """
    laws, notes = [], []
    for law in scene.laws:
        if law.kind in STEPPED:
            raise MechlabError(
                f"{m.name}, scene {scene.name}: the law {law.kind} on {', '.join(law.targets())} holds rates by bounded forces and has "
                "no stiffness. Modes need laws that are smooth: choose another scene, or none (the drives then hold their targets)."
            )
        if isinstance(law, DcMotor) and law.inductance:
            law = replace(law, inductance=0.0)
            notes.append(f"the current of the motor on {law.on} is taken to follow at once (no inductance)")
        elif tuple(getattr(law, "start", tuple)()):
            raise MechlabError(
                f"{m.name}, scene {scene.name}: the law {law.kind} has states of its own; modes take laws without."
            )
        laws.append(law)
    _refuse_steady(m, scene, tuple(laws))
    if any(scene.initial_rates.values()):
        notes.append("the rates of the start are left out: an equilibrium at rest is looked for")
    return tuple(laws), tuple(notes)


def _refuse_steady(m: Mechanism, scene: Scene, laws: tuple[Law, ...]) -> None:
    """Raise NoSolution for a law whose force changes with time in a mechanism that stands still."""
    plant = TreePlant(m)
    for law in laws:
        forces = []
        for t in (0.0, 0.137 * scene.duration, 0.618 * scene.duration, scene.duration):
            plant.t = t
            forces.append(applied_force(m, (law,), t, plant)[0])
        if np.max(np.abs(np.array(forces) - forces[0]), initial=0.0) > 1e-9 * max(1.0, float(np.max(np.abs(forces)))):
            raise NoSolution(
                f"{m.name}, scene {scene.name}: the law {law.kind} on {', '.join(law.targets())} follows a motion: the mechanism runs, it "
                "does not rest, and modes about a steady motion are not computed. Choose a scene whose drives stand still, or none "
                "(the drives then hold their targets)."
            )


ITERATIONS = 300
LARGEST = 0.3
"""Largest change of a coordinate in one step [rad or m]."""
BALANCED = 1e-9
"""Largest unbalanced force, relative to the load, that is accepted when rounding stops the descent."""
SOFT = 1e-6
"""Largest stiffness, relative to the load, of a direction that may stand still when it is balanced to a tenth of BALANCED."""
STALLED = 20
"""Steps without half the residual after which soft directions stand still: a rod that spins about its own axis against almost nothing
moves at every step, and disturbs the stiff directions by the square of it."""


@dataclass(frozen=True)
class Rest:
    """An equilibrium: the engine's coordinates x, the unbalanced force along the allowed motions [N m or N], number of
    steps."""

    x: Array
    residual: float
    steps: int


def settle(dynamics: Dynamics, q: Array, soft_stay: bool = False) -> Rest:
    """The equilibrium reached by descent of the potential from coordinates q (nq,); if q is an equilibrium, stable or
    not, q.

    Newton's method where the potential is convex; elsewhere it uses the absolute values of the curvatures, so that the
    step goes downhill and away from a saddle. Directions without force and stiffness stay; with `soft_stay`, or when the
    descent stalls, soft ones that are balanced too. Raises NoSolution when q cannot be assembled, or when no equilibrium is found.
    """
    found = dynamics.closed(dynamics.pose(q))
    if not found.closed:
        raise NoSolution(
            f"{dynamics.mechanism.name}: the start does not close (open by {found.residual:.3g}): {found.status.value}."
        )
    x, load, last = found.q, 0.0, np.inf
    best, when = np.inf, 0
    for k in range(ITERATIONS):
        now = linear(dynamics, x, with_damping=False)
        load = max(load, now.load, 0.1 * now.stiffest)
        residual = _unbalanced(dynamics, now)
        if residual <= 1e-15 * load or (residual < BALANCED * load and residual >= 0.5 * last):
            return Rest(x, residual, k)
        last = residual
        if residual < 0.5 * best:
            best, when = residual, k
        x = _step(dynamics, x, now, _direction(now, load, soft_stay or k - when >= STALLED))
    raise NoSolution(
        f"{dynamics.mechanism.name}: no equilibrium at rest from this start: after {ITERATIONS} steps {residual:.3g} N m or N stay "
        f"unbalanced at {_culprit(dynamics, now)}. Something keeps pushing (a constant load on a free part), or the position is "
        "singular; give another start (X_0=...) or hold the part."
    )


def _unbalanced(dynamics: Dynamics, now: LinearMotion) -> float:
    """Largest generalized force along the allowed motions [N m or N], each motion scaled to a largest entry of 1."""
    if not len(now.gradient):
        return 0.0
    return float(np.max(np.abs(now.gradient) / np.max(np.abs(now.basis), axis=0)))


def _direction(now: LinearMotion, load: float, soft_stay: bool) -> Array:
    """Descent step y (f,) in the basis of `now`."""
    g, values, vectors = now.gradient, *np.linalg.eigh(0.5 * (now.stiffness + now.stiffness.T))
    sizes = np.max(np.abs(now.basis @ vectors), axis=0)
    floor = 1e-9 * max(load, now.stiffest) * sizes**2
    along = vectors.T @ g
    idle = (np.abs(values) <= floor) & (np.abs(along) <= 1e-12 * load * sizes)
    if soft_stay:
        soft = np.abs(values) <= SOFT * max(load, now.stiffest) * sizes**2
        idle |= soft & (np.abs(along) <= 0.1 * BALANCED * load * sizes)
    if np.all((values > floor) | idle):
        keep = vectors[:, ~idle]
        return -keep @ np.linalg.solve(keep.T @ now.stiffness @ keep, keep.T @ g) if keep.shape[1] else 0.0 * g
    curved = np.where(idle, 0.0, along / np.maximum(np.abs(values), np.maximum(floor, 1e-300)))
    return np.asarray(-vectors @ curved)


def _step(dynamics: Dynamics, x: Array, now: LinearMotion, y: Array) -> Array:
    """The next pose. The step is halved while the pose cannot be assembled or while it overshoots the minimum along the
    step: the slope there must not exceed half the slope at the start."""
    dv = now.basis @ y
    biggest = float(np.max(np.abs(dv), initial=0.0))
    scale = min(1.0, LARGEST / biggest) if biggest > 0.0 else 1.0
    slope = float(now.gradient @ y)
    trial = x
    for _ in range(12):
        found = dynamics.closed(dynamics.moved(x, scale * dv))
        if found.closed:
            trial = found.q
            if _slope(dynamics, trial, dv) <= max(0.5 * abs(slope), 1e-13 * now.load * biggest):
                return trial
        scale *= 0.5
    return trial


def _slope(dynamics: Dynamics, x: Array, dv: Array) -> float:
    """Slope of the potential at x along the part of dv that the constraints allow there."""
    rows = dynamics.rows(x)
    along = dv - np.linalg.lstsq(rows, rows @ dv, rcond=1e-11)[0] if len(rows) else dv
    return float(dynamics.force(x) @ along)


def _culprit(dynamics: Dynamics, now: LinearMotion) -> str:
    push = dynamics.rates((now.basis @ now.gradient)[:, None])[:, 0]
    return dynamics.mechanism.rate_names[int(np.argmax(np.abs(push)))]
