"""A stability study as one line, as text (maps of letters, sentences), and as files."""

from __future__ import annotations

import json
import math
from pathlib import Path

from mechlab.errors import MechlabError
from mechlab.files import whole_folder, write
from mechlab.results import line_of, save_result, text_of
from mechlab.studies.stability.data import MethodPanel, RunOutcome, Stability, StabilityMap, Theory
from mechlab.studies.stability.picture import draw

BLOWN = frozenset({RunOutcome.BLOWN_UP})
BAD = frozenset({RunOutcome.BLOWN_UP, RunOutcome.WRONG, RunOutcome.DRIFTING, RunOutcome.REFUSED})


def sentences(made: StabilityMap, remark: str = "") -> tuple[str, ...]:
    """Sentences on a map: for stiffness first theory against measurement, then each method, then the remark."""
    row = nominal_row(made)
    out = []
    if made.kind == "stiffness":
        out += [s for t in made.theory for name in t.methods if (s := _boundary(made, t, name, row))]
    out += [_summary(made, p, row) for p in made.panels]
    if remark:
        out.append(f"{remark[0].upper()}{remark[1:]}.")
    return tuple(out)


def nominal_row(made: StabilityMap) -> int:
    """Index of the row closest to the nominal value of y; the last row where y has no nominal value."""
    if made.y.nominal is None:
        return len(made.y.values) - 1
    nominal = made.y.nominal
    return min(range(len(made.y.values)), key=lambda k: abs(made.y.values[k] - nominal))


def _boundary(made: StabilityMap, theory: Theory, name: str, row: int) -> str:
    panel = made.panel(name)
    good, bad = panel.limit(row, made.x.values, BLOWN)
    limit = theory.x[row]
    if good == 0.0 and math.isinf(bad):
        return ""
    where = (
        f"between {_s(good)} and {_s(bad)}"
        if good and math.isfinite(bad)
        else f"below {_s(bad)}"
        if not good
        else f"above {_s(good)}"
    )
    return f"{name} blows up above {theory.formula} = {_s(limit)} as given; measured {where}."


def _summary(made: StabilityMap, panel: MethodPanel, row: int) -> str:
    """A sentence: the timesteps up to which a method is right, in the nominal row and in the first and last rows."""
    run = [c for r in panel.cells for c in r if c.outcome not in (RunOutcome.NOT_RUN, RunOutcome.REFUSED)]
    if not run:
        return f"{panel.method}: nothing could be run ({_reason(panel)})."
    right = sum(c.outcome is RunOutcome.RIGHT for c in run)
    blown = sum(c.outcome is RunOutcome.BLOWN_UP for c in run)
    if right == len(run):
        return f"{panel.method} is right in all {right} runs."
    if right == 0:
        best = min((c.value for c in run if math.isfinite(c.value)), default=math.nan)
        tail = f", blown up in {blown}" if blown else ""
        return f"{panel.method} is right in none of {len(run)} runs{tail}; the best is off by {best:.2g}."
    rows = sorted({0, row, len(made.y.values) - 1})
    limits = ", ".join(f"{_s(panel.limit(k, made.x.values, BAD)[0])} at {_y(made, k)}" for k in rows)
    return f"{panel.method} is right in {right} of {len(run)} runs and blown up in {blown}: up to {limits}."


def _reason(panel: MethodPanel) -> str:
    reasons = [c.reason for r in panel.cells for c in r if c.reason]
    return reasons[0] if reasons else "no reason given"


def _y(made: StabilityMap, row: int) -> str:
    unit = f" {made.y.unit}" if made.y.unit else ""
    return f"{made.y.values[row]:.3g}{unit}"


def _s(h: float) -> str:
    """A timestep in words."""
    if h == 0.0:
        return "no timestep tried"
    if math.isinf(h):
        return "every timestep tried"
    return f"{1e3 * h:.3g} ms"


LETTERS = {
    RunOutcome.RIGHT: "o", RunOutcome.DRIFTING: "~", RunOutcome.WRONG: "w", RunOutcome.BLOWN_UP: "X", RunOutcome.REFUSED: "-",
    RunOutcome.NOT_RUN: ".",
}  # fmt: skip


@line_of.register
def _(found: Stability) -> str:
    return f"Stability of {found.name}, scene {found.scene}: {', '.join(m.kind for m in found.maps) or 'no map'}"


@text_of.register
def _(found: Stability) -> str:
    """Every map as rows of letters, with its sentences."""
    legend = ", ".join(f"{letter} {o.value}" for o, letter in LETTERS.items())
    lines = [f"{found.name}, scene {found.scene}: where methods fail", f"what acts: {found.acts}", legend]
    for made in found.maps:
        lines += ["", *_map(made)]
    lines += ["", *(f"no map {kind}: {why}" for kind, why in found.without.items())]
    lines += [f"{found.cpu_s:.1f} s of CPU"]
    return "\n".join(lines)


def _map(made: StabilityMap) -> list[str]:
    steps = made.x.values
    unit = f" [{made.y.unit}]" if made.y.unit else ""
    head = f"{made.kind}: timestep {1e3 * steps[0]:.3g} to {1e3 * steps[-1]:.3g} ms (left to right), {made.duration:.3g} s simulated"
    lines = [
        head,
        f"rows: {made.y.name}{unit}: {made.y.text}",
        f"{made.value_name}: o up to {made.right:g}, ~ up to {made.wrong:g}",
    ]
    for panel in made.panels:
        lines.append(f"  {panel.method}")
        for y, row in reversed(list(zip(made.y.values, panel.cells, strict=True))):
            lines.append(f"    {y:10.3g}  {' '.join(LETTERS[c.outcome] for c in row)}")
    lines += [f"  not shown: {name} ({why})" for name, why in made.skipped.items()]
    return lines + [f"  {s}" for s in made.sentences]


@save_result.register
def _(found: Stability, folder: Path) -> dict[str, Path]:
    """Write stability_NAME.json and stability_NAME_KIND.png for each map into a folder.

    Raises MechlabError for a path that is a file.
    """
    if folder.suffix or folder.is_file():
        raise MechlabError(f"stability: -o takes a folder, got {folder}; it gets a .json and a .png for each map.")
    names = {"json": f"stability_{found.name}.json"}
    names |= {made.kind: f"stability_{found.name}_{made.kind}.png" for made in found.maps}
    with whole_folder(folder) as stage:
        write(stage / names["json"], json.dumps(found.to_dict(), indent=1, allow_nan=False))
        for made in found.maps:
            draw(found, made, stage / names[made.kind])
    return {kind: folder / name for kind, name in names.items()}
