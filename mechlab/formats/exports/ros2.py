"""A ROS 2 description package of a mechanism: URDF with ros2_control, meshes, launch files, controllers, and what it lacks.

A joint with a drive has a command interface: position for a servo with a stiffness, velocity for one with damping alone, effort
for a motor. All other joints only report their state: in a mechanism with loops they follow, which URDF cannot say.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

from mechlab.experiment.model_file import LeftOut
from mechlab.files import write
from mechlab.formats.exports.graph import Exported, left_out_of
from mechlab.formats.urdf import UrdfMap, mimics, to_urdf, unmimicked, urdf_map
from mechlab.formats.write import write_meshes
from mechlab.formats.xml_text import add, text
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Drive

STATES = ("position", "velocity", "effort")
RATE = 100
"""Update rate of the controllers [Hz]."""


def package_name(m: Mechanism) -> str:
    """The package: lower case letters, digits and single underscores, beginning with a letter (REP 144)."""
    name = re.sub(r"[^a-z0-9]+", "_", m.name.lower()).strip("_") or "mechanism"
    return f"{name if name[0].isalpha() else 'm' + name}_description"


def interface(drive: Drive) -> str:
    """The command of a drive."""
    if drive.winding is not None:
        return "effort"
    return "position" if drive.stiffness else "velocity" if drive.damping else "effort"


def write_ros2(m: Mechanism, folder: Path) -> Exported:
    """Write ros2/PACKAGE: package.xml, CMakeLists.txt, urdf, meshes, config, launch, README.md."""
    package = package_name(m)
    home = folder / "ros2" / package
    home.mkdir(parents=True)
    meshes = {s: f"package://{package}/{f}" for s, f in write_meshes(m, home).items()}
    commands = _commands(m, urdf_map(m))
    lost = ros2_left_out(m)
    written = {
        "package.xml": _package(m, package),
        "CMakeLists.txt": _cmake(package, bool(meshes)),
        f"urdf/{m.name}.urdf": _urdf(m, to_urdf(m, meshes), commands),
        "config/controllers.yaml": _controllers(commands),
        "launch/display.launch.py": _launch(m, package, f"Show {m.name} in RViz, its joints moved by sliders.", SHOWING),
        "launch/control.launch.py": _launch(m, package, f"Run the controllers of {m.name} on mock hardware.", _control_nodes(commands)),
        "README.md": _readme(m, package, commands, lost),
    }
    for name, content in written.items():
        write(home / name, content)
    return Exported({"ros2": Path("ros2", package)}, lost)


def ros2_left_out(m: Mechanism) -> tuple[LeftOut, ...]:
    """What of a mechanism a URDF does not hold."""
    joints = {j.name for j in m.joints}
    return left_out_of(
        m, "URDF",
        ("loop", [x.name for x in m.loops], "a URDF is a tree; see the README.md of the package"),
        ("relation", unmimicked(m), "a <mimic> couples two joints"),
        ("drive", [d.name for d in m.drives if d.on not in joints], "a shaft has no joint in the URDF"),
    )  # fmt: skip


def _commands(m: Mechanism, names: UrdfMap) -> dict[str, str]:
    """URDF joint -> its command interface; drives of joints that follow another by a <mimic> have none."""
    follow = mimics(m)
    driven = {d.on: interface(d) for d in m.drives if d.on in names.joints and d.on not in follow}
    return {names.joints[n][0]: driven[n] for n in names.joints if n in driven}


def _urdf(m: Mechanism, plain: str, commands: dict[str, str]) -> str:
    root = ET.fromstring(plain)
    for extension in root.findall("mujoco"):
        root.remove(extension)
    control = add(root, "ros2_control", name=f"{m.name}_system", type="system")
    add(add(control, "hardware"), "plugin").text = "mock_components/GenericSystem"
    for joint in root.findall("joint"):
        if joint.get("type") == "fixed":
            continue
        element = add(control, "joint", name=str(joint.get("name")))
        if (command := commands.get(str(joint.get("name")))) is not None:
            add(element, "command_interface", name=command)
        for state in STATES:
            add(element, "state_interface", name=state)
    return text(root)


def _package(m: Mechanism, package: str) -> str:
    root = ET.Element("package", {"format": "3"})
    add(root, "name").text = package
    add(root, "version").text = "0.0.1"
    add(root, "description").text = m.summary or f"Description of {m.name}"
    add(root, "maintainer", email="nobody@example.com").text = "unknown"
    add(root, "license").text = "unspecified"
    add(root, "buildtool_depend").text = "ament_cmake"
    for name in (
        "controller_manager", "forward_command_controller", "joint_state_broadcaster", "joint_state_publisher_gui",
        "robot_state_publisher", "ros2_control", "rviz2",
    ):  # fmt: skip
        add(root, "exec_depend").text = name
    add(add(root, "export"), "build_type").text = "ament_cmake"
    return '<?xml version="1.0"?>\n' + text(root)


def _cmake(package: str, meshes: bool) -> str:
    folders = " ".join(["urdf", *(["meshes"] if meshes else []), "config", "launch"])
    return (
        f"cmake_minimum_required(VERSION 3.16)\nproject({package} NONE)\nfind_package(ament_cmake REQUIRED)\n"
        f"install(DIRECTORY {folders} DESTINATION share/${{PROJECT_NAME}})\nament_package()\n"
    )


def _controllers(commands: dict[str, str]) -> str:
    """The controllers: states of all joints, and one forward controller for each kind of command."""
    kinds = _kinds(commands)
    lines = ["controller_manager:", "  ros__parameters:", f"    update_rate: {RATE}"]
    lines += ["    joint_state_broadcaster:", "      type: joint_state_broadcaster/JointStateBroadcaster"]
    for kind in kinds:
        lines += [f"    {kind}_commands:", "      type: forward_command_controller/ForwardCommandController"]
    for kind in kinds:
        joints = ", ".join(n for n, c in commands.items() if c == kind)
        lines += [f"{kind}_commands:", "  ros__parameters:", f"    joints: [{joints}]", f"    interface_name: {kind}"]
    return "\n".join(lines) + "\n"


LAUNCH = '''"""{what}"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    share = Path(get_package_share_directory("{package}"))
    description = {{"robot_description": (share / "urdf" / "{name}.urdf").read_text()}}
    return LaunchDescription(
        [
            Node(package="robot_state_publisher", executable="robot_state_publisher", parameters=[description]),
{nodes}
        ]
    )
