"""Counts the workspace of a design, compares two designs, and makes a closed surface of the border (marching cubes) for CAD;
the result of all three."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.regions import Region
from mechlab.errors import EngineMissing, MechlabError, NoSolution, install_extra, unknown
from mechlab.files import write
from mechlab.lab.design import Design
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.results import Shown
from mechlab.studies.named.number import parameter_values
from mechlab.studies.workspace.grid import SLAB, WorkspaceGrid, product
from mechlab.studies.workspace.plan import WorkspacePlan, plan
from mechlab.studies.workspace.survey import (
    MapSummary,
    WorkspaceComparison,
    WorkspaceSurvey,
    compare,
    map_over,
    survey,
)

Progress = Callable[[int, int], None]
DEEPEST = "largest_margin"


@dataclass(frozen=True, repr=False)
class WorkspaceResult(Shown):
    """The plan of a workspace, its survey, and on request the comparison with a second design and the surface."""

    plan: WorkspacePlan
    survey: WorkspaceSurvey
    maps: Mapping[str, MapSummary] = field(default_factory=dict)
    comparison: WorkspaceComparison | None = None
    against: Mapping[str, Any] = field(default_factory=dict)
    surface_volume: float | None = None
    files: Mapping[str, Path] = field(default_factory=dict)

    @property
    def exit_code(self) -> int:
        """3 when the witness did not converge at some nodes, so that nodes may be missing; 4 when no node is inside;
        else 0."""
        if self.doubtful:
            return 3
        return 0 if self.survey.voxels else 4

    @property
    def doubtful(self) -> int:
        """Number of nodes at which the witness did not converge."""
        poses = self.plan.poses
        return sum(n for s, n in poses.statuses.items() if s.exit_code == 3) if poses else 0

    @property
    def message(self) -> str:
        """What was found, in one sentence."""
        s, name = self.survey, self.plan.design.name
        if self.doubtful:
            return (
                f"{name}: {self.plan.how} did not converge at {self.doubtful} of {s.grid.size} nodes, which count as outside; "
                "the workspace may be larger"
            )
        if not s.voxels:
            worst = Counter({k: c.decides_outside for k, c in s.clauses.items()}).most_common(1)[0][0]
            return (
                f"{name}: the workspace is empty on this grid of {s.grid.size} nodes; the clause that most often decides is "
                f"{worst!r}. Relax it, or move the grid"
            )
        return f"{name}: {s.voxels} of {s.grid.size} nodes are inside"

    @property
    def volume_unit(self) -> str:
        """Unit of the volume: the product of the units of the axes."""
        return product([self.plan.units.get(a, "") for a in self.survey.grid.names])

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        s, p = self.survey, self.plan
        out: dict[str, Any] = {
            "status": "empty" if not s.voxels else "counted", "message": self.message, "nodes": p.text, "answered_by": p.how,
        }  # fmt: skip
        if s.columns is not None:
            out[f"{''.join(s.grid.names[:2])}_nodes" if set(s.grid.names) == set("xyz") else "columns"] = s.columns
        out |= {
            "voxels": s.voxels, "volume": s.volume, "bounds": s.bounds,
            "centroid": dict(zip(s.grid.names, s.centroid, strict=True)) if s.voxels else {},
            DEEPEST: {"margin": s.margin, "at": dict(zip(s.grid.names, s.deepest, strict=True))} if p.margin_unit else None,
            "clauses": {c.name: s.clauses[c.name].to_dict() | {"text": c.text} for c in p.region.clauses},
            "maps": {k: m.to_dict() for k, m in self.maps.items()},
            "grid": {k: {"low": a, "high": b, "count": n} for k, (a, b, n) in s.grid.axes.items()} | dict(s.grid.fixed),
            "units": {"volume": self.volume_unit, "margin": p.margin_unit} | {a: p.units.get(a, "") for a in s.grid.names},
            "parameters": parameter_values(p.design),
            "warnings": list(p.design.warnings),
        }  # fmt: skip
        if p.poses is not None:
            out["statuses"] = {status.value: n for status, n in p.poses.statuses.items()}
        if self.comparison is not None:
            out["against"] = {"parameters": dict(self.against)} | self.comparison.to_dict()
        if self.surface_volume is not None:
            out["surface_volume"] = self.surface_volume
        return out | ({"files": {k: str(f) for k, f in self.files.items()}} if self.files else {})


def workspace(
    design: Design, asked: Mapping[str, Any], witness: str | None = None, progress: Progress = lambda done, total: None
) -> WorkspaceResult:
    """Count the workspace of a design. asked: axes as ranges, fixed coordinates, limits; see `plan`."""
    chosen = plan(design, asked, witness)
    found = survey(chosen.region, chosen.grid, chosen.slab, progress)
    maps = {k: m for k, item in chosen.maps.items() if (m := map_over(chosen.region, chosen.grid, item)) is not None}
    return WorkspaceResult(chosen, found, maps)


def compared(
    result: WorkspaceResult, other: Design, asked: Mapping[str, Any], changes: Mapping[str, Any]
) -> tuple[WorkspaceResult, WorkspacePlan]:
    """The result with the comparison to a second design on the same grid, and the plan of the second.

    changes: parameters in which the second design differs. Raises MechlabError where the axes differ.
    """
    witness = None if result.plan.poses is None else result.plan.how
    second = plan(other, asked, witness)
    grid: WorkspaceGrid = result.plan.grid
    if second.grid.axes != grid.axes:
        raise MechlabError(f"{other.name}: two designs are compared on one grid; the axes differ.")
    return replace(
        result, comparison=compare(result.plan.region, second.region, grid, result.plan.slab), against=dict(changes)
    ), second


def with_surfaces(
    result: WorkspaceResult, stl: str | Path | None = None, glb: str | Path | None = None
) -> tuple[WorkspaceResult, WorkspaceSurface]:
    """The result with its surface, written to the STL and GLB files that are given."""
    border = surface(result.plan.region, result.plan.grid, result.survey)
    wanted = {"STL": stl, "GLB": glb}
    files = {k: write_surface(border, path) for k, path in wanted.items() if path is not None}
    return replace(result, surface_volume=border.volume, files=dict(result.files) | files), border


MOST = 20_000_000
"""Largest number of nodes for a surface (80 MB); of a finer grid every second, third ... node is taken."""


KINDS = (".stl", ".glb", ".ply", ".obj")


@dataclass(frozen=True)
class WorkspaceSurface:
    """Closed surface margin = 0: vertices (n, 3) in the coordinates of the axes, faces (m, 3), normals outwards."""

    vertices: Array
    faces: NDArray[np.int64]

    @property
    def volume(self) -> float:
        """Enclosed volume, by the divergence theorem."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        return float(np.sum(a * np.cross(b, c)) / 6.0)


