"""Workspaces: where a mechanism can be, counted on a grid, with margins, maps, surfaces and comparisons."""

from mechlab.studies.workspace.grid import Grid, grid_of
from mechlab.studies.workspace.plan import Plan, plan
from mechlab.studies.workspace.result import WorkspaceResult
from mechlab.studies.workspace.surface import Surface, surface, write_surface
from mechlab.studies.workspace.survey import Survey, survey
from mechlab.studies.workspace.work import compared, with_surfaces, workspace

__all__ = [
    "Grid",
    "Plan",
    "Surface",
    "Survey",
    "WorkspaceResult",
    "compared",
    "grid_of",
    "plan",
    "surface",
    "survey",
    "with_surfaces",
    "workspace",
    "write_surface",
]
