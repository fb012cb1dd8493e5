"""Eigenmodes of M y'' + C y' + K y = 0 with mass 1: one mode for each freedom, two eigenvalues each."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mechlab.mechanism.geometry import Array
from mechlab.study.modes.dynamics import Linear

OSCILLATING, OVERDAMPED, UNSTABLE, RIGID = "oscillating", "overdamped", "unstable", "rigid"
ROUNDING_LOAD, ROUNDING_STIFFNESS = 1e-11, 1e-12
"""Stiffness that rounding and difference quotients make: shares of the loads and of the largest stiffness."""
GROWTH = 1e-8
"""Rates of growth below this share of the frequency are rounding."""


@dataclass(frozen=True)
class Mode:
    """Motions exp(r t) along one shape for the two eigenvalues r of `eigenvalues` [1/s].

    omega = sqrt |r1 r2| [rad/s], the undamped frequency; damping = -(r1 + r2) / (2 omega), the damping ratio (None for a
    rigid mode). kind: oscillating; overdamped (two real, none positive); unstable (one grows); rigid (no stiffness at all).
    shape: (nv,) complex in the order of the Mechanism's rates, its largest entry 1.
    """

    omega: float
    damping: float | None
    kind: str
    eigenvalues: tuple[complex, complex]
    shape: Array

    @property
    def frequency_hz(self) -> float:
        """omega / 2 pi."""
        return self.omega / (2.0 * math.pi)

    @property
    def growth(self) -> float:
        """Largest real part of the eigenvalues [1/s]: positive grows."""
        return max(r.real for r in self.eigenvalues)


def modes(linear: Linear, rates: Callable[[Array], Array]) -> tuple[Mode, ...]:
    """All modes, slowest first. `rates` takes columns of displacements to the order of the Mechanism's rates."""
    count = len(linear.stiffness)
    if not count:
        return ()
    out = []
    for (r1, y1), (r2, y2) in _pairs(linear):
        y = y1 if abs(r1.real) <= abs(r2.real) else y2
        size = np.max(np.abs(linear.basis @ y)) / np.linalg.norm(y)
        rounding = (ROUNDING_LOAD * linear.load + ROUNDING_STIFFNESS * linear.stiffest) * size**2
        out.append(_mode(r1, r2, y, rounding, rates(linear.basis @ y[:, None])[:, 0]))
    return tuple(sorted(out, key=lambda m: (m.omega, -m.growth)))


def _mode(r1: complex, r2: complex, y: Array, rounding: float, shape: Array) -> Mode:
    top = shape[int(np.argmax(np.abs(shape)))] if len(shape) else 1.0
    shape = shape / top if abs(top) > 0.0 else shape
    omega = math.sqrt(abs(r1 * r2))
    if omega**2 <= rounding:
        fall = min(r1.real, r2.real) if abs(r1.imag) == 0.0 and min(r1.real, r2.real) < -math.sqrt(rounding) else 0.0
        return Mode(0.0, None, RIGID, (0j, complex(fall)), shape)
    damping = -0.5 * (r1 + r2).real / omega
    grows = max(r1.real, r2.real) > GROWTH * omega
    kind = UNSTABLE if grows else OSCILLATING if r1.imag else OVERDAMPED
    return Mode(omega, 0.0 if abs(damping) < GROWTH else damping, kind, (complex(r1), complex(r2)), shape)


Root = tuple[complex, Array]


def _pairs(linear: Linear) -> list[tuple[Root, Root]]:
    """Eigenvalues two by two, with their shapes: conjugates, and real ones whose shapes are most alike."""
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
    """Real roots paired greedily by the likeness of their shapes."""
    units = [y / max(float(np.linalg.norm(y)), 1e-300) for _, y in roots]
    alike = [(abs(np.vdot(units[i], units[j])), i, j) for i in range(len(roots)) for j in range(i)]
    out: list[tuple[Root, Root]] = []
    taken: set[int] = set()
    for _, i, j in sorted(alike, key=lambda x: -x[0]):
        if not {i, j} & taken:
            taken |= {i, j}
            out.append((roots[i], roots[j]))
    return out
