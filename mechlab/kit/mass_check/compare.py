"""Mass, momenta, energy and power of a mechanism at moving states: closed form against three implementations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechlab.experiment.entry import CheckResult
from mechlab.kit.mass_check.engines import Reading, by_mujoco, by_numpy, by_pinocchio
from mechlab.kit.mass_check.particles import Pair, State, coordinates
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array, cross

TEXT = "masses, momenta, energy, power and points of a moving state"
SOURCE = "particles in closed form"


def compare(pairs: Sequence[Pair], tolerance: float = 1e-9) -> CheckResult:
    """Mass, centre of mass, inertia tensor and angular momentum about the world's origin, momentum, kinetic energy, power of
    gravity with springs, power of dampers, points, shafts, opening of loops and relations, freedoms: three implementations
    against closed form, each quantity relative to its size. Raises MechlabError where the closed form leaves out a name."""
    said: dict[str, list[Array]] = {"expected": [], "numpy": [], "pinocchio": [], "mujoco": []}
    labels: list[str] = []
    for m, state in pairs:
        q, v = coordinates(m, state)
        readings = {"numpy": by_numpy(m, q, v), "pinocchio": by_pinocchio(m, q, v), "mujoco": by_mujoco(m, q, v)}
        truth, sizes = _expected(m, state)
        told = {"expected": truth} | {name: _told(m, state, q, v, r) for name, r in readings.items()}
        for name, numbers in told.items():
            said[name].append(np.concatenate([np.ravel(numbers[k]) / sizes[k] for k in sizes]))
        labels += [k for k in sizes for _ in range(np.size(truth[k]))]
    values = {k: np.concatenate(x) for k, x in said.items()}
    expected = values.pop("expected")
    # Sums of some dozens of terms round to 1e-15, poses of a closed form close to 1e-12: 1e-9 leaves three digits of margin.
    found = CheckResult(values, tolerance, expected, f"{len(pairs)} states, each quantity relative to its size")
    if found.passed:
        return found
    wrong: dict[str, dict[str, None]] = {}
    for name, row in values.items():
        for k in np.flatnonzero(~(np.abs(row - expected) <= tolerance)):
            wrong.setdefault(labels[k], {})[name] = None
    sentence = "; ".join(f"{label} ({', '.join(names)})" for label, names in wrong.items())
    return CheckResult(values, tolerance, expected, f"{found.note}. Not so: {sentence}")


def _shafts(m: Mechanism) -> list[str]:
    return [s.name for s in m.shafts]


def _told(m: Mechanism, state: State, q: Array, v: Array, r: Reading) -> dict[str, Any]:
    mass = sum(s.mass for s in r.shares)
    first = sum((s.mass * s.centre for s in r.shares), np.zeros(3))
    moved = q - m.reference() if state.is_reference else np.zeros(m.nq)
    angles = np.array([float(m.value(n, q)) for n in _shafts(m)])
    return {
        "mass": mass, "centre of mass": first / max(mass, 1e-300),
        "inertia tensor": sum((s.tensor + _steiner(s.mass, s.centre) for s in r.shares), np.zeros((3, 3))),
        "momentum": sum((s.momentum for s in r.shares), np.zeros(3)),
        "angular momentum": sum((s.spin + cross(s.centre, s.momentum) for s in r.shares), np.zeros(3)),
        "kinetic energy": 0.5 * v @ r.matrix @ v, "power of gravity and springs": v @ r.still,
        "power of dampers": 0.5 * v @ (r.ahead - r.back), "points": r.points,
        "poses of bodies": np.array([np.column_stack(r.poses[n]) for n in state.poses]),
        "shafts": np.concatenate([np.cos(angles), np.sin(angles), [m.row(n) @ v for n in _shafts(m)]]),
        "opening of loops": r.rows[0], "opening rate of loops": r.rows[1], "freedoms": r.rows[2],
        "coordinates": moved,
    }  # fmt: skip


def _expected(m: Mechanism, state: State) -> tuple[dict[str, Any], dict[str, float]]:
    """The quantities of `_told` from the particles, and the scale of each."""
    mass, x, v = state.particles.mass, state.particles.place, state.particles.velocity
    total, gravity = float(np.sum(mass)), np.asarray(state.gravity, dtype=float)
    away, fast = (float(np.sqrt(mass @ np.sum(z**2, axis=1) / max(total, 1e-300))) for z in (x, v))
    momentum = mass @ v
    angles = np.array([float(state.values[n]) for n in _shafts(m)])
    kinetic = 0.5 * total * fast**2 + state.rotors
    truth: dict[str, Any] = {
        "mass": total, "centre of mass": mass @ x / max(total, 1e-300),
        "inertia tensor": sum((_steiner(k, z) for k, z in zip(mass, x, strict=True)), np.zeros((3, 3))),
        "momentum": momentum, "angular momentum": mass @ np.cross(x, v), "kinetic energy": kinetic,
        "power of gravity and springs": state.stored - gravity @ momentum, "power of dampers": state.lost,
        "points": np.array([state.points[f.name] for f in m.frames], dtype=float).reshape(-1, 3),
        "poses of bodies": np.array([np.column_stack([np.asarray(z) for z in p]) for p in state.poses.values()]),
        "shafts": np.concatenate([np.cos(angles), np.sin(angles), [float(state.rates[n]) for n in _shafts(m)]]),
        "opening of loops": 0.0, "opening rate of loops": 0.0, "freedoms": state.freedoms,
        "coordinates": np.zeros(m.nq),
    }  # fmt: skip
    power = (
        total * fast * (float(np.linalg.norm(gravity)) + fast**2 / max(away, 1e-300)) + abs(state.stored) + state.lost
    )
    sizes = {
        "mass": total, "centre of mass": away, "inertia tensor": total * away**2, "momentum": total * fast,
        "angular momentum": total * away * fast, "kinetic energy": kinetic, "power of gravity and springs": power,
        "power of dampers": power, "points": away, "poses of bodies": 1.0, "opening of loops": away, "opening rate of loops": fast,
        "shafts": max(1.0, float(np.max(np.abs(truth["shafts"]), initial=0.0))), "freedoms": 1.0, "coordinates": 1.0,
    }  # fmt: skip
    return truth, {k: x or 1.0 for k, x in sizes.items()}


def _steiner(mass: float, place: Array) -> Array:
    """(3, 3) inertia tensor about the origin [kg m2] of a point mass at a place (3,)."""
    return np.asarray(mass * (place @ place * np.eye(3) - np.outer(place, place)))
