"""A moving state of a mechanism in closed form, with its rigid parts as particles.

Every rigid part is equimomental to six particles, each of a sixth of its mass, at distances +-sqrt(3) spread from its
centre along its three principal axes (Routh, Elementary Rigid Dynamics, 1905). The particles of a box lie in the
middles of its faces; those of a slender bar are one at each end and four in the middle (Simpson's rule). A check then
needs no inertia tensor: it sums over positions and velocities of particles.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array


@dataclass(frozen=True)
class Particles:
    """Masses (n,) [kg], positions (n, 3) [m] and velocities (n, 3) [m/s] in world axes. `a + b`: the particles of
    both."""

    mass: Array
    place: Array
    velocity: Array

    def __add__(self, other: Particles) -> Particles:
        pairs = ((self.mass, other.mass), (self.place, other.place), (self.velocity, other.velocity))
        return Particles(*(np.concatenate(pair) for pair in pairs))


NOTHING = Particles(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)))


def solid(
    mass: float, centre: ArrayLike, spread: ArrayLike = (0.0, 0.0, 0.0), axes: ArrayLike = ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    velocity: ArrayLike = (0.0, 0.0, 0.0), turn: ArrayLike = (0.0, 0.0, 0.0),
) -> Particles:  # fmt: skip
    """A rigid part as six particles: `centre` of mass and its `velocity`, `turn` = angular velocity, all (3,) in world axes;
    `spread` (3,) [m]: root mean square distances from the centre along its principal axes, the columns of `axes` (3, 3).
    Without a spread it is a point mass. Spread of a box: edge / sqrt(12); of a circular section: radius / 2."""
    arms = np.sqrt(3.0) * (np.asarray(axes, dtype=float) * np.asarray(spread, dtype=float)).T
    arms = np.concatenate([arms, -arms])
    around = np.cross(np.asarray(turn, dtype=float), arms)
    return Particles(np.full(6, mass / 6.0), np.asarray(centre) + arms, np.asarray(velocity) + around)


def spread_of(mass: float, moments: Sequence[float]) -> Array:
    """(3,) spread [m] along the principal axes of a part with this mass [kg] and these principal moments [kg m2]."""
    return np.sqrt(np.maximum(0.0, 0.5 * np.sum(moments) - np.asarray(moments, dtype=float)) / mass)


def rod(mass: float, a: ArrayLike, b: ArrayLike, va: ArrayLike, vb: ArrayLike, radius: float = 0.0) -> Particles:
    """A uniform round rod between ends a, b (3,) [m] with velocities va, vb (3,) [m/s], without spin about its axis."""
    a, b, va, vb = (np.asarray(x, dtype=float) for x in (a, b, va, vb))
    way = b - a
    length = float(np.linalg.norm(way))
    axes = np.linalg.svd(way[None])[2].T  # the first axis along the rod, the others any two across it
    spread = (length / np.sqrt(12.0), 0.5 * radius, 0.5 * radius)
    turn = np.cross(way, vb - va) / length**2
    return solid(mass, (a + b) / 2.0, spread, axes, (va + vb) / 2.0, turn)


@dataclass(frozen=True)
class State:
    """A moving state of a mechanism in closed form.

    values, rates: joint or shaft -> value, rate (spherical joint: quaternion w, x, y, z, and angular velocity in body
    axes). They set the state of the engines; those of shafts are compared too. particles: all moving masses. points:
    frame -> world position (3,) [m]. gravity (3,) [m/s2]. freedoms: degrees of freedom. rotors [J]: kinetic energy of
    armatures and shafts. stored [W]: power into springs; lost [W]: power into dampers. poses: body -> rotation (3, 3)
    and origin (3,) in the world, for bodies without mass or whose rotation moves no mass. is_reference: True at the
    reference pose, where all coordinates are zero.
    """

    values: Mapping[str, Any]
    rates: Mapping[str, Any]
    particles: Particles
    points: Mapping[str, ArrayLike]
    gravity: ArrayLike
    freedoms: int
    rotors: float = 0.0
    stored: float = 0.0
    lost: float = 0.0
    poses: Mapping[str, tuple[ArrayLike, ArrayLike]] = field(default_factory=dict)
    is_reference: bool = False


Pair = tuple[Mechanism, State]


def coordinates(m: Mechanism, state: State) -> tuple[Array, Array]:
    """q (nq,) and v (nv,) of the mechanism at the state. Raises MechlabError where the closed form leaves out a name."""
    _complete(m, state)
    q, v = m.reference(), np.zeros(m.nv)
    for j in m.joints:
        zero = j.zero if j.nv == 1 else 0.0
        q[m.q_slice[j.name]] = np.asarray(state.values[j.name], dtype=float) - zero
        v[m.v_slice[j.name]] = state.rates[j.name]
    return q, v


def _complete(m: Mechanism, state: State) -> None:
    for what, needed, given in (
        ("values", {*(j.name for j in m.joints), *m.scalar_names}, state.values),
        ("rates", {*(j.name for j in m.joints), *m.scalar_names}, state.rates),
        ("points", {f.name for f in m.frames}, state.points),
    ):
        lacking = sorted(needed - set(given))
        if lacking:
            raise MechlabError(
                f"{m.name}: the closed form has no {what} of {', '.join(lacking)}; expected {sorted(needed)}."
            )
