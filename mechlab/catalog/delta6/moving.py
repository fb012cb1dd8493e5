"""Check A15: the delta at moving states in particles. The head centre runs straight and the angles turn evenly; places are
closed forms of time, velocities and rates their differences over short times."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.moving_parts import BEVEL, CENTRAL, PLANET, SPUR, STUB, Moment
from mechlab.catalog.delta6.parameters import Delta6Parameters
from mechlab.catalog.delta6.probes import random_poses
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit import mass_check
from mechlab.kit.mass_check import Particles, State
from mechlab.mechanism.geometry import Array

FREEDOMS = {"minimal": 6, "parts": 6, "full": 9}
VELOCITY, TURNING = np.array([0.11, -0.07, 0.09]), np.array([0.9, -0.6, 0.7])
"""Rates of O [m/s] and of alpha, beta, gamma [rad/s]."""
STEP = 1e-3
"""Of the differences [s]: of fourth order, 1e-12 / 30 of fifth derivatives of 1; rounding 1e-16 / STEP."""
GRAVITY = (0.0, 0.0, -9.81)


def state(p: Delta6Parameters, fidelity: str, centre: Array, angles: Array) -> State:
    """The delta at a pose, moving at VELOCITY and TURNING."""

    times = (k * STEP for k in (-2, -1, 0, 1, 2))
    before, just, now, soon, then = (Moment(p, fidelity, centre + t * VELOCITY, angles + t * TURNING) for t in times)

    def rate(of: Callable[[Moment], Array]) -> Array:
        return np.asarray((8.0 * (of(soon) - of(just)) - (of(then) - of(before))) / (12.0 * STEP))

    values: dict[str, Any] = dict(now.values)
    rates: dict[str, Any] = {n: rate(lambda m, n=n: np.asarray(m.values[n])) for n in values}  # type: ignore[misc]
    for n, x in values.items():
        if np.ndim(x):  # the turning of the body in its own axes: twice the vector part of conj(q) q'
            w, u, dw, du = x[0], x[1:], rates[n][0], rates[n][1:]
            rates[n] = 2.0 * (w * du - dw * u - np.cross(u, du))
    shafts = _shafts(p, now.angles)
    values |= {n: row @ angles for n, (row, _) in shafts.items()}
    rates |= {n: row @ TURNING for n, (row, _) in shafts.items()}
    if fidelity == "minimal":
        energy = 0.5 * sum(moment * float(row @ TURNING) ** 2 for row, moment in shafts.values())
    else:
        armature = p.rotor_inertia + (_spins(p) if fidelity == "parts" else 0.0)
        energy = 0.5 * armature * sum(float(rates[f"phi{i}"]) ** 2 for i in (1, 2, 3))
    parts = now.particles()
    particles = Particles(parts.mass, parts.place, rate(lambda m: m.particles().place))
    points = {"O": centre, "D": centre + p.head_offset * now.output[:, 0]}
    return State(values, rates, particles, points, GRAVITY, FREEDOMS[fidelity], energy)


def _spins(p: Delta6Parameters) -> float:
    """Moment of what turns with a shaft besides rotor and gear: two stubs, two crosses, the rod [kg m2]."""
    return 2.0 * STUB[1][2] + 2.0 * p.cross_mass * 0.012**2 / 3.0 + 0.5 * p.rod_mass * p.rod_radius**2


def _shafts(p: Delta6Parameters, angles: Array) -> Mapping[str, tuple[Array, float]]:
    """Shaft -> its turn per turn of alpha, beta, gamma, and its moment [kg m2]: absolute turns of the external train."""
    k, bevel = float(p.k_transfer / p.k_spur), float(p.k_bevel)
    drives, spin = closed.drive_matrix(p.geometry), p.rotor_inertia + _spins(p) + SPUR[1][2]
    rows = {f"phi{i + 1}": (drives[i], spin) for i in range(3)} | {"idler": (np.array([0.0, 0.0, -1.0]), 0.0)}
    for i, sign in ((1, -1.0), (2, 1.0)):
        rows[f"rho{i}"] = (np.array([k * bevel, sign * k, 1.0]), CENTRAL[1][2])
        rows[f"planet{i}_spin"] = (np.array([-bevel, -sign, 1.0]), PLANET[1][2])
        rows[f"bevel{i}_spin"] = (np.array([sign * bevel, 1.0, 0.0]), BEVEL[1][1])
    return rows


def a15(p: Delta6Parameters) -> CheckResult:
    """Two moving states of every fidelity."""
    poses = list(zip(*random_poses(p, 2, seed=17), strict=True))
    pairs = [(build(p, f), state(p, f, c, 0.7 * a)) for f in FREEDOMS for c, a in poses]
    return mass_check.compare(pairs)


CHECKS = (Check("A15", mass_check.TEXT, a15, mass_check.SOURCE),)
