"""The result of a workspace study: counts, clauses, maps, comparison and files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mechlab.results import Shown
from mechlab.studies.named import parameter_values
from mechlab.studies.workspace.grid import product
from mechlab.studies.workspace.plan import WorkspacePlan
from mechlab.studies.workspace.survey import MapSummary, WorkspaceComparison, WorkspaceSurvey

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
