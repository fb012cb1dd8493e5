"""Two regions on one grid: what they share, and what each has alone."""

from __future__ import annotations

from dataclasses import dataclass

from mechlab.analytic.regions import Region
from mechlab.study.workspace.grid import SLAB, Grid


@dataclass(frozen=True)
class Comparison:
    """Nodes of both regions, of the first alone, of the second alone; a cell is the volume of a node."""

    both: int
    only_first: int
    only_second: int
    cell: float

    @property
    def union(self) -> int:
        """Nodes of at least one."""
        return self.both + self.only_first + self.only_second

    @property
    def voxels(self) -> dict[str, int]:
        """Nodes by part."""
        return {"both": self.both, "only_first": self.only_first, "only_second": self.only_second, "union": self.union}

    def to_dict(self) -> dict[str, object]:
        """Voxels and volumes."""
        return {"voxels": self.voxels, "volumes": {k: n * self.cell for k, n in self.voxels.items()}}


def compare(first: Region, second: Region, grid: Grid, slab: int = SLAB) -> Comparison:
    """Count both on the grid, slab by slab."""
    both = alone = other = 0
    for cut in grid.slabs(slab):
        points = grid.points(*cut)
        a, b = (r.decide(points).inside for r in (first, second))
        both += int((a & b).sum())
        alone += int((a & ~b).sum())
        other += int((b & ~a).sum())
    return Comparison(both, alone, other, grid.cell)
