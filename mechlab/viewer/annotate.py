"""What is drawn besides the parts: joint axes, names."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from mechlab.mechanism import GROUND, Mechanism, Shape
from mechlab.mechanism.geometry import Array
from mechlab.viewer.pack import quaternions
from mechlab.viewer.story import Mark, Part


def marks(mechanism: Mechanism, parts: Sequence[Part]) -> tuple[Mark, ...]:
    """Joint axes (kind: that of the joint), frames (kind "frame") and names of bodies that are drawn (kind "body")."""
    found = []
    for body in mechanism.bodies:
        if len(body.joints) > 1 and body.joints[0].nv == 1:
            joint, place = body.joints[0], body.placement
            found.append(
                _axis(body.parent, joint.name, place.translation, place.rotation @ np.array(joint.axis), joint.kind)
            )
        if body.joints and body.joints[-1].nv == 1:
            joint = body.joints[-1]
            found.append(_axis(body.name, joint.name, np.zeros(3), np.array(joint.axis), joint.kind))
    for frame in mechanism.frames:
        found.append(Mark(frame.body, frame.name, _triple(frame.placement.translation), None, "frame"))
    for name in dict.fromkeys(p.body for p in parts if p.body != GROUND):
        own = [p.vertices @ p.placement[:3, :3].T + p.placement[:3, 3] for p in parts if p.body == name]
        points = np.concatenate(own)
        found.append(Mark(name, name, _triple((points.min(axis=0) + points.max(axis=0)) / 2.0), None, "body"))
    return tuple(found)


def _axis(body: str, name: str, point: Array, direction: Array, kind: str) -> Mark:
    return Mark(body, name, _triple(point), _triple(direction), kind)


def _triple(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z


def turn_per_step(mechanism: Mechanism, q: Array) -> float:
    """Largest turn of a revolute joint or shaft [rad] from one row of q (n, nq) to the next."""
    slides = {j.name for j in mechanism.joints if j.kind == "prismatic"}
    angles = [mechanism.value(n, q) for n in mechanism.scalar_names if n not in slides]
    return max((float(np.abs(np.diff(a)).max()) for a in angles if len(a) > 1), default=0.0)


def turning_rates(poses: Array, t: Array) -> Array:
    """(nb,) largest angular velocity [rad/s] of each body along poses (n, nb, 4, 4); less than pi a frame."""
    if len(t) < 2:
        return np.zeros(poses.shape[1])
    step = np.einsum("nbji,nbjk->nbik", poses[:-1, :, :3, :3], poses[1:, :, :3, :3])
    angle = 2.0 * np.arccos(np.clip(np.abs(quaternions(step)[..., 3]), 0.0, 1.0))
    return np.asarray((angle / np.diff(t)[:, None]).max(axis=0), dtype=np.float64)


def tooth_rate(owners: Sequence[tuple[str, Sequence[Shape]]], names: Sequence[str], rates: Array) -> float:
    """Largest rate [1/s] at which teeth of a drawn gear pass a fixed point; rates (bodies,) [rad/s] as `names`."""
    found = [0.0]
    for owner, shapes in owners:
        teeth = max((s.parameters.get("teeth", 0.0) for s in shapes if s.kind != "rack"), default=0.0)
        found.append(teeth * float(rates[list(names).index(owner)]) / (2.0 * np.pi))
    return max(found)


def body_corners(parts: Sequence[Part], names: Sequence[str]) -> dict[int, Array]:
    """Index of a body in `names` -> (8, 3) corners of the box round its parts, in the body [m]; bodies without parts are left out."""
    found = {}
    for k, name in enumerate(names):
        own = [p.vertices @ p.placement[:3, :3].T + p.placement[:3, 3] for p in parts if p.body == name]
        if own:
            points = np.concatenate(own)
            found[k] = np.array(list(itertools.product(*zip(points.min(axis=0), points.max(axis=0), strict=True))))
    return found
