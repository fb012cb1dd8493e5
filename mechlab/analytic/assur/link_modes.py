"""All assembly modes of a linkage of links, pins and slides, with their rates: groups of class II to VI alike.

L of the unknowns z, y of the loop equations (`mechlab.analytic.assur.links`) follow from the others: with them and their conjugates as
independent unknowns, |z_j|^2 = 1 and y_s conj(z_k) = conj(y_s) z_k are 2 L bilinear equations, so there are at most binomial(2 L, L) modes:
2 for a dyad, 6 for classes III and IV of two loops, 20 for three.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.assur.bilinear import Bilinear, all_solutions, path_count
from mechlab.analytic.assur.links import FIXED_GUIDE, Links, Loops, loops
from mechlab.analytic.assur.plane import Complex, Flags, Real, unit
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

ON_CIRCLE = 2e-2
"""A solution with all |z| so near 1 is tried as a real one: two modes about to merge are hard to find exactly."""
CLOSED = 1e-11
"""Misfit of a loop over the size of the linkage."""
_SEED = 1
SAME = 1e-7
"""Turns of two modes that are one [rad], and their places over the size of the linkage."""
JUMP = 0.35
"""Largest distance of a mode from the extrapolation of its branch [rad]; of a place, over the size of the linkage."""


@dataclass(frozen=True)
class LinkModes:
    """All modes at drive angles (n, drives): turns (n, modes, quantities) of the unknown links [rad], and places of the slides [m], padded
    with NaN after `count` (n,), sorted by the first of them; rates and accelerations alike; det (n, modes): determinant of the loop
    equations; lost, infinite (n,): paths without an end, and with an end at infinity; bound: largest number of modes; turning: how many
    of the quantities are turns; size [m] of the linkage."""

    turns: Real
    rates: Real
    accels: Real
    det: Real
    count: np.ndarray
    lost: np.ndarray
    infinite: np.ndarray
    bound: int
    turning: int
    size: float

    def apart(self, change: Real) -> Real:
        """Differences of quantities (..., quantities) as numbers: turns modulo full ones, places over the size."""
        return _regular(change / _scales(self.turning, change.shape[-1], self.size), self.turning)


def modes_of(linkage: Links, angles: ArrayLike, rates: ArrayLike = 0.0, accels: ArrayLike = 0.0) -> LinkModes:
    """All assembly modes for drive angles (n, drives) [rad], with rates and accelerations of the drives, by continuation in complex
    turns from the binomial(2 L, L) solutions of a start system; each real one polished by Newton."""
    given, eq, motion = _given(linkage, angles, rates, accels)
    n, loop_count, turning = len(given), eq.free.shape[0], eq.turning
    right = eq.right - unit(given) @ eq.known.T
    # dependent unknowns by the columns that a pivoted factorization takes first
    from scipy.linalg import qr

    order = qr(eq.free, mode="r", pivoting=True)[1]
    dependent, independent = order[:loop_count], order[loop_count:]
    inverse = np.linalg.inv(eq.free[:, dependent])
    w = np.zeros((n, 2 * loop_count, loop_count + 1), dtype=complex)  # unknowns as functions of 1 and the independent ones
    w[:, independent, 1 + np.arange(loop_count)] = 1.0
    w[:, dependent, 0], w[:, dependent, 1:] = right @ inverse.T, -inverse @ eq.free[:, independent]
    ends = all_solutions(_equations(eq, w, given))
    found = np.einsum("pki,pmi->pmk", w, np.concatenate([np.ones((*ends.finite.shape, 1)), ends.x], axis=-1))
    turn, place = found[..., :turning], found[..., turning:] * np.conj(_guides(eq, found, given[:, None]))
    with np.errstate(invalid="ignore"):
        real = ends.finite & (np.abs(np.abs(turn) - 1.0).max(axis=-1, initial=0.0) < ON_CIRCLE)
        real &= (np.abs(place.imag) / (1.0 + np.abs(place))).max(axis=-1, initial=0.0) < ON_CIRCLE
    row, slot = np.nonzero(real)
    starts = np.concatenate([np.angle(turn), place.real], axis=-1)[row, slot]
    turns, closed = newton(eq, right[row], given[row], starts)
    infinite = np.count_nonzero(~ends.finite, axis=-1) - ends.lost
    return _collect(eq, motion, row[closed], turns[closed], n, (ends.lost, infinite), path_count(loop_count))


def _equations(eq: Loops, w: Complex, given: Real) -> Bilinear:
    """z conj(z) = 1 for each turn, y conj(z_k) - z_k conj(y) = 0 for each slide, for the unknowns w (n, 2 L, L + 1)."""
    if not eq.guides:
        return Bilinear(w, np.conj(w))
    u, v = w.copy(), np.conj(w)
    r, s = np.zeros_like(w), np.zeros_like(w)
    for k, guide in enumerate(eq.guides):
        place = eq.turning + k
        of = np.zeros_like(w[:, 0])
        if guide >= 0:
            of = w[:, guide]
        else:
            of[:, 0] = 1.0 if guide == FIXED_GUIDE else unit(given[:, -2 - guide])
        v[:, place], r[:, place], s[:, place] = np.conj(of), -of, np.conj(w[:, place])
    circles = (np.arange(w.shape[1]) < eq.turning).astype(float)
    return Bilinear(u, v, r, s, circles)


def _guides(eq: Loops, z: Complex, given: Real) -> Complex:
    """Directions z_k (..., slides) of the guides, for unknowns z (..., 2 L), of which the first are turns, and drives (..., drives)."""
    shape = np.broadcast_shapes(z.shape[:-1], given.shape[:-1])
    out = np.ones((*shape, len(eq.guides)), dtype=complex)
    for k, guide in enumerate(eq.guides):
        if guide != FIXED_GUIDE:
            out[..., k] = z[..., guide] if guide >= 0 else unit(given[..., -2 - guide])
    return out


def _vectors(eq: Loops, x: Real, given: Real) -> tuple[Complex, Complex, Complex]:
    """The unknowns (k, 2 L) as complex numbers, the directions (k, slides) of the guides, and the Jacobian (k, L, 2 L)."""
    z = unit(x[:, : eq.turning])
    guide = _guides(eq, z, given)
    places = x[:, eq.turning :] * guide
    whole = np.concatenate([z, places], axis=1)
    columns = eq.free[None] * whole[:, None, :]
    jacobian = 1j * columns
    for k, of in enumerate(eq.guides):
        if of >= 0:
            jacobian[:, :, of] += 1j * columns[:, :, eq.turning + k]
    jacobian[:, :, eq.turning :] = eq.free[None, :, eq.turning :] * guide[:, None, :]
    return whole, guide, jacobian


def newton(eq: Loops, right: Complex, given: Real, start: Real, steps: int = 40) -> tuple[Real, Flags]:
    """Turns and places over the size (k, 2 L) near given ones that close the loops, right (k, L), at drive angles (k, drives), and whether
    they do. A step is at most 0.5."""
    x = start.copy()
    busy = np.arange(len(x))
    damping = 1e-15 * float(np.sum(np.abs(eq.free) ** 2)) * np.eye(x.shape[1])  # of use where two modes merge
    for _ in range(steps):
        whole, _, jacobian = _vectors(eq, x[busy], given[busy])
        gap = whole @ eq.free.T - right[busy]
        open_ = np.abs(gap).max(axis=1, initial=0.0) > 1e-15 * eq.size
        busy, jacobian, gap = busy[open_], jacobian[open_], gap[open_]
        if not busy.size:
            break
        rows = np.concatenate([jacobian.real, jacobian.imag], axis=1)
        sides = np.concatenate([gap.real, gap.imag], axis=1)
        turned = rows.transpose(0, 2, 1)
        change = -np.linalg.solve(turned @ rows + damping, turned @ sides[..., None])[..., 0]
        x[busy] += change * np.minimum(1.0, 0.5 / np.maximum(np.abs(change).max(axis=1, keepdims=True), 1e-300))
    gap = np.abs(_vectors(eq, x, given)[0] @ eq.free.T - right)
    return _regular(x, eq.turning), np.asarray(gap.max(axis=1, initial=0.0) < CLOSED * eq.size)


def modes_by_trial(linkage: Links, angles: ArrayLike, rates: ArrayLike = 0.0, accels: ArrayLike = 0.0, starts: int = 40) -> LinkModes:
    """What `modes_of` finds, by Newton's method from `starts` x binomial(2 L, L) random turns at each position: a second way, that
    proves nothing where it finds less."""
    given, eq, motion = _given(linkage, angles, rates, accels)
    n, bound = len(given), path_count(eq.free.shape[0])
    right = eq.right - unit(given) @ eq.known.T
    rng = np.random.default_rng(_SEED)
    row = np.repeat(np.arange(n), starts * bound)
    turns, closed = newton(eq, right[row], given[row], rng.uniform(-np.pi, np.pi, (len(row), eq.free.shape[1])))
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
    first = turns[:, 0] if not eq.turning else (turns[:, 0] + 1e-4) % (2.0 * np.pi)  # 0 and pi are no border
    order = np.lexsort((first, row)) if len(row) else np.arange(0)
    for k in order:
        away = [np.abs(_regular(turns[k] - other, eq.turning)).max() for other in kept[row[k]]]
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
            array[position, slot] = values * _scales(eq.turning, links, eq.size)
        det[position, slot] = found[2]
    return LinkModes(out[0], out[1], out[2], det, count, paths[0], paths[1], bound, eq.turning, eq.size)


def _rates(eq: Loops, x: Real, angle: Real, rate: Real, accel: Real) -> tuple[Real, Real, Real]:
    """Rates and accelerations (k, 2 L), and det J (k,), from the first and second derivative of the loop equations by time.

    (s z_k)' = (s' + i w_k s) z_k;   (s z_k)'' = (s'' + 2 i w_k s' + i e_k s - w_k^2 s) z_k.
    """
    whole, guide, jacobian = _vectors(eq, x, angle)
    drive = unit(angle)
    rows = np.concatenate([jacobian.real, jacobian.imag], axis=1)
    det = np.linalg.det(rows)

    def solve(side: Complex) -> Real:
        sides = np.concatenate([side.real, side.imag], axis=1)
        regular = np.linalg.cond(rows) < 1e13
        out = np.full(x.shape, np.nan)
        out[regular] = np.linalg.solve(rows[regular], sides[regular][..., None])[..., 0]
        return out

    def of_guides(values: Real, driven: Real) -> Real:
        """(k, slides) rates of the guides from those of the unknowns and the drives; 0 of the ground."""
        out = np.zeros(guide.shape)
        for k, g in enumerate(eq.guides):
            if g != FIXED_GUIDE:
                out[:, k] = values[:, g] if g >= 0 else driven[:, -2 - g]
        return out

    places, slides = whole[:, eq.turning :], eq.free[:, eq.turning :]
    by_drive = of_guides(np.zeros_like(x), rate) * 1j * places
    w = solve(-(1j * drive * rate) @ eq.known.T - by_drive @ slides.T)
    turning = of_guides(w, rate)
    bent = whole[:, : eq.turning] * w[:, : eq.turning] ** 2
    moved = (turning**2 - 1j * of_guides(np.zeros_like(x), accel)) * places - 2j * turning * w[:, eq.turning :] * guide
    e = solve((drive * rate**2 - 1j * drive * accel) @ eq.known.T + bent @ eq.free[:, : eq.turning].T + moved @ slides.T)
    return w, e, det


def positions(linkage: Links, angles: ArrayLike, turns: Real) -> dict[str, Complex]:
    """Points (...) by name from drive angles (..., drives) and the quantities (..., quantities) of a mode."""
    eq, names = loops(linkage), list(linkage.links)
    given = np.broadcast_to(np.asarray(angles, dtype=float), (*turns.shape[:-1], len(linkage.drives)))
    z = unit(turns[..., : eq.turning])
    every = np.zeros((*turns.shape[:-1], len(names) + len(eq.guides)), dtype=complex)
    every[..., [names.index(n) for n in linkage.unknowns]] = z
    every[..., [names.index(n) for n in linkage.drives]] = unit(given)
    every[..., len(names) :] = turns[..., eq.turning :] / eq.size * _guides(eq, z, given)
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
    scales = _scales(modes.turning, modes.turns.shape[-1], modes.size)
    trace: dict[int, tuple[Real, Real]] = {k: (x, 0.0 * x) for k, x in enumerate(modes.turns[0, : modes.count[0]])}
    for i in range(1, len(modes.count)):
        new, before = modes.turns[i, : modes.count[i]], dict(trace)
        trace = {}
        if before and len(new):
            keys = list(before)
            away = np.array([[np.abs(modes.apart(x - before[b][0] - before[b][1])).max() for x in new] for b in keys])
            signs = np.array([np.sign(modes.det[i - 1, np.flatnonzero(out[i - 1] == b)[0]]) for b in keys])
            away[signs[:, None] != np.sign(modes.det[i, : len(new)])[None]] = 10.0
            for a, k in zip(*linear_sum_assignment(away), strict=True):
                if away[a, k] < JUMP:
                    out[i, k] = keys[a]
                    trace[keys[a]] = (new[k], modes.apart(new[k] - before[keys[a]][0]) * scales)
        for k in np.flatnonzero(out[i, : len(new)] < 0):
            out[i, k] = following
            trace[following] = (new[k], 0.0 * new[k])
            following += 1
    return out


def _scales(turning: int, count: int, size: float) -> Real:
    """(count,) 1 for turns, the size of the linkage for places."""
    return np.where(np.arange(count) < turning, 1.0, size)


def _regular(x: Real, turning: int) -> Real:
    """Quantities (..., quantities) with their turns modulo full ones."""
    return np.concatenate([wrapped(x[..., :turning]), x[..., turning:]], axis=-1)


def wrapped(angle: Real) -> Real:
    """The angle modulo full turns, in (-pi, pi]."""
    return np.asarray(-((-angle + np.pi) % (2 * np.pi) - np.pi))
