"""Any planar linkage of rigid links and pins as data, and all its assembly modes: groups of class II to VI alike.

Point P of link j stands at p_j + c_jP z_j, z_j = e^(i theta_j); a pin says that a point of several links, or of the ground, is one. That
is linear in p and z; what annihilates p leaves one complex equation for each independent loop,

    sum_j A_lj z_j = r_l,   |z_j| = 1,   l = 1 .. L,

in n unknown turns. A group (with the drives, links whose angle is given) is determinate where n = 2 L. L of the z follow from the others:
with z and its conjugate as independent unknowns |z_j|^2 = 1 are 2 L bilinear equations, so there are at most binomial(2 L, L) modes: 2 for
a dyad, 6 for classes III and IV of two loops, 20 for three.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.assur.bilinear import all_solutions, path_count
from mechlab.analytic.assur.plane import Complex, Flags, Real, unit
from mechlab.errors import MechlabError, unknown

GROUND = "ground"
LARGEST_LOOPS = 5
"""252 paths."""
ON_CIRCLE = 2e-2
"""A solution with all |z| so near 1 is tried as a real one: two modes about to merge are hard to find exactly."""
CLOSED = 1e-11
"""Misfit of a loop over the size of the linkage."""
_SEED = 1
SAME = 1e-7
"""Turns of two modes that are one [rad]."""


@dataclass(frozen=True)
class Links:
    """Links with their points in their own axes (complex, x + iy [m]), fixed points of the ground, and the driven links by name."""

    links: Mapping[str, Mapping[str, complex]]
    fixed: Mapping[str, complex]
    drives: tuple[str, ...]

    def __post_init__(self) -> None:
        for name in self.drives:
            if name not in self.links:
                raise unknown("linkage: driven link", name, self.links)
        if GROUND in self.links:
            raise MechlabError(f"linkage: {GROUND!r} is not a link; its points are the fixed ones.")
        lone = [n for n, points in self.links.items() if not any(self._shared(p) > 1 for p in points)]
        if lone:
            raise MechlabError(f"linkage: link {lone[0]!r} hangs on nothing: it shares no point with another link or the ground.")

    def _shared(self, point: str) -> int:
        return sum(point in points for points in self.links.values()) + (point in self.fixed)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Links whose turn is not given."""
        return tuple(n for n in self.links if n not in self.drives)

    @property
    def points(self) -> tuple[str, ...]:
        """All points, each once."""
        return tuple(dict.fromkeys([*self.fixed, *(p for points in self.links.values() for p in points)]))

    @property
    def size(self) -> float:
        """Largest distance in a link or of the ground from its origin [m], the measure for misfits."""
        every = [abs(c) for points in self.links.values() for c in points.values()] + [abs(c) for c in self.fixed.values()]
        return max([*every, 1e-300])


@dataclass(frozen=True)
class Loops:
    """The loop equations known @ z_known + free @ z = right; and origins = back_right - back @ z of the links."""

    free: Complex
    known: Complex
    right: Complex
    back: Complex
    back_right: Complex


