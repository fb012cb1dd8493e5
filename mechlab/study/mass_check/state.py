"""What a closed form says of a mechanism at one moving state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.study.mass_check.particles import Particles


@dataclass(frozen=True)
class State:
    """What a closed form says of a mechanism at one moving state.

    values, rates: of every joint and shaft by name (a quaternion w, x, y, z and the body's angular velocity in its own axes for a
    spherical joint). They set the engines' state; those of shafts are compared, too. particles: everything that has mass and
    moves. points (3,): every frame by name, in the world. gravity (3,). freedoms: of the motion. rotors [J]: kinetic energy of
    armatures and shafts. stored [W]: power that flows into springs; lost [W]: into dampers. poses: body -> rotation (3, 3) and
    origin (3,) in the world, of bodies that carry no mass or whose turn no mass feels. is_reference: this is the reference pose, so
    that all coordinates are zero.
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
