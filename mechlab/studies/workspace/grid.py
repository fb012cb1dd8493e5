"""The grid that a workspace is counted on: named axes, evaluated slab by slab so that memory does not grow with the
grid."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import field
from functools import cached_property
from math import prod

import numpy as np

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.values import Range

SLAB = 2_000_000
"""Largest number of nodes evaluated at once: about 150 MB at the peak."""
COUNT = 41
"""Number of nodes of an axis given as low:high."""
MOST = 10**11


@dataclass(frozen=True)
class WorkspaceGrid:
    """Axes by name: (low, high, count); fixed: coordinates that are the same everywhere.

    Node i is ((n - 1 - i) low + i high) / (n - 1): both ends are exact, and so are hundredths on the grid -1:1:201."""

    axes: Mapping[str, tuple[float, float, int]]
    fixed: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not 1 <= len(self.axes) <= 3:
            raise MechlabError(f"workspace: expected one to three axes, got {', '.join(self.axes) or 'none'}.")
        for name, (low, high, count) in self.axes.items():
            if not low < high or count < 2:
                raise MechlabError(
                    f"workspace: axis {name}: expected low < high and at least 2 nodes, got {low:g}:{high:g}:{count}."
                )
        if self.size > MOST:
            raise MechlabError(f"workspace: {self.size:.3g} nodes are too many; expected at most {MOST:.0e}.")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the axes."""
        return tuple(self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of nodes along each axis."""
        return tuple(n for _, _, n in self.axes.values())

    @property
    def size(self) -> int:
        """Number of all nodes."""
        return prod(self.shape)

    @property
    def steps(self) -> tuple[float, ...]:
        """Distance between two nodes, by axis."""
        return tuple((high - low) / (n - 1) for low, high, n in self.axes.values())

    @property
    def cell(self) -> float:
        """Volume (area, length) that belongs to a node, in the product of the axes' units."""
        return prod(self.steps)

    @cached_property
    def nodes(self) -> tuple[Array, ...]:
        """Coordinates of the nodes, by axis."""
        out = []
        for low, high, n in self.axes.values():
            i = np.arange(n)
            out.append(((n - 1 - i) * low + i * high) / (n - 1))
        return tuple(out)

    def points(self, *cuts: slice) -> dict[str, Array]:
        """Coordinates by axis, shaped to broadcast; `cuts`: slices of the first axes, the other axes are whole."""
        dims = len(self.axes)
        out = {}
        for k, name in enumerate(self.axes):
            values = self.nodes[k][cuts[k]] if k < len(cuts) else self.nodes[k]
            out[name] = values.reshape([-1 if j == k else 1 for j in range(dims)])
        return out | {name: np.full((1,) * dims, value) for name, value in self.fixed.items()}

    def slabs(self, most: int = SLAB) -> Iterator[tuple[slice, ...]]:
        """Slices of the first axis (and of the second, where one layer is larger than `most`) that cover the grid
        once."""
        layer = self.size // self.shape[0]
        thick = max(1, most // layer)
        inner = [slice(None)]
        if layer > most and len(self.shape) > 1:
            rows = max(1, most // (layer // self.shape[1]))
            inner = [slice(j, min(j + rows, self.shape[1])) for j in range(0, self.shape[1], rows)]
        for i in range(0, self.shape[0], thick):
            for part in inner:
                cut = (slice(i, min(i + thick, self.shape[0])), part)
                yield cut[: len(self.shape)]


def grid_of(ranges: Mapping[str, Range], fixed: Mapping[str, float] | None = None) -> WorkspaceGrid:
    """A grid from ranges as a user writes them; low:high has 41 nodes."""
    axes = {k: (float(r.low), float(r.high), COUNT if r.count is None else r.count) for k, r in ranges.items()}
    return WorkspaceGrid(axes, dict(fixed or {}))


def product(units: list[str]) -> str:
    """The product of units: m, m, m -> m3; m, m, rad -> m2 rad."""
    counts = Counter(u for u in units if u)
    return " ".join(u if n == 1 else f"{u}{n}" for u, n in counts.items())
