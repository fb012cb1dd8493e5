"""The error of a fidelity against the richest: the same scene, at the same times, in everything that both name.

Engines hold loops and gears by soft rows, of which a richer model has more. To leave their softness out, every sample is first
closed again by the smallest correction in the sense of the kinetic energy. Below the size of these corrections (`resolution`)
an error cannot be told from the softness of the engine.

A fidelity is an exact reduction of another where both have the same accelerations in the same states under the same laws.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.laws import applied_force
from mechlab.experiment.recording import Recording, basic_channels
from mechlab.experiment.scene import Scene, initial_state
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, close, integrate, newton
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import DryFriction
from mechlab.mechanism.structure import null_space, structure

REFERENCE = "pinocchio"
"""The engine that closes samples and gives accelerations: its rows are rigid."""
SAMPLES = 100


@dataclass(frozen=True)
class FidelityError:
    """poses: largest difference of a joint, shaft or frame coordinate [rad or m]; worst: its name; slip [rad or m]: how
    far the rows of the engine gave way in this run; resolution [rad or m]: the sum of the slips of both runs.

    forces: largest error of a drive force, root mean square over the run, as a share of that of the force; loads:
    likewise of a tooth load; None where the rows differ. Mean squares, because the first instant of an unbalanced start
    means nothing.
    """

    poses: float
    worst: str
    forces: float | None
    loads: float | None = None
    slip: float = 0.0
    resolution: float = 0.0


def error_against(run: Recording, richest: Recording) -> FidelityError:
    """The error of a run against the richest, over the time that both cover."""
    names = [n for n in run.mechanism.scalar_names if n in richest.mechanism.scalar_names]
    frames = {f.name for f in run.mechanism.frames} & {f.name for f in richest.mechanism.frames}
    names += [f"{f}_{a}" for f in sorted(frames) for a in "xyz"]
    end = min(float(run.t[-1]), float(richest.t[-1]))
    times = run.t[run.t <= end * (1.0 + 1e-12)]
    (mine, slip), (theirs, other_slip) = closed(thinned(run)), closed(thinned(richest))
    few = mine.t[mine.t <= end * (1.0 + 1e-12)]
    gaps = {n: float(np.max(np.abs(_at(mine, n, few) - _at(theirs, n, few)))) for n in names}
    worst = max(gaps, key=lambda n: gaps[n]) if gaps else ""
    forces = [n for n in run.channels if n.endswith("_force") and n in richest.channels]
    rows, other_rows = ({r.name for r in x.mechanism.relations} for x in (run, richest))
    loads = [f"{n}_load" for n in sorted(rows)] if rows == other_rows else []
    shares = [_share(run, richest, channels, times) for channels in (forces, loads)]
    return FidelityError(gaps.get(worst, 0.0), worst, shares[0], shares[1], slip, slip + other_slip)


def thinned(run: Recording) -> Recording:
    """The run at about SAMPLES of its samples, the first and the last among them."""
    stride = max(1, (len(run.t) - 1) // SAMPLES)
    keep = np.unique(np.append(np.arange(0, len(run.t), stride), len(run.t) - 1))
    channels = {n: x[keep] for n, x in run.channels.items()}
    return replace(run, t=run.t[keep], q=run.q[keep], v=run.v[keep], channels=channels)


def closed(run: Recording) -> tuple[Recording, float]:
    """The run with every pose closed again, its basic channels from them; and the largest correction [rad or m]."""
    m = run.mechanism
    if not m.is_closed:
        return run, 0.0
    plant = engine(REFERENCE).plant(m)
    q, slip = run.q.copy(), 0.0
    for k in range(len(q)):
        moved = np.zeros(m.nv)
        for _ in range(4):
            residual = plant.set(q[k]).closing()[0]
            if np.max(np.abs(residual)) < 1e-13:
                break
            step = plant.correction(residual)
            moved += step
            q[k] = integrate(m, q[k], step)
        slip = max(slip, float(np.max(np.abs(moved))))
    channels, _ = basic_channels(m, q, run.v)
    return run.with_channels(channels, {}), slip


def _at(run: Recording, name: str, times: Array) -> Array:
    if len(run.t) >= len(times) and np.array_equal(run.t[: len(times)], times):
        return run.channel(name)[: len(times)]
    return np.array([run.at(name, min(t, float(run.t[-1]))) for t in times])


def _share(run: Recording, richest: Recording, names: Sequence[str], times: Array) -> float | None:
    """Largest root mean square difference of any of the channels, as a share of that of the channel; None without any."""
    out = []
    for n in names:
        if n in run.channels and n in richest.channels:
            a, b = _at(run, n, times), _at(richest, n, times)
            off, size = float(np.sqrt(np.mean((a - b) ** 2))), float(np.sqrt(np.mean(b**2)))
            out.append(off / size if size > 1e-12 else off)
    return max(out) if out else None


EXACT = 1e-8
"""Relative difference of accelerations that is rounding: redundant rows of a full model cost some digits."""
STATES = 4
POSE_SPREAD = 0.05
FRICTION_WIDTH = 1e-4
"""Rate [rad/s or m/s] over which dry friction is smoothed, in both alike."""


@dataclass(frozen=True)
class Agreement:
    """difference: largest relative difference of the accelerations, infinite where a state of one is not possible in
    the other; states: how many were compared."""

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
    for _ in range(STATES - 1):
        free = null_space(constraints.jacobian(tree.set(q)))
        step = free @ rng.standard_normal(free.shape[1])
        limit = POSE_SPREAD * (0.2 if m.slides else 1.0)
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
    rigid = engine(REFERENCE)
    laws = applied_force(m, scene.laws, 0.0, rigid.plant(m).set(q, v))[0]
    found = rigid.accelerations(m, q, v, laws + DryFriction.of(m).force(v, FRICTION_WIDTH))
    if not np.all(np.isfinite(found)):
        raise MechlabError(f"{m.name}: accelerations at the start of {scene.name!r} are not finite.")
    return np.asarray(found)
