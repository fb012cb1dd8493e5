"""A parsed URDF text: its links and joints, the tree that its joints span, the joints that close loops in it, the names.

A link that two joints end in (the way SDF writes a loop) hangs on the first of them that is reached from the root, in the
order of the file; the other one closes a loop.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET

from mechlab.errors import MechlabError, unknown
from mechlab.formats.mjcf.source import Names, fail
from mechlab.formats.soundness import sound
from mechlab.formats.urdf_meshes import Surfaces
from mechlab.formats.xml_text import floats
from mechlab.mechanism.geometry import IDENTITY, Placement
from mechlab.mechanism.naming import colliding_frame
from mechlab.mechanism.parts import GROUND, MAX_BODIES, MAX_SHAPES
from mechlab.mechanism.tree import too_many_bodies, too_many_shapes
from mechlab.tables import listed

KINDS = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
MACRO = re.compile(
    r"<xacro:|<(?:link|joint|origin|mass|inertia|axis|limit|dynamics|mimic|parent|child|box|sphere|cylinder)\b[^<>]*=\s*[\"'][^\"'<>]*\$[({]"
)
"""A xacro element, or an expression ${...} in what describes the mechanics."""
DUMMY = 1e-6
"""Share of the whole mass below which the mass of a fixed link without shapes is a filler: exporters write 1e-9 kg."""


class UrdfText:
    """A parsed URDF text.

    `above`: link -> the joint that it hangs on; `closing`: the joints that close a loop; `ground`: the root link;
    `bodies`, `joint_names`: the names in the file -> those in the Mechanism; `bare`: the links that become frames;
    `surfaces`, `unread`: the meshes that were read from the files beside it, and why others were not (`urdf_meshes`).
    Raises MechlabError for what spans no tree.
    """

    def __init__(self, content: str) -> None:
        refuse_xacro(content)
        self.root = sound(content, "robot", "URDF file")
        self.links = _named(self.root, "link")
        self.joints = _named(self.root, "joint")
        if not self.links:
            raise MechlabError("this URDF has no links: <robot> needs a <link> and a <joint> for each part that moves.")
        if sum(j.get("type") != "fixed" for j in self.joints.values()) > MAX_BODIES:
            raise too_many_bodies(self.root.get("name", "robot"))
        visuals = sum(len(link.findall("visual")) for link in self.links.values())
        if visuals > MAX_SHAPES:
            raise too_many_shapes(self.root.get("name", "robot"), visuals)
        self.parent = {name: self._end(joint, "parent") for name, joint in self.joints.items()}
        self.child = {name: self._end(joint, "child") for name, joint in self.joints.items()}
        for name, joint in self.joints.items():
            if self.parent[name] == self.child[name]:
                raise fail(joint, f"its parent and its child are the same link {self.child[name]!r}.")
        self.ground = self._root_link()
        self.above, self.closing = self._span()
        self.mass = sum(mass_of(link) for link in self.links.values())
        self.children = {self.parent[j.get("name", "")] for j in self.above.values()}
        self.notes: list[str] = []
        self.surfaces: Surfaces = {}
        self.unread: dict[str, str] = {}
        self._rename()

    # -- the tree ----------------------------------------------------------------------------------------------------

    def _end(self, joint: ET.Element, tag: str) -> str:
        element = joint.find(tag)
        name = None if element is None else element.get("link")
        if name is None or name not in self.links:
            raise unknown(f"joint {joint.get('name')!r}: {tag} link", name, self.links)
        return name

    def _root_link(self) -> str:
        ends = set(self.child.values())
        roots = [name for name in self.links if name not in ends]
        if not roots:
            raise MechlabError(
                "a URDF has exactly one root link; in this one each link hangs on another, in a cycle. Take away the joint "
                "that ends in the link that stands still, or hang a link on a new root by a fixed joint."
            )
        if len(roots) > 1:
            raise MechlabError(
                f"a URDF has exactly one root link; this one has {len(roots)}: {listed(roots, 6)}. Hang all but one of them on "
                "another link by a joint (type fixed, if it does not move), or put each robot into a file of its own."
            )
        return roots[0]

    def _span(self) -> tuple[dict[str, ET.Element], list[ET.Element]]:
        above: dict[str, ET.Element] = {}
        reached = {self.ground}
        waiting = list(self.joints)
        grown = True
        while grown:
            grown, rest = False, []
            for name in waiting:
                if self.parent[name] in reached and self.child[name] not in reached:
                    above[self.child[name]] = self.joints[name]
                    reached.add(self.child[name])
                    grown = True
                else:
                    rest.append(name)
            waiting = rest
        lost = [name for name in self.links if name not in reached]
        if lost:
            raise MechlabError(
                f"the links {listed(lost, 6)} form a cycle that does not hang on the root link {self.ground!r}: one of their "
                "joints must have a parent that does."
            )
        return above, [self.joints[name] for name in waiting]

    # -- names -------------------------------------------------------------------------------------------------------

    def _rename(self) -> None:
        """Names that a Mechanism may have; the changed ones are noted."""
        links, joints = Names("link"), Names("joint")
        links.add(GROUND)
        self.bodies = {self.ground: GROUND}
        self.joint_names = {name: joints.add(name) for name in self.joints}
        frames = [name for name in self.links if self._is_bare(name)]
        for name in self.links:
            if name == self.ground:
                continue
            given = links.add(name)
            while name in frames and colliding_frame(given, self.joint_names.values()):
                given = links.add(f"{given}_frame")
            self.bodies[name] = given
        for what, names in (("link", self.bodies), ("joint", self.joint_names)):
            changed = [f"{old!r} is {new!r}" for old, new in names.items() if old != new and old != self.ground]
            if changed:
                self.notes.append(f"renamed: {what} {listed(changed, 6)} here, because names must be unique and plain")
        self.bare = tuple(frames)
        heavy = [name for name in frames if mass_of(self.links[name])]
        if heavy:
            mass = sum(mass_of(self.links[name]) for name in heavy)
            self.notes.append(f"links that only mark a frame lose their mass, {mass:.2g} kg in all: {listed(heavy, 6)}")

    def _is_bare(self, name: str) -> bool:
        """True for a fixed link that is nothing but a frame: without children, shapes and, next to the whole, mass."""
        joint = self.above.get(name)
        if joint is None or joint.get("type") != "fixed" or name in self.children:
            return False
        return {e.tag for e in self.links[name]} <= {"inertial"} and mass_of(self.links[name]) <= DUMMY * self.mass

    def place(self, name: str, what: str) -> tuple[str, Placement]:
        """Body and placement in it of a link, or of the frame of a joint; raises MechlabError that names `what`."""
        link = name if name in self.links else self.child.get(name)
        if link is None or (name not in self.links and self.joints[name] in self.closing):
            raise unknown(f"{what}: link or joint", name, [*self.links, *self.joints])
        placement = IDENTITY
        if link in self.bare:
            joint = self.above[link]
            placement, link = origin_of(joint), self.parent[joint.get("name", "")]
        return self.bodies[link], placement


def refuse_xacro(content: str) -> None:
    """Raise MechlabError for xacro text, with the command that makes a URDF of it. A URDF that only names the xacro name space,
    as expanded files do, passes."""
    if MACRO.search(re.sub(r"<!--.*?-->", "", content, flags=re.DOTALL)):
        raise MechlabError(
            "this is xacro text, a URDF with macros that are not expanded yet. Expand it, in ROS: "
            "xacro robot.urdf.xacro > robot.urdf  (outside of ROS: pip install xacro, the same command)."
        )


def _named(root: ET.Element, tag: str) -> dict[str, ET.Element]:
    out: dict[str, ET.Element] = {}
    for element in root.findall(tag):
        name = element.get("name")
        if not name:
            raise fail(element, f"every {tag} needs a name of its own.")
        if name in out:
            raise fail(element, f"there are two {tag}s of this name; every {tag} needs a name of its own.")
        out[name] = element
    return out


def mass_of(link: ET.Element) -> float:
    """The mass [kg] that a link states; 0 without one."""
    mass = link.find("inertial/mass")
    return 0.0 if mass is None else number_of(mass, "value", 0.0)


def number_of(element: ET.Element, key: str, default: float) -> float:
    """The number of an attribute, or the default where it is absent."""
    values = floats(element, key, 1)
    return default if values is None else values[0]


def origin_of(element: ET.Element) -> Placement:
    """The placement in the <origin> child of an element; the identity without one."""
    origin = element.find("origin")
    return IDENTITY if origin is None else placement_of(origin)


def placement_of(origin: ET.Element) -> Placement:
    """The placement in the attributes xyz and rpy of an element."""
    x, y, z = floats(origin, "xyz", 3) or (0.0, 0.0, 0.0)
    roll, pitch, yaw = floats(origin, "rpy", 3) or (0.0, 0.0, 0.0)
    return Placement((x, y, z), _quaternion(roll / 2.0, pitch / 2.0, yaw / 2.0))


def _quaternion(r: float, p: float, y: float) -> tuple[float, float, float, float]:
    """(w, x, y, z) of Rz Ry Rx, from half angles."""
    cr, sr, cp, sp, cy, sy = math.cos(r), math.sin(r), math.cos(p), math.sin(p), math.cos(y), math.sin(y)
    w, x = cy * cp * cr + sy * sp * sr, cy * cp * sr - sy * sp * cr
    return (w, x, cy * sp * cr + sy * cp * sr, sy * cp * cr - cy * sp * sr)
