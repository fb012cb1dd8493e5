"""What an engine must give for small motions about a rest, and the matrices that follow on the constraint manifold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import Untrustworthy
from mechlab.mechanism.assembly import Assembly
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.structure import null_space

STEP = 1e-3
"""Step of the difference quotients of fourth order, in radians, or in sizes of the mechanism: their error is 1e-12."""


class Dynamics(Protocol):
    """M a + g(x, v) = J^T reactions of a mechanism under laws at rest. `mechlab.solve.linearise` and
    `mechlab.simulate.linearise` implement it, each over its own coordinates x and displacements."""

    mechanism: Mechanism
    nv: int

    def pose(self, q: ArrayLike) -> Array:
        """The engine's pose of coordinates q (nq,)."""
        ...

    def coordinates(self, x: Array) -> Array:
        """(nq,) coordinates of the Mechanism."""
        ...

    def rates(self, basis: Array) -> Array:
        """Columns of displacements in the order of the Mechanism's rates."""
        ...

    def moved(self, x: Array, dv: Array) -> Array:
        """The pose after a displacement."""
        ...

    def closed(self, x: Array) -> Assembly:
        """The nearest assembled pose."""
        ...

    def rows(self, x: Array) -> Array:
        """(rows, nv) constraint Jacobian."""
        ...

    def mass(self, x: Array) -> Array:
        """(nv, nv) mass matrix."""
        ...

    def force(self, x: Array, v: Array | None = None) -> Array:
        """(nv,) g at pose x and rates v (default: at rest)."""
        ...


@dataclass(frozen=True)
class Linear:
    """M y'' + C y' + K y = -g for small y, with displacement = basis y; basis (nv, f) is M-orthonormal, so mass = 1.

    damping C (f, f), stiffness K (f, f), gradient g (f,); load: size of the generalised forces in play [N m or N];
    stiffest: largest entry of the stiffness per unit of displacement: both set the level of rounding.
    """

    basis: Array
    damping: Array
    stiffness: Array
    gradient: Array
    load: float
    stiffest: float


def step_size(mechanism: Mechanism) -> float:
    """STEP in radians; where parts slide, no more than STEP sizes of the mechanism."""
    if all(j.kind != "prismatic" for j in mechanism.joints):
        return STEP
    lengths = [float(np.linalg.norm(b.placement.position)) for b in mechanism.bodies]
    lengths += [float(np.linalg.norm(x.placement_b.position)) for x in mechanism.loops]
    return STEP * min(1.0, max(lengths, default=0.0) or 1.0)


def linear(dynamics: Dynamics, x: Array, with_damping: bool = True) -> Linear:
    """The linear equations on the constraint manifold at an assembled pose x.

    With N a basis of the null space of J and reactions r from J^T r = g: K = N^T d/dx (g - J(x)^T r) N, whose second
    term is the geometric stiffness of the reactions, and C = N^T dg/dv N. Raises Untrustworthy when a motion that the
    constraints allow has no inertia.
    """
    rows = dynamics.rows(x)
    free = null_space(rows) if len(rows) else np.eye(dynamics.nv)
    force = dynamics.force(x)
    reactions = np.linalg.lstsq(rows.T, force, rcond=1e-11)[0] if len(rows) else np.zeros(0)
    basis = _normalised(dynamics, free, x)
    h = step_size(dynamics.mechanism)

    def net(direction: Array, s: float) -> Array:
        y = dynamics.moved(x, s * direction)
        pull = dynamics.force(y)
        return pull - dynamics.rows(y).T @ reactions if len(rows) else pull

    columns, damped, stiffest = [], [], 0.0
    for direction in basis.T:
        size = float(np.max(np.abs(direction)))
        unit = direction / size
        slope = (8 * (net(unit, h) - net(unit, -h)) - net(unit, 2 * h) + net(unit, -2 * h)) / (12 * h)
        stiffest = max(stiffest, float(np.max(np.abs(slope))))
        columns.append(size * slope)
        if with_damping:
            damped.append(size * (dynamics.force(x, h * unit) - dynamics.force(x, -h * unit)) / (2 * h))
    f = basis.shape[1]
    stiffness = basis.T @ np.array(columns).reshape(f, dynamics.nv).T
    damping = basis.T @ np.array(damped).T if damped else np.zeros((f, f))
    load = float(max(np.max(np.abs(force), initial=0.0), np.max(np.abs(rows.T @ reactions), initial=0.0)))
    return Linear(basis, damping, stiffness, basis.T @ force, load, stiffest)


def _normalised(dynamics: Dynamics, free: Array, x: Array) -> Array:
    """The basis turned and scaled so that the kinetic energy is half the sum of squares."""
    if not free.shape[1]:
        return free
    mass = free.T @ dynamics.mass(x) @ free
    values, vectors = np.linalg.eigh(0.5 * (mass + mass.T))
    if values[0] <= 1e-13 * values[-1]:
        light = dynamics.rates(free @ vectors[:, :1])[:, 0]
        name = dynamics.mechanism.rate_names[int(np.argmax(np.abs(light)))]
        raise Untrustworthy(
            f"{dynamics.mechanism.name}: a motion that the constraints allow, mostly of {name}, has no inertia; its frequency "
            "would be infinite. Give the parts that move in it a mass."
        )
    return np.asarray(free @ (vectors / np.sqrt(values)))