def surface(region: Region, grid: WorkspaceGrid, found: WorkspaceSurvey) -> WorkspaceSurface:
    """The border of the region; where the region reaches beyond the grid, the side of the grid closes the surface.

    Raises EngineMissing without scikit-image, MechlabError unless there are three axes, NoSolution for an empty region.
    """
    if len(grid.axes) != 3:
        raise MechlabError(f"a surface needs three axes with ranges, got {', '.join(grid.axes)}.")
    if not found.voxels:
        raise NoSolution("the workspace is empty on this grid: it has no surface.")
    cubes = _marching_cubes()
    values, nodes = _field(region, grid, found)
    steps = [float(v[1] - v[0]) if len(v) > 1 else s for v, s in zip(nodes, grid.steps, strict=True)]
    bound = max(steps)
    padded = np.pad(np.clip(values, -bound, bound), 1, constant_values=-1e3 * bound)  # puts the lid on the grid's side
    vertices, faces, _, _ = cubes(padded, 0.0, spacing=tuple(steps), gradient_direction="ascent")
    origin = np.array([v[0] for v in nodes]) - np.array(steps)
    return WorkspaceSurface(vertices.astype(float) + origin, faces.astype(np.int64))


def write_surface(shape: WorkspaceSurface, path: str | Path) -> Path:
    """Write STL, GLB, PLY or OBJ by the suffix. Raises MechlabError for another one."""
    import trimesh

    target = Path(path)
    if target.suffix.lower() not in KINDS:
        raise unknown("workspace surface: file type", target.suffix, KINDS)
    solid = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    content = solid.export(file_type=target.suffix.lower()[1:])
    return write(target, content if isinstance(content, bytes) else str(content))


def _marching_cubes() -> Any:
    try:
        from skimage.measure import marching_cubes
    except ModuleNotFoundError as error:
        raise EngineMissing(
            f"the surface of a workspace needs scikit-image ({error.name} is missing): {install_extra('workspace')}. "
            "Counts, volumes and maps do without it."
        ) from None
    return marching_cubes


def _field(
    region: Region, grid: WorkspaceGrid, found: WorkspaceSurvey
) -> tuple[NDArray[np.float32], tuple[Array, ...]]:
    """Margins (float32) in the box around the inside nodes, and the coordinates of the box by axis."""
    wide = [slice(max(0, a - 1), b + 2) for a, b in zip(found.low, found.high, strict=True)]
    nodes = [v[w] for v, w in zip(grid.nodes, wide, strict=True)]
    stride = int(np.ceil((np.prod([float(len(v)) for v in nodes]) / MOST) ** (1.0 / 3.0)))
    nodes = [v[:: max(1, stride)] for v in nodes]
    out = np.empty([len(v) for v in nodes], dtype=np.float32)
    thick = max(1, SLAB // (out.size // len(nodes[0])))
    dims = {name: k for k, name in enumerate(grid.names)}
    for i in range(0, len(nodes[0]), thick):
        part = [nodes[0][i : i + thick], *nodes[1:]]
        points = {n: part[k].reshape([-1 if j == k else 1 for j in range(3)]) for n, k in dims.items()}
        points |= {n: np.full((1, 1, 1), v) for n, v in grid.fixed.items()}
        out[i : i + thick] = region.decide(points).margin
    return out, tuple(nodes)
