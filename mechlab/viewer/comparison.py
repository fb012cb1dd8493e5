"""Two runs in one Story: the second as ghost with its own parts and paths, its curves, its health, and the
differences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording
from mechlab.mechanism import GROUND
from mechlab.mechanism.geometry import Array
from mechlab.viewer.story import Part, Story

Difference = tuple[str, str, str]


def against(story: Story, other: Story, name: str, differences: tuple[Difference, ...] = ()) -> Story:
    """The story with another one as its ghost, at the same times: poses, parts, paths of points, curves in the plots, and
    the findings of its health, which begin with `name`. differences: (what, here, there) for the table of the page.

    Raises MechlabError when the two have no body in common, or no time.
    """
    common = [b for b in story.bodies if b in other.bodies and b != GROUND]
    if not common:
        raise MechlabError(
            f"{name} has no body in common with {story.title}: {', '.join(other.bodies)} against {', '.join(story.bodies)}."
        )
    if other.t[0] > story.t[-1] or other.t[-1] < story.t[0]:
        raise MechlabError(f"{name} and {story.title} have no time in common.")
    ghost = np.array(story.poses)
    for body in common:
        ghost[:, story.bodies.index(body)] = poses_at(other, body, story.t)
    inside = (story.t >= other.t[0]) & (story.t <= other.t[-1])
    curves = {(p.unit, k): np.interp(story.t, other.t, v) for p in other.plots for k, v in p.series.items()}
    plots = tuple(
        replace(p, against={k: np.where(inside, curves[p.unit, k], np.nan) for k in p.series if (p.unit, k) in curves})
        for p in story.plots
    )
    paths = {k: np.column_stack([np.interp(story.t, other.t, x) for x in v.T]) for k, v in other.traces.items()}
    return replace(
        story, ghost=ghost, ghost_name=name, ghost_shown=True, ghost_parts=_ghost_parts(story, other, common),
        ghost_traces=paths, plots=plots, differences=differences,
        health=(*story.health, *((severity, f"{name}: {sentence}") for severity, sentence in other.health)),
    )  # fmt: skip


def _ghost_parts(story: Story, other: Story, common: list[str]) -> tuple[Part, ...]:
    """The parts of the other run, without those that stand still in both runs and look the same."""
    drawn = {_key(part) for part in story.parts}
    moving = {b for b in common if any(np.ptp(s.poses[:, s.bodies.index(b)], axis=0).max() > 0 for s in (story, other))}
    return tuple(p for p in other.parts if p.body in moving or (p.body in common and _key(p) not in drawn))


def _key(part: Part) -> tuple[str, bytes, bytes]:
    return part.body, part.vertices.tobytes(), part.placement.tobytes()


def poses_at(story: Story, body: str, times: Array) -> Array:
    """(n, 4, 4) poses of a body of a story at times (n,) [s], blended as the page does; the ends are held."""
    from scipy.spatial.transform import Rotation, Slerp

    track = story.poses[:, story.bodies.index(body)]
    clipped = np.clip(times, story.t[0], story.t[-1])
    out = np.tile(np.eye(4), (len(times), 1, 1))
    out[:, :3, 3] = np.column_stack([np.interp(clipped, story.t, track[:, i, 3]) for i in range(3)])
    if len(story.t) == 1:
        out[:, :3, :3] = track[0, :3, :3]
    else:
        out[:, :3, :3] = Slerp(story.t, Rotation.from_matrix(track[:, :3, :3].copy()))(clipped).as_matrix()
    return out


def differences(
    first: Recording, second: Recording, words: tuple[Mapping[str, str], Mapping[str, str]] = ({}, {})
) -> tuple[Difference, ...]:
    """(what, here, there) of every input in which two runs differ: mechanism, scene,
    parameters, initial values, duration, settings, versions. words: values of parameters as text with their units."""
    return tuple(
        (what, *_texts(a, b, words[0].get(what, ""), words[1].get(what, "")))
        for what, a, b in _pairs(first, second)
        if a != b
    )


def _pairs(first: Recording, second: Recording) -> Iterator[tuple[str, object, object]]:
    for field in fields(Recording):
        a, b = getattr(first, field.name), getattr(second, field.name)
        if isinstance(a, str):
            yield "mechanism" if field.name == "name" else field.name, a, b
    yield from _both(first.parameters, second.parameters)
    if first.mechanism != second.mechanism and first.parameters == second.parameters:
        yield "bodies and joints", "as in this run", "others"
    if first.mechanism == second.mechanism:
        yield from _both(_start(first), _start(second))
    yield "duration [s]", float(first.t[-1] - first.t[0]), float(second.t[-1] - second.t[0])
    yield from _both(vars(first.settings), vars(second.settings))
    for package, a, b in _both(first.versions, second.versions):
        yield f"version of {package}", a, b


def _both(first: Mapping[str, object], second: Mapping[str, object]) -> Iterator[tuple[str, object, object]]:
    for key in dict.fromkeys((*first, *second)):
        yield key, first.get(key), second.get(key)


def _start(recording: Recording) -> dict[str, object]:
    """Initial values and rates of joints and shafts."""
    m, out = recording.mechanism, dict[str, object]()
    for name in m.scalar_names:
        out[f"{name} at the start"] = float(m.value(name, recording.q[:1])[0])
        out[f"{name}_rate at the start"] = float(recording.v[0] @ m.row(name))
    return out


def _texts(a: object, b: object, here: str, there: str) -> tuple[str, str]:
    """Two different values as two different texts."""
    if here and there and here != there:
        return here, there
    shown = [f"{x:.6g}" if isinstance(x, float) else "none" if x is None else str(x) for x in (a, b)]
    return (shown[0], shown[1]) if shown[0] != shown[1] else (repr(a), repr(b))
