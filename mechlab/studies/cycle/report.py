"""A cycle as one line, text, and as files: the table as CSV, charts and curves as SVG, the curves as DXF."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.files import write
from mechlab.formats.dxf import dxf_polylines
from mechlab.mechanism.geometry import Array
from mechlab.results import line_of, save_result, text_of
from mechlab.studies.cycle.cycle import CycleResult
from mechlab.studies.cycle.quantities import extremum
from mechlab.tables import csv_text, number, table


@save_result.register
def _(cycle: CycleResult, path: Path) -> Path:
    """Write the file in the format of its suffix; raises MechlabError for a suffix other than .csv, .svg, .dxf."""
    kinds = {".csv": _csv, ".svg": _svg, ".dxf": _dxf}
    kind = path.suffix.lower()
    if kind not in kinds:
        raise MechlabError(
            f"{path}: a cycle is written as .csv (table), .svg (charts) or .dxf (curves), not {kind or 'that'}."
        )
    return write(path, kinds[kind](cycle))


def _csv(cycle: CycleResult) -> str:
    """A header line of `name [unit]`, then one line a position, in full precision; values that are not finite are
    empty."""
    heads = [f"{n} [{cycle.units[n]}]" if cycle.units.get(n) else n for n in cycle.columns]
    table_of_numbers = np.column_stack(list(cycle.columns.values()))
    return csv_text([heads, *([repr(float(x)) if np.isfinite(x) else "" for x in row] for row in table_of_numbers)])


def curves(cycle: CycleResult) -> dict[str, Array]:
    """Frame -> curve [m]: (n, 2) right and up in the plane of a planar mechanism, else (n, 3). Fixed frames are left
    out."""
    out = {}
    for frame in cycle.mechanism.frames:
        points = np.column_stack([cycle[f"{frame.name}_{x}"] for x in "xyz"])
        if float(np.max(np.ptp(points, axis=0))) > 1e-12:
            out[frame.name] = points if cycle.normal is None else points @ plane(cycle.normal).T
    return out


def plane(normal: tuple[float, float, float]) -> Array:
    """(2, 3) unit vectors right and up in a plane. Up is the world's z, or its y in a nearly horizontal plane."""
    n = np.array(normal)
    up = np.array([0.0, 1.0, 0.0]) if abs(n[2]) > 0.9 else np.array([0.0, 0.0, 1.0])
    up = up - (up @ n) * n
    up /= np.linalg.norm(up)
    right = np.cross(up, n)
    side = right[np.argmax(np.abs(right))]
    return np.array([right if side > 0 else -right, up]) + 0.0


def _dxf(cycle: CycleResult) -> str:
    found = curves(cycle)
    if not found:
        raise MechlabError(
            f"{cycle.name}: it has no moving frame, so there is no curve; add one with builder.frame(...)."
        )
    return dxf_polylines(found)


def _svg(cycle: CycleResult) -> str:
    import matplotlib
    from matplotlib.figure import Figure

    groups = _groups(cycle)
    paths = curves(cycle)
    rows = (len(groups) + bool(paths) + 1) // 2
    with matplotlib.rc_context({"svg.hashsalt": "mechlab", "svg.fonttype": "none"}):
        figure = Figure(figsize=(11.0, 3.1 * rows), layout="constrained")
        axes = list(figure.subplots(rows, 2, squeeze=False).ravel())
        if paths:
            _draw_curves(axes.pop(0), paths)
        phi = cycle.columns[cycle.drive]
        for title, unit, names in groups:
            ax = axes.pop(0)
            for name in names:
                ax.plot(phi, cycle.columns[name], label=name, linewidth=1.2)
            ax.set_title(title)
            ax.set_ylabel(unit)
            ax.set_xlabel(f"{cycle.drive} [{cycle.units[cycle.drive]}]")
            ax.grid(alpha=0.3)
            ax.legend(fontsize=7)
        for ax in axes:
            ax.set_axis_off()
        figure.suptitle(cycle.message)
        out = io.StringIO()
        figure.savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()


def _draw_curves(ax: Any, paths: dict[str, Array]) -> None:
    for name, points in paths.items():
        shown = points if points.shape[1] == 2 else points[:, [0, 2]]
        ax.plot(shown[:, 0], shown[:, 1], label=name, linewidth=1.2)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_title("curves of the frames")
    ax.set_xlabel("m")
    ax.set_ylabel("m")
    ax.grid(alpha=0.3)
    ax.legend(fontsize=7)


def _groups(cycle: CycleResult) -> list[tuple[str, str, list[str]]]:
    """Title, unit and columns of each chart that has at least one column."""
    names = [n for n in cycle.columns if n != cycle.drive]
    joints = list(cycle.mechanism.scalar_names)
    unit = cycle.units[f"{cycle.drive}_force"]
    chosen = [
        ("rates", "rad/s or m/s", [f"{n}_rate" for n in joints]),
        ("accelerations", "rad/s2 or m/s2", [f"{n}_accel" for n in joints]),
        ("force of the drive", unit, [f"{cycle.drive}_force"]),
        ("reactions", "N", [n for n in names if n.endswith("_reaction")]),
        ("shaking force", "N", [n for n in names if n.startswith("shaking_f")]),
        ("shaking moment about the origin", "N m", [n for n in names if n.startswith("shaking_m")]),
        ("transmission angle", "rad", [n for n in names if n.endswith("transmission_angle")]),
        ("velocity ratio", "", [n for n in names if n == "velocity_ratio"]),
    ]
    return [(t, u, kept) for t, u, asked in chosen if (kept := [n for n in asked if n in cycle.columns])]


@line_of.register
def _(cycle: CycleResult) -> str:
    return f"Cycle of {cycle.message}"


@text_of.register
def _(cycle: CycleResult) -> str:
    """Least and largest value of each column at the positions, and where; `extremum` looks between them too."""
    phi = cycle.columns[cycle.drive]
    rows = []
    for name, values in cycle.columns.items():
        low, high = extremum(phi, values, -1), extremum(phi, values, 1)
        if low is not None and high is not None:
            cells = (number(x, 6) for x in (low.value, low.at, high.value, high.at))
            rows.append([name, cycle.units.get(name, ""), *cells])
    lines = [
        f"{cycle.message}; least and largest of these positions",
        *([f"what acts: {cycle.acts}"] if cycle.acts else []),
        table(["column", "unit", "least", f"at {cycle.drive}", "largest", f"at {cycle.drive}"], rows),
    ]
    lines += [f"note: {n}" for n in cycle.notes]
    lines += [f"largest difference {k}: {v:.3g}" for k, v in cycle.witnesses.items()]
    return "\n".join(lines)
