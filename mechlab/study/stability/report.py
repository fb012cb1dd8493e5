"""A stability study as text and as files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from mechlab.errors import MechlabError
from mechlab.files import whole_folder, write
from mechlab.study.stability.data import Outcome

if TYPE_CHECKING:
    from mechlab.study.stability.data import Map, Stability

LETTERS = {
    Outcome.RIGHT: "o", Outcome.DRIFTING: "~", Outcome.WRONG: "w", Outcome.BLOWN_UP: "X", Outcome.REFUSED: "-",
    Outcome.NOT_RUN: ".",
}  # fmt: skip


def text(found: Stability) -> str:
    """Every map as rows of letters, and what follows from it."""
    legend = ", ".join(f"{letter} {o.value}" for o, letter in LETTERS.items())
    lines = [f"{found.name}, scene {found.scene}: where methods fail", f"what acts: {found.acts}", legend]
    for made in found.maps:
        lines += ["", *_map(made)]
    lines += ["", *(f"no map {kind}: {why}" for kind, why in found.without.items())]
    lines += [f"{found.cpu_s:.1f} s of CPU"]
    return "\n".join(lines)


def _map(made: Map) -> list[str]:
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


def save(found: Stability, folder: str | Path) -> dict[str, Path]:
    """Write stability_NAME.json and stability_NAME_KIND.png for each map into a folder.

    Raises MechlabError for a path that is a file.
    """
    from mechlab.study.stability.picture import draw

    target = Path(folder)
    if target.suffix or target.is_file():
        raise MechlabError(f"stability: -o takes a folder, got {target}; it gets a .json and a .png for each map.")
    names = {"json": f"stability_{found.name}.json"}
    names |= {made.kind: f"stability_{found.name}_{made.kind}.png" for made in found.maps}
    with whole_folder(target) as stage:
        write(stage / names["json"], json.dumps(found.to_dict(), indent=1, allow_nan=False))
        for made in found.maps:
            draw(found, made, stage / names[made.kind])
    return {kind: target / name for kind, name in names.items()}
