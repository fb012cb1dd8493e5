"""Moving the drives by hand in the page: closed poses, solved beforehand so densely that what lies between is closed too."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism import (
    ConstraintSet,
    Loop,
    Mechanism,
    TreeKinematics,
    integrate,
    newton,
    structure,
)
from mechlab.mechanism.geometry import Array
from mechlab.view.held import Held

MOST_SWEEPS = 8
STENCIL = 6
"""Samples that one position in the page is blended from (a polynomial of degree 5)."""
TOLERANCE = 1e-7
"""Largest error of the blend, in sizes of the mechanism (and in radians)."""
FEWEST, MOST = 25, 1537
MARGIN = 0.06
MARCH = 48


@dataclass(frozen=True, eq=False)
class Sweep:
    """One drive moved through its reach, the others at home.

    name, unit: of the joint or shaft; q: (k, nq) closed coordinates at `values` (k,), evenly spaced or, with `cosine`,
    dense at the ends: value = middle - half cos(theta), theta even. poses: (k, nb, 4, 4), filled in by the story.
    closeness: (k,) 0 at a singularity, 1 at the farthest from it. low, high: ends of the slider; beyond `values` no pose
    exists, and `low_reason`, `high_reason` say why. home: value at home.
    """

    name: str
    unit: str
    values: Array
    cosine: bool
    q: Array
    closeness: Array
    low: float
    high: float
    low_reason: str
    high_reason: str
    home: float
    poses: Array

    def position(self, value: float) -> float:
        """Where in the samples a value lies, 0 to k - 1; outside of the reach, the end."""
        first, last = self.values[0], self.values[-1]
        share = min(1.0, max(0.0, (value - first) / (last - first)))
        if self.cosine:
            share = math.acos(1.0 - 2.0 * share) / math.pi
        return share * (len(self.values) - 1)


@dataclass(frozen=True, eq=False)
class Exploration:
    """Sweeps of all drives of a mechanism. size [m]: what gaps are measured by; mode: the assembly mode in words;
    loops: what the page checks."""

    sweeps: tuple[Sweep, ...]
    size: float
    mode: str
    loops: tuple[Loop, ...]
    bodies: tuple[str, ...]

    def packed(self, block: Any, pack_motion: Callable[[Array, Any], Any]) -> dict[str, Any]:
        """What the page reads."""
        return {
            "size": self.size, "mode": self.mode,
            "loops": [_packed_loop(x, self.bodies) for x in self.loops],
            "sweeps": [
                {
                    "name": s.name, "unit": s.unit, "low": s.low, "high": s.high, "first": float(s.values[0]),
                    "last": float(s.values[-1]), "cosine": s.cosine, "count": len(s.values), "home": s.home,
                    "lowReason": s.low_reason, "highReason": s.high_reason, "motion": pack_motion(s.poses, block),
                    "closeness": block.add(s.closeness, "f4"),
                }
                for s in self.sweeps
            ],
        }  # fmt: skip


def _packed_loop(loop: Loop, bodies: tuple[str, ...]) -> dict[str, Any]:
    """Ends of a loop, and along which axes of its first end they must meet."""
    axes = "xy" if loop.kind in ("cylindrical", "prismatic") else "xyz"
    return {
        "name": loop.name, "a": bodies.index(loop.body_a), "b": bodies.index(loop.body_b), "length": loop.length,
        "axes": len(axes), "placement": loop.placement_a.matrix().T.reshape(-1).tolist(),
        "point": [float(x) for x in loop.placement_b.translation],
    }  # fmt: skip


def lagrange(position: float, count: int) -> tuple[int, Array]:
    """First sample and weights (STENCIL,) of the blend at a position 0 to count - 1; the page does the same."""
    first = min(max(int(position) - (STENCIL // 2 - 1), 0), count - STENCIL)
    x = position - first
    weights = np.ones(STENCIL)
    for i in range(STENCIL):
        for j in range(STENCIL):
            if j != i:
                weights[i] *= (x - j) / (i - j)
    return first, weights


def blend_weights(sweep: Sweep, value: float) -> tuple[int, Array]:
    """As `lagrange`, at a value of the drive."""
    return lagrange(sweep.position(value), len(sweep.values))


def explore(
    mechanism: Mechanism, names: tuple[str, ...], poses_of: Callable[[Array], Array], size: float
) -> Exploration:
    """Sweeps of every drive (without drives: of the independent joints) of a mechanism about its reference pose.

    names: bodies as drawn; poses_of(q (n, nq)) -> (n, len(names), 4, 4). Raises MechlabError when nothing can be moved.
    """
    drives = tuple(dict.fromkeys(d.on for d in mechanism.drives))
    if not drives:
        drives = tuple(n for n in structure(mechanism).independent if n in mechanism.scalar_names)
    if not drives:
        raise MechlabError(f"{mechanism.name}: it has no drive, joint or shaft that could be moved in the page.")
    solver = _Solver(mechanism, drives)
    sweeps = tuple(_sweep(solver, k, poses_of, size) for k in range(min(len(drives), MOST_SWEEPS)))
    mode = "that of the reference pose" if solver.home_sign else "cannot be told: the drives do not fix the mechanism"
    return Exploration(sweeps, size, mode, mechanism.loops, names)


class _Solver:
    """Closes one mechanism with all drives, and what the drives leave free, held."""

    def __init__(self, mechanism: Mechanism, drives: tuple[str, ...]) -> None:
        self.mechanism, self.drives = mechanism, drives
        self.tree, self.constraints = TreeKinematics(mechanism), ConstraintSet(mechanism)
        self.home = mechanism.reference()
        self.held = Held(mechanism, drives)
        self.drive_rows = np.array([mechanism.row(n) for n in drives]).reshape(len(drives), mechanism.nv)
        self.home_values = np.array([mechanism.value(n, self.home) for n in drives])
        from mechlab.mechanism.structure import independent_rows

        self.keep = independent_rows(mechanism, self.constraints)
        self.home_sign = self.sign(self.home)

    def matrix(self, q: Array) -> Array:
        """Constraint rows, drive rows, held rows at q."""
        jacobian = self.constraints.jacobian(self.tree.set(q))
        return np.vstack([jacobian, self.drive_rows, self.held.jacobian(q)])

    def sign(self, q: Array) -> int:
        """Sign of the determinant whose zero separates assembly modes; 0 when the drives do not fix the mechanism."""
        full = self.matrix(q)
        count = len(self.constraints)
        square = np.vstack([full[:count][self.keep], full[count:]])
        if square.shape[0] != square.shape[1]:
            return 0
        sign, size = np.linalg.slogdet(square)
        return int(sign) if size > -80 else 0

    def distance(self, q: Array) -> float:
        """Smallest singular value of the independent rows, each scaled to unit length."""
        full = self.matrix(q)
        count = len(self.constraints)
        rows = np.vstack([full[:count][self.keep], full[count:]])
        rows = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-12)
        return float(np.linalg.svd(rows, compute_uv=False)[min(rows.shape) - 1])

    def solve(self, q: Array, k: int, value: float) -> Array | None:
        """Coordinates with drive k at `value` and the others at home, from the neighbour q; None: not in this mode."""
        m = self.mechanism
        wanted = self.home_values.copy()
        wanted[k] = value

        def evaluate(x: Array) -> tuple[Array, Array]:
            self.tree.set(x)
            now = np.array([m.value(n, x) for n in self.drives])
            residual = np.concatenate([self.constraints.residual(self.tree), now - wanted, self.held.residual(x)])
            return residual, np.vstack([self.constraints.jacobian(self.tree), self.drive_rows, self.held.jacobian(x)])

        found = newton(evaluate, lambda x, dv: integrate(m, x, dv), q, iterations=25)
        if not found.closed or float(np.abs(found.q - q).max(initial=0.0)) > 0.6:
            return None
        return found.q if self.sign(found.q) == self.home_sign or self.home_sign == 0 else None


def _sweep(solver: _Solver, k: int, poses_of: Callable[[Array], Array], size: float) -> Sweep:
    m, name = solver.mechanism, solver.drives[k]
    joint = next((j for j in m.joints if j.name == name), None)
    slides = joint is not None and joint.kind == "prismatic"
    home = float(solver.home_values[k])
    span = size if slides else math.pi
    ends = [home - span, home + span]
    limited = joint is not None and joint.range is not None
    if limited:
        assert joint is not None and joint.range is not None
        ends = [max(ends[0], joint.range[0]), min(ends[1], joint.range[1])]
    marched = {home: solver.home}
    reach = [_march(solver, k, marched, home, end) for end in ends]
    stopped = [abs(r - e) > 1e-9 * span for r, e in zip(reach, ends, strict=True)]
    if reach[1] - reach[0] < 1e-6 * span:
        raise MechlabError(f"{m.name}: {name} cannot be moved from the reference pose; the other drives hold it there.")
    starts = np.array(sorted(marched))

    def at(values: Array) -> Array:
        out = []
        for value in values:
            q = solver.solve(marched[float(starts[np.abs(starts - value).argmin()])], k, float(value))
            if q is None:  # on the very border: the nearest closed pose
                q = marched[float(starts[np.abs(starts - value).argmin()])]
            out.append(q)
        return np.array(out)

    cosine = any(stopped)
    values, q = _refine(at, reach[0], reach[1], cosine, poses_of, size)
    distances = np.array([solver.distance(x) for x in q])
    margin = MARGIN * (reach[1] - reach[0])
    reasons = []
    for stop, word in zip(stopped, ("lower", "higher"), strict=True):
        edge = f"the end of the range of {name}" if limited else f"the end of the slider: {name} goes on"
        reasons.append(
            f"no assembly exists with {name} {word}: the mechanism is stretched or folded there" if stop else edge
        )
    return Sweep(
        name, "m" if slides else "rad", values, cosine, q, distances / max(float(distances.max()), 1e-300),
        reach[0] - margin * stopped[0], reach[1] + margin * stopped[1], reasons[0], reasons[1], home, poses_of(q),
    )  # fmt: skip


def _march(solver: _Solver, k: int, marched: dict[float, Array], start: float, end: float) -> float:
    """The last value on the way to `end` that has a closed pose in the same mode, to 1e-10 of the way."""
    value, q = start, solver.home
    step = (end - start) / MARCH
    smallest = 1e-9 * abs(end - start)
    while abs(end - value) > smallest and abs(step) > smallest:
        target = end if abs(end - value) <= abs(step) * (1 + 1e-9) else value + step
        found = solver.solve(q, k, target)
        if found is None:
            step *= 0.5
            continue
        value, q = target, found
        marched[value] = q
    return value


def _refine(
    at: Callable[[Array], Array], low: float, high: float, cosine: bool, poses_of: Callable[[Array], Array], size: float
) -> tuple[Array, Array]:
    """Values (k,) and coordinates (k, nq), k doubled until the blend meets the poses between the samples."""

    def grid(count: int) -> Array:
        share = np.linspace(0.0, 1.0, count)
        if cosine:
            share = 0.5 * (1.0 - np.cos(math.pi * share))
        return np.asarray(low + (high - low) * share)

    count = FEWEST
    q = at(grid(count))
    while True:
        finer = grid(2 * count - 1)
        between = at(finer[1::2])
        error = _blend_error(poses_of(q), poses_of(between), size)
        merged = np.empty((2 * count - 1, q.shape[1]))
        merged[0::2], merged[1::2] = q, between
        if error < TOLERANCE:
            return grid(count), q
        count, q = 2 * count - 1, merged
        if 2 * count - 1 > MOST:
            return grid(count), q


def _blend_error(poses: Array, between: Array, size: float) -> float:
    """Largest difference of the blend to `between` (k - 1, nb, 4, 4), the poses in the middle of the samples (k, ...)."""
    worst = 0.0
    for i, pose in enumerate(between):
        first, weights = lagrange(i + 0.5, len(poses))
        blend = np.tensordot(weights, poses[first : first + STENCIL], axes=1)
        error = np.abs(blend - pose)
        worst = max(worst, float(error[:, :3, 3].max(initial=0.0)) / size, float(error[:, :3, :3].max(initial=0.0)))
    return worst
