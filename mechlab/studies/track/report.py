"""A Track as one line and as text, and its files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from mechlab.errors import MechlabError
from mechlab.files import write
from mechlab.formats import save_recording
from mechlab.results import line_of, save_result, text_of
from mechlab.studies.track.result import Track
from mechlab.tables import number, table


@line_of.register
def _(found: Track) -> str:
    return f"Track of {found.name}, {found.t[-1] - found.t[0]:g} s, {len(found.t)} times: {found.message}"


@text_of.register
def _(found: Track) -> str:
    """Targets with their errors, the commands, limits, distances from singularity, notes."""
    t = found.t
    rows = [
        [
            x.name,
            "must be met" if x.required else f"wish {x.priority}",
            number(x.largest, 4),
            x.unit,
            number(x.tolerance, 4),
        ]
        for x in found.targets
    ]
    lines = [
        f"{found.name}: {len(t)} times, {t[0]:g} to {t[-1]:g} s",
        table(["target", "", "largest error", "unit", "tolerance"], rows),
        "",
    ]
    r = found.recording
    shown = {f"{name} (drive)" if name == d.on else f"{name} ({d.on})": x for d in r.mechanism.drives
             for name, x in [(d.name, r.channel(d.on))]}  # fmt: skip
    kind = "command" if shown else "joint"
    shown = shown or {n: r.channel(n) for n in r.mechanism.scalar_names}
    ends = [[n, *(number(v, 7) for v in (x[0], x.min(), x.max(), x[-1]))] for n, x in shown.items()]
    lines += [table([f"{kind} [rad or m]", "first", "least", "largest", "last"], ends), ""]
    lines += [
        f"limit: {x.sentence}, "
        + (f"from {t[x.first]:g} to {t[x.last]:g} s" if x.last > x.first else f"at {t[x.first]:g} s")
        for x in found.limits
    ]
    lines += [
        f"distance from singularity, {n}: at least {number(x.min(), 4)} (at {t[int(np.argmin(x))]:g} s)"
        for n, x in found.distances.items()
    ]
    lines.append(
        f"loops and gears open by at most {found.gap:.2g} of the size; {found.steps} steps, {found.cpu_s:.3g} s of CPU"
    )
    lines += [f"note: {n}" for n in found.notes]
    lines += [f"{k}: {path}" for k, path in found.files.items()]
    return "\n".join([*lines, found.message])


@save_result.register
def _(found: Track, path: Path) -> Path:
    """The recording (.npz), which `view` opens, or all numbers (.json). Raises MechlabError for another ending."""
    if path.suffix == ".npz":
        return save_recording(found.recording, path)
    if path.suffix == ".json":
        return write(path, json.dumps(found.to_dict(), indent=1, default=str))
    raise MechlabError(f"{path.name}: a track is written as .npz (the recording) or .json.")
