"""Counts the workspace of a design, compares two designs, and makes a closed surface of the border (marching cubes) for
CAD."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.regions import Region
from mechlab.errors import EngineMissing, MechlabError, NoSolution, unknown
from mechlab.files import write
from mechlab.lab.design import Design
from mechlab.mechanism.geometry import Array
from mechlab.studies.workspace.grid import SLAB, WorkspaceGrid
from mechlab.studies.workspace.plan import WorkspacePlan, plan
from mechlab.studies.workspace.result import WorkspaceResult
from mechlab.studies.workspace.survey import WorkspaceSurvey, compare, map_over, survey

Progress = Callable[[int, int], None]


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
            f"the surface of a workspace needs scikit-image ({error.name} is missing): pip install 'mechlab[workspace]'. "
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
