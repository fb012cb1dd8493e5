"""Workspaces: where a mechanism can be, counted on a grid, with margins, maps, surfaces and comparisons."""

from mechlab.study.workspace.grid import Grid, grid_of
from mechlab.study.workspace.plan import Plan, plan
from mechlab.study.workspace.result import WorkspaceResult
from mechlab.study.workspace.surface import Surface, surface, write_surface
from mechlab.study.workspace.survey import Survey, survey
from mechlab.study.workspace.work import compared, with_surfaces, workspace

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