def loops(linkage: Links) -> Loops:
    """The loop equations of a linkage. Raises MechlabError where drives and loops do not determine all turns."""
    names = list(linkage.links)
    rows: list[tuple[dict[str, float], complex, str]] = []  # sign of a link's point, right side, point
    for point in linkage.points:
        holders = [n for n in names if point in linkage.links[n]]
        if point in linkage.fixed:
            rows += [({h: 1.0}, linkage.fixed[point], point) for h in holders]
        else:
            rows += [({holders[0]: 1.0, h: -1.0}, 0j, point) for h in holders[1:]]
    origin, turns = np.zeros((len(rows), len(names))), np.zeros((len(rows), len(names)), dtype=complex)
    right = np.zeros(len(rows), dtype=complex)
    for k, (signs, b, point) in enumerate(rows):
        right[k] = b
        for n, sign in signs.items():
            origin[k, names.index(n)] = sign
            turns[k, names.index(n)] = sign * linkage.links[n][point]
    if np.linalg.matrix_rank(origin) < len(names):
        raise MechlabError("linkage: some links are not connected with the ground; every link needs a way to a fixed point.")
    left, _, _ = np.linalg.svd(origin)
    null = left[:, len(names) :]
    reduced, reduced_right = null.T @ turns, null.T @ right
    free = [names.index(n) for n in linkage.unknowns]
    known = [names.index(n) for n in linkage.drives]
    count, loop_count = len(free), reduced.shape[0]
    if count != 2 * loop_count:
        surplus = count - 2 * loop_count
        what = f"{surplus} more drives are needed" if surplus > 0 else f"{-surplus} constraints too many, counting two for each loop"
        raise MechlabError(f"linkage: {count} unknown turns in {loop_count} loops of two equations each: {what}.")
    if loop_count > LARGEST_LOOPS:
        many = path_count(loop_count)
        raise MechlabError(f"linkage: {loop_count} loops have up to {many} modes; at most {LARGEST_LOOPS} loops are solved.")
    if np.linalg.matrix_rank(reduced[:, free], tol=1e-12 * linkage.size) < loop_count:
        raise MechlabError("linkage: a loop without an unknown turn; two drives, or a drive and the ground, contradict each other.")
    back = np.linalg.pinv(origin).astype(complex)
    return Loops(reduced[:, free], reduced[:, known], reduced_right, back @ turns, back @ right)


@dataclass(frozen=True)
class LinkModes:
    """All modes at drive angles (n, drives): turns (n, modes, unknown links) padded with NaN after `count` (n,), sorted by the turn of the
    first link; rates and accelerations alike; det (n, modes): determinant of the loop equations; lost, infinite (n,): paths without an end,
    and with an end at infinity; bound: largest number of modes."""

    turns: Real
    rates: Real
    accels: Real
    det: Real
    count: np.ndarray
    lost: np.ndarray
    infinite: np.ndarray
    bound: int


def modes_of(linkage: Links, angles: ArrayLike, rates: ArrayLike = 0.0, accels: ArrayLike = 0.0) -> LinkModes:
    """All assembly modes for drive angles (n, drives) [rad], with rates and accelerations of the drives, by continuation in complex
    turns from the binomial(2 L, L) solutions of a start system; each real one polished by Newton."""
    given, eq, motion = _given(linkage, angles, rates, accels)
    n, loop_count = len(given), eq.free.shape[0]
    right = eq.right - unit(given) @ eq.known.T
    # dependent z by the columns that a pivoted factorization takes first
    from scipy.linalg import qr

    order = qr(eq.free, mode="r", pivoting=True)[1]
    dependent, independent = order[:loop_count], order[loop_count:]
    inverse = np.linalg.inv(eq.free[:, dependent])
    shift, slope = right @ inverse.T, -inverse @ eq.free[:, independent]  # z_dependent = shift + slope @ w
    u = np.zeros((n, 2 * loop_count, loop_count + 1), dtype=complex)
    u[:, np.arange(loop_count), 1 + np.arange(loop_count)] = 1.0
    u[:, loop_count:, 0], u[:, loop_count:, 1:] = shift, slope
    ends = all_solutions(u, np.conj(u))
    z = np.full((n, ends.finite.shape[1], 2 * loop_count), np.nan, dtype=complex)
    z[..., independent] = ends.x
    z[..., dependent] = shift[:, None] + ends.x @ slope.T
    with np.errstate(invalid="ignore"):
        real = ends.finite & (np.abs(np.abs(z) - 1.0).max(axis=-1) < ON_CIRCLE)
    row, slot = np.nonzero(real)
    turns, closed = newton(eq, right[row], np.angle(z[row, slot]), linkage.size)
    infinite = np.count_nonzero(~ends.finite, axis=-1) - ends.lost
    return _collect(eq, motion, row[closed], turns[closed], n, (ends.lost, infinite), path_count(loop_count))


