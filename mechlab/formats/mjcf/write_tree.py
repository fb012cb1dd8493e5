"""The tree of bodies in MJCF: joints, inertias, visual geoms, sites."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

import numpy as np

from mechlab.experiment.scene import Settings
from mechlab.formats.mjcf import write_loops as names
from mechlab.formats.mjcf.write_loops import ConnectorBody, own_share
from mechlab.formats.xml_text import add, pose, primitive
from mechlab.mechanism.geometry import IDENTITY, Placement, matrix_to_quaternion
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import FLOOR, GROUND, Joint, Shape

JOINT_TYPES = {"revolute": "hinge", "prismatic": "slide", "spherical": "ball"}
LEAST = 2e-15
"""Mass [kg] and moment [kg m2] of a moving body that has none: just above what MuJoCo refuses."""
SMALLEST_MOMENT = 2e-14
"""Smallest principal moment [kg m2] of a full tensor: just above what MuJoCo's diagonalization refuses."""
NUDGE = 4e-14
"""Relative isotropic addition to a tensor on the edge of what is possible (rods, plates), so that rounding in MuJoCo's
diagonalization cannot break the triangle inequality."""

MeshFiles = Mapping[Shape, str]


def write_tree(
    root: ET.Element,
    m: Mechanism,
    s: Settings,
    plan: tuple[ConnectorBody, ...],
    held: Mapping[str, tuple[str, Placement]],
    sites: Mapping[str, list[tuple[str, Placement]]],
    meshes: Mapping[str, str],
    mesh_files: MeshFiles,
    size: float,
    drawn: bool = True,
) -> None:
    """The <worldbody> with one fixed body `base` around everything. `meshes`: file -> name of its mesh asset; drawn: with the shapes."""
    world = add(root, "worldbody")
    elements = {GROUND: add(world, "body", name=names.BASE)}
    for item in m.ground_shapes if drawn else ():
        _geom(elements[GROUND], item, meshes, mesh_files)
    for body in m.bodies:
        stages = joint_stages(body.joints)
        element, placement = elements[body.parent], body.placement
        for k, joints in enumerate(stages):
            last = k == len(stages) - 1
            name = names.body_name(body.name) if last else names.stage_name(body.name, k + 1)
            element = add(element, "body", name=name, **pose(placement))
            placement = IDENTITY
            for joint in joints:
                _joint(element, joint, s)
            if not last:
                _inertial(element, Inertia(), True)
        elements[body.name] = element
        _inertial(element, own_share(m, plan, body.name), bool(body.joints))
        for item in body.shapes if drawn else ():
            _geom(element, item, meshes, mesh_files)
    for shaft in m.shafts:
        for item in shaft.shapes if drawn else ():
            _geom(elements[shaft.body], item, meshes, mesh_files, shaft.placement)
    for c in plan:
        element = add(elements[c.host], "body", name=names.connector_name(c.loop.name), **pose(c.placement))
        for k, (kind, axis) in enumerate(c.joints):
            add(element, "joint", name=names.connector_joint(c.loop.name, k + 1), type=kind, axis=axis)
        _inertial(element, c.inertia, True)
        elements[names.connector_name(c.loop.name)] = element
    for loop, (carrier, at) in held.items():
        element = elements[names.holder_name(loop)] = add(elements[carrier], "body", name=names.holder_name(loop))
        add(element, "inertial", pos=at.position, mass=0.0, diaginertia=(0.0, 0.0, 0.0))
    by_mjcf_name = {e.get("name"): e for e in elements.values()}
    for frame in m.frames:
        element = elements[frame.body]
        add(element, "site", name=frame.name, class_="frame", size=(0.02 * size,), **pose(frame.placement))
    for body_name, items in sites.items():
        for name, placement in items:
            add(by_mjcf_name[body_name], "site", name=name, class_="end", size=(0.02 * size,), **pose(placement))


def joint_stages(joints: tuple[Joint, ...]) -> list[tuple[Joint, ...]]:
    """The joints of one body in groups that MuJoCo allows in one body: no turn after a ball joint, at most 6 rates.

    All but the last group go to bodies of their own, which have a mass of LEAST.
    """
    out: list[list[Joint]] = [[]]
    for joint in joints:
        rates = sum(j.nv for j in out[-1]) + joint.nv
        balls = any(j.kind == "spherical" for j in out[-1])
        if rates > 6 or (balls and joint.kind != "prismatic"):
            out.append([])
        out[-1].append(joint)
    return [tuple(group) for group in out]


