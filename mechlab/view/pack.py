"""A Story as one JSON document and one block of bytes: what the page in the browser reads."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.view.crease import crease
from mechlab.view.framing import FIELD_OF_VIEW, MARGIN, THREE_QUARTER, frame_story, nice_step
from mechlab.view.story import Part, Story
from mechlab.view.tempo import SPEEDS, tempo

Array = NDArray[np.float64]

ARROW_LENGTH = 0.7
"""Length of the longest arrow, at most, in radii of the mechanism."""


class Block:
    """Collects arrays into one block of little-endian bytes; `add` returns the reference that stands for the
    array in the JSON."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._length = 0

    def add(self, array: NDArray[Any], kind: str) -> dict[str, Any]:
        """Appends `array` as `kind` (f8, f4, i2, u2, u4), aligned to 8 bytes; the reference is {at, kind,
        count}."""
        data = np.ascontiguousarray(array, dtype="<" + kind).tobytes()
        reference = {"at": self._length, "kind": kind, "count": int(np.size(array))}
        padded = data + bytes(-len(data) % 8)
        self._pieces.append(padded)
        self._length += len(padded)
        return reference

    def bytes(self) -> bytes:
        """Everything added so far."""
        return b"".join(self._pieces)


def quaternions(rotations: Array) -> Array:
    """Rotation matrices (..., 3, 3) as unit quaternions (..., 4) in the order x, y, z, w (the order of
    three.js)."""
    from scipy.spatial.transform import Rotation

    flat = np.asarray(rotations, dtype=np.float64).reshape(-1, 3, 3)
    if not len(flat):
        return np.zeros((*rotations.shape[:-2], 4))
    return np.asarray(Rotation.from_matrix(flat).as_quat()).reshape(*rotations.shape[:-2], 4)


def pack(story: Story) -> tuple[dict[str, Any], bytes]:
    """The story as a JSON-ready dict of plain Python values, and the block of bytes that its references point
    into.

    Positions keep all 64 bits and quaternions 32: a recorded pose comes back to 2e-7. A body that stands
    still takes one frame.
    """
    block = Block()
    motion = pack_motion(story.poses, block)
    pace = tempo(story)
    geometries, parts = _pack_parts(story, block)
    framing = frame_story(story)
    document = {
        "title": story.title,
        "summary": story.summary,
        "t": block.add(story.t, "f8"),
        "bodies": list(story.bodies),
        "motion": motion,
        "geometries": geometries,
        "parts": parts,
        "plots": [
            {
                "title": plot.title,
                "unit": plot.unit,
                "series": [
                    {"name": name, "values": block.add(values, "f8")}
                    | ({"against": block.add(plot.against[name], "f8")} if name in plot.against else {})
                    for name, values in plot.series.items()
                ],
            }
            for plot in story.plots
        ],
        "traces": [{"name": name, "points": block.add(points, "f8")} for name, points in story.traces.items()],
        "facts": [list(pair) for pair in story.facts],
        "health": [list(pair) for pair in story.health],
        "reconstructed": list(story.reconstructed),
        "arrows": [
            {
                "name": a.name,
                "kind": a.kind,
                "unit": a.unit,
                "points": block.add(a.points, "f8"),
                "vectors": block.add(a.vectors, "f8"),
            }
            for a in story.arrows
        ],
        "arrowScales": _scales(story, framing.step, framing.radius),
        "marks": [
            {
                "body": story.bodies.index(m.body),
                "name": m.name,
                "point": list(m.point),
                "direction": None if m.direction is None else list(m.direction),
                "kind": m.kind,
            }
            for m in story.marks
        ],
        "ghost": None
        if story.ghost is None
        else {"name": story.ghost_name, "shown": story.ghost_shown, "motion": pack_motion(story.ghost, block)},
        "playback": story.playback,
        "tempo": {
            "speed": pace.speed,
            "limit": pace.limit if np.isfinite(pace.limit) else None,
            "sentence": pace.sentence,
            "speeds": list(SPEEDS),
        },
        "explore": None if story.explore is None else story.explore.packed(block, pack_motion),
        "framing": {
            "points": framing.points.tolist(),
            "low": framing.low.tolist(),
            "high": framing.high.tolist(),
            "floor": framing.floor,
            "step": framing.step,
            "radius": framing.radius,
            "fieldOfView": FIELD_OF_VIEW,
            "margin": MARGIN,
            "threeQuarter": THREE_QUARTER.tolist(),
        },
    }
    return document, block.bytes()


def pack_motion(poses: Array, block: Block) -> list[dict[str, Any]]:
    """References of positions and quaternions of poses (n, nb, 4, 4), body by body."""
    rotation = quaternions(poses[:, :, :3, :3])
    motion = []
    for k in range(poses.shape[1]):
        still = bool(np.all(poses[:, k] == poses[0, k]))
        frames = slice(0, 1) if still else slice(None)
        motion.append(
            {
                "position": block.add(poses[frames, k, :3, 3], "f8"),
                "quaternion": block.add(rotation[frames, k], "f4"),
            }
        )
    return motion


def _scales(story: Story, step: float, radius: float) -> dict[str, float]:
    """Unit -> amount of it that an arrow one grid step long stands for: 1, 2 or 5 times a power of ten."""
    largest: dict[str, float] = {}
    for arrow in story.arrows:
        size = float(np.linalg.norm(arrow.vectors, axis=1).max())
        largest[arrow.unit] = max(largest.get(arrow.unit, 0.0), size)
    return {unit: nice_step(size * step / (ARROW_LENGTH * radius), 1) for unit, size in largest.items() if size > 0}


def geometry_key(part: Part) -> str:
    """Equal for parts that look the same before they are placed and coloured."""
    digest = hashlib.sha256(part.vertices.astype("<f4").tobytes())
    digest.update(b"faces" + part.faces.astype("<i8").tobytes())
    return digest.hexdigest()


def _pack_parts(story: Story, block: Block) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    index: dict[str, int] = {}
    geometries: list[dict[str, Any]] = []
    parts: list[dict[str, Any]] = []
    for part in story.parts:
        key = geometry_key(part)
        if key not in index:
            index[key] = len(geometries)
            mesh = crease(part.vertices, part.faces)
            width = "u2" if len(mesh.vertices) <= 0xFFFF else "u4"
            geometries.append(
                {
                    "positions": block.add(mesh.vertices, "f4"),
                    "normals": block.add(np.rint(mesh.normals * 32767.0), "i2"),
                    "faces": block.add(mesh.faces, width),
                    "edges": block.add(mesh.edges, width),
                }
            )
        parts.append(
            {
                "body": story.bodies.index(part.body),
                "name": part.name,
                "geometry": index[key],
                "color": list(part.color),
                "placement": part.placement.T.reshape(-1).tolist(),
            }
        )
    return geometries, parts