def newton(eq: Loops, right: Complex, turns: Real, size: float, steps: int = 40) -> tuple[Real, Flags]:
    """Turns (k, links) near given ones that close the loops, right (k, L), and whether they do. A step is at most 0.5 rad."""
    theta = turns.copy()
    busy = np.arange(len(theta))
    damping = 1e-15 * float(np.sum(np.abs(eq.free) ** 2)) * np.eye(theta.shape[1])  # of use where two modes merge
    for _ in range(steps):
        z = unit(theta[busy])
        gap = z @ eq.free.T - right[busy]
        open_ = np.abs(gap).max(axis=1, initial=0.0) > 1e-15 * size
        busy, z, gap = busy[open_], z[open_], gap[open_]
        if not busy.size:
            break
        jacobian = 1j * eq.free[None] * z[:, None, :]
        rows = np.concatenate([jacobian.real, jacobian.imag], axis=1)
        sides = np.concatenate([gap.real, gap.imag], axis=1)
        turned = rows.transpose(0, 2, 1)
        change = -np.linalg.solve(turned @ rows + damping, turned @ sides[..., None])[..., 0]
        theta[busy] += change * np.minimum(1.0, 0.5 / np.maximum(np.abs(change).max(axis=1, keepdims=True), 1e-300))
    gap = np.abs(unit(theta) @ eq.free.T - right)
    return wrapped(theta), np.asarray(gap.max(axis=1, initial=0.0) < CLOSED * size)


def modes_by_trial(linkage: Links, angles: ArrayLike, rates: ArrayLike = 0.0, accels: ArrayLike = 0.0, starts: int = 40) -> LinkModes:
    """What `modes_of` finds, by Newton's method from `starts` x binomial(2 L, L) random turns at each position: a second way, that
    proves nothing where it finds less."""
    given, eq, motion = _given(linkage, angles, rates, accels)
    n, bound = len(given), path_count(eq.free.shape[0])
    right = eq.right - unit(given) @ eq.known.T
    rng = np.random.default_rng(_SEED)
    row = np.repeat(np.arange(n), starts * bound)
    turns, closed = newton(eq, right[row], rng.uniform(-np.pi, np.pi, (len(row), eq.free.shape[1])), linkage.size)
    nothing = np.zeros(n, dtype=int)
    return _collect(eq, motion, row[closed], turns[closed], n, (nothing, nothing), bound)


def _given(linkage: Links, angles: ArrayLike, rates: ArrayLike, accels: ArrayLike) -> tuple[Real, Loops, tuple[Real, Real, Real]]:
    given = np.atleast_2d(np.asarray(angles, dtype=float))
    if given.shape[-1] != len(linkage.drives):
        raise MechlabError(f"linkage: expected angles of {len(linkage.drives)} drives, got {given.shape[-1]}.")
    v, a = (np.broadcast_to(np.asarray(x, dtype=float), given.shape) for x in (rates, accels))
    return given, loops(linkage), (given, v, a)


def _collect(
    eq: Loops, motion: tuple[Real, Real, Real], row: np.ndarray, turns: Real, n: int, paths: tuple[np.ndarray, np.ndarray], bound: int
) -> LinkModes:
    """Modes sorted, each once, with rates and accelerations."""
    kept: list[list[Real]] = [[] for _ in range(n)]
    order = np.lexsort(((turns[:, 0] + 1e-4) % (2.0 * np.pi), row)) if len(row) else np.arange(0)  # 0 and pi are no border
    for k in order:
        away = [np.abs(wrapped(turns[k] - other)).max() for other in kept[row[k]]]
        if not away or min(away) > SAME:
            kept[row[k]].append(turns[k])
    count = np.array([len(x) for x in kept], dtype=int)
    most, links = max(int(count.max(initial=0)), 1), eq.free.shape[1]
    out = [np.full((n, most, links), np.nan) for _ in range(3)]
    det = np.full((n, most), np.nan)
    position = np.repeat(np.arange(n), count)
    slot = np.concatenate([np.arange(c) for c in count]) if len(position) else np.arange(0)
    if len(position):
        theta = np.array([t for x in kept for t in x])
        found = _rates(eq, theta, *(m[position] for m in motion))
        for array, values in zip(out, (theta, *found[:2]), strict=True):
            array[position, slot] = values
        det[position, slot] = found[2]
    return LinkModes(out[0], out[1], out[2], det, count, paths[0], paths[1], bound)


