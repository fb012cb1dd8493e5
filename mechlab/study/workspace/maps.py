"""Quantities mapped over a workspace: dexterity, margins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import prod

import numpy as np

from mechlab.analytic.regions import Region
from mechlab.experiment.workspace import Map
from mechlab.mechanism.geometry import Array
from mechlab.study.workspace.grid import Grid

MOST = 1_000_000
"""A map with more nodes than this is taken on every so-manyeth node of each axis."""


@dataclass(frozen=True)
class MapSummary:
    """A quantity over the part of its axes where every clause holds that looks at these axes alone: extremes, median, and
    `values` over `nodes` (the coordinates of its axes), NaN where a clause fails."""

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


def map_over(region: Region, grid: Grid, item: Map) -> MapSummary | None:
    """The map over the grid; None where no node keeps the clauses."""
    free = [n for n in item.axes if n in grid.axes]
    size = prod(grid.axes[n][2] for n in free)
    stride = int(np.ceil((size / MOST) ** (1.0 / max(1, len(free))))) if size > MOST else 1
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
