"""A mechanism as links and single joints, loops among them: what formats with graphs of joints (SDF, USD) are written from.

A body with several joints gets links BODY__JOINT before it, a universal or cylindrical loop a link of its own between its two
joints: such links have next to no mass. Every joint has one frame, in which its axis stands; in the reference pose it is the
same place in both links, so all joints are 0 there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from pathlib import Path

import numpy as np

from mechlab.experiment.model_file import LeftOut
from mechlab.formats.urdf import ROOT
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import IDENTITY, Placement, Vector
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Body, Joint, Loop, Shape, X, Y, Z
from mechlab.mechanism.tree import reference_poses

FILLED = 1e-6
"""Mass and moment of a moving link without any, relative to the smallest of the bodies: readers refuse 0."""


@dataclass(frozen=True)
class Link:
    """A link: `placement` in the world in the reference pose; `body` is the body it is, None for a link in between.

    Each has a mass, the ground too: SDF takes a link without one for 1 kg.
    """

    name: str
    body: str | None
    placement: Placement
    inertia: Inertia
    shapes: tuple[Shape, ...] = ()


@dataclass(frozen=True)
class Edge:
    """A joint between two links, its frame `placement` in the world in the reference pose and its axis in that frame.

    kind: revolute, prismatic, spherical, fixed or distance (its ends are `placement` and `other`, `length` apart). `closes`:
    the child has another joint already. `joint`: the joint of the mechanism; None for one of a loop or a weld.
    """

    name: str
    kind: str
    parent: str
    child: str
    placement: Placement
    axis: Vector = Z
    joint: Joint | None = None
    closes: bool = False
    other: Placement = IDENTITY
    length: float = 0.0


@dataclass
class JointGraph:
    """Links (the ground first), joints (those of the tree first) and the names that they have."""

    links: list[Link] = field(default_factory=list)
    edges: list[Edge] = field(default_factory=list)
    taken: set[str] = field(default_factory=lambda: {"world"})

    def fresh(self, name: str, kind: str = "") -> str:
        """The name, made different from all others by its kind or a "_": links, joints and frames share one list of names."""
        if name in self.taken and kind:
            name = f"{name}_{kind}"
        while name in self.taken:
            name += "_"
        self.taken.add(name)
        return name

    def link_of(self, body: str) -> Link:
        """The link of a body or of the ground."""
        return next(x for x in self.links if x.body == body)

    def placed(self, link: str) -> Placement:
        """The placement of a link in the world."""
        return next(x.placement for x in self.links if x.name == link)


def joint_graph(m: Mechanism) -> JointGraph:
    """The graph of a mechanism: tree, welds and loops."""
    graph = JointGraph()
    poses = {n: Placement.of(r, p) for n, (r, p) in reference_poses(m.bodies).items()}
    filled = _filled(m)
    graph.links.append(Link(graph.fresh(ROOT), GROUND, IDENTITY, filled, m.ground_shapes))
    names = {b.name: graph.fresh(b.name) for b in m.bodies} | {GROUND: ROOT}
    for body in m.bodies:
        _add_body(graph, body, names, poses[body.name], filled)
    for loop in m.loops:
        _add_loop(graph, loop, names, poses, filled)
    return graph


def _filled(m: Mechanism) -> Inertia:
    masses = [b.inertia.mass for b in m.bodies if b.inertia.mass]
    moments = [x for b in m.bodies for x in np.linalg.eigvalsh(b.inertia.matrix()).tolist() if x > 1e-300]
    mass = FILLED * min(masses)
    moment = FILLED * min(moments) if moments else mass * m.length_scale**2
    return Inertia(mass, (0.0, 0.0, 0.0), (moment, moment, moment, 0.0, 0.0, 0.0))


def _add_body(graph: JointGraph, body: Body, names: dict[str, str], pose: Placement, filled: Inertia) -> None:
    parent = names[body.parent]
    inertia = body.inertia if body.inertia.mass else filled
    for k, joint in enumerate(body.joints):
        last = k == len(body.joints) - 1
        child = names[body.name] if last else graph.fresh(f"{body.name}__{joint.name}")
        link = Link(child, body.name, pose, inertia, body.shapes) if last else Link(child, None, pose, filled)
        graph.links.append(link)
        graph.edges.append(Edge(graph.fresh(joint.name, "joint"), joint.kind, parent, child, pose, joint.axis, joint))
        parent = child
    if not body.joints:
        graph.links.append(Link(names[body.name], body.name, pose, inertia, body.shapes))
        graph.edges.append(Edge(graph.fresh(f"{body.name}__fixed"), "fixed", parent, names[body.name], pose))


def _add_loop(
    graph: JointGraph, loop: Loop, names: dict[str, str], poses: dict[str, Placement], filled: Inertia
) -> None:
    a, b = poses[loop.body_a] @ loop.placement_a, poses[loop.body_b] @ loop.placement_b
    parent, child = names[loop.body_a], names[loop.body_b]
    name = graph.fresh(loop.name, "loop")
    if loop.kind in ("revolute", "prismatic", "spherical", "fixed"):
        graph.edges.append(Edge(name, loop.kind, parent, child, b, closes=True))
        return
    if loop.kind == "distance":
        graph.edges.append(Edge(name, "distance", parent, child, a, closes=True, other=b, length=loop.length))
        return
    first, second = {"universal": ("revolute", "revolute"), "cylindrical": ("revolute", "prismatic")}[loop.kind]
    near, far = (X, Y) if loop.kind == "universal" else (Z, Z)
    between = graph.fresh(f"{loop.name}__link")
    graph.links.append(Link(between, None, b, filled))
    graph.edges.append(Edge(graph.fresh(f"{loop.name}__1"), first, parent, between, a, near))
    graph.edges.append(Edge(name, second, between, child, b, far, closes=True))


def left_out_of(m: Mechanism, name: str, *own: tuple[str, Sequence[str], str]) -> tuple[LeftOut, ...]:
    """What no joint of the format `name` can hold: springs between points, shafts, curves, rotor inertias; and what is its own:
    (what, names, why)."""
    found = (
        ("spring", [s.name for s in m.springs], f"{name} has no spring between two points"),
        ("shaft", [s.name for s in m.shafts], f"{name} has no part that turns as a sum of joints"),
        ("curve", [x.name for x in m.curves], f"{name} has no joint that follows a function of another one"),
        ("rotor inertia", [j.name for j in m.joints if j.armature], f"{name} has no inertia of a joint"),
        *own,
    )
    return tuple(LeftOut(what, tuple(names), why) for what, names, why in found if names)


@dataclass(frozen=True)
class Exported:
    """What was written: label -> file, relative to the folder, and what the files do not hold."""

    files: dict[str, Path]
    left_out: tuple[LeftOut, ...] = ()
