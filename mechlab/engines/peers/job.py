"""What a peer is asked, as plain data that travels to another process; and the tree of a Mechanism as one-joint links, the form
that every peer accepts.

A body with several joints becomes several links, the last of which has its inertia; a body without joints is part of its parent's
link. The frame of a link stands at its joint and has the joint's axis along z.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from mechlab.experiment.scene import Scene, initial_state
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import ConstraintSet, TreeKinematics
from mechlab.mechanism.geometry import Array, frame_along, vector
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Loop
from mechlab.mechanism.structure import redundancies, sample_poses

WORTH = 1e-6
"""A row is independent of others when the part that they do not span is at least this share, in the median of poses."""


@dataclass(frozen=True)
class Job:
    """A run: the mechanism with its assembled start q (nq,), v (nv,), constant loads (nv,) on the coordinates, `outputs` + 1
    even times up to `duration` [s], the integrator, and its step [s] or tolerance. links: the tree (see `links_of`). rows:
    of each loop, which of its rows are independent of the others (see `independent`). mjcf: the model as text, for peers
    that read it."""

    mechanism: Mechanism
    q: Array
    v: Array
    loads: Array
    duration: float
    outputs: int
    integrator: str
    value: float
    links: Links
    rows: dict[str, tuple[bool, ...]]
    mjcf: str = ""

    @property
    def between(self) -> float:
        """Distance of the output times [s]."""
        return self.duration / self.outputs

    @property
    def each(self) -> int:
        """Steps of the size `value`, rounded so that they divide the distance of the outputs."""
        return max(1, round(self.between / self.value))


def job_of(mechanism: Mechanism, scene: Scene, outputs: int, integrator: str, value: float) -> Job:
    """The job of a scene whose laws are constant loads (see `refusal`)."""
    q, v = initial_state(mechanism, scene)
    loads = np.zeros(mechanism.nv)
    for law in scene.laws:
        loads = loads + law.value * mechanism.row(law.on)  # type: ignore[attr-defined]
    lean = replace(
        mechanism,
        bodies=tuple(replace(b, shapes=()) for b in mechanism.bodies),
        shafts=tuple(replace(s, shapes=()) for s in mechanism.shafts),
        ground_shapes=(),
    )
    rows = dict(_independent(mechanism, tuple(q.tolist())))
    return Job(lean, q, v, loads, scene.duration, outputs, integrator, value, links_of(lean), rows)


@lru_cache(maxsize=32)
def _independent(mechanism: Mechanism, q: tuple[float, ...]) -> tuple[tuple[str, tuple[bool, ...]], ...]:
    return tuple(independent(mechanism, np.array(q)).items())


def independent(mechanism: Mechanism, q: Array) -> dict[str, tuple[bool, ...]]:
    """Loop -> which of its rows to keep, for engines that break down on redundant rows.

    No fixed choice of the rows of a redundant loop is right at all poses. Rows are kept one by one: the next is the row
    whose part not spanned by those kept is largest in the median over the poses (the start and some near the
    reference).
    """
    tree, constraints = TreeKinematics(mechanism), ConstraintSet(mechanism)
    if not mechanism.loops:
        return {}
    poses = [q, *sample_poses(mechanism, count=8, spread=1.0)]
    jacobians = [constraints.jacobian(tree.set(x)) for x in poses]
    wanted = len(constraints) - len(redundancies(mechanism))
    keep = _spread(jacobians, wanted)
    return {x.name: tuple(i in keep for i in range(s.start, s.stop)) for x in mechanism.loops
            for s in [constraints.slices[x.name]]}  # fmt: skip


def _spread(jacobians: list[Array], wanted: int) -> set[int]:
    """`wanted` rows at most, each with the largest part not spanned by those before it, in the median over the
    poses."""
    scale = max(float(np.max(np.linalg.norm(j, axis=1), initial=0.0)) for j in jacobians)
    rests = [j / scale for j in jacobians]
    keep: list[int] = []
    while len(keep) < wanted:
        worst = np.median([np.linalg.norm(r, axis=1) for r in rests], axis=0)
        worst[keep] = -1.0
        k = int(np.argmax(worst))
        if worst[k] < WORTH:
            break
        keep.append(k)
        for r in rests:
            size = float(np.linalg.norm(r[k]))
            if size > WORTH:
                u = r[k] / size
                r -= np.outer(r @ u, u)
    return set(keep)


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
