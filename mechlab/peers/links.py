"""The tree of a Mechanism as a chain of one-joint links, in the form in which every peer takes it.

A body with several joints becomes several links, the last of which carries its inertia; a body without joints is part of
its parent's link. The frame of a link stands at its joint and has the joint's axis along z.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechlab.mechanism.geometry import Array, frame_along, vector
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Loop

_TO_Z = {
    (0.0, 0.0, 1.0): np.eye(3),
    (1.0, 0.0, 0.0): np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    (0.0, 1.0, 0.0): np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
}
"""Rotations whose third column is a coordinate axis, exact."""


@dataclass(frozen=True)
class Pose:
    """A frame in another: rotation (3, 3), translation (3,) [m]."""

    rotation: Array
    translation: Array

    def __matmul__(self, other: Pose) -> Pose:
        return Pose(self.rotation @ other.rotation, self.rotation @ other.translation + self.translation)

    def inverse(self) -> Pose:
        """The other frame in this one."""
        return Pose(self.rotation.T, -self.rotation.T @ self.translation)


@dataclass(frozen=True)
class Link:
    """name: that of the joint. parent: index of the link before it, -1 for the ground. pose: in the frame of the parent link
    at joint coordinate 0. kind: "revolute" or "prismatic", about or along z. inertia: in the frame of the link."""

    name: str
    parent: int
    pose: Pose
    kind: str
    inertia: Inertia


@dataclass(frozen=True)
class Links:
    """All links in the order of the coordinates, and where each body stands: (link, its pose in the link)."""

    links: tuple[Link, ...]
    place: dict[str, tuple[int, Pose]]

    def point(self, body: str, point: tuple[float, float, float]) -> tuple[int, Array]:
        """(link, point in the frame of the link) of a point of a body."""
        link, pose = self.place[body]
        return link, pose.rotation @ np.array(point) + pose.translation


def links_of(mechanism: Mechanism) -> Links:
    """The links of a mechanism whose joints all have one coordinate (see `refusal`)."""
    raw: list[tuple[str, int, Pose, str]] = []
    inertia: list[Inertia] = []
    still = Pose(np.eye(3), np.zeros(3))
    place: dict[str, tuple[int, Pose]] = {GROUND: (-1, still)}
    for body in mechanism.bodies:
        link, pose = place[body.parent]
        pose = pose @ Pose(body.placement.rotation, body.placement.translation)
        for joint in body.joints:
            known = _TO_Z.get(joint.axis)
            along = Pose(frame_along(joint.axis) if known is None else known, np.zeros(3))
            raw.append((joint.name, link, pose @ along, joint.kind))
            inertia.append(Inertia())
            link, pose = len(raw) - 1, along.inverse()
        place[body.name] = (link, pose)
        if body.inertia.mass and link >= 0:
            moved = body.inertia.at(vector(pose.translation, "body"), pose.rotation)
            inertia[link] = inertia[link] + moved
    made = tuple(Link(n, p, x, k, i) for (n, p, x, k), i in zip(raw, inertia, strict=True))
    return Links(made, place)


def loop_points(links: Links, loop: Loop) -> list[Array]:
    """Points of a loop frame that coincide: its origin, or two on its axis for a revolute one."""
    if loop.kind == "spherical":
        return [np.zeros(3)]
    span = max([float(np.linalg.norm(x.pose.translation)) for x in links.links] + [1e-3])
    return [np.array([0.0, 0.0, z]) for z in (-0.5 * span, 0.5 * span)]
