"""Counts a region on a grid (nodes inside, columns, deciding clauses), maps quantities over it, and compares two
regions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from math import prod

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.regions import Region
from mechlab.experiment.entry import WorkspaceMap
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.studies.workspace.grid import SLAB, WorkspaceGrid

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class ClauseCount:
    """Numbers of nodes for one clause. keeps: where it holds; decides_outside: where it is the most violated clause;
    decides_inside: where it is the tightest; alone: that are outside only because of it."""

    keeps: int = 0
    decides_outside: int = 0
    decides_inside: int = 0
    alone: int = 0

    def to_dict(self) -> dict[str, int]:
        """JSON-able form."""
        return dict(vars(self))


@dataclass(frozen=True)
class WorkspaceSurvey:
    """Counts of a region on a grid. voxels: nodes inside. columns: nodes of the first two of three axes at which every
    clause that does not depend on the last axis holds (None for other numbers of axes). low, high: indices of the
    smallest box with all inside nodes. deepest: the node with the largest margin; margin: its value."""

    grid: WorkspaceGrid
    voxels: int
    columns: int | None
    clauses: Mapping[str, ClauseCount]
    low: tuple[int, ...] = ()
    high: tuple[int, ...] = ()
    centroid: tuple[float, ...] = ()
    deepest: tuple[float, ...] = ()
    margin: float = -np.inf

    @property
    def volume(self) -> float:
        """Nodes inside times the volume of a cell."""
        return self.voxels * self.grid.cell

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """Smallest and largest coordinate of a node inside, by axis; empty for an empty region."""
        if not self.voxels:
            return {}
        return {
            name: (float(nodes[a]), float(nodes[b]))
            for name, nodes, a, b in zip(self.grid.names, self.grid.nodes, self.low, self.high, strict=True)
        }


def survey(
    region: Region,
    grid: WorkspaceGrid,
    slab: int = SLAB,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> WorkspaceSurvey:
    """Count the region on the grid, at most `slab` nodes at a time. progress(done, total) counts nodes."""
    tally = _Tally(region, grid)
    for cut in grid.slabs(slab):
        tally.add(cut)
        progress(tally.seen, grid.size)
    return tally.result()


class _Tally:
    """Sums over the slabs counted so far."""

    def __init__(self, region: Region, grid: WorkspaceGrid) -> None:
        self.region, self.grid, self.dims = region, grid, len(grid.shape)
        self.names = [c.name for c in region.clauses]
        self.counts = np.zeros((4, len(self.names)), dtype=np.int64)
        self.columns = self.seen = 0
        self.along = [np.zeros(n, dtype=np.int64) for n in grid.shape]
        self.best = -np.inf
        self.deepest: tuple[float, ...] = ()

    def add(self, cut: tuple[slice, ...]) -> None:
        """Count one slab."""
        points = self.grid.points(*cut)
        found = self.region.decide(points)
        inside = found.inside
        shape = inside.shape
        self.seen += inside.size
        kept: list[Mask] = [np.asarray(c.margin(points) >= 0.0) for c in self.region.clauses]
        self.counts[0] += [int(k.sum()) * (inside.size // k.size) for k in kept]
        self.counts[1] += np.bincount(found.clause[~inside], minlength=len(self.names))
        self.counts[2] += np.bincount(found.clause[inside], minlength=len(self.names))
        self.counts[3] += self._alone(kept, shape)
        self.columns += self._columns(kept, shape)
        for axis in range(self.dims):
            part = cut[axis] if axis < len(cut) else slice(None)
            self.along[axis][part] += inside.sum(axis=tuple(a for a in range(self.dims) if a != axis))
        where = int(np.argmax(found.margin))
        top = float(found.margin.flat[where])
        if top > self.best:
            self.best = top
            index = np.unravel_index(where, shape)
            self.deepest = tuple(float(points[n].ravel()[i]) for n, i in zip(self.grid.names, index, strict=True))

    def _alone(self, kept: list[Mask], shape: tuple[int, ...]) -> list[int]:
        """By clause, the number of nodes that violate this clause only."""
        broken = np.zeros(shape, dtype=np.int8)
        for k in kept:
            broken += ~k
        once = broken == 1
        return [int(np.count_nonzero(once & ~k)) for k in kept]

    def _columns(self, kept: list[Mask], shape: tuple[int, ...]) -> int:
        """Number of columns at which every clause that does not depend on the last axis holds."""
        last = self.grid.names[-1]
        flat = np.ones((*shape[:-1], 1), dtype=bool)
        for clause, k in zip(self.region.clauses, kept, strict=True):
            if last not in clause.axes:
                flat &= k
        return int(flat.sum())

    def result(self) -> WorkspaceSurvey:
        """The counts of all slabs."""
        voxels = int(self.along[0].sum())
        by_name = {n: ClauseCount(*(int(x) for x in self.counts[:, i])) for i, n in enumerate(self.names)}
        columns = self.columns if self.dims == 3 else None
        if not voxels:
            return WorkspaceSurvey(self.grid, 0, columns, by_name, deepest=self.deepest, margin=self.best)
        ends = [np.flatnonzero(a)[[0, -1]] for a in self.along]
        centre = [float(a @ nodes) / voxels for a, nodes in zip(self.along, self.grid.nodes, strict=True)]
        low, high = (tuple(int(e[k]) for e in ends) for k in (0, 1))
        return WorkspaceSurvey(self.grid, voxels, columns, by_name, low, high, tuple(centre), self.deepest, self.best)


MOST_IN_MAP = 1_000_000
"""Largest number of nodes of a map; on a finer grid it takes every second, third ... node of each axis."""


@dataclass(frozen=True)
class MapSummary:
    """A quantity over its axes, where every clause that depends on these axes alone holds: extremes, median, and
    `values` at `nodes` (axis -> coordinates), NaN where a clause fails."""

    axes: tuple[str, ...]
    unit: str
    text: str
    smallest: float
    median: float
    largest: float
    nodes: Mapping[str, Array] = field(repr=False)
    values: Array = field(repr=False)

    def to_dict(self) -> dict[str, object]:
        """JSON-able form, without the arrays."""
        return {
            "axes": list(self.axes), "unit": self.unit, "smallest": self.smallest, "median": self.median,
            "largest": self.largest, "text": self.text,
        }  # fmt: skip


def map_over(region: Region, grid: WorkspaceGrid, item: WorkspaceMap) -> MapSummary | None:
    """The map over the grid; None where no node satisfies the clauses."""
    free = [n for n in item.axes if n in grid.axes]
    size = prod(grid.axes[n][2] for n in free)
    stride = int(np.ceil((size / MOST_IN_MAP) ** (1.0 / max(1, len(free))))) if size > MOST_IN_MAP else 1
    nodes = {n: grid.nodes[grid.names.index(n)][::stride] for n in free}
    points = {n: v.reshape([-1 if m == n else 1 for m in free]) for n, v in nodes.items()}
    points |= {n: np.full((1,) * len(free), grid.fixed[n]) for n in item.axes if n not in points}
    shape = tuple(len(v) for v in nodes.values())
    holds = np.ones(shape, dtype=bool)
    for clause in region.clauses:
        if set(clause.axes) <= set(item.axes):
            holds &= clause.margin(points) >= 0.0
    if not holds.any():
        return None
    values = np.broadcast_to(item.function(points), shape)
    inside = values[holds]
    return MapSummary(
        tuple(free), item.unit, item.text, float(inside.min()), float(np.median(inside)), float(inside.max()), nodes,
        np.where(holds, values, np.nan),
    )  # fmt: skip


@dataclass(frozen=True)
class WorkspaceComparison:
    """Numbers of nodes in both regions, in the first only, in the second only; cell: volume of a node."""

    both: int
    only_first: int
    only_second: int
    cell: float

    @property
    def union(self) -> int:
        """Number of nodes in at least one region."""
        return self.both + self.only_first + self.only_second

    @property
    def voxels(self) -> dict[str, int]:
        """Part -> number of nodes."""
        return {"both": self.both, "only_first": self.only_first, "only_second": self.only_second, "union": self.union}

    def to_dict(self) -> dict[str, object]:
        """Voxels and volumes."""
        return {"voxels": self.voxels, "volumes": {k: n * self.cell for k, n in self.voxels.items()}}


def compare(first: Region, second: Region, grid: WorkspaceGrid, slab: int = SLAB) -> WorkspaceComparison:
    """Count both regions on the grid, slab by slab."""
    both = alone = other = 0
    for cut in grid.slabs(slab):
        points = grid.points(*cut)
        a, b = (r.decide(points).inside for r in (first, second))
        both += int((a & b).sum())
        alone += int((a & ~b).sum())
        other += int((b & ~a).sum())
    return WorkspaceComparison(both, alone, other, grid.cell)
