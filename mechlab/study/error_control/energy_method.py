"""Method "energy": one freedom under forces of position alone, by quadrature: t = integral of dphi / sqrt(2 (E - V) / J).

No steps, no drift, no constraint rows: the time along the orbit is integrated with Chebyshev polynomials and inverted
where the motion is asked for. Refining doubles the nodes; its error falls geometrically.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechlab.errors import NoSolution
from mechlab.experiment.scene import Scene
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.study.error_control.batch import BatchRows, BatchTree
from mechlab.study.error_control.branch import TURN, Branch, branches, next_coordinate
from mechlab.study.error_control.clock import Clock, deriving, fitting, nodes
from mechlab.study.error_control.conservative import Energies
from mechlab.study.error_control.orbit import Explorer, Orbit


@dataclass(frozen=True)
class States:
    """q, v, a (n, nv) at asked times."""

    q: Array
    v: Array
    a: Array


@dataclass(frozen=True)
class _Samples:
    """Exact values at the nodes of all cells, shape (cells, n + 1, ...)."""

    x: Array
    q: Array
    inertia: Array
    height: Array
    slope: Array


class EnergyMotion:
    """The motion of a mechanism from q0, v0 by its energy. Raises NoSolution where no joint counts along it."""

    def __init__(
        self, mechanism: Mechanism, scene: Scene, q0: Array, v0: Array, tree: BatchTree, rows: BatchRows
    ) -> None:
        self.mechanism, self.tree = mechanism, tree
        self.energies = Energies(tree, scene)
        explorer = self._explore(q0, v0, rows, scene.duration)
        self.energy, self.duration = explorer.energy, scene.duration
        self.samples: _Samples | None = None
        self.evaluations = 0

    def _explore(self, q0: Array, v0: Array, rows: BatchRows, duration: float) -> Explorer:
        """The orbit along the first joint that counts; one that stops hands on the poses that it has reached."""
        tree = self.tree
        left = branches(self.mechanism, q0, tree, rows)
        failed: Branch | None = None
        why = ""
        k: int | None = left[0]
        while k is not None:
            left.remove(k)
            branch = Branch(self.mechanism, q0, k, tree, rows)
            if failed is not None:
                branch.seed(failed)
            if not rows.count and tree.revolute[k]:
                branch.turn = np.full(1, TURN)
            explorer = Explorer(branch, self.energies, float(v0[k]), duration)
            try:
                self.orbit: Orbit = explorer.orbit()
            except NoSolution as cause:
                why, failed = str(cause), branch
                k = next_coordinate(branch, left)
                continue
            self.branch = branch
            return explorer
        raise NoSolution(f"the energy does not tell the motion: {why}")

    @property
    def n(self) -> int:
        """Nodes of a cell less one."""
        return 0 if self.samples is None else self.samples.x.shape[1] - 1

    def refine(self, n: int) -> None:
        """Exact samples at n + 1 nodes of every cell; n twice the last one keeps those."""
        o = self.orbit
        width = (o.high - o.low) / o.cells
        xs = o.low + width * (np.arange(o.cells)[:, None] + 0.5 * (nodes(n) + 1.0))
        old = self.samples
        new = xs if old is None else xs[:, 1::2]
        q, u = self.branch.at(o.phi(new.ravel()))
        found = [a.reshape(*new.shape, *a.shape[1:]) for a in (q, *self.energies(q, u))]
        self.evaluations += new.size
        if old is not None:
            both = []
            for coarse, fine in zip((old.q, old.inertia, old.height, old.slope), found, strict=True):
                out = np.empty((coarse.shape[0], n + 1, *coarse.shape[2:]))
                out[:, ::2], out[:, 1::2] = coarse, fine
                both.append(out)
            found = both
        self.samples = _Samples(xs, *found)

    def states(self, t: Array, every: int = 1, shift: float = 0.0) -> States:
        """The motion at times t (P,), from every `every`-th node; `shift` [J] of the energy tells what rounding does.
        Raises NoSolution where the speed is lost between turning points."""
        s, o = self.samples, self.orbit
        assert s is not None
        x, q, inertia = s.x[:, ::every], s.q[:, ::every], s.inertia[:, ::every]
        corner = o.turning(x)
        square = np.where(corner, 1.0, 2.0 * (self.energy + shift - s.height[:, ::every]) / inertia)
        if not np.all(square > 0.0):
            raise NoSolution("the motion comes to rest on its way: an equilibrium that it just reaches")
        g = np.where(
            corner, o.at_turning(inertia, np.maximum(np.abs(s.slope[:, ::every]), 1e-300)), o.slope(x) / np.sqrt(square)
        )
        clock = Clock.of(o.low, o.high, g)
        return self._at(clock, q, t)

    def _at(self, clock: Clock, q: Array, t: Array) -> States:
        o, n = self.orbit, q.shape[1] - 1
        total, sign, turns = clock.total, np.ones(len(t)), np.zeros(len(t))
        if o.kind == "swing":
            phase = clock.time(o.x0)
            p = np.mod((phase if o.forward else 2.0 * total - phase) + t, 2.0 * total)
            sign = np.where(p > total, -1.0, 1.0)
            p = np.where(p > total, 2.0 * total - p, p)
        elif o.kind == "turn":
            p = clock.time(o.x0) + t
            turns = np.floor(p / total)
            p, turns = p - turns * total, o.sign * (turns - 1.0)
        else:
            if t[-1] > total * (1.0 + 1e-12):
                raise NoSolution("the orbit was not followed far enough")
            p = np.minimum(t, total)
        cell, _, b = clock.invert(p)
        c = np.einsum("kj,cjv->ckv", fitting(n), q)
        d = np.einsum("kj,cjv->ckv", deriving(n), c) * (2.0 / clock.width)
        dd = np.einsum("kj,cjv->ckv", deriving(n), d) * (2.0 / clock.width)
        b = b[:, : n + 1]
        value, first, second = (np.einsum("pk,pkv->pv", b, x[cell]) for x in (c, d, dd))
        g = np.sum(b * clock.slopes[cell], axis=1)
        dg = np.sum(b * (clock.slopes @ deriving(n).T)[cell], axis=1) * (2.0 / clock.width)
        if o.kind == "turn" and self.branch.turn is not None:
            value = value + turns[:, None] * self.branch.turn
        v = first * (sign / g)[:, None]
        return States(value, v, second / (g * g)[:, None] - first * (dg / g**3)[:, None])


__all__ = ["EnergyMotion", "States"]
