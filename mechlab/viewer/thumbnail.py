"""A story as a few kilobytes that a small canvas moves: outlines of its parts, and places of its bodies on the screen.

A part is the convex outline of some points of it, filled, from the farthest part to the nearest; `loops` are the true outline of one that
is hollow or slotted. The view has no perspective, so a
body's place on the screen is a matrix (2, 3) and a shift (2,), between frames in straight lines. Numbers are whole, in units of
1 / UNIT of the half width of the picture.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np

from mechlab.viewer.facing import faced_from
from mechlab.viewer.film import film_span
from mechlab.viewer.framing import THREE_QUARTER, frame_story
from mechlab.viewer.outline import hollow_outline
from mechlab.viewer.story import Array, Part, Story

FRAMES = 24
UNIT = 400
MOST_PARTS = 48
"""Largest number of parts that are drawn, the largest ones first."""
STEP = math.radians(24.0)
"""Most that a body turns between two frames; where it is more, less of the motion is shown."""
CLOSED = 0.02
"""The motion begins again where its end is as near to its beginning, in half widths; otherwise it is played back and forth."""
ROUND = 0.03
"""A part whose two larger extents differ by less than this part gets a mark, by which one sees it turn."""
ASPECT = 4.0 / 3.0
_AROUND = np.array([d for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)])


def thumbnail(story: Story) -> dict[str, Any]:
    """JSON-able: `parts` [{body, color, points [[x, y, z], ...], mark [two points] or [], loops or none}], `bodies` {index: frames of
    [a, b, c, d, e, f, x, y], one frame where it stands still}, `paths` [{color, points [[x, y], ...]}], `loop`, `seconds` of a
    round. Empty for a story that does not move."""
    if len(story.t) < 2 or not story.parts:
        return {}
    framing = frame_story(story)
    toward = faced_from(story, framing)
    view = _view(THREE_QUARTER if toward is None else toward)
    times, seconds = _span(story)
    poses = _poses(story, times)
    flat = (framing.points @ view.T)[:, :2]
    middle = 0.5 * (flat.min(axis=0) + flat.max(axis=0))
    half = 0.54 * max(np.ptp(flat[:, 0]), np.ptp(flat[:, 1]) * ASPECT)
    largest = sorted(story.parts, key=lambda p: -float(np.linalg.norm(np.ptp(p.vertices, axis=0))))[:MOST_PARTS]
    index = {b: k for k, b in enumerate(story.bodies)}

    def nearness(part: Part) -> float:
        return float(view[2] @ _in_world(part, poses[0, index[part.body]]).mean(axis=0))

    drawn = []
    for part in sorted(largest, key=nearness):
        seen = view @ poses[0, index[part.body]][:3, :3]
        drawn.append(_drawn(part, index[part.body], seen, half, toward is not None))
    bodies = {}
    for k in sorted({d["body"] for d in drawn}):
        turned = view[:2] @ poses[:, k, :3, :3]
        shifted = (poses[:, k, :3, 3] @ view[:2].T - middle) / half * UNIT
        rows = np.rint(np.concatenate([turned.reshape(-1, 6) * UNIT, shifted], axis=1)).astype(int)
        bodies[k] = (rows if np.ptp(rows, axis=0).any() else rows[:1]).tolist()
    ends = [(np.array(frames[0]), np.array(frames[-1])) for frames in bodies.values()]
    closed = all(np.abs(first - last).max() <= CLOSED * UNIT for first, last in ends)
    paths = []
    for trace in story.traces.values():
        line = np.rint((trace @ view[:2].T - middle) / half * UNIT).astype(int)[:: max(1, len(trace) // 90)]
        paths.append(line.tolist())
    return {"parts": drawn, "bodies": bodies, "paths": paths, "loop": closed, "seconds": seconds}


def _view(toward: Array) -> Array:
    """(3, 3): rows to the right, upwards and towards the eye."""
    back = np.asarray(toward, dtype=float) / np.linalg.norm(toward)
    right = np.cross([0.0, 0.0, 1.0], back)
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-9 else np.array([1.0, 0.0, 0.0])
    return np.array([right, np.cross(back, right), back])


def _span(story: Story) -> tuple[Array, float]:
    """Times of the frames, and the seconds in which they are shown: those of a film, shorter where a body would turn too far."""
    pace, end = film_span(story)
    begin = float(story.t[0])
    times = np.linspace(begin, end, 8 * FRAMES)
    rotations = story.poses[[story.frame(t) for t in times]][:, :, :3, :3]
    cosine = 0.5 * (np.einsum("tbij,tbij->tb", rotations[1:], rotations[:-1]) - 1.0)
    most = float(np.arccos(np.clip(cosine, -1.0, 1.0)).sum(axis=0).max(initial=0.0))
    share = min(1.0, STEP * (FRAMES - 1) / most) if most > 0.0 else 1.0
    end = begin + share * (end - begin)
    return np.linspace(begin, end, FRAMES), float(np.clip((end - begin) / pace, 2.0, 6.0))


def _poses(story: Story, times: Array) -> Array:
    """(n, bodies, 4, 4) poses at times, in straight lines between the recorded ones."""
    k = np.clip(np.searchsorted(story.t, times, side="right") - 1, 0, len(story.t) - 2)
    part = ((times - story.t[k]) / (story.t[k + 1] - story.t[k]))[:, None, None, None]
    return np.asarray((1.0 - part) * story.poses[k] + part * story.poses[k + 1])


def _in_world(part: Part, pose: Array) -> Array:
    placed = pose @ part.placement
    return part.vertices @ placed[:3, :3].T + placed[:3, 3]


def _drawn(part: Part, body: int, seen: Array, half: float, planar: bool) -> dict[str, Any]:
    """The outline of a part in its body. seen (3, 3): body to view, in whose picture plane the outermost points are taken, and all around
    where the mechanism is not planar."""
    points = part.vertices @ part.placement[:3, :3].T + part.placement[:3, 3]
    turn = np.linspace(0.0, 2.0 * np.pi, 25)[:-1]
    directions = np.column_stack([np.cos(turn), np.sin(turn)]) @ seen[:2]
    directions = directions if planar else np.concatenate([_AROUND, directions[::2]])
    chosen = points[np.unique((points @ directions.T).argmax(axis=0))]
    extents = np.sort(np.ptp(points @ part.placement[:3, :3], axis=0))
    loops = [loop @ part.placement[:3, :3].T + part.placement[:3, 3] for loop in hollow_outline(part, seen[2] @ part.placement[:3, :3])]
    mark: list[list[int]] = []
    if extents[2] - extents[1] < ROUND * extents[2] and extents[0] < 0.8 * extents[1]:
        center = 0.5 * (points.min(axis=0) + points.max(axis=0))
        rim = chosen[np.linalg.norm(chosen - center, axis=1).argmax()]
        begin = max([0.35, *(_hole(loop, center, float(np.linalg.norm(rim - center))) for loop in loops)])
        mark = _whole([center + begin * (rim - center), center + max(0.92, begin) * (rim - center)], half)
    red, green, blue = (round(255 * c) for c in part.color[:3])
    out = {"body": body, "color": f"#{red:02x}{green:02x}{blue:02x}", "points": _whole(chosen, half), "mark": mark}
    return out | {"loops": [_whole(loop, half) for loop in loops]} if loops else out


def _hole(loop: Array, center: Array, radius: float) -> float:
    """Radius of a hole about the centre, as a share of the outer one; 0 for other loops."""
    off = np.linalg.norm(loop.mean(axis=0) - center)
    share = float(np.linalg.norm(loop - loop.mean(axis=0), axis=1).max()) / radius
    return share if share < 0.99 and off < radius * max(0.1, 1.0 - share) and off < 0.5 * share * radius else 0.0


def _whole(points: Any, half: float) -> list[list[int]]:
    rounded: list[list[int]] = np.rint(np.asarray(points) / half * UNIT).astype(int).tolist()
    return rounded
