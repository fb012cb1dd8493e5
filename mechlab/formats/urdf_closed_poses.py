"""The search of the poses that close the loops of a file.

Newton starts at the zero pose of the file, then at poses around it, farther and farther away; a closed pose found slides
towards the zero pose, and each branch is kept once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mechlab.formats.urdf_closing_rows import closing_rows
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics, integrate
from mechlab.mechanism.length_unit import in_unit_of_length
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import newton
from mechlab.mechanism.parts import GROUND, Joint
from mechlab.mechanism.structure import rank

STARTS, RIGID_STARTS = 60, 15
"""Most starts of Newton, and those where the rows leave no freedom at an open pose: such loops close in single poses, if at all."""
ENOUGH = 4
"""Closed regular poses inside the ranges after which no more starts are made."""
MENDED = 1e-6
"""Largest gap, in units of the size of the mechanism, that is closed by moving the end of a loop: of rounded numbers in a
file with more rows than the closure needs. A larger one is a mistake in the file."""
SPREADS = (0.05, 0.3, 0.8, 1.5, 3.0)
"""Distances of the starts from the zero pose [rad, units of length], in turn."""
NEAR = 1e-3
"""Motion from the zero pose [rad, units of length] below which that pose is meant: no other branch is looked for."""
ATTEMPTS = 5
"""Starts for each loop, where loops are closed one after the other."""
SAME = 1e-4
"""Poses that differ by less [rad, units of length] are the same branch."""
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Branch:
    """A closed pose of some loops: q and residual in the unit of length of the mechanism; motion from the zero pose, ranges
    broken, singular."""

    q: Array
    residual: float
    motion: float
    outside: tuple[str, ...]
    singular: bool

    @property
    def order(self) -> tuple[bool, int, float]:
        """The best branch has the least."""
        return (self.singular, len(self.outside), self.motion)


@dataclass(frozen=True)
class Group:
    """Loops and relations that share joints: their names, their rows, the rates they depend on; the poses that close them, or
    why there are none."""

    names: tuple[str, ...]
    rows: Indices
    columns: Indices
    found: tuple[Branch, ...] = ()
    starts: int = 0
    hopeless: str = ""

    @property
    def best(self) -> Branch:
        """The branch that is taken."""
        return min(self.found, key=lambda b: b.order)


class Closing:
    """Newton for one mechanism, in its own unit of length."""

    def __init__(self, bare: Mechanism) -> None:
        self.unit = bare.length_scale
        self.m = bare if self.unit == 1.0 else in_unit_of_length(bare, self.unit)
        self.tree, self.rows = TreeKinematics(self.m), ConstraintSet(self.m)
        self.parts = {c.name: closing_rows(c) for c in self.rows.items}
        self._held: dict[tuple[str, ...], list[int]] = {}

    def residual(self, q: Array) -> Array:
        """(rows,) residual, lengths in the unit."""
        self.tree.set(q)
        return np.concatenate([c.residual(self.tree) for c in self.parts.values()])

    @cached_property
    def groups(self) -> list[Group]:
        """The loops and relations, those that share a joint together."""
        rng = np.random.default_rng(3)
        some = [self._step(self.m.reference(), rng.standard_normal(self.m.nv)) for _ in range(2)]
        uses = np.sum([np.abs(self.rows.jacobian(self.tree.set(q))) for q in some], axis=0)
        names = list(self.rows.slices)
        columns = {n: {int(k) for k in np.flatnonzero(uses[self.rows.slices[n]].max(axis=0) > 1e-9)} for n in names}
        together: list[list[str]] = []
        for name in names:
            joined = [g for g in together if any(columns[n] & columns[name] for n in g)]
            together = [g for g in together if g not in joined] + [[*(n for g in joined for n in g), name]]
        return [self._group(g, columns) for g in together]

    def _group(self, names: Sequence[str], columns: Mapping[str, set[int]]) -> Group:
        rows = np.concatenate([np.arange(self.rows.slices[n].start, self.rows.slices[n].stop) for n in names])
        return Group(tuple(names), rows, np.array(sorted(set().union(*(columns[n] for n in names))), dtype=np.intp))

    def merged(self, q: Array, other: Array, group: Group) -> Array:
        """q with the coordinates of a group from another pose."""
        out = q.copy()
        for joint in self.m.joints:
            if self.m.v_slice[joint.name].start in group.columns:
                out[self.m.q_slice[joint.name]] = other[self.m.q_slice[joint.name]]
        return out

    def _evaluate(self, q: Array, group: Group) -> tuple[Array, Array]:
        self.tree.set(q, only=self._bodies(group.names))
        parts = [self.parts[name] for name in group.names]
        jacobian = np.zeros((len(group.rows), self.m.nv))
        jacobian[:, group.columns] = np.vstack([c.jacobian(self.tree) for c in parts])[:, group.columns]
        return np.concatenate([c.residual(self.tree) for c in parts]), jacobian

    def _bodies(self, names: tuple[str, ...]) -> list[int]:
        """Indices of the bodies that loops of these names hold, and of their parents: all that a residual depends on."""
        if names not in self._held:
            ends = [x for loop in self.m.loops if loop.name in names for x in (loop.body_a, loop.body_b)]
            needed: set[str] = set()
            while ends:
                name = ends.pop()
                if name != GROUND and name not in needed:
                    needed.add(name)
                    ends.append(self.m.body(name).parent)
            self._held[names] = [i for i, b in enumerate(self.m.bodies) if b.name in needed]
        return self._held[names]

    def _step(self, q: Array, dv: Array) -> Array:
        return integrate(self.m, q, dv)

    def _shaken(self, q: Array, columns: Indices, spread: float, rng: np.random.Generator) -> Array:
        step = np.zeros(self.m.nv)
        step[columns] = spread * rng.standard_normal(len(columns))
        return self._step(q, step)

    def close(self, q: Array, group: Group) -> tuple[Array, float]:
        """A pose near q with the least residual, by damped Newton, and that residual; redundant rows that contradict each
        other by rounding are met in the mean."""
        found = newton(lambda x: self._evaluate(x, group), self._step, q, tolerance=1e-13, iterations=50)
        best, size = found.q, found.residual
        if 1e-13 < size < 1e-2:  # rows that nearly repeat others: leave their differences alone
            for _ in range(8):
                residual, jacobian = self._evaluate(best, group)
                trial = self._step(best, np.asarray(-np.linalg.lstsq(jacobian, residual, rcond=1e-5)[0], dtype=np.float64))
                after = largest(self._evaluate(trial, group)[0])
                if after < size or (after < 2.0 * size and after < MENDED):
                    best, size = trial, after
        return best, size

    def search(self, group: Group, start: Array) -> Group:
        """The group with the closed poses found, the nearest of each branch once."""
        rng = np.random.default_rng(1)
        found: list[Branch] = []
        rigid = rank(self._evaluate(self._some, group)[1]) == len(group.columns)
        k = 0
        for k in range(RIGID_STARTS if rigid else STARTS):
            spread = 0.0 if k == 0 else SPREADS[(k - 1) % len(SPREADS)]
            q = self._shaken(start, group.columns, spread, rng)
            q, size = self._grown(q, group, rng) if k % 2 else self.close(q, group)
            if size > MENDED and k == 0 and (hopeless := self._hopeless(group)):
                return replace(group, starts=k + 1, hopeless=hopeless)
            if size > MENDED:
                continue
            branch = self._judged(*self._nearer(q, size, group), group)
            if all(np.max(np.abs(branch.q - b.q)) > SAME for b in found):
                found.append(branch)
            good = sum(not b.singular and not b.outside for b in found)
            if good >= ENOUGH or (good and k == 0 and branch.motion < NEAR):
                break
        return replace(group, found=tuple(found), starts=k + 1)

    def _grown(self, q: Array, group: Group, rng: np.random.Generator) -> tuple[Array, float]:
        """The pose with one loop after the other closed, each from a few starts of the joints that it adds."""
        closed: list[str] = []
        size = np.inf
        parts = {g.names[0]: g for g in (self._alone(n) for n in group.names)}
        done: set[int] = set()
        for name in rng.permutation(list(group.names)):
            own = parts[str(name)]
            fresh = np.array([c for c in own.columns if int(c) not in done] or own.columns, dtype=np.intp)
            closed.append(str(name))
            both = self._joined([parts[n] for n in closed])
            for attempt in range(ATTEMPTS):
                trial, size = self.close(q if attempt == 0 else self._shaken(q, fresh, 1.0, rng), both)
                if size <= MENDED:
                    break
            else:
                return q, size
            q = trial
            done |= {int(c) for c in own.columns}
        return q, size

    def _hopeless(self, group: Group) -> str:
        """Half a sentence on the first loop of a group that does not even close alone; empty where each does."""
        rng = np.random.default_rng(5)
        for name in group.names:
            own, least = self._alone(name), np.inf
            for k in range(STARTS):
                q = self._shaken(self.m.reference(), own.columns, 0.0 if k == 0 else SPREADS[k % len(SPREADS)], rng)
                least = min(least, self.close(q, own)[1])
                if least <= MENDED:
                    break
            else:
                names = [j.name for j in self.m.joints if self.m.v_slice[j.name].start in own.columns]
                return (
                    f"{name} does not even close alone: its {len(own.rows)} rows over the joints {', '.join(names)} stay open by "
                    f"{least:.2g} at best from {STARTS} starts"
                )
        return ""

    def _alone(self, name: str) -> Group:
        rows = np.arange(self.rows.slices[name].start, self.rows.slices[name].stop)
        whole = next(g for g in self.groups if name in g.names)
        uses = np.abs(self._evaluate(self._some, replace(whole, names=(name,), rows=rows))[1]).max(axis=0)
        return Group((name,), rows, np.flatnonzero(uses > 1e-9))

    def _joined(self, groups: Sequence[Group]) -> Group:
        columns = np.unique(np.concatenate([g.columns for g in groups]))
        return Group(tuple(n for g in groups for n in g.names), np.concatenate([g.rows for g in groups]), columns)

    @cached_property
    def _some(self) -> Array:
        return self._step(self.m.reference(), np.random.default_rng(4).standard_normal(self.m.nv))

    def _nearer(self, q: Array, size: float, group: Group) -> tuple[Array, float]:
        """Slide along the closed poses towards the zero pose, as far as that shortens the way to it."""
        for _ in range(40):
            jacobian = self._evaluate(q, group)[1][:, group.columns]
            way = -self._away(q)[group.columns]
            _, values, vt = np.linalg.svd(jacobian)
            free = vt[int(np.sum(values > 1e-7 * max(values[0], 1e-12))) :]
            along = np.zeros(self.m.nv)
            along[group.columns] = free.T @ (free @ way)
            if np.max(np.abs(along), initial=0.0) < 1e-3:
                break
            scale = min(1.0, 0.3 / float(np.max(np.abs(along))))
            trial, after = self.close(self._step(q, scale * along), group)
            if after > max(10.0 * size, 1e-12) or self._motion(trial, group) > self._motion(q, group) - 1e-6:
                break
            q, size = trial, after
        return q, size

    def _away(self, q: Array) -> Array:
        """(nv,) the coordinates as a step from the zero pose; angles within half a turn."""
        out = np.zeros(self.m.nv)
        for joint in self.m.joints:
            x, v = q[self.m.q_slice[joint.name]], self.m.v_slice[joint.name]
            if joint.kind == "spherical":
                turn = 2.0 * np.arctan2(np.linalg.norm(x[1:]), abs(x[0]))
                norm = float(np.linalg.norm(x[1:]))
                out[v] = 0.0 if norm == 0.0 else np.copysign(turn, x[0]) * x[1:] / norm
            else:
                out[v] = _half_turn(x) if joint.kind == "revolute" and joint.range is None else x
        return out

    def _motion(self, q: Array, group: Group) -> float:
        return float(np.linalg.norm(self._away(q)[group.columns]))

    def _judged(self, q: Array, size: float, group: Group) -> Branch:
        q, outside = q.copy(), []
        for joint in self.m.joints:
            at = self.m.q_slice[joint.name]
            if self.m.v_slice[joint.name].start not in group.columns or joint.kind == "spherical":
                continue
            turned = _half_turn(q[at])
            if joint.kind == "revolute" and (joint.range is None or not _inside(joint, q[at][0])) and _inside(joint, turned[0]):
                q[at] = turned
            if not _inside(joint, q[at][0]):
                outside.append(joint.name)
        residual, jacobian = self._evaluate(q, group)
        rng = np.random.default_rng(2)
        near = [self.close(self._shaken(q, group.columns, 0.02, rng), group)[0] for _ in range(2)]
        full = max(rank(self._evaluate(x, group)[1]) for x in near)
        return Branch(q, largest(residual), self._motion(q, group), tuple(outside), rank(jacobian) < full)


def _inside(joint: Joint, x: float) -> bool:
    return joint.range is None or joint.range[0] - 1e-6 <= x + joint.zero <= joint.range[1] + 1e-6


def _half_turn(x: Array) -> Array:
    return np.asarray((x + np.pi) % (2.0 * np.pi) - np.pi)


def largest(residual: Array) -> float:
    """The largest absolute residual; 0 of no rows."""
    return float(np.max(np.abs(residual), initial=0.0))
