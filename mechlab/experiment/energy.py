"""Energy of a mechanism along a motion, and the finding that says whether it balances with the work done on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.experiment.acting import held_drives
from mechlab.experiment.laws import Law, Servo
from mechlab.experiment.recording import Finding, limit_finding
from mechlab.integrate.samples import integral_by_chords, integral_by_parabolas
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_poses import ManyPoses
from mechlab.mechanism.many_states import ManyStates
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Joint, Shaft

ENERGY_LIMIT = 1e-2
ENERGY_WARNING = 1e-3
NOTHING = 1e-300
"""The turnover [J] of a run in which nothing has energy, so that shares of it are defined."""
STANDSTILL = 1e-3
"""Least turnover of energy: the work of the weight over this distance [m], for a mechanism at rest."""
CREEP = 1e-7
"""Rates below this [rad/s or m/s] are rounding in a mechanism at rest, and so is their kinetic energy."""


def kinetic_energy(mechanism: Mechanism, q: Array, v: Array) -> Array:
    """(n,) kinetic energy [J] along q (n, nq), v (n, nv): bodies, armatures and shafts."""
    return ManyStates(mechanism, np.atleast_2d(q), np.atleast_2d(v)).kinetic_energy()


def potential_energy(mechanism: Mechanism, q: Array) -> Array:
    """(n,) potential energy [J] along q (n, nq): gravity, springs of joints and shafts, springs between points."""
    return ManyStates(mechanism, np.atleast_2d(q)).potential_energy()


def energy(mechanism: Mechanism, q: Array, v: Array) -> Array:
    """(n,) kinetic + potential + spring energy [J] along q (n, nq), v (n, nv)."""
    states = ManyStates(mechanism, np.atleast_2d(q), np.atleast_2d(v))
    return states.kinetic_energy() + states.potential_energy()


def held_energy(mechanism: Mechanism, laws: Sequence[Law], q: Array, v: Array) -> tuple[Array, Array]:
    """(n,) energy [J] stored by holding drives without a force limit, and its rate (n,) [W], along q (n, nq), v
    (n, nv).

    Such a drive acts as a spring: energy = sum of stiffness (value - target)^2 / 2.
    """
    stored, rate = np.zeros(len(q)), np.zeros(len(q))
    for law in held_drives(laws):
        if isinstance(law, Servo) and np.isinf(law.limit):
            off = mechanism.value(law.on, q) - law.motion.at(0.0)[0]
            stored += 0.5 * law.stiffness * off**2
            rate += law.stiffness * off * (v @ mechanism.row(law.on))
    return stored, rate


def dissipation(mechanism: Mechanism, q: Array, v: Array) -> Array:
    """(n,) power [W] >= 0 dissipated by dampers and dry friction of joints and shafts, and by dampers of springs."""
    q, v = np.atleast_2d(q), np.atleast_2d(v)
    diagonal = np.array([j.damping for j in mechanism.joints for _ in range(j.nv)])
    out = v**2 @ diagonal
    for item in _scalars(mechanism):
        rate = v @ mechanism.row(item.name)
        out = out + item.friction * np.abs(rate)
        if isinstance(item, Shaft):
            out = out + item.damping * rate**2
    damped = [s for s in mechanism.springs if s.damping]
    if damped:
        poses = ManyPoses(mechanism).set(q)
        out = out + sum(s.damping * poses.spring(s, v)[1] ** 2 for s in damped)
    return np.asarray(out)


def work(t: ArrayLike, power: ArrayLike) -> Array:
    """(n,) work [J] of the power (n,) [W] from t[0] to each time of t (n,): cumulative Simpson rule, also at uneven
    times."""
    t, power = np.asarray(t, dtype=float), np.asarray(power, dtype=float)
    return integral_by_parabolas(t, power) if len(t) > 2 else integral_by_chords(t, power)


def energy_finding(
    mechanism: Mechanism,
    t: Array,
    q: Array,
    v: Array,
    power: Array,
    done: Array | None = None,
    limit: float = ENERGY_LIMIT,
    warn: float = ENERGY_WARNING,
    in_rows: float = 0.0,
    stopped: NDArray[np.bool_] | None = None,
    laws: Sequence[Law] = (),
) -> Finding:
    """Finding "energy_balance": the largest |E(t) - E(0) - work(t)|, relative to the turnover of energy in the run.

    power (n,) [W]: of all laws less the dissipation, at the samples. Its work is integrated by Simpson's rule, or, more
    accurately, given by the engine as `done` (n,) [J]. laws: those of the scene; energy that holding drives store as
    springs counts as potential energy. Turnover: the largest of the maximal kinetic energy, the span of the potential
    energy, the integral of |power|, and the work of the weight over STANDSTILL. Two amounts are allowed for: the error
    of Simpson's rule between samples (a tenth of its difference from the trapezoidal rule), and `in_rows` [J], the work
    that soft gear rows take up under load (their lag has its own finding).

    stopped (n - 1,): the intervals between samples in which a joint was at an end of its range. A stop can only take
    energy: energy lost in these intervals is accounted for; energy gained there, and any change elsewhere, is not.
    """
    # the last state is the first pose at the rates of standstill
    still = np.full((1, mechanism.nv), CREEP)
    states = ManyStates(mechanism, np.concatenate([q, q[:1]]), np.concatenate([v, still]))
    (kinetic, creep), potential = np.split(states.kinetic_energy(), [len(q)]), states.potential_energy()[:-1]
    stored, storing = held_energy(mechanism, laws, q, v)
    potential, power = potential + stored, power + storing
    if done is not None:
        done = np.asarray(done, dtype=float) + stored - stored[0]
    total = kinetic + potential
    spent = work(t, power) if done is None else np.asarray(done, dtype=float)
    weight = mechanism.total_mass * float(np.linalg.norm(mechanism.gravity))
    moved = (float(np.max(kinetic)), float(np.ptp(potential)), float(work(t, np.abs(power))[-1]))
    turnover = max(*moved, weight * STANDSTILL, NOTHING)
    open_ = total - total[0] - (spent - spent[0])
    at_stops = np.zeros(len(open_)) if stopped is None else _lost_at_stops(open_, stopped)
    missing = np.abs(open_ - at_stops)
    if done is None and len(t) > 2:
        missing = np.maximum(0.0, missing - 0.1 * np.abs(integral_by_chords(t, power) - spent))
    missing = np.maximum(0.0, missing - in_rows)
    noise = max(1e-12 * float(np.max(np.abs(potential), initial=0.0)), float(creep[0]))
    value = float(np.max(missing)) / turnover if not np.max(missing) <= noise else 0.0
    if turnover == NOTHING and value == 0.0:
        return nothing_moved(limit)
    taken = f" beside the {-at_stops[-1]:.3g} J that stops took" if at_stops[-1] < 0.0 else ""
    text = f"energy balance: at most {np.max(missing):.3g} J of {turnover:.3g} J turned over is unaccounted for{taken}:"
    return limit_finding("energy_balance", value, limit, "of the turnover", text, warn)


def nothing_moved(limit: float) -> Finding:
    """Finding "energy_balance" of a run without any energy."""
    text = "energy balance: nothing moved, and no energy came or went"
    return Finding("energy_balance", 0.0, limit, "of the turnover", "ok", text)


def _lost_at_stops(missing: Array, stopped: NDArray[np.bool_]) -> Array:
    """(n,) energy [J] <= 0 that stops have taken up to each sample, from the energy error `missing` (n,).

    In the intervals `stopped` (n - 1,) a fall of the error is energy lost to a stop or stored in a soft one; a soft
    stop may return at most what it has stored in the same contact.
    """
    out = np.zeros(len(missing))
    lent = 0.0
    for k, at_one in enumerate(stopped):
        change = float(missing[k + 1] - missing[k])
        change = min(change, -lent) if at_one else 0.0
        lent = lent + change if at_one else 0.0
        out[k + 1] = out[k] + change
    return out


def _scalars(mechanism: Mechanism) -> list[Joint | Shaft]:
    return [j for j in mechanism.joints if j.nv == 1] + list(mechanism.shafts)


__all__ = [
    "ENERGY_LIMIT", "ENERGY_WARNING", "dissipation", "energy", "energy_finding", "held_energy", "kinetic_energy",
    "potential_energy", "work",
]  # fmt: skip
