"""Small motions about an equilibrium: linear equations on the constraint manifold, and their modes.

With an M-orthonormal basis they are y'' + C y' + K y = 0: one mode for each degree of freedom, two eigenvalues each.
`Dynamics` is the interface that an engine implements for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import Untrustworthy
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly
from mechlab.mechanism.structure import null_space, step_size

WEIGHT = 1e-3
"""Share of the weight of all parts, at the size of the mechanism, that a load is taken to be at least."""
STEP = 1e-3
"""Smallest step of the difference quotients [rad], or relative to the size of the mechanism."""

KINKED = 1e-8
"""Share of a stiffness by which quotients of step and double step differ where a derivative jumps between their poses."""


class Dynamics(Protocol):
    """Equations M a + g(x, v) = J^T reactions of a mechanism under constant laws, in the coordinates x of one engine.

    Implemented by the engines: `mechlab.engines.protocol.Engine.small_motions`.
    """

    mechanism: Mechanism
    nv: int

    def pose(self, q: ArrayLike) -> Array:
        """The engine's coordinates x for the Mechanism's coordinates q (nq,)."""
        ...

    def coordinates(self, x: Array) -> Array:
        """The Mechanism's coordinates (nq,) for x."""
        ...

    def rates(self, basis: Array) -> Array:
        """Columns of displacements (nv, k), reordered to the Mechanism's rates."""
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
class LinearMotion:
    """y'' + C y' + K y = -g for small y, with displacement = basis y; basis (nv, f) is M-orthonormal, so the mass is 1.

    damping C (f, f), stiffness K (f, f), gradient g (f,). load: largest generalized force [N m or N], at least
    WEIGHT of the weight: what acts on a part balanced on its axis is rounding of its weight; stiffest: largest
    derivative of a generalized force by a displacement; both set the level of rounding. doubt (f, f): estimated error of the
    stiffness.
    """

    basis: Array
    damping: Array
    stiffness: Array
    gradient: Array
    load: float
    stiffest: float
    doubt: Array


def linear(dynamics: Dynamics, x: Array, with_damping: bool = True) -> LinearMotion:
    """The linear equations on the constraint manifold at an assembled pose x.

    With N a basis of the null space of J and reactions r from J^T r = g: K = N^T d/dx (g - J(x)^T r) N, whose second
    term is the geometric stiffness of the reactions, and C = N^T dg/dv N. The derivative is the difference quotient D of fourth
    order; with damping (the equations that are asked for, not a step on the way to a rest) it is D(h) + (D(h) - D(2h)) / 15, of
    sixth order, and the added term is its `doubt`; where a derivative jumps within the steps, the whole difference is. Raises
    Untrustworthy when a motion that the constraints allow has no inertia.
    """
    rows = dynamics.rows(x)
    free = null_space(rows) if len(rows) else np.eye(dynamics.nv)
    force = dynamics.force(x)
    reactions = np.linalg.lstsq(rows.T, force, rcond=1e-11)[0] if len(rows) else np.zeros(0)
    basis = _normalised(dynamics, free, x)
    h = STEP * step_size(dynamics.mechanism)

    def net(direction: Array, s: float) -> Array:
        y = dynamics.moved(x, s * direction)
        pull = dynamics.force(y)
        return pull - dynamics.rows(y).T @ reactions if len(rows) else pull

    def central(unit: Array, s: float) -> Array:
        return net(unit, s) - net(unit, -s)

    columns, damped, corrections, stiffest = [], [], [], 0.0
    for direction in basis.T:
        size = float(np.max(np.abs(direction)))
        unit = direction / size
        near, middle = central(unit, h), central(unit, 2 * h)
        slope = (8 * near - middle) / (12 * h)
        stiffest = max(stiffest, float(np.max(np.abs(slope))))
        correction = np.zeros_like(slope)
        if with_damping:
            correction = (slope - (8 * middle - central(unit, 4 * h)) / (24 * h)) / 15
            damped.append(size * (dynamics.force(x, h * unit) - dynamics.force(x, -h * unit)) / (2 * h))
        columns.append(size * (slope + correction))
        whole = 15.0 * np.abs(correction).max() > KINKED * np.abs(slope).max()  # across a kink the quotient is of first order
        corrections.append(size * correction * (15.0 if whole else 1.0))
    f = basis.shape[1]
    stiffness, doubt = (basis.T @ np.array(x).reshape(f, dynamics.nv).T for x in (columns, corrections))
    damping = basis.T @ np.array(damped).T if damped else np.zeros((f, f))
    load = float(max(np.max(np.abs(force), initial=0.0), np.max(np.abs(rows.T @ reactions), initial=0.0)))
    load = max(load, WEIGHT * _weight(dynamics.mechanism))
    return LinearMotion(basis, damping, stiffness, basis.T @ force, load, stiffest, doubt)


def _weight(m: Mechanism) -> float:
    """The weight of the parts times the size of the mechanism [N m]."""
    return m.total_mass * float(np.linalg.norm(m.gravity)) * (m.size or 1.0)


def _normalised(dynamics: Dynamics, free: Array, x: Array) -> Array:
    """The basis combined and scaled to N^T M N = 1. Raises Untrustworthy for a motion without inertia."""
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


OSCILLATING, OVERDAMPED, UNSTABLE, RIGID = "oscillating", "overdamped", "unstable", "rigid"
ROUNDING_LOAD, ROUNDING_STIFFNESS = 1e-11, 1e-12
"""Stiffness that can be rounding or error of the difference quotients: shares of the load and of the largest
stiffness."""
GROWTH = 1e-8
"""Rates of growth below this share of the frequency are rounding."""


