"""Is a fidelity an exact reduction of another? The accelerations of what both name, in the same states, under the same laws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.initial import initial_state
from mechlab.experiment.laws import applied_force
from mechlab.experiment.scene import Scene
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, close, integrate, newton
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import null_space, structure
from mechlab.study.witness import room

EXACT = 1e-8
"""Relative difference of accelerations that is rounding: redundant rows of a full model cost some digits."""
STATES = 4
SPREAD = 0.05
WIDTH = 1e-4
"""Rate [rad/s or m/s] over which dry friction is smoothed, in both alike."""


@dataclass(frozen=True)
class Agreement:
    """difference: largest relative difference of the accelerations, infinite where the states of one are none of the other;
    states: how many were compared."""

    difference: float
    states: int
    reason: str = ""

    @property
    def exact(self) -> bool:
        """True for the same equations of motion, as far as the states tell."""
        return self.difference <= EXACT


def agreement(small: Mechanism, rich: Mechanism, scene_small: Scene, scene_rich: Scene) -> Agreement:
    """Accelerations of the joints and shafts that both have, at the start of the scene and at random states near it.

    The state of the rich one follows from that of the small one through the common names and its own closure. Equal
    accelerations in all states mean equal motions and, as laws are functions of the state, equal drive forces.
    """
    common = [n for n in small.scalar_names if n in rich.scalar_names]
    here, there = structure(small), structure(rich)
    if here.mobility != there.mobility:
        return Agreement(np.inf, 0, f"{here.mobility} freedoms against {there.mobility}")
    if not common:
        return Agreement(np.inf, 0, "no joint or shaft in common")
    worst, count = 0.0, 0
    for q, v in _states(small, scene_small):
        found = _same_state(small, rich, common, q, v)
        if found is None:
            return Agreement(np.inf, count, "a state of one is no state of the other")
        a, b = _accelerations(small, scene_small, q, v), _accelerations(rich, scene_rich, *found)
        mine, theirs = (np.array([m.row(n) @ x for n in common]) for m, x in ((small, a), (rich, b)))
        size = float(np.max(np.abs(theirs), initial=0.0))
        worst = max(worst, float(np.max(np.abs(mine - theirs))) / size if size > 1e-9 else 0.0)
        count += 1
    return Agreement(worst, count)


def _states(m: Mechanism, scene: Scene) -> list[tuple[Array, Array]]:
    """The start, and random poses and rates near it."""
    q, v = initial_state(m, scene)
    rng = np.random.default_rng(11)
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    out = [(q, v)]
    scale = max(1.0, float(np.max(np.abs(v), initial=0.0)))
    slides = [m.v_slice[j.name].start for j in m.joints if j.kind == "prismatic"]
    for _ in range(STATES - 1):
        free = null_space(constraints.jacobian(tree.set(q)))
        step = free @ rng.standard_normal(free.shape[1])
        limit = SPREAD * (0.2 if slides else 1.0)
        step *= limit / max(float(np.max(np.abs(step), initial=0.0)), 1e-300)
        moved = newton(
            lambda x: (constraints.residual(tree.set(x)), constraints.jacobian(tree)),
            lambda x, dv: integrate(m, x, dv),
            integrate(m, q, step),
        )
        if moved.closed:
            free = null_space(constraints.jacobian(tree.set(moved.q)))
            kick = free @ rng.standard_normal(free.shape[1])
            base = free @ (free.T @ v)
            out.append((moved.q, base + 0.1 * scale * kick))
    return out


def _same_state(small: Mechanism, rich: Mechanism, common: list[str], q: Array, v: Array) -> tuple[Array, Array] | None:
    found = close(rich, None, {n: float(small.value(n, q)) for n in common}, steps=10)
    if not found.closed:
        return None
    rows = np.vstack([ConstraintSet(rich).jacobian(TreeKinematics(rich, found.q)), [rich.row(n) for n in common]])
    wanted = np.concatenate([np.zeros(len(rows) - len(common)), [small.row(n) @ v for n in common]])
    rates = np.linalg.lstsq(rows, wanted, rcond=1e-11)[0]
    if np.max(np.abs(rows @ rates - wanted)) > 1e-8 * max(1.0, float(np.max(np.abs(wanted)))):
        return None
    return found.q, rates


def _accelerations(m: Mechanism, scene: Scene, q: Array, v: Array) -> Array:
    plant = room("pinocchio").PinPlant(m, q, v)
    force = applied_force(m, scene.laws, 0.0, plant)[0] + plant.passive.friction_force(v, WIDTH)
    found = plant.accelerations(force)[0]
    if not np.all(np.isfinite(found)):
        raise MechlabError(f"{m.name}: accelerations at the start of {scene.name!r} are not finite.")
    return np.asarray(found)
