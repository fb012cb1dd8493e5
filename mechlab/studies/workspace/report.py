"""A workspace as one line and as text: counts, clauses, maps, comparison, files."""

from __future__ import annotations

from mechlab.results import line_of, text_of
from mechlab.studies.workspace.study import WorkspaceResult
from mechlab.tables import number, table


@line_of.register
def _(result: WorkspaceResult) -> str:
    return f"Workspace of {result.message}"


@text_of.register
def _(result: WorkspaceResult) -> str:
    """Counts, clauses, maps, comparison, files."""
    s, p = result.survey, result.plan
    axes = ", ".join(f"{k} {a:g} to {b:g} ({n})" for k, (a, b, n) in s.grid.axes.items())
    lines = [f"{result.message}.", f"nodes: {p.text}; answered by {p.how}", f"grid: {axes}"]
    if s.columns is not None:
        lines.append(f"{', '.join(s.grid.names[:2])} nodes: {s.columns}")
    lines.append(f"voxels: {s.voxels}    volume: {s.volume:.6g} {result.volume_unit}")
    if s.bounds:
        lines.append(
            "inside: " + ", ".join(f"{k} {a:.4g} to {b:.4g} {p.units.get(k, '')}" for k, (a, b) in s.bounds.items())
        )
    if s.voxels and p.margin_unit:
        where = ", ".join(f"{v:.4g}" for v in s.deepest)
        lines.append(f"largest margin: {s.margin:.4g} {p.margin_unit} at ({where})")
    heads = ("clause", "holds at", "decides outside", "alone", "decides inside", "meaning")
    rows = []
    for c in p.region.clauses:
        n = s.clauses[c.name]
        rows.append((c.name, n.keeps, n.decides_outside, n.alone, n.decides_inside, c.text))
    lines += ["", table(heads, rows)]
    if result.maps:
        cells = [
            (k, m.unit, *(number(x, 4) for x in (m.smallest, m.median, m.largest)), m.text)
            for k, m in result.maps.items()
        ]
        lines += ["", table(("map", "unit", "smallest", "median", "largest", "meaning"), cells)]
    if result.comparison is not None:
        cell = result.comparison.cell
        cells = [(k, str(n), f"{n * cell:.6g}") for k, n in result.comparison.voxels.items()]
        what = ", ".join(f"{k} = {v}" for k, v in result.against.items())
        lines += ["", f"against {what}:", table(("part", "voxels", f"volume [{result.volume_unit}]"), cells)]
    if result.surface_volume is not None:
        lines.append(f"volume inside the surface: {result.surface_volume:.6g} {result.volume_unit}")
    lines += [f"{k}: {f}" for k, f in result.files.items()]
    return "\n".join([*lines, *(f"warning: {w}" for w in p.design.warnings)])