def _joint(element: ET.Element, joint: Joint, s: Settings) -> None:
    """A joint whose qpos is the coordinate of the Mechanism; the physical value is user[0] + qpos."""
    attributes: dict[str, object] = {"name": joint.name, "type": JOINT_TYPES[joint.kind]}
    if joint.kind != "spherical":
        attributes["axis"] = joint.axis
    if joint.kind == "spherical" and joint.range is not None:
        attributes |= {"range": joint.range, "solreflimit": s.solref, "solimplimit": s.solimp}
    elif joint.range is not None:
        attributes["range"] = (joint.range[0] - joint.zero, joint.range[1] - joint.zero)
        attributes |= {"solreflimit": s.solref, "solimplimit": s.solimp}
    for key, value in (("damping", joint.damping), ("armature", joint.armature), ("stiffness", joint.stiffness)):
        if value:
            attributes[key] = value
    if joint.stiffness and joint.kind != "spherical" and joint.spring_rest != joint.zero:
        attributes["springref"] = joint.spring_rest - joint.zero
    if joint.friction:
        attributes |= {"frictionloss": joint.friction, "solreffriction": s.solref, "solimpfriction": s.solimp}
    if joint.zero:
        attributes["user"] = joint.zero
    add(element, "joint", **attributes)


def _inertial(element: ET.Element, inertia: Inertia, moves: bool) -> None:
    """The <inertial> of a body; fullinertia has the order of `Inertia.tensor`: xx yy zz xy xz yz."""
    if inertia.mass == 0.0 and not moves:
        return
    if not moves and not any(inertia.tensor):  # a welded point mass: nothing of it is too small for MuJoCo
        add(element, "inertial", pos=inertia.com, mass=inertia.mass, diaginertia=(0.0, 0.0, 0.0))
    elif inertia.mass < LEAST:
        add(element, "inertial", pos=inertia.com, mass=LEAST, diaginertia=(LEAST, LEAST, LEAST))
    else:
        tensor = safe_tensor(inertia)
        axes = nearly_body_axes(tensor)
        if axes is None:
            add(element, "inertial", pos=inertia.com, mass=inertia.mass, fullinertia=tensor)
        else:
            add(element, "inertial", pos=inertia.com, quat=axes[0], mass=inertia.mass, diaginertia=axes[1])


def nearly_body_axes(tensor: Sequence[float]) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """Quaternion and principal moments, in another order than the body axes, of a tensor whose principal axes are nearly those
    of the body; None for other tensors.

    MuJoCo takes principal axes within about 1e-6 rad of the body axes for the body axes and drops the products of inertia: the
    mass matrix is off by up to 1e-9 of its size. In another order the axes are far from those of the body, and kept.
    """
    xx, yy, zz, xy, xz, yz = tensor
    products, largest = max(abs(xy), abs(xz), abs(yz)), max(xx, yy, zz)
    if not 1e-13 * largest < products < 1e-4 * largest:
        return None
    moments, axes = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    order = [int(k) for k in np.argmax(np.abs(axes), axis=1)]
    if sorted(order) != [0, 1, 2]:
        return None
    near = axes[:, order] * np.sign(np.diag(axes[:, order]))
    if np.max(np.abs(near - np.eye(3))) > 1e-4:
        return None
    turned = matrix_to_quaternion(near[:, [1, 2, 0]])
    sizes = moments[order]
    return turned, (float(sizes[1]), float(sizes[2]), float(sizes[0]))


def safe_tensor(inertia: Inertia) -> tuple[float, ...]:
    """The tensor (xx, yy, zz, xy, xz, yz), lifted by SMALLEST_MOMENT and NUDGE where MuJoCo would refuse it."""
    xx, yy, zz, xy, xz, yz = inertia.tensor
    a, b, c = np.linalg.eigvalsh(inertia.matrix())
    nudge = NUDGE * (xx + yy + zz)
    lift = nudge if a + b < c * (1.0 + NUDGE) or a < nudge else 0.0
    if a < SMALLEST_MOMENT + nudge:
        lift += SMALLEST_MOMENT
    return (xx + lift, yy + lift, zz + lift, xy, xz, yz)


def _geom(
    element: ET.Element, item: Shape, meshes: Mapping[str, str], mesh_files: MeshFiles, inside: Placement | None = None
) -> None:
    placement = item.placement if inside is None else inside @ item.placement
    sizes = primitive(item)
    attributes: dict[str, object]
    if item in mesh_files:
        attributes = {"type": "mesh", "mesh": meshes[mesh_files[item]]}
    elif item.kind == FLOOR:
        attributes = {"type": "plane", "size": (item.parameters.get("x", 0.0) / 2.0, item.parameters.get("y", 0.0) / 2.0, 0.1)}
    elif sizes is None:
        return
    else:
        half = sizes if item.kind == "sphere" else tuple(x / 2.0 for x in sizes)
        attributes = {"type": item.kind, "size": (sizes[0], half[1]) if item.kind == "cylinder" else half}
    add(element, "geom", class_="looks", **attributes, **pose(placement), rgba=item.color)
