"""A Story as one JSON document and one block of bytes, which the page in the browser reads."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.formats.mechanism_json import to_json
from mechlab.mechanism import Mechanism
from mechlab.shapes.feature_edges import split_at_edges
from mechlab.viewer.channels import Channels
from mechlab.viewer.facing import faced_from
from mechlab.viewer.framing import (
    FIELD_OF_VIEW,
    MARGIN,
    SPEEDS,
    THREE_QUARTER,
    frame_story,
    nice_step,
    outermost,
    tempo,
)
from mechlab.viewer.knots import Knots
from mechlab.viewer.reach import BorderSurface
from mechlab.viewer.story import ColorField, Part, Story

Array = NDArray[np.float64]

ARROW_LENGTH = 0.7
"""Largest length of an arrow, in radii of the mechanism."""
RING_SHARE = 0.6
"""Largest width of the ring of a torque, relative to ARROW_LENGTH."""
FEW_ARROWS = 3
"""A story with at most this many arrows shows all of them; the page has the same constant."""


class ByteBlock:
    """Collects arrays into one block of little-endian bytes; `add` returns the reference that stands for the
    array in the JSON."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._length = 0
        self._known: dict[tuple[str, bytes], dict[str, Any]] = {}

    def add(self, array: NDArray[Any], kind: str, steps: bool = False) -> dict[str, Any]:
        """Appends `array` as `kind` (f8, f4, i2, u2, u4, u1), aligned to 8 bytes, unless the same bytes are there already;
        the reference is {at, kind, count}. steps: of integers that grow slowly the differences are kept, which compress to a third;
        they are added up modulo the size of the kind."""
        values = np.ascontiguousarray(array, dtype="<" + kind).reshape(-1)
        data = (np.diff(values, prepend=values.dtype.type(0)) if steps else values).tobytes()
        key = (f"{kind} {steps}", hashlib.sha256(data).digest())
        if key in self._known:
            return self._known[key]
        reference: dict[str, Any] = {"at": self._length, "kind": kind, "count": len(values)}
        if steps:
            reference["steps"] = True
        padded = data + bytes(-len(data) % 8)
        self._pieces.append(padded)
        self._length += len(padded)
        self._known[key] = reference
        return reference

    def bytes(self) -> bytes:
        """Everything added so far."""
        return b"".join(self._pieces)


def quaternions(rotations: Array) -> Array:
    """Rotation matrices (..., 3, 3) as unit quaternions (..., 4) in the order x, y, z, w (the order of
    three.js)."""
    from scipy.spatial.transform import Rotation

    flat = np.array(rotations, dtype=np.float64).reshape(-1, 3, 3)  # a copy: scipy before 1.17 refuses what is read-only
    if not len(flat):
        return np.zeros((*rotations.shape[:-2], 4))
    return np.asarray(Rotation.from_matrix(flat).as_quat()).reshape(*rotations.shape[:-2], 4)