'''


SHOWING = [
    'Node(package="joint_state_publisher_gui", executable="joint_state_publisher_gui"),',
    'Node(package="rviz2", executable="rviz2"),',
]


def _control_nodes(commands: dict[str, str]) -> list[str]:
    spawned = ["joint_state_broadcaster", *(f"{kind}_commands" for kind in _kinds(commands))]
    return [
        'Node(package="controller_manager", executable="ros2_control_node",',
        '     parameters=[description, str(share / "config" / "controllers.yaml")]),',
        *(f'Node(package="controller_manager", executable="spawner", arguments=["{n}"]),' for n in spawned),
    ]


def _kinds(commands: dict[str, str]) -> list[str]:
    """The command interfaces in use."""
    return sorted(set(commands.values()))


def _launch(m: Mechanism, package: str, what: str, nodes: list[str]) -> str:
    lines = "\n".join(" " * 12 + line for line in nodes)
    return LAUNCH.format(what=what, package=package, name=m.name, nodes=lines)


def _readme(m: Mechanism, package: str, commands: dict[str, str], lost: tuple[LeftOut, ...]) -> str:
    """What the package is, which joints take commands, and what a URDF cannot hold."""
    lines = [f"# {package}", "", m.summary or f"A description of {m.name}.", ""]
    lines += ["    ros2 launch " + package + f" {f}.launch.py" for f in ("display", "control")]
    lines += ["", "Units are SI. All joints are 0 in the reference pose, in which the mechanism is assembled.", "", "## Joints", ""]
    lines += [f"- `{name}`: command `{command}`, states position, velocity, effort" for name, command in commands.items()]
    passive = [f"`{x}`" for parts in urdf_map(m).joints.values() for x in parts if x not in commands]
    if passive:
        lines.append(f"- {', '.join(passive)}: state only (passive, or following another joint)")
    if m.loops:
        lines += [
            "", "## Closed loops", "",
            f"A URDF is a tree: the loops {', '.join(f'`{x.name}`' for x in m.loops)} are **not** in it. `robot_state_publisher`, "
            "RViz and MoveIt do not close them: joint states must come from something that does (the hardware, a simulator, or "
            "mechlab), and the sliders of `display.launch.py` take the mechanism apart. For motion with loops use the MJCF or "
            "the SDF of the same mechanism.",
        ]  # fmt: skip
    if lost:
        lines += ["", "## Not in the URDF", "", *(f"- {x.sentence}" for x in lost)]
    return "\n".join(lines) + "\n"
