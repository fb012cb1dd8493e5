"""A motion of one freedom under forces of position alone, from its energy: t = integral of dphi / sqrt(2 (E - V) / J).

No steps, no drift, no constraint rows: the time along the orbit is integrated with Chebyshev polynomials (between two turning
points: with cosines) and inverted where the motion is asked for. With twice the nodes the error falls geometrically.
"""

from __future__ import annotations

import math
from copy import copy

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import NoSolution
from mechlab.experiment.scene import Scene
from mechlab.integrate.path_time import (
    PathTime,
    SwingTime,
    chebyshev_basis,
    chebyshev_derivative,
    chebyshev_fit,
    chebyshev_nodes,
    cosine_midpoints,
    cosine_nodes,
    wave_numbers,
)
from mechlab.integrate.path_time import cosine_fit as cosines
from mechlab.lab.accuracy.branch import CLOSED_TO, TURN, PoseBranch, candidate_joints, next_joint
from mechlab.lab.accuracy.energies import EnergyFunction, energies_of
from mechlab.lab.accuracy.measure import States
from mechlab.lab.accuracy.orbit import EnergyOrbit, OrbitSearch
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.batch_tree import BatchRows, BatchTree
from mechlab.mechanism.geometry import Array

MANY = 2
"""Where more poses are closed than this many times those of the continuation, these are worth being sharpened first."""
PATIENCE = 2
"""Steps along a joint that may fail while there are other joints to try."""
NEAR = 1e-2
"""Poses farther than this [rad or m] from the polynomials of the coarser nodes may lie on another branch: they are closed anew."""
COPIED = 1_000_000
"""Numbers up to which the coefficients of the polynomials are copied to the places where they are asked for."""
SETTLED = 1e-2
"""Largest share by which the time of a swing may change with half the nodes, or with the last digit of the energy. Beyond it the
motion hardly leaves its turning point, and the change says nothing of the error."""


@dataclass(frozen=True)
class PlacedStates(States):
    """States, and their places on the orbit."""

    place: _CellPlace | _SwingPhase


@dataclass(frozen=True)
class _CellPlace:
    """Place on an orbit of cells: completed passages, cell, Chebyshev basis there, pose without full turns."""

    lap: Array
    cell: NDArray[np.intp]
    basis: Array
    q: Array


@dataclass(frozen=True)
class _SwingPhase:
    """Place on a swing: x since the first turning point and its waves; mean: the time of a swing over pi."""

    mean: float
    x: Array
    waves: Array


@dataclass(frozen=True)
class _NodeSamples:
    """Exact values at the nodes of all cells, shape (cells, n + 1, ...)."""

    x: Array
    q: Array
    inertia: Array
    height: Array
    slope: Array