def pack(story: Story) -> tuple[dict[str, Any], bytes]:
    """The story as a JSON-ready dict of plain Python values, and the block of bytes that its references point
    into.

    Positions keep all 64 bits and quaternions 32: a recorded pose comes back to 2e-7. A body that stands
    still takes one frame.
    """
    block = ByteBlock()
    # With knots the page has the poses from the model; the first of each body stays, for what needs one.
    poses = story.poses if story.knots is None or story.model is None else story.poses[:1]
    motion = pack_motion(poses, block)
    pace = tempo(story)
    geometries, (parts, ghost_parts) = _pack_parts(story.bodies, (story.parts, story.ghost_parts), block)
    framing = frame_story(story)
    scales = _scales(story, framing.step, framing.radius)
    document = {
        "title": story.title,
        "summary": story.summary,
        "t": block.add(story.t, "f8"),
        "bodies": list(story.bodies),
        "motion": motion,
        "moving": np.any(story.poses != story.poses[:1], axis=(0, 2, 3)).tolist(),
        "knots": None if story.knots is None or story.model is None else _pack_knots(story.knots, block),
        "geometries": geometries,
        "parts": parts,
        "floors": [
            {"placement": f.placement.T.reshape(-1).tolist(), "size": [f.x, f.y], "color": list(f.color)} for f in story.floors
        ],
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
        "clips": [{"name": c.name, "value": c.value, "text": c.text, "start": c.start, "end": c.end} for c in story.clips],
        "fields": [_pack_field(f, story.parts, block) for f in story.fields],
        "channels": _pack_channels(story.channels, block),
        "traces": _pack_traces(story.traces, block),
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
                "on": a.on,
                "by": a.by,
            }
            for a in story.arrows
        ],
        "arrowScales": scales,
        "marks": _pack_marks(story),
        "ghost": None
        if story.ghost is None
        else {
            "name": story.ghost_name,
            "shown": story.ghost_shown,
            "motion": pack_motion(story.ghost, block),
            "parts": ghost_parts,
            "traces": _pack_traces(story.ghost_traces, block),
        },
        "differences": [list(row) for row in story.differences],
        "playback": story.playback,
        "tempo": {
            "speed": pace.speed,
            "limit": pace.limit if np.isfinite(pace.limit) else None,
            "sentence": pace.sentence,
            "speeds": list(SPEEDS),
        },
        "model": None if story.model is None else _pack_model(story.model, block),
        "named": None if story.named is None else asdict(story.named),
        "explore": None
        if story.explore is None
        else {"rates": dict(story.explore.rates), "reach": _pack_reach(story.explore.reach, block)},
        "variants": [
            {
                "key": v.key,
                "unit": v.unit,
                "values": list(v.values),
                "home": v.home,
                "choices": [x if isinstance(x, str) else _pack_choice(x, block) for x in v.stories],
            }
            for v in story.variants
        ],
        "framing": {
            "points": [*framing.points.tolist(), *_tips(story, scales, framing.step)],
            "low": framing.low.tolist(),
            "high": framing.high.tolist(),
            "floor": framing.floor,
            "step": framing.step,
            "radius": framing.radius,
            "fieldOfView": FIELD_OF_VIEW,
            "margin": MARGIN,
            "threeQuarter": THREE_QUARTER.tolist(),
            "face": None if (face := faced_from(story, framing)) is None else face.tolist(),
        },
    }
    return document, block.bytes()


def pack_motion(poses: Array, block: ByteBlock, kind: str = "f8") -> list[dict[str, Any]]:
    """References of positions (as `kind`) and quaternions (f4) of poses (n, nb, 4, 4), one dict for each body."""
    rotation = quaternions(poses[:, :, :3, :3])
    motion = []
    for k in range(poses.shape[1]):
        still = bool(np.all(poses[:, k] == poses[0, k]))
        frames = slice(0, 1) if still else slice(None)
        motion.append(
            {"position": block.add(poses[frames, k, :3, 3], kind), "quaternion": block.add(rotation[frames, k], "f4")}
        )
    return motion


def _pack_model(mechanism: Mechanism, block: ByteBlock) -> dict[str, Any]:
    """Reference of the model document, the JSON text that `generate` writes; the page solves it."""
    return block.add(np.frombuffer(to_json(mechanism).encode(), dtype=np.uint8), "u1")


def _pack_knots(knots: Knots, block: ByteBlock) -> dict[str, Any]:
    return {"t": block.add(knots.t, "f8"), "q": block.add(knots.q, "f8"), "rates": block.add(knots.rates, "f8")}


def _pack_marks(story: Story) -> list[dict[str, Any]]:
    return [
        {
            "body": story.bodies.index(m.body),
            "name": m.name,
            "point": list(m.point),
            "direction": None if m.direction is None else list(m.direction),
            "kind": m.kind,
        }
        for m in story.marks
    ]


def _pack_traces(traces: Mapping[str, Array], block: ByteBlock) -> list[dict[str, Any]]:
    return [{"name": name, "points": block.add(points, "f8")} for name, points in traces.items()]


def _pack_field(field: ColorField, parts: Sequence[Part], block: ByteBlock) -> dict[str, Any]:
    """A field at the vertices that the page draws: those of the part, some of them several times."""
    from scipy.spatial import KDTree

    part = next(p for p in parts if p.name == field.part)
    drawn = split_at_edges(part.vertices, part.faces).vertices
    values = field.values[KDTree(part.vertices).query(drawn)[1]]
    return {
        "part": field.part, "name": field.name, "unit": field.unit, "text": field.text,
        "low": float(np.nanmin(values)), "high": float(np.nanmax(values)), "values": block.add(values, "f4"),
    }  # fmt: skip


