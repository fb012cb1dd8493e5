"""A Mechanism as SDF 1.11 (Gazebo): links and joints, loops as joints whose child has another joint already.

* The root link is `base`, the ground, fixed to the world. Poses of links are those of the reference pose, in the model; a joint
  stands at a pose of its child, its axis in the joint. All joints are 0 in the reference pose.
* Links, joints and frames share one list of names: a joint that is called like a link gets the name NAME_joint, a frame NAME_frame.
* Rotations are quaternions (x, y, z, w), numbers have 17 digits.
* A relation between two joints is a <mimic> of the follower's axis. Others, springs and shafts are left out; motors are plugins.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

from mechlab.errors import explained
from mechlab.experiment.model_file import LeftOut
from mechlab.files import write
from mechlab.formats.exports.graph import Edge, Exported, JointGraph, Link, joint_graph, left_out_of
from mechlab.formats.mjcf.write_tree import safe_tensor
from mechlab.formats.urdf import Follow, mimics, unmimicked
from mechlab.formats.write import write_meshes
from mechlab.formats.xml_text import SIZES, add, numbers, primitive, text
from mechlab.mechanism.geometry import IDENTITY, Placement
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Shape

VERSION = "1.11"
KINDS = {"spherical": "ball", "revolute": "revolute", "prismatic": "prismatic", "fixed": "fixed"}


def write_sdf(m: Mechanism, folder: Path) -> Exported:
    """Write sdf/NAME (model.sdf, model.config, meshes) and sdf/world.sdf, which holds the model and its gravity."""
    model = m.name.strip(".") or "model"  # "." and ".." are no folders to write into
    home = folder / "sdf" / model
    home.mkdir(parents=True)
    meshes = write_meshes(m, home)
    write(home / "model.sdf", to_sdf(m, meshes))
    write(home / "model.config", _config(m))
    write(folder / "sdf" / "world.sdf", _world(m, {s: f"{model}/{f}" for s, f in meshes.items()}))
    files = {"sdf": Path("sdf", model, "model.sdf"), "sdf world": Path("sdf", "world.sdf")}
    return Exported(files, sdf_left_out(m))


@explained
def to_sdf(m: Mechanism, mesh_files: Mapping[Shape, str] | None = None) -> str:
    """The mechanism as SDF text of one model; `mesh_files`: the file of each shape that has one, relative to it. What it cannot
    hold: `sdf_left_out`."""
    root = ET.Element("sdf", {"version": VERSION})
    _model(root, m, mesh_files or {})
    return text(root)


def sdf_left_out(m: Mechanism) -> tuple[LeftOut, ...]:
    """What of a mechanism its SDF does not hold."""
    return left_out_of(
        m, "SDF",
        ("relation", unmimicked(m), "a <mimic> couples two joints"),
        ("distance loop", [x.name for x in m.loops if x.kind == "distance"], "SDF has no such joint"),
        ("drive", [d.name for d in m.drives], "in Gazebo a plugin drives a joint"),
    )  # fmt: skip


def _config(m: Mechanism) -> str:
    root = ET.Element("model")
    add(root, "name").text = m.name
    add(root, "version").text = "1.0"
    add(root, "sdf", version=VERSION).text = "model.sdf"
    add(root, "description").text = m.summary or m.name
    return text(root)


def _world(m: Mechanism, meshes: Mapping[Shape, str]) -> str:
    root = ET.Element("sdf", {"version": VERSION})
    world = add(root, "world", name=f"{m.name}_world")
    add(world, "gravity").text = numbers(m.gravity)
    light = add(world, "light", name="sun", type="directional")
    add(light, "direction").text = "-0.3 0.4 -1"
    add(light, "cast_shadows").text = "true"
    _model(world, m, meshes)
    return text(root)


def _model(root: ET.Element, m: Mechanism, meshes: Mapping[Shape, str]) -> None:
    graph = joint_graph(m)
    model = add(root, "model", name=m.name)
    for link in graph.links:
        _link(model, link, meshes)
    for frame in m.frames:
        element = add(model, "frame", name=graph.fresh(frame.name, "frame"), attached_to=graph.link_of(frame.body).name)
        _pose(element, frame.placement, relative_to=graph.link_of(frame.body).name)
    fixed = add(model, "joint", name=graph.fresh("base_to_world"), type="fixed")
    add(fixed, "parent").text = "world"
    add(fixed, "child").text = graph.link_of(GROUND).name
    follow = mimics(m)
    joints = {e.joint.name: e.name for e in graph.edges if e.joint}
    for edge in graph.edges:
        if edge.kind in KINDS:
            _joint(model, graph, edge, follow, joints)


def _pose(element: ET.Element, placement: Placement, **attributes: object) -> None:
    """A <pose>; nothing for the identity, unless it is relative to something."""
    if placement == IDENTITY and not attributes:
        return
    w, x, y, z = placement.quaternion
    add(element, "pose", rotation_format="quat_xyzw", **attributes).text = numbers((*placement.position, x, y, z, w))


def _link(model: ET.Element, link: Link, meshes: Mapping[Shape, str]) -> None:
    element = add(model, "link", name=link.name)
    _pose(element, link.placement)
    section = add(element, "inertial")
    add(section, "mass").text = numbers([link.inertia.mass])
    _pose(section, Placement(link.inertia.com))
    tensor = add(section, "inertia")
    for key, value in zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), safe_tensor(link.inertia), strict=True):
        add(tensor, key).text = numbers([value])
    for k, item in enumerate(link.shapes):
        _visual(element, item, f"{link.name}_visual_{k}", meshes)


def _visual(link: ET.Element, item: Shape, name: str, meshes: Mapping[Shape, str]) -> None:
    sizes = primitive(item)
    if sizes is None and item not in meshes:
        return
    visual = add(link, "visual", name=name)
    _pose(visual, item.placement)
    geometry = add(visual, "geometry")
    if sizes is None:
        add(add(geometry, "mesh"), "uri").text = meshes[item]
    elif item.kind == "box":
        add(add(geometry, "box"), "size").text = numbers(sizes)
    else:
        solid = add(geometry, item.kind)
        for key, value in zip(SIZES[item.kind], sizes, strict=True):
            add(solid, key).text = numbers([value])
    material = add(visual, "material")
    add(material, "ambient").text = add(material, "diffuse").text = numbers(item.color)


def _joint(
    model: ET.Element, graph: JointGraph, edge: Edge, follow: Mapping[str, Follow], names: Mapping[str, str]
) -> None:
    element = add(model, "joint", name=edge.name, type=KINDS[edge.kind])
    _pose(element, graph.placed(edge.child).inverse() @ edge.placement if edge.closes or not edge.joint else IDENTITY)
    add(element, "parent").text = edge.parent
    add(element, "child").text = edge.child
    if edge.kind not in ("revolute", "prismatic"):
        return
    axis = add(element, "axis")
    add(axis, "xyz").text = numbers(edge.axis)
    joint = edge.joint
    limit = add(axis, "limit")
    if joint is None:
        add(limit, "lower").text, add(limit, "upper").text = "-inf", "inf"
        return
    low, high = joint.range or (-float("inf"), float("inf"))
    for key, value in (("lower", low - joint.zero), ("upper", high - joint.zero)):
        add(limit, key).text = numbers([value]) if abs(value) < float("inf") else "inf" if value > 0 else "-inf"
    dynamics = add(axis, "dynamics")
    for key, value in (("damping", joint.damping), ("friction", joint.friction), ("spring_stiffness", joint.stiffness)):
        if value:
            add(dynamics, key).text = numbers([value])
    if joint.stiffness:
        add(dynamics, "spring_reference").text = numbers([joint.spring_rest - joint.zero])
    if joint.name in follow:
        mimic = add(axis, "mimic", joint=names[follow[joint.name].leader])
        add(mimic, "multiplier").text = numbers([float(follow[joint.name].ratio)])
        add(mimic, "offset").text = add(mimic, "reference").text = "0"