def _rates(eq: Loops, theta: Real, angle: Real, rate: Real, accel: Real) -> tuple[Real, Real, Real]:
    """Rates and accelerations (k, links), and det J (k,): sum A i z w = -known i z_d w_d, and its derivative."""
    z, drive = unit(theta), unit(angle)
    jacobian = 1j * eq.free[None] * z[:, None, :]
    rows = np.concatenate([jacobian.real, jacobian.imag], axis=1)
    det = np.linalg.det(rows)

    def solve(side: Complex) -> Real:
        sides = np.concatenate([side.real, side.imag], axis=1)
        regular = np.linalg.cond(rows) < 1e13
        out = np.full(theta.shape, np.nan)
        out[regular] = np.linalg.solve(rows[regular], sides[regular][..., None])[..., 0]
        return out

    w = solve(-(1j * drive * rate) @ eq.known.T)
    e = solve((drive * rate**2 - 1j * drive * accel) @ eq.known.T + (z * w**2) @ eq.free.T)
    return w, e, det


def positions(linkage: Links, angles: ArrayLike, turns: Real) -> dict[str, Complex]:
    """Points (...) by name from drive angles (..., drives) and turns (..., unknown links) of a mode."""
    eq, names = loops(linkage), list(linkage.links)
    every = np.zeros((*turns.shape[:-1], len(names)), dtype=complex)
    every[..., [names.index(n) for n in linkage.unknowns]] = unit(turns)
    given = np.broadcast_to(np.asarray(angles, dtype=float), (*turns.shape[:-1], len(linkage.drives)))
    every[..., [names.index(n) for n in linkage.drives]] = unit(given)
    origins = eq.back_right - every @ eq.back.T
    out = {p: np.full(turns.shape[:-1], c) for p, c in linkage.fixed.items()}
    for k, n in enumerate(names):
        out |= {p: origins[..., k] + c * every[..., k] for p, c in linkage.links[n].items() if p not in out}
    return out


def branches(modes: LinkModes) -> np.ndarray:
    """(n, modes) numbers of the branches through neighbouring positions, -1 where there is no mode.

    A mode goes on as the one of the same sign of det nearest to its extrapolation; one that finds none within JUMP ends there.
    """
    from scipy.optimize import linear_sum_assignment

    out = np.full(modes.det.shape, -1)
    out[0, : modes.count[0]] = np.arange(modes.count[0])
    following = int(modes.count[0])
    trace: dict[int, tuple[Real, Real]] = {k: (x, 0.0 * x) for k, x in enumerate(modes.turns[0, : modes.count[0]])}
    for i in range(1, len(modes.count)):
        new, before = modes.turns[i, : modes.count[i]], dict(trace)
        trace = {}
        if before and len(new):
            keys = list(before)
            away = np.array([[np.abs(wrapped(x - before[b][0] - before[b][1])).max() for x in new] for b in keys])
            signs = np.array([np.sign(modes.det[i - 1, np.flatnonzero(out[i - 1] == b)[0]]) for b in keys])
            away[signs[:, None] != np.sign(modes.det[i, : len(new)])[None]] = 10.0
            for a, k in zip(*linear_sum_assignment(away), strict=True):
                if away[a, k] < JUMP:
                    out[i, k] = keys[a]
                    trace[keys[a]] = (new[k], wrapped(new[k] - before[keys[a]][0]))
        for k in np.flatnonzero(out[i, : len(new)] < 0):
            out[i, k] = following
            trace[following] = (new[k], 0.0 * new[k])
            following += 1
    return out


JUMP = 0.35
"""Largest distance of a mode from the extrapolation of its branch [rad]."""


def wrapped(angle: Real) -> Real:
    """The angle modulo full turns, in (-pi, pi]."""
    return np.asarray(-((-angle + np.pi) % (2 * np.pi) - np.pi))
