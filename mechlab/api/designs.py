"""Verbs about designs: where a mechanism can be, and how designs compare."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechlab.api.finding import Source, load
from mechlab.errors import MechlabError
from mechlab.lab.ask import parameters_and_rest

if TYPE_CHECKING:
    from mechlab.studies.workspace.plan import WorkspacePlan
    from mechlab.studies.workspace.result import WorkspaceResult
    from mechlab.studies.workspace.study import WorkspaceSurface

FIRST, SECOND = (0.20, 0.47, 0.75, 0.45), (0.90, 0.55, 0.15, 0.45)


def workspace(
    source: Source,
    values: Mapping[str, Any] | None = None,
    against: Mapping[str, Any] | None = None,
    witness: str | None = None,
    stl: str | Path | None = None,
    glb: str | Path | None = None,
    html: str | Path | None = None,
    maps: str | Path | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
    **more: Any,
) -> WorkspaceResult:
    """Where a mechanism can be, counted on a grid.

    values (and keyword arguments): parameters, axes (`mechlab.values.Range`), fixed coordinates, limits. against: values that
    a second design has different, on the same grid. witness: who answers where a question is asked at every node.
    stl, glb: the surface; html: a page with the mechanism and the surface; maps: the maps as arrays (.npz).
    Raises EngineMissing where a surface is wanted and scikit-image is not installed, NoSolution where it would be empty.
    """
    from mechlab.studies.workspace.study import compared, with_surfaces
    from mechlab.studies.workspace.study import workspace as work

    given = dict(values or {}) | more
    base = load(source)
    parameters, asked = parameters_and_rest(base.entry.parameters, given)
    result = work(load(base, **parameters), asked, witness, progress)
    second: WorkspacePlan | None = None
    if against is not None:
        changed, other_asked = parameters_and_rest(base.entry.parameters, against)
        other = load(base, **(parameters | changed))
        result, second = compared(result, other, asked | other_asked, against)
    if maps is not None:
        result = replace(result, files=dict(result.files) | {"maps": _write_maps(result, Path(maps))})
    if result.survey.voxels and (stl is not None or glb is not None or html is not None):
        result, border = with_surfaces(result, stl, glb)
        if html is not None:
            result = replace(result, files=dict(result.files) | {"page": _page(result, border, second, Path(html))})
    return result


def _page(result: WorkspaceResult, border: WorkspaceSurface, second: WorkspacePlan | None, path: Path) -> Path:
    """The mechanism in its reference pose inside its workspace."""
    from mechlab.mechanism import GROUND
    from mechlab.studies.workspace.study import surface
    from mechlab.studies.workspace.survey import survey
    from mechlab.viewer import write_page
    from mechlab.viewer.from_recording import mechanism_story
    from mechlab.viewer.story import Part

    design = result.plan.design
    if set(result.survey.grid.names) != set("xyz"):
        raise MechlabError(
            f"{design.name}: a page of the workspace needs the axes x, y, z, got {', '.join(result.survey.grid.names)}."
        )
    order = [result.survey.grid.names.index(a) for a in "xyz"]
    even = -1 if order in ([0, 2, 1], [1, 0, 2], [2, 1, 0]) else 1  # an odd exchange of axes turns the faces inside out
    shapes = [(border, "workspace", FIRST)]
    if second is not None:
        found = survey(second.region, second.grid, second.slab)
        if found.voxels:
            shapes.append((surface(second.region, second.grid, found), "workspace of the other design", SECOND))
    data = result.to_dict()
    facts = {
        "nodes": data["nodes"],
        "voxels": str(data["voxels"]),
        "volume": f"{data['volume']:.6g} {result.volume_unit}",
    }
    facts |= {
        f"{k}, smallest to largest": f"{m.smallest:.4g} to {m.largest:.4g} {m.unit}" for k, m in result.maps.items()
    }
    if result.comparison is not None:
        facts |= {k: f"{v:.6g} {result.volume_unit}" for k, v in data["against"]["volumes"].items()}
    told = mechanism_story(
        design.mechanism(list(design.entry.fidelities)[-1]), f"{design.entry.title}: workspace", facts
    )
    parts = [Part(GROUND, name, s.vertices[:, order], s.faces[:, ::even], color) for s, name, color in shapes]
    return write_page(replace(told, parts=(*told.parts, *parts)), path)


def _write_maps(result: WorkspaceResult, path: Path) -> Path:
    """Each map over the coordinates of its axes, NaN outside, as NAME, NAME_x, NAME_y."""
    import io

    import numpy as np

    from mechlab.files import write

    if path.suffix != ".npz":
        raise MechlabError(f"maps: expected a file name that ends in .npz, got {path}.")
    if not result.maps:
        raise MechlabError(
            f"{result.plan.design.name}: there are no maps over this workspace; expected a closed-form region that is not empty."
        )
    arrays: dict[str, Any] = {}
    for name, m in result.maps.items():
        arrays |= {name: m.values} | {f"{name}_{a}": v for a, v in m.nodes.items()}
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)
    return write(path, content.getvalue())
