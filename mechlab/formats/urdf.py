"""The tree of a Mechanism as URDF, for tools that read it.

Loops, gears between three joints, shafts and gravity are in the JSON that is written with it.

* The root link is `base`, the ground; where a part has that name, it is `world`, or another free name.
  Joint values are coordinates: 0 in the reference pose.
* URDF has one joint a link: further joints of a body get links BODY__JOINT before it.
* A spherical joint becomes three revolutes NAME_x, NAME_y, NAME_z about the moved axes, R = Rx Ry Rz (singular at
  NAME_y = 90 deg); their rates are not the angular velocity. A floating body becomes three prismatics and those.
* Moving links without mass get MASSLESS: MuJoCo refuses them otherwise. It is too small to change a result.
* Joints without limits are `revolute` with wide limits: Pinocchio gives `continuous` two coordinates.
* A relation between two joints becomes a <mimic>, always of an independent joint, so that no chain of mimics can
  contradict itself. MuJoCo and yourdfpy apply it; Pinocchio does only on request (buildModelFromUrdf(..., mimic=True)).
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import field
from fractions import Fraction

from mechlab.errors import MechlabError, explained
from mechlab.formats.mjcf.write_tree import safe_tensor
from mechlab.formats.xml_text import SIZES, add, primitive, text
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import IDENTITY, Placement, Vector
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Body, Joint, Shape


@dataclass(frozen=True)
class Follow:
    """follower = ratio x leader."""

    leader: str
    ratio: Fraction


def mimics(m: Mechanism) -> dict[str, Follow]:
    """Follower joint -> its leader and ratio, for the relations between exactly two joints.

    Chains are resolved to one leader: a driven joint if there is one, else the first in the order of coordinates.
    """
    order = {j.name: k for k, j in enumerate(m.joints)}
    driven = {d.on for d in m.drives}
    groups: dict[str, dict[str, Fraction]] = {}
    root: dict[str, str] = {}
    for relation in m.relations:
        if len(relation.coefficients) != 2:
            continue
        (a, ca), (b, cb) = relation.coefficients
        for name in (a, b):
            root.setdefault(name, name)
            groups.setdefault(root[name], {name: Fraction(1)})
        if root[a] == root[b]:
            continue
        # b in units of the root of a, from ca a + cb b = 0
        scale = -ca / cb * groups[root[a]][a] / groups[root[b]][b]
        moved = {name: ratio * scale for name, ratio in groups.pop(root[b]).items()}
        groups[root[a]] |= moved
        for name in moved:
            root[name] = root[a]
    out: dict[str, Follow] = {}
    for members in groups.values():
        leader = min(members, key=lambda n: (n not in driven, order[n]))
        for name, ratio in members.items():
            if name != leader:
                out[name] = Follow(leader, ratio / members[leader])
    return {n: out[n] for n in sorted(out, key=order.__getitem__)}


def unmimicked(m: Mechanism) -> tuple[str, ...]:
    """Names of the relations that no <mimic> can say: those of one joint, or of more than two."""
    return tuple(r.name for r in m.relations if len(r.coefficients) != 2)


ROOT = "base"
MASSLESS = 2e-14
"""Mass [kg] and moment [kg m2] written for a moving link that has none."""
FILLED: tuple[float, ...] = (MASSLESS, MASSLESS, MASSLESS, 0.0, 0.0, 0.0)
WIDE = 1e9
"""Limit written for a joint range, effort or rate that has none."""


@dataclass
class UrdfMap:
    """Names of the mechanism -> names in the URDF: links of bodies and of frames, joints."""

    bodies: dict[str, str] = field(default_factory=dict)
    frames: dict[str, str] = field(default_factory=dict)
    joints: dict[str, list[str]] = field(default_factory=dict)

    def to_dict(self, m: Mechanism) -> dict[str, object]:
        """The map as JSON values for the sidecar."""
        follow = {n: {"joint": f.leader, "multiplier": str(f.ratio)} for n, f in mimics(m).items()}
        return {
            "root": self.bodies.get(GROUND, ROOT), "bodies": self.bodies, "frames": self.frames, "joints": self.joints, "mimic": follow,
            "not_in_urdf": [x.name for x in m.loops] + [x.name for x in m.shafts] + [x.name for x in m.springs]
            + [x.name for x in m.curves] + list(unmimicked(m)),
            "gravity": list(m.gravity),
        }  # fmt: skip


def urdf_map(m: Mechanism) -> UrdfMap:
    """The map from the names of a mechanism to those of its URDF."""
    names = {b.name for b in m.bodies} | {f.name for f in m.frames}
    root = next(n for n in (ROOT, "world", *(f"world{'_' * k}" for k in range(1, len(names) + 2))) if n not in names)
    out = UrdfMap({GROUND: root})
    taken = {root}

    def fresh(name: str) -> str:
        while name in taken:
            name += "_"
        taken.add(name)
        return name

    for body in m.bodies:
        out.bodies[body.name] = fresh(body.name)
    for frame in m.frames:
        out.frames[frame.name] = fresh(frame.name)
    taken = set()
    for joint in m.joints:
        parts = [joint.name] if joint.nv == 1 else [f"{joint.name}_{a}" for a in "xyz"]
        out.joints[joint.name] = [fresh(p) for p in parts]
    return out


@explained
def to_urdf(m: Mechanism, mesh_files: Mapping[Shape, str] | None = None) -> str:
    """The tree of the mechanism as URDF text; `mesh_files`: the file of each shape that has one, relative to it."""
    files = mesh_files or {}
    names = urdf_map(m)
    root = ET.Element("robot", {"name": m.name})
    compiler = {"discardvisual": "false", "strippath": "false", "fusestatic": "false", "balanceinertia": "false"}
    add(add(root, "mujoco"), "compiler", **compiler)
    base = add(root, "link", name=names.bodies[GROUND])
    for item in m.ground_shapes:
        _visual(base, item, files)
    follow = mimics(m)
    for body in m.bodies:
        _body(root, m, body, names, follow, files)
    for frame in m.frames:
        add(root, "link", name=names.frames[frame.name])
        joint = add(root, "joint", name=f"{names.frames[frame.name]}__fixed", type="fixed")
        _between(joint, names.bodies[frame.body], names.frames[frame.name], frame.placement)
    return text(root)


def _body(
    root: ET.Element, m: Mechanism, body: Body, names: UrdfMap, follow: Mapping[str, Follow], files: Mapping[Shape, str]
) -> None:
    link = names.bodies[body.name]
    steps = [step for joint in body.joints for step in _steps(joint, names.joints[joint.name])]
    parent, placement = names.bodies[body.parent], body.placement
    for k, (name, kind, axis, joint) in enumerate(steps):
        last = k == len(steps) - 1
        child = link if last else f"{link}__{name}"
        if child in names.bodies.values() and not last:
            raise MechlabError(f"{m.name}: the URDF needs a link {child!r}, but a body has that name; rename the body.")
        if not last:
            _inertial(add(root, "link", name=child), Inertia(), True)
        else:
            _link(root, child, body, True, files)
        element = add(root, "joint", name=name, type=kind)
        _between(element, parent, child, placement)
        add(element, "axis", xyz=axis)
        _limits(element, m, joint)
        if name in follow:
            add(element, "mimic", joint=follow[name].leader, multiplier=float(follow[name].ratio), offset=0)
        parent, placement = child, IDENTITY
    if not steps:
        _link(root, link, body, False, files)
        element = add(root, "joint", name=f"{link}__fixed", type="fixed")
        _between(element, parent, link, placement)


def _steps(joint: Joint, names: list[str]) -> list[tuple[str, str, Vector, Joint]]:
    if joint.nv == 1:
        return [(names[0], joint.kind, joint.axis, joint)]
    axes: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return [(n, "revolute", a, joint) for n, a in zip(names, axes, strict=True)]


def _limits(element: ET.Element, m: Mechanism, joint: Joint) -> None:
    free = joint.range is None or joint.nv > 1
    low, high = (-WIDE, WIDE) if free else (joint.range[0] - joint.zero, joint.range[1] - joint.zero)  # type: ignore[index]
    efforts = [d.limit for d in m.drives if d.on == joint.name and d.limit is not None]
    add(element, "limit", lower=low, upper=high, effort=max(efforts, default=WIDE), velocity=WIDE)
    if joint.damping or joint.friction:
        add(element, "dynamics", damping=joint.damping, friction=joint.friction)


def _link(root: ET.Element, name: str, body: Body, moves: bool, files: Mapping[Shape, str]) -> None:
    link = add(root, "link", name=name)
    _inertial(link, body.inertia, moves)
    for item in body.shapes:
        _visual(link, item, files)


def _inertial(link: ET.Element, inertia: Inertia, moves: bool) -> None:
    if inertia.mass == 0.0 and not moves:
        return
    t = FILLED if inertia.mass == 0.0 else safe_tensor(inertia)
    section = add(link, "inertial")
    add(section, "origin", xyz=inertia.com, rpy=(0.0, 0.0, 0.0))
    add(section, "mass", value=inertia.mass or MASSLESS)
    add(section, "inertia", ixx=t[0], ixy=t[3], ixz=t[4], iyy=t[1], iyz=t[5], izz=t[2])


def _visual(link: ET.Element, item: Shape, files: Mapping[Shape, str]) -> None:
    sizes = primitive(item)
    tag, attributes = item.kind, dict[str, object]()
    if item in files:
        tag, attributes = "mesh", {"filename": files[item]}
    elif sizes is None:
        return
    elif tag == "box":
        attributes = {"size": sizes}
    else:
        attributes = dict(zip(SIZES[tag], sizes, strict=True))
    visual = add(link, "visual")
    _origin(visual, item.placement)
    add(add(visual, "geometry"), tag, **attributes)
    name = "color_" + "_".join(f"{round(255 * min(max(c, 0.0), 1.0)):02x}" for c in item.color)
    add(add(visual, "material", name=name), "color", rgba=item.color)


def _between(joint: ET.Element, parent: str, child: str, placement: Placement) -> None:
    _origin(joint, placement)
    add(joint, "parent", link=parent)
    add(joint, "child", link=child)


def _origin(element: ET.Element, placement: Placement) -> None:
    add(element, "origin", xyz=placement.position, rpy=roll_pitch_yaw(placement))


def roll_pitch_yaw(placement: Placement) -> Vector:
    """Angles with R = Rz(yaw) Ry(pitch) Rx(roll), to rounding also near pitch = +-90 deg (Bernardes & Viollet 2022)."""
    w, x, y, z = placement.quaternion
    half_sum, half_difference = math.atan2(z + x, w - y), math.atan2(z - x, w + y)
    pitch = 2.0 * math.atan2(math.hypot(w + y, z - x), math.hypot(w - y, z + x)) - math.pi / 2.0
    return (_wrapped(half_sum - half_difference), pitch, _wrapped(half_sum + half_difference))


def _wrapped(angle: float) -> float:
    """The angle in (-pi, pi]; half a turn is +pi, whatever its last bit says, so that files of all machines are alike."""
    turned = math.remainder(angle, 2.0 * math.pi)
    return turned + 2.0 * math.pi if turned < -math.pi + 1e-12 else turned
