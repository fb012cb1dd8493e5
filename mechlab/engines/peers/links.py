"""The tree of a Mechanism as one-joint links, the form that every peer accepts; and the sentence that says, before
anything is built, what of a scene a peer cannot express.

A body with several joints becomes several links, the last of which has its inertia; a body without joints is part of its parent's
link. The frame of a link stands at its joint and has the joint's axis along z.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from mechlab.errors import install_extra, unknown
from mechlab.experiment.scene import Scene
from mechlab.mechanism.geometry import Array, frame_along, vector
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, LOOP_ROWS, Loop

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


PEERS = {"exudyn": "exudyn", "drake": "pydrake", "opensim": "opensim"}
"""Peer -> the Python module to import."""
LOOPS = {
    "exudyn": ("spherical", "revolute", "cylindrical", "prismatic", "fixed"),
    "drake": ("spherical", "revolute", "fixed"),
    "opensim": ("spherical", "revolute", "fixed"),
}
"""Kinds of loop that each peer has a counterpart for."""


def installed(peer: str) -> bool:
    """Whether the peer can be imported here (it is not). Raises MechlabError for an unknown one."""
    if peer not in PEERS:
        raise unknown("peer", peer, PEERS)
    return find_spec(PEERS[peer]) is not None


OPEN_ONLY = {
    "exudyn": ("RK44", "RK67", "DOPRI5"),
    "drake": ("runge_kutta3", "runge_kutta5", "radau3"),
    "opensim": (),
}
"""Integrators that take no loops."""
CONTROLLED = {
    "exudyn": ("DOPRI5",),
    "drake": ("runge_kutta3", "runge_kutta5", "radau3"),
    "opensim": ("RungeKuttaMerson", "RungeKuttaFeldberg", "CPodes"),
}
"""Integrators that choose their own steps, to a tolerance; the others take fixed ones."""
INTEGRATORS = {
    "exudyn": ("generalized-alpha", "trapezoidal", *OPEN_ONLY["exudyn"]),
    "drake": ("SAP", *OPEN_ONLY["drake"]),
    "opensim": CONTROLLED["opensim"],
}


def refusal(peer: str, integrator: str, mechanism: Mechanism, scene: Scene) -> str:
    """Why the peer's integrator cannot be given the scene, as a sentence; empty when it can.

    Raises MechlabError for an unknown peer or integrator, listing those that exist.
    """
    if not installed(peer):
        return f"{peer} is not installed; {install_extra('peers')}"
    return not_expressible(peer, integrator, mechanism, scene)


def controlled(peer: str, integrator: str) -> bool:
    """Whether the integrator of a peer chooses its own steps, to a tolerance."""
    return integrator in CONTROLLED[peer]


def not_expressible(peer: str, integrator: str, mechanism: Mechanism, scene: Scene) -> str:
    """What of the scene has no counterpart in the peer; empty when all has. Looks at the data alone."""
    if integrator not in INTEGRATORS[peer]:
        raise unknown(f"integrator of {peer}", integrator, INTEGRATORS[peer])
    m = mechanism
    for joint in m.joints:
        if joint.nv != 1:
            return f"the {joint.kind} joint {joint.name} is not carried over to peers"
        if joint.friction:
            return f"the dry friction of {joint.name} is not carried over to peers"
        if joint.armature:
            return f"the armature of {joint.name} is not carried over to peers"
    if m.relations:
        return f"the gear relation {m.relations[0].name} is not carried over to peers"
    for shaft in m.shafts:
        if shaft.inertia or shaft.damping or shaft.friction or shaft.stiffness:
            return f"peers have no shafts without coordinates such as {shaft.name}"
    for loop in m.loops:
        assert loop.kind in LOOP_ROWS
        if loop.kind not in LOOPS[peer]:
            return f"the {loop.kind} loop {loop.name} has no counterpart in {peer}"
    if m.loops and integrator in OPEN_ONLY[peer]:
        return f"{peer} closes no loops with {integrator}"
    for law in scene.laws:
        if law.kind != "constant":
            return f"the {law.kind} law on {', '.join(law.targets())} is not carried over to peers, only constant loads"
    return ""
