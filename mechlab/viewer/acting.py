"""Forces and torques of a recording as arrows, where they act on what is drawn: drives at their motors, reactions in their layer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from mechlab.experiment.recording import Recording
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import GROUND, Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_poses import ManyPoses
from mechlab.mechanism.parts import FORCES, MOMENTS
from mechlab.viewer.facing import plane_normal
from mechlab.viewer.story import Arrow, Part

MOST_ARROWS = 12
INSIDE = 0.02
"""A joint belongs to a part whose box it leaves by less than this share of the box's diagonal."""


@dataclass(frozen=True)
class _Source:
    """The channels of one arrow: of a drive or load on a joint or shaft, or of a loop."""

    name: str
    channels: tuple[str, ...]
    is_loop: bool


def arrows(
    recording: Recording, keep: Array, mechanism: Mechanism, q: Array, parts: Sequence[Part]
) -> tuple[Arrow, ...]:
    """Forces and torques of a recording at its samples `keep` (k,): drives and loads along their axes, reactions of loops on their
    body b, world axes. Those that stay zero are left out; the MOST_ARROWS largest remain, in falling order.

    mechanism, q (k, nq): what is drawn at these samples; a joint or shaft that it shares by name with the recorded mechanism has its
    arrow there, others where the recorded one has them. parts: what is drawn; of a planar mechanism an arrow stands in the layer of
    the part that it acts on.
    """
    m = recording.mechanism
    sources = [_Source(n, (f"{n}_force",), False) for n in m.scalar_names if f"{n}_force" in recording.channels]
    for loop in m.loops:
        for three in (FORCES, MOMENTS):
            names = tuple(f"{loop.name}_{x}" for x in three)
            if all(n in recording.channels for n in names):
                sources.append(_Source(loop.name, names, True))
    values = {s: np.column_stack([recording.channels[n][keep] for n in s.channels]) for s in sources}
    lively = [s for s in sources if np.all(np.isfinite(values[s])) and np.any(np.abs(values[s]) > 1e-12)]
    lively.sort(key=lambda s: -float(np.abs(values[s]).max()))
    shown, own = _Places(mechanism, q), _Places(m, recording.q[keep])
    layers, driven, out = _Layers(mechanism, parts), {d.on for d in m.drives}, []
    for s in lively[:MOST_ARROWS]:
        unit = recording.units.get(s.channels[0], "")
        places = shown if s.name in (shown.loops if s.is_loop else shown.scalars) else own
        points, axes, on, by = places.of_loop(s.name) if s.is_loop else places.of_scalar(s.name)
        vectors = values[s] if s.is_loop else axes * values[s]
        kind: Literal["force", "torque"] = "force" if unit == "N" else "torque"
        label = s.name if s.is_loop else f"{s.name} ({'drive' if s.name in driven else 'load'})"
        out.append(Arrow(label, kind, unit, points + layers.shift(places, on, points), vectors, on, by))
    return tuple(out)


class _Places:
    """Where joints, shafts and loops of a mechanism are at coordinates q (n, nq)."""

    def __init__(self, m: Mechanism, q: Array) -> None:
        self.m, self.poses = m, ManyPoses(m).set(q)
        self.columns = {j.name: m.v_slice[j.name].start for j in m.joints if j.nv == 1}
        self.bodies = {j.name: b for b in m.bodies for j in b.joints}
        self.shafts = {s.name: s for s in m.shafts}
        self.scalars, self.loops = set(m.scalar_names), {x.name: x for x in m.loops}

    def frame(self, body: str) -> tuple[Array, Array]:
        """Rotations (n, 3, 3) and origins (n, 3) of a body."""
        if body == GROUND:
            n = len(self.poses.origins)
            return np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))
        k = self.poses.index[body]
        return self.poses.rotations[:, k], self.poses.origins[:, k]

    def of_scalar(self, name: str) -> tuple[Array, Array, str, str]:
        """Points and axes (n, 3) of a joint or shaft; the body that turns, the one that carries it."""
        if name in self.columns:
            k, body = self.columns[name], self.bodies[name]
            return self.poses.anchors[:, k], self.poses.axes[:, k], body.name, body.parent
        shaft = self.shafts[name]
        rotation, origin = self.frame(shaft.body)
        return origin + rotation @ shaft.placement.translation, rotation @ shaft.placement.rotation[:, 2], name, shaft.body

    def of_loop(self, name: str) -> tuple[Array, Array, str, str]:
        """Points (n, 3) of a loop on its body b, no axes, both bodies."""
        loop = self.loops[name]
        rotation, origin = self.frame(loop.body_b)
        points = origin + rotation @ loop.placement_b.translation
        return points, np.zeros_like(points), loop.body_b, loop.body_a


class _Layers:
    """The layers in which the parts of a planar mechanism lie."""

    def __init__(self, m: Mechanism, parts: Sequence[Part]) -> None:
        self.normal = plane_normal(m)
        self.boxes: dict[str, list[tuple[Array, Array]]] = {}
        for part in parts:
            points = part.vertices @ part.placement[:3, :3].T + part.placement[:3, 3]
            self.boxes.setdefault(part.body, []).append((points.min(axis=0), points.max(axis=0)))

    def shift(self, places: _Places, body: str, points: Array) -> Array:
        """(3,) way along the normal from the first of the points (n, 3) on a body to the middle of its thinnest part there."""
        if self.normal is None or body not in places.poses.index:
            return np.zeros(3)
        rotation, origin = (x[0] for x in places.frame(body))
        here, normal = rotation.T @ (points[0] - origin), rotation.T @ self.normal
        found = []
        for low, high in self.boxes.get(body, []):
            across = np.abs(normal) < 0.5
            slack = INSIDE * float(np.linalg.norm(high - low))
            if np.all((low - slack <= here)[across]) and np.all((here <= high + slack)[across]):
                thickness = float(np.abs(normal) @ (high - low))
                found.append((thickness, float(normal @ (0.5 * (low + high) - here))))
        return np.asarray(min(found)[1] * self.normal if found else np.zeros(3))
