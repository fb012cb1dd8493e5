"""From a Mechanism or a Recording to a Story: poses of all parts, plots of the channels, facts and health in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mechlab.experiment.health import Health
from mechlab.experiment.recording import Recording, frame_positions
from mechlab.mechanism import GROUND, Mechanism, body_poses
from mechlab.mechanism.geometry import Array
from mechlab.shapes import mesh
from mechlab.view.story import Part, Plot, Severity, Story

MAX_FRAMES = 401
MAX_SERIES = 6
WORDS: dict[str, Severity] = {"ok": "ok", "warning": "warning", "error": "error"}


def mechanism_story(mechanism: Mechanism, title: str = "", facts: Mapping[str, str] | None = None) -> Story:
    """A still Story of the reference pose."""
    return motion_story(mechanism, np.zeros(1), mechanism.reference()[None], title or mechanism.name, facts=facts)


def recording_story(
    recording: Recording,
    drawn: tuple[Mechanism, Array] | None = None,
    title: str = "",
    summary: str = "",
    facts: Mapping[str, str] | None = None,
    channels: Sequence[str] | None = None,
) -> Story:
    """A moving Story of a run. `drawn`: a richer Mechanism and its coordinates (n, nq) along the run, drawn instead."""
    keep = _frames(recording.t)
    mechanism, q = drawn if drawn is not None else (recording.mechanism, recording.q)
    known = {b.name for b in recording.mechanism.bodies} | {s.body for s in recording.mechanism.shafts}
    rebuilt = tuple(b.name for b in mechanism.bodies if b.name not in known)
    return motion_story(
        mechanism, recording.t[keep], q[keep], title or recording.name or mechanism.name, summary or mechanism.summary,
        facts=facts, health=recording.health, plots=_plots(recording, keep, channels), reconstructed=rebuilt,
    )  # fmt: skip


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
    names, poses, parts = _scene(mechanism, q)
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
    )  # fmt: skip


def _frames(t: Array) -> Array:
    """At most MAX_FRAMES indices, evenly spread, both ends kept."""
    return np.unique(np.round(np.linspace(0, len(t) - 1, min(len(t), MAX_FRAMES))).astype(int))


def _scene(mechanism: Mechanism, q: Array) -> tuple[tuple[str, ...], Array, tuple[Part, ...]]:
    """Names, poses (n, nb, 4, 4) and parts of the bodies, of shafts that are drawn, and of the ground."""
    bodies = body_poses(mechanism, q)
    names = [b.name for b in mechanism.bodies]
    poses = [bodies[:, k] for k in range(len(names))]
    index = {n: k for k, n in enumerate(names)}
    parts: list[Part] = []
    owners = [(b.name, b.shapes) for b in mechanism.bodies] + [(GROUND, mechanism.ground_shapes)]
    still = np.tile(np.eye(4), (len(q), 1, 1))
    for shaft in mechanism.shafts:
        if not shaft.shapes:
            continue
        carrier = bodies[:, index[shaft.body]] if shaft.body in index else still
        turn = still.copy()
        angle = mechanism.value(shaft.name, q) - shaft.zero
        turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1] = (
            np.cos(angle),
            -np.sin(angle),
            np.sin(angle),
            np.cos(angle),
        )
        names.append(f"{shaft.name} (shaft)" if shaft.name in index else shaft.name)
        poses.append(carrier @ shaft.placement.matrix() @ turn)
        owners.append((names[-1], shaft.shapes))
    names.append(GROUND)
    poses.append(still)
    for owner, shapes in owners:
        for k, item in enumerate(shapes):
            solid = mesh(item.kind, item.parameters)
            parts.append(
                Part(
                    owner,
                    item.name or f"{item.kind}_{k}",
                    solid.vertices,
                    solid.faces.astype(np.int64),
                    item.color,
                    item.placement.matrix(),
                )
            )
    return tuple(names), np.stack(poses, axis=1), tuple(parts)


def _plots(recording: Recording, keep: Array, wanted: Sequence[str] | None) -> tuple[Plot, ...]:
    """One plot for each unit, drives and wanted channels first."""
    m = recording.mechanism
    first = list(wanted or ())
    drives = [d.on for d in m.drives] or [j.name for j in m.joints if j.nv == 1]
    first += [n for d in drives for n in (d, f"{d}_force")]
    first += [f"{f.name}_{a}" for f in m.frames for a in "xyz"]
    groups: dict[tuple[str, str], dict[str, Array]] = {}
    for name in dict.fromkeys(first):
        if name not in recording.channels:
            continue
        unit = recording.units.get(name, "")
        kind = (
            "forces"
            if name.endswith("_force")
            else "points"
            if unit == "m" and name[-2:] in ("_x", "_y", "_z")
            else "drives"
        )
        if wanted and name in wanted:
            kind = "asked"
        series = groups.setdefault((kind, unit), {})
        if len(series) < MAX_SERIES:
            series[name] = recording.channels[name][keep]
    titles = {"forces": "drive forces", "points": "points", "drives": "drives", "asked": "channels"}
    plots = []
    for (kind, unit), series in groups.items():
        title = titles[kind]
        if kind in ("drives", "forces"):
            title = {
                "m": "linear drives",
                "rad": "rotary drives",
                "N": "forces of linear drives",
                "N m": "torques of rotary drives",
            }.get(unit, title)
        plots.append(Plot(title, unit, series))
    return tuple(plots[:6])