class EnergyMotion:
    """The motion of a mechanism from q0 (nv,), v0 (nv,), by its energy. closed: last correction of its poses [rad or m]; energies:
    those of the scene, joints: its `candidate_joints`, where they are known already; corrected [rad or m]: the largest last correction of
    the poses at the nodes; size [J]: that of the parts of V at q0. Raises NoSolution where no joint moves all along it."""

    def __init__(
        self, mechanism: Mechanism, scene: Scene, q0: Array, v0: Array, tree: BatchTree, rows: BatchRows,
        closed: float = CLOSED_TO, energies: EnergyFunction | None = None, joints: list[int] | None = None,
    ) -> None:  # fmt: skip
        self.mechanism, self.tree = mechanism, tree
        self.energies = energies or energies_of(tree, scene)
        explorer = self._explore(q0, v0, rows, scene.duration, joints)
        self.energy, self.duration = explorer.energy, scene.duration
        self.size = self.energies.size(q0)
        self.samples: _NodeSamples | None = None
        self.evaluations, self.corrected = 0, 0.0
        self.closed, self.last_step = closed, max(1e-7, math.sqrt(closed))

    def _explore(self, q0: Array, v0: Array, rows: BatchRows, duration: float, joints: list[int] | None) -> OrbitSearch:
        """The orbit along the first joint that does not stop; the next joint takes over the poses reached so far."""
        order = candidate_joints(self.mechanism, q0, rows) if joints is None else joints
        # first a joint near a limit position is soon left for another; if all of them are, each is followed to its limit
        why = ""
        for patience in (PATIENCE, 10**9) if rows.count and len(order) > 1 else (10**9,):
            left, failed = list(order), None
            k: int | None = left[0]
            while k is not None:
                left.remove(k)
                branch = PoseBranch(self.mechanism, q0, k, self.tree, rows)
                branch.patience = patience
                if failed is not None:
                    branch.seed(failed)
                if not rows.count and self.tree.revolute[k]:
                    branch.turn = np.full(1, TURN)
                explorer = OrbitSearch(branch, self.energies, float(v0[k]), duration)
                try:
                    self.orbit: EnergyOrbit = explorer.orbit()
                except NoSolution as cause:
                    why, failed = str(cause), branch
                    k = next_joint(branch, left)
                    continue
                self.branch = branch
                return explorer
        raise NoSolution(f"the energy does not tell the motion: {why}")

    @property
    def n(self) -> int:
        """Number of nodes of a cell, less one."""
        return 0 if self.samples is None else self.samples.x.shape[1] - 1

    @property
    def lively(self) -> float:
        """The largest kinetic energy at the nodes over the size of the parts of the potential energy."""
        assert self.samples is not None
        return float((self.energy - self.samples.height.min()) / max(self.size, 1e-300))

    @property
    def resolution(self) -> str:
        """The nodes in words."""
        if self.orbit.kind == "swing":
            return f"{self.n + 1} nodes between its turning points"
        return f"{self.n + 1} nodes in each of {self.orbit.cells} cells"

    def refine(self, n: int) -> None:
        """Exact values at n + 1 nodes of every cell; with twice the last n those that are known are kept."""
        o = self.orbit
        if o.kind == "swing":
            xs = cosine_nodes(n)
        else:
            width = (o.high - o.low) / o.cells
            xs = o.low + width * (np.arange(o.cells)[:, None] + 0.5 * (chebyshev_nodes(n) + 1.0))
        old = self.samples
        new = xs if old is None else xs[:, 1::2]
        q, u = self._poses(o.phi(new.ravel()), new.shape[1])
        self.corrected = max(self.corrected, self.branch.corrected)
        found = [a.reshape(*new.shape, *a.shape[1:]) for a in (q, *self.energies(q, u))]
        self.evaluations += new.size
        if old is not None:
            both = []
            for coarse, fine in zip((old.q, old.inertia, old.height, old.slope), found, strict=True):
                out = np.empty((coarse.shape[0], n + 1, *coarse.shape[2:]))
                out[:, ::2], out[:, 1::2] = coarse, fine
                both.append(out)
            found = both
        self.samples = _NodeSamples(xs, *found)
        self._paces: Array | None = None

    def _poses(self, phi: Array, per_cell: int) -> tuple[Array, Array]:
        """Closed poses at phi (P,), `per_cell` in each cell: guessed by the polynomials of the coarser nodes where these are close
        enough, so that little is left to correct."""
        old = self.samples
        if old is not None and self.branch.rows.count:
            n = self.n
            at = (
                cosine_midpoints(n)
                if self.orbit.kind == "swing"
                else chebyshev_basis(chebyshev_nodes(2 * n)[1::2], n) @ chebyshev_fit(n)
            )
            guess = (at @ old.q).reshape(len(phi), -1)
            try:
                q, u = self.branch.close(phi, guess, self.closed)
            except NoSolution:
                pass
            else:
                if np.max(np.abs(q - guess)) < NEAR:
                    return q, u
        if old is None and len(phi) > MANY * len(self.branch.phi):
            self.branch.sharpen()
        return self.branch.at(phi, self.closed)

    def states(self, t: Array, accelerations: bool = False) -> PlacedStates:
        """The motion at times t (P,). Raises NoSolution where its speed vanishes between turning points."""
        assert self.samples is not None
        o = self.orbit
        if o.kind == "swing":
            return self._swinging(t, accelerations)
        clock = self._clock()
        total, lap = clock.total, np.zeros(1)
        if o.kind == "turn":
            p = clock.time(o.x0) + t
            lap = np.floor(p / total)
            p = p - lap * total
        else:
            if t[-1] > total * (1.0 + 1e-12):
                raise NoSolution("the orbit was not followed far enough")
            p = np.minimum(t, total)
        cell, _, wide = clock.invert(p, self.last_step)
        b, n = wide[:, :-1], self.n
        c = chebyshev_fit(n) @ self.samples.q
        slope = chebyshev_derivative(n) * (2.0 / clock.width)
        d = slope @ c
        g = (b * clock.slopes[cell]).sum(axis=1)
        polynomials = (c, d, slope @ d) if accelerations else (c, d)
        found = [_of_cells(b, x, cell) for x in polynomials]
        value, first = found[:2]
        v = first / g[:, None]
        q = value
        if o.kind == "turn" and self.branch.turn is not None:
            q = value + np.multiply.outer(o.sign * (lap - 1.0), self.branch.turn)
        place = _CellPlace(lap, cell, wide, value)
        if not accelerations:
            return PlacedStates(q, v, None, place)
        dg = (b * (clock.slopes @ slope.T)[cell]).sum(axis=1)
        return PlacedStates(q, v, found[2] / (g * g)[:, None] - first * (dg / g**3)[:, None], place)

    def _swinging(self, t: Array, accelerations: bool) -> PlacedStates:
        """`states` of a swing."""
        assert self.samples is not None
        beat, n, nq = self._beat(), self.n, self.samples.q.shape[2]
        x, w = beat.invert(beat.time(self._x0) + t, self.last_step)
        c = cosines(n) @ self.samples.q[0]
        k = wave_numbers(n)
        rows = np.empty((2 * nq + 1, n + 1))
        rows[:nq] = c.T
        np.multiply(rows[:nq], k, out=rows[nq:-1])
        rows[-1] = beat.slopes
        found = rows @ w
        q, first, g = found[:nq, ::2].T.copy(), -found[nq:-1, 1::2], found[-1, ::2]
        v = (first / g).T.copy()
        if not accelerations:
            return PlacedStates(q, v, None, _SwingPhase(beat.mean, x, w))
        second = -(rows[nq:-1] * k @ w)[:, ::2]
        dg = -(beat.slopes * k @ w)[1::2]
        return PlacedStates(q, v, ((second - first * (dg / g)) / (g * g)).T.copy(), _SwingPhase(beat.mean, x, w))

    def cruder(self) -> EnergyMotion:
        """The motion from every second node alone."""
        assert self.samples is not None
        out, s = copy(self), self.samples
        out.samples = _NodeSamples(*(a[:, ::2] for a in (s.x, s.q, s.inertia, s.height, s.slope)))
        out._paces = None
        return out

    def moved(self, states: PlacedStates, t: Array, every: int = 1, shift: float = 0.0) -> Array:
        """(P, nv) change of the poses of `states` at times t with only each `every`-th node, or with `shift` [J] more energy.

        change = rate x (difference of the times at which the two motions pass the same place) + difference of their
        polynomials at that place. Raises NoSolution as `states` does.
        """
        assert self.samples is not None
        o, place = self.orbit, states.place
        if isinstance(place, _SwingPhase):
            beat = self._beat(every, shift)
            if abs(beat.mean - place.mean) > SETTLED * place.mean:
                raise NoSolution("the time of a swing is not resolved: it all but stands still on its way")
            out = states.v * (t + (beat.time(self._x0) - beat.passed(place.x, place.waves)))[:, None]
            if every > 1:
                rows = (cosines(beat.n) @ self.samples.q[0, ::every]).T @ place.waves[: beat.n + 1]
                out += rows[:, ::2].T - states.q
            return np.asarray(out)
        clock, whole = self._clock(every, shift), self._clock().total
        if abs(clock.total - whole) > SETTLED * whole:
            raise NoSolution("the time on the way is not resolved: the motion all but stands still there")
        n = clock.slopes.shape[1] - 1
        b = place.basis[:, : n + 2]
        passed = clock.starts[place.cell] + (b * clock.times[place.cell]).sum(axis=1)
        if o.kind == "turn":
            passed = passed + clock.total * place.lap - clock.time(o.x0)
        out = states.v * (t - passed)[:, None]
        if every > 1:
            out += _of_cells(b[:, :-1], chebyshev_fit(n) @ self.samples.q[:, ::every], place.cell) - place.q
        return np.asarray(out)

    @property
    def _x0(self) -> float:
        """x at the start of a swing; x increases from there, also on the way back."""
        return self.orbit.x0 if self.orbit.forward else -self.orbit.x0

    def _clock(self, every: int = 1, shift: float = 0.0) -> PathTime:
        return PathTime.of(self.orbit.low, self.orbit.high, self._pace(every, shift))

    def _beat(self, every: int = 1, shift: float = 0.0) -> SwingTime:
        return SwingTime.of(self._pace(every, shift)[0])

    def _pace(self, every: int, shift: float) -> Array:
        """dt/dx at each `every`-th node of all cells, with `shift` [J] more energy."""
        s, o = self.samples, self.orbit
        assert s is not None
        if not shift and self._paces is not None:
            return self._paces[:, ::every]
        if every > 1 and not shift:
            return self._pace(1, 0.0)[:, ::every]
        x, inertia, height, slope = (a[:, ::every] for a in (s.x, s.inertia, s.height, s.slope))
        along = o.slope(x)
        corner = o.turning(along)
        square = 2.0 * (self.energy + shift - height) / inertia
        if corner is not None:
            square[corner] = 1.0
        if not square.min() > 0.0:
            raise NoSolution("the motion comes to rest on its way: an equilibrium that it just reaches")
        g = along / np.sqrt(square)
        if corner is not None:
            g[corner] = o.at_turning(inertia[corner], np.maximum(np.abs(slope[corner]), 1e-300))
        if not shift:
            self._paces = np.asarray(g)
        return np.asarray(g)


def _of_cells(basis: Array, coefficients: Array, cell: NDArray[np.intp]) -> Array:
    """(P, nv) sums of basis (P, n) times the coefficients (cells, n, nv) of each place's cell; of large mechanisms cell by cell, so
    that no coefficient is copied."""
    if basis.size * coefficients.shape[2] < COPIED:
        return np.asarray((basis[:, None] @ coefficients[cell])[:, 0])
    out = np.empty((len(basis), coefficients.shape[2]))
    for k in np.unique(cell):
        here = cell == k
        out[here] = basis[here] @ coefficients[k]
    return out
