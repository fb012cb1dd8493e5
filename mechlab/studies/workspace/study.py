"""The study: plan, survey, maps, comparison, surfaces."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from mechlab.errors import MechlabError
from mechlab.lab.design import Design
from mechlab.studies.workspace.grid import WorkspaceGrid, compare, map_over
from mechlab.studies.workspace.plan import WorkspacePlan, plan
from mechlab.studies.workspace.result import WorkspaceResult
from mechlab.studies.workspace.surface import WorkspaceSurface, surface, write_surface
from mechlab.studies.workspace.survey import survey

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
    """The result with a second design beside it, on the same grid; changes: what the second one has different."""
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
    """The result with its surface, written to the files asked for."""
    border = surface(result.plan.region, result.plan.grid, result.survey)
    wanted = {"STL": stl, "GLB": glb}
    files = {k: write_surface(border, path) for k, path in wanted.items() if path is not None}
    return replace(result, surface_volume=border.volume, files=dict(result.files) | files), border