@dataclass(frozen=True)
class VibrationMode:
    """Motions exp(r t) along one shape for the two eigenvalues r of `eigenvalues` [1/s].

    omega = sqrt |r1 r2| [rad/s], the undamped frequency; damping = -(r1 + r2) / (2 omega), the damping ratio
    (None for a rigid mode). kind: oscillating; overdamped (two real eigenvalues, none positive); unstable (an
    eigenvalue has a positive real part); rigid (no stiffness). shape: (nv,) complex in the order of the Mechanism's
    rates, its largest entry 1. error: what an error dk of the stiffness makes of the eigenvalues [1/s], from r^2 + c r + k = 0:
    dk / |r1 - r2|, at most sqrt(dk).
    """

    omega: float
    damping: float | None
    kind: str
    eigenvalues: tuple[complex, complex]
    shape: Array
    error: float

    @property
    def frequency_hz(self) -> float:
        """omega / 2 pi."""
        return self.omega / (2.0 * math.pi)

    @property
    def growth(self) -> float:
        """Largest real part of the eigenvalues [1/s]: positive grows."""
        return max(r.real for r in self.eigenvalues)


def modes(linear: LinearMotion, rates: Callable[[Array], Array]) -> tuple[VibrationMode, ...]:
    """All modes, slowest first. `rates` reorders columns of displacements to the Mechanism's rates."""
    count = len(linear.stiffness)
    if not count:
        return ()
    out = []
    for (r1, y1), (r2, y2) in _pairs(linear):
        y = y1 if abs(r1.real) <= abs(r2.real) else y2
        unit = y / np.linalg.norm(y)
        size = np.max(np.abs(linear.basis @ unit))
        rounding = (ROUNDING_LOAD * linear.load + ROUNDING_STIFFNESS * linear.stiffest) * size**2
        rounding = float(max(rounding, abs(np.vdot(unit, linear.doubt @ unit))))
        out.append(_mode(r1, r2, y, rounding, rates(linear.basis @ y[:, None])[:, 0]))
    return tuple(sorted(out, key=lambda m: (m.omega, -m.growth)))


def _mode(r1: complex, r2: complex, y: Array, rounding: float, shape: Array) -> VibrationMode:
    top = shape[int(np.argmax(np.abs(shape)))] if len(shape) else 1.0
    shape = shape / top if abs(top) > 0.0 else shape
    omega = math.sqrt(abs(r1 * r2))
    limit = math.sqrt(rounding)
    if omega**2 <= rounding:
        fall = min(r1.real, r2.real) if abs(r1.imag) == 0.0 and min(r1.real, r2.real) < -limit else 0.0
        return VibrationMode(0.0, None, RIGID, (0j, complex(fall)), shape, limit)
    error = rounding / max(abs(r1 - r2), limit) if rounding else 0.0
    damping = -0.5 * (r1 + r2).real / omega
    grows = max(r1.real, r2.real) > max(GROWTH * omega, error)
    kind = UNSTABLE if grows else OSCILLATING if r1.imag else OVERDAMPED
    return VibrationMode(
        omega, 0.0 if abs(damping) < GROWTH else damping, kind, (complex(r1), complex(r2)), shape, error
    )


Root = tuple[complex, Array]


def _pairs(linear: LinearMotion) -> list[tuple[Root, Root]]:
    """Pairs of eigenvalues with their shapes: conjugate ones, and real ones whose shapes are most alike."""
    k, c = linear.stiffness, linear.damping
    count = len(k)
    symmetric = np.max(np.abs(k - k.T)) <= 1e-8 * max(float(np.max(np.abs(k))), 1e-300)
    if symmetric:
        k = 0.5 * (k + k.T)
    if symmetric and np.max(np.abs(c)) <= 1e-11 * math.sqrt(max(float(np.max(np.abs(k))), 1e-300)):
        values, vectors = np.linalg.eigh(k)
        roots = [complex(0.0, math.sqrt(w)) if w > 0 else complex(math.sqrt(-w)) for w in values.tolist()]
        return [((r, vectors[:, i]), (-r, vectors[:, i])) for i, r in enumerate(roots)]
    state = np.block([[np.zeros((count, count)), np.eye(count)], [-k, -c]])
    values, vectors = np.linalg.eig(state)
    tops = vectors[:count] / np.linalg.norm(vectors, axis=0)
    found = [(complex(r), tops[:, i]) for i, r in enumerate(values)]
    swinging = [(x, (x[0].conjugate(), x[1].conj())) for x in found if x[0].imag > 0.0]
    return swinging + _real_pairs([x for x in found if x[0].imag == 0.0])


def _real_pairs(roots: list[Root]) -> list[tuple[Root, Root]]:
    """Real eigenvalues in pairs; those with the most similar shapes are paired first."""
    units = [y / max(float(np.linalg.norm(y)), 1e-300) for _, y in roots]
    alike = [(abs(np.vdot(units[i], units[j])), i, j) for i in range(len(roots)) for j in range(i)]
    out: list[tuple[Root, Root]] = []
    taken: set[int] = set()
    for _, i, j in sorted(alike, key=lambda x: -x[0]):
        if not {i, j} & taken:
            taken |= {i, j}
            out.append((roots[i], roots[j]))
    return out
