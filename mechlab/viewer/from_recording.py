"""From a Mechanism or a Recording to a Story: poses of all parts, plots of the channels, facts and health in words.

`write_csv` writes all channels of a Recording as a table that any spreadsheet reads.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mechlab.experiment.entry import PlotRecipe
from mechlab.experiment.recording import Health, Recording, frame_positions
from mechlab.files import write
from mechlab.mechanism import GROUND, Mechanism, Shape
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_poses import ManyPoses
from mechlab.mechanism.parts import FLOOR
from mechlab.shapes import mesh
from mechlab.viewer import annotate
from mechlab.viewer.acting import arrows
from mechlab.viewer.channels import recorded_channels
from mechlab.viewer.chosen_plots import chosen_plots
from mechlab.viewer.explore import explore
from mechlab.viewer.framing import frame_story
from mechlab.viewer.knots import Drawn, Knots, choose_knots, drawn_rates
from mechlab.viewer.lines import lines
from mechlab.viewer.reach import BorderSurface
from mechlab.viewer.story import Floor, Part, Plot, Severity, Story


def recording_to_csv(recording: Recording) -> str:
    """CSV text: the time, then every channel, each column headed "name [unit]"; one row for each recorded time.

    Numbers are written so that they read back bit for bit; a value that is not finite is an empty field.
    """
    heads = ["t [s]"]
    for name in recording.channels:
        unit = recording.units.get(name, "")
        heads.append(f"{name} [{unit}]" if unit else name)
    columns = [recording.t, *recording.channels.values()]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow(heads)
    for row in zip(*(column.tolist() for column in columns), strict=True):
        writer.writerow([repr(x) if abs(x) < float("inf") else "" for x in row])
    return out.getvalue()


def write_csv(recording: Recording, path: str | os.PathLike[str]) -> Path:
    """Writes `recording_to_csv` to `path`, whole or not at all, and returns the path. Raises OSError."""
    return write(path, recording_to_csv(recording))


MAX_FRAMES = 501
MOST_FRAMES = 2001
MAX_TURN = 1.0  # [rad]
MAX_CUT = 1e-3
WORDS: dict[str, Severity] = {"ok": "ok", "warning": "warning", "error": "error"}


def mechanism_story(mechanism: Mechanism, title: str = "", facts: Mapping[str, str] | None = None) -> Story:
    """A still Story of the reference pose."""
    still = mechanism.reference()[None]
    return motion_story(mechanism, np.zeros(1), still, title or mechanism.name, mechanism.summary, facts=facts)


def recording_story(
    recording: Recording,
    drawn: Drawn | None = None,
    title: str = "",
    summary: str = "",
    facts: Mapping[str, str] | None = None,
    channels: Sequence[str] = (),
    plots: Sequence[PlotRecipe] = (),
) -> Story:
    """A moving Story of a run. drawn(recording) -> a richer Mechanism and its coordinates (n, nq) along the run, drawn instead.
    channels, plots: shown first, see `chosen_plots`."""
    mechanism, q = drawn(recording) if drawn is not None else (recording.mechanism, recording.q)
    keep = _frames(recording.t, mechanism, q)
    known = {b.name for b in recording.mechanism.bodies} | {s.body for s in recording.mechanism.shafts}
    rebuilt = tuple(b.name for b in mechanism.bodies if b.name not in known)
    story = motion_story(
        mechanism, recording.t[keep], q[keep], title or recording.name or mechanism.name, summary or mechanism.summary,
        facts=facts, health=recording.health, plots=chosen_plots(recording, keep, plots, channels), reconstructed=rebuilt,
    )  # fmt: skip
    drawn_arrows = arrows(recording, keep, mechanism, q[keep], story.parts)
    story = replace(story, channels=recorded_channels(recording), arrows=drawn_arrows)
    if len(recording.t) < 3:
        return story
    knots = choose_knots(
        mechanism, recording.t, q, drawn_rates(recording, drawn), annotate.body_corners(story.parts, story.bodies),
        frame_story(story).radius, lambda x: placed(mechanism, x)[1],
    )  # fmt: skip
    return replace(story, knots=knots, playback=_said(knots) + _starting(recording))


def motion_story(
    mechanism: Mechanism,
    t: Array,
    q: Array,
    title: str,
    summary: str = "",
    facts: Mapping[str, str] | None = None,
    health: Health | None = None,
    plots: Sequence[Plot] = (),
    reconstructed: tuple[str, ...] = (),
) -> Story:
    """A Story from coordinates q (n, nq) at times t (n,)."""
    names, poses, parts, owners = scene_of(mechanism, q)
    traces = {}
    if len(t) > 1 and mechanism.frames:
        points = frame_positions(mechanism, q)
        for k, frame in enumerate(mechanism.frames):
            if float(np.ptp(points[:, k], axis=0).max()) > 1e-6:
                traces[frame.name] = points[:, k]
    findings = tuple((WORDS[f.severity], f.sentence) for f in (health.findings if health else ()))
    return Story(
        title=title, summary=summary, t=t, bodies=names, poses=poses, parts=parts, plots=tuple(plots),
        facts=tuple((facts or {}).items()), health=findings, traces=traces,
        reconstructed=tuple(n for n in reconstructed if n in names),
        marks=annotate.marks(mechanism, parts),
        ghost=placed(mechanism, mechanism.reference()[None])[1] if len(t) > 1 else None, ghost_name="reference pose",
        tooth_rate=annotate.tooth_rate(owners, names, annotate.turning_rates(poses, t)),
        floors=floors_of(names, poses, owners), model=mechanism,
    )  # fmt: skip


def exploration_story(
    mechanism: Mechanism,
    title: str = "",
    facts: Mapping[str, str] | None = None,
    rates: Mapping[str, float] | None = None,
    reach: BorderSurface | None = None,
) -> Story:
    """A Story that opens to be moved by hand in the page; see `mechlab.viewer.explore`. Raises MechlabError like `explore`."""
    still = mechanism_story(mechanism, title, facts)
    size = 2.0 * frame_story(still).radius
    return replace(still, explore=explore(mechanism, lambda q: placed(mechanism, q)[1], size, rates, reach))


def _said(knots: Knots) -> str:
    """Sentence on how far the picture is from the recording, and how far between recorded times."""
    at = "exactly" if knots.error == 0.0 else f"within {length_text(knots.error)}"
    return (
        f"Shows the {knots.recorded} recorded times {at}, from the coordinates and rates at {len(knots.t)} of them; between recorded "
        f"times it follows cubics and is off by about {length_text(knots.between)} at most."
    )


def _starting(recording: Recording) -> str:
    """Sentence on servos whose force builds up from the first sample: it is off target by nothing there."""
    if "servo" not in recording.acts or len(recording.t) < 10:
        return ""
    forces = [v for n, v in recording.channels.items() if n.endswith("_force") and np.all(np.isfinite(v))]
    if not any(abs(v[1] - v[0]) > max(4.0 * abs(v[2] - v[1]), 0.02 * np.ptp(v)) for v in forces):
        return ""
    return (
        " At the first sample a servo stands exactly on its target and gives no more than its constant part; its force builds up "
        "within the next ones."
    )


def length_text(metres: float) -> str:
    """A length of two digits, in the unit that an engineer would write."""
    for size, unit in ((1.0, "m"), (1e-3, "mm"), (1e-6, "\u00b5m")):
        if metres >= 0.1 * size:
            return f"{metres / size:.2g} {unit}"
    return f"{metres / 1e-9:.2g} nm"


def _frames(t: Array, mechanism: Mechanism, q: Array) -> Array:
    """Indices of the frames, at which plots, paths and films have their points: every k-th and the last, at most MAX_FRAMES + 1; a
    smaller k where a part would turn more than MAX_TURN [rad] from one to the next, because films and GLB files turn along the
    shortest arc, or where a path would be cut by more than MAX_CUT, up to MOST_FRAMES."""
    stride = -(-(len(t) - 1) // (MAX_FRAMES - 1)) if len(t) > 1 else 1
    turn = annotate.turn_per_step(mechanism, q[::stride])
    if turn > MAX_TURN:
        stride = max(1, int(stride * MAX_TURN / turn))
    while stride > 1 and len(t) / stride < MOST_FRAMES and _cut(mechanism, q[::stride]) > MAX_CUT:
        stride = max(1, stride // 2)
    return np.unique(np.append(np.arange(0, len(t), stride), len(t) - 1))


def _cut(mechanism: Mechanism, q: Array) -> float:
    """Largest distance of a path of a named point from the chords between its points at q (n, nq), relative to all paths."""
    if len(q) < 3 or not mechanism.frames:
        return 0.0
    poses = ManyPoses(mechanism).set(q).poses()
    index = {b.name: k for k, b in enumerate(mechanism.bodies)}
    moving = [f for f in mechanism.frames if f.body in index]
    paths = [poses[:, index[f.body], :3, :3] @ f.placement.translation + poses[:, index[f.body], :3, 3] for f in moving]
    sagitta = [np.linalg.norm(p[:-2] - 2.0 * p[1:-1] + p[2:], axis=1).max() / 8.0 for p in paths]
    extent = float(np.linalg.norm(np.ptp(np.concatenate(paths), axis=0))) if paths else 0.0
    return float(max(sagitta)) / extent if extent > 0.0 else 0.0


Owners = list[tuple[str, tuple[Shape, ...]]]


def placed(mechanism: Mechanism, q: Array) -> tuple[tuple[str, ...], Array, Owners]:
    """Names, poses (n, nb, 4, 4) and shapes of the bodies, of shafts that are drawn, and of the ground."""
    bodies = ManyPoses(mechanism).set(q).poses()
    names = [b.name for b in mechanism.bodies]
    poses = [bodies[:, k] for k in range(len(names))]
    index = {n: k for k, n in enumerate(names)}
    owners: Owners = [(b.name, b.shapes) for b in mechanism.bodies] + [(GROUND, mechanism.ground_shapes)]
    still = np.tile(np.eye(4), (len(q), 1, 1))
    for shaft in mechanism.shafts:
        if not shaft.shapes:
            continue
        carrier = bodies[:, index[shaft.body]] if shaft.body in index else still
        turn = still.copy()
        angle = mechanism.value(shaft.name, q) - shaft.zero
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
        turn[:, 1, 0], turn[:, 0, 1] = np.sin(angle), -np.sin(angle)
        names.append(f"{shaft.name} (shaft)" if shaft.name in index else shaft.name)
        poses.append(carrier @ shaft.placement.matrix() @ turn)
        owners.append((names[-1], shaft.shapes))
    names.append(GROUND)
    poses.append(still)
    return tuple(names), np.stack(poses, axis=1), owners


def floors_of(names: Sequence[str], poses: Array, owners: Owners) -> tuple[Floor, ...]:
    """The floors among the shapes, where they are in the first of the poses (n, nb, 4, 4)."""
    return tuple(
        Floor(poses[0, names.index(owner)] @ item.placement.matrix(), item.parameters.get("x", 0.0), item.parameters.get("y", 0.0),
              item.color)
        for owner, shapes in owners for item in shapes if item.kind == FLOOR
    )  # fmt: skip


def scene_of(mechanism: Mechanism, q: Array) -> tuple[tuple[str, ...], Array, tuple[Part, ...], Owners]:
    """As `placed`, with the parts that the shapes make; bodies without shapes as lines."""
    names, poses, owners = placed(mechanism, q)
    drawn = lines(mechanism)
    owners = [(owner, shapes or drawn.get(owner, ())) for owner, shapes in owners]
    parts: list[Part] = []
    for owner, shapes in owners:
        for k, item in enumerate(shapes):
            if item.kind == FLOOR:
                continue
            solid = mesh(item.kind, item.parameters, item.data)
            name = item.name or f"{item.kind}_{k}"
            faces = solid.faces.astype(np.int64)
            parts.append(Part(owner, name, solid.vertices, faces, item.color, item.placement.matrix()))
    return names, poses, tuple(parts), owners
