"""Gear trains about one axis, z, at a moving state in particles, and how many of their meshes share a load."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mechlab.catalog.epicyclic import FIDELITIES
from mechlab.experiment.check import Check, Measured
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import rank
from mechlab.study import mass_check
from mechlab.study.mass_check import Particles, State, solid, spread_of
from mechlab.study.witness import room

TURN, RATE = 0.7, 1.3
"""Angle [rad] and rate [rad/s] of the carrier at which a train is looked at; other members turn as its teeth say."""


def wheel(mass: float, moment: float, rate: float, at: Array | None = None, orbit_rate: float = 0.0) -> Particles:
    """A flat part of revolution about z with its `moment`, turning at `rate`; its axis rides round the z axis from `at` (3,)."""
    centre = np.zeros(3) if at is None else np.asarray(at, dtype=float)
    velocity = orbit_rate * np.array([-centre[1], centre[0], 0.0])
    spread = spread_of(mass, (0.5 * moment, 0.5 * moment, moment))
    return solid(mass, centre, spread, velocity=velocity, turn=(0.0, 0.0, rate))


def disc(moment: float, radius: float, rate: float) -> Particles:
    """A uniform flat disc about the z axis: mass 2 moment / radius^2."""
    return wheel(2.0 * moment / radius**2, moment, rate)


def seats(radius: float, planets: int, turn: float = TURN) -> list[Array]:
    """Where planets at equal angles stand when their carrier has turned by `turn`, each (3,) [m]."""
    angles = (turn + 2.0 * math.pi * k / planets for k in range(planets))
    return [radius * np.array([math.cos(a), math.sin(a), 0.0]) for a in angles]


def train_state(turns: Mapping[str, float], particles: Particles, rotors: float = 0.0, freedoms: int = 1) -> State:
    """A train without gravity and springs: `turns` of joints and shafts for a turn of the carrier, what turns, and twice the
    energy of its shafts at 1 rad/s of the carrier [kg m2]."""
    angles, rates = ({n: x * c for n, c in turns.items()} for x in (TURN, RATE))
    return State(angles, rates, particles, {}, (0.0, 0.0, 0.0), freedoms, 0.5 * rotors * RATE**2)


def moving_check(name: str, build: Callable[[Any, str], Mechanism], state: Callable[[Any, str], State | None]) -> Check:
    """The check of `mechlab.study.mass_check` in every fidelity that can be built (state None: it cannot)."""

    def run(p: Any) -> Measured:
        states = {f: state(p, f) for f in FIDELITIES}
        return mass_check.compare([(build(p, f), s) for f, s in states.items() if s is not None])

    return Check(name, mass_check.TEXT, run, mass_check.SOURCE)


def mesh_check(name: str, build: Callable[[Any, str], Mechanism], meshes: int, wheels: int) -> Check:
    """Each ray of planets has so many `meshes` and `wheels`. The first one makes the train; every other one repeats as many
    rows as it has meshes more than wheels: that many loads statics cannot share out."""

    def run(p: Any) -> Measured:
        import mujoco

        from mechlab.simulate.model import equality_jacobian

        said: dict[str, list[int]] = {"numpy": [], "mujoco": []}
        expected: list[int] = []
        for fidelity, rays in (("parts", 1), ("full", int(p.planets))):
            m = build(p, fidelity)
            model, data = room("mujoco").to_mujoco(m)
            mujoco.mj_forward(model, data)
            rows = {"numpy": ConstraintSet(m).jacobian(TreeKinematics(m)), "mujoco": equality_jacobian(model, data)}
            for who, jacobian in rows.items():
                said[who] += [len(jacobian), len(jacobian) - rank(jacobian)]
            expected += [rays * meshes, (rays - 1) * (meshes - wheels)]
        return Measured(said, 0.0, expected, "rows and redundant rows: parts, full")

    return Check(name, "rows of the meshes, and how many repeat others", run, "count of meshes and wheels on a ray")