def _pack_channels(channels: Channels, block: ByteBlock) -> dict[str, Any]:
    """Channels in 32 bits; a value beyond them is a gap."""
    limit = float(np.finfo(np.float32).max)
    return {
        "t": block.add(channels.t, "f8"),
        "recorded": channels.recorded,
        "items": [
            {"name": name, "unit": channels.units.get(name, ""), "values": block.add(np.where(np.abs(v) < limit, v, np.nan), "f4")}
            for name, v in channels.values.items()
        ],
    }


def _pack_choice(story: Story, block: ByteBlock) -> dict[str, Any]:
    """The parts of a story in which the variants of a mechanism differ."""
    geometries, (parts,) = _pack_parts(story.bodies, (story.parts,), block)
    return {"geometries": geometries, "parts": parts, "marks": _pack_marks(story),
            "model": None if story.model is None else _pack_model(story.model, block)}  # fmt: skip


def _pack_reach(reach: BorderSurface | None, block: ByteBlock) -> dict[str, Any] | None:
    if reach is None:
        return None
    return {"name": reach.name, "positions": block.add(reach.vertices, "f4"), "faces": block.add(reach.faces, "u2")}


def _scales(story: Story, step: float, radius: float) -> dict[str, float]:
    """Unit -> amount of it that an arrow one grid step long or a ring one grid step wide stands for: 1, 2 or 5 times a power of ten."""
    largest: dict[str, float] = {}
    for arrow in story.arrows:
        largest[arrow.unit] = max(largest.get(arrow.unit, 0.0), float(np.nanmax(np.linalg.norm(arrow.vectors, axis=1))))
    length = {unit: ARROW_LENGTH * radius * (RING_SHARE if unit == "N m" else 1.0) for unit in largest}
    return {unit: nice_step(size * step / length[unit], 1) for unit, size in largest.items() if size > 0}


def _tips(story: Story, scales: dict[str, float], step: float) -> list[list[float]]:
    """Outermost tips (k, 3) [m] of the arrows that are shown from the start, so that the camera includes them."""
    if not 0 < len(story.arrows) <= FEW_ARROWS:
        return []
    tips = [a.points + a.vectors * (step / scales[a.unit]) for a in story.arrows if a.unit in scales]
    return outermost(np.concatenate(tips)).tolist() if tips else []


def geometry_key(part: Part) -> str:
    """A key that is equal for parts with the same vertices and faces."""
    digest = hashlib.sha256(part.vertices.astype("<f4").tobytes())
    digest.update(b"faces" + part.faces.astype("<i8").tobytes())
    return digest.hexdigest()


def _pack_parts(
    bodies: Sequence[str], lists: Sequence[Sequence[Part]], block: ByteBlock
) -> tuple[list[dict[str, Any]], list[list[dict[str, Any]]]]:
    """Geometries that lists of parts share, and the lists."""
    index: dict[str, int] = {}
    geometries: list[dict[str, Any]] = []
    packed: list[list[dict[str, Any]]] = [[] for _ in lists]
    for k, part in ((k, part) for k, parts in enumerate(lists) for part in parts):
        key = geometry_key(part)
        if key not in index:
            index[key] = len(geometries)
            mesh = split_at_edges(part.vertices, part.faces)
            width = "u2" if len(mesh.vertices) <= 0xFFFF else "u4"
            geometries.append(
                {
                    "positions": block.add(mesh.vertices, "f4"),
                    "normals": block.add(np.rint(mesh.normals * 32767.0), "i2"),
                    "faces": block.add(mesh.faces, width, steps=True),
                    "edges": block.add(mesh.edges, width, steps=True),
                    "closed": mesh.closed,
                }
            )
        packed[k].append(
            {
                "body": bodies.index(part.body),
                "name": part.name,
                "geometry": index[key],
                "color": list(part.color),
                "placement": part.placement.T.reshape(-1).tolist(),
            }
        )
    return geometries, packed
