"""A Mechanism as MJCF for MuJoCo: our own writer, 17 significant digits, the same byte for byte every time.

qpos of every joint is the coordinate of the Mechanism: 0 in the reference pose; the physical value is user[0] + qpos.
Parts of the file: `mjcf_tree` bodies, `mjcf_loops` equalities and connector bodies, `mjcf_drives` tendons, actuators,
sensors and the keyframe.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from mechlab.experiment.settings import MUJOCO_INTEGRATORS, Settings
from mechlab.formats import mjcf_drives as drives
from mechlab.formats import mjcf_loops as loops
from mechlab.formats.mjcf_tree import MeshFiles, write_tree
from mechlab.formats.xml_text import add, text
from mechlab.mechanism.model import Mechanism


def to_mjcf(
    m: Mechanism, settings: Settings | None = None, contacts: bool = False, mesh_files: MeshFiles | None = None
) -> str:
    """The mechanism as MJCF text.

    `settings` give timestep, integrator and the softness of the constraints (default: the preset accurate). `contacts`:
    let the shapes collide. `mesh_files`: the file of each shape that has one, relative to the MJCF file; shapes without
    are drawn if they are boxes, cylinders or spheres.
    """
    s = settings or Settings()
    files = mesh_files or {}
    plan = loops.connectors(m)
    size = loops.spread(m)
    root = ET.Element("mujoco", {"model": m.name})
    root.append(
        ET.Comment(
            " Written by mechlab. SI units, radians. qpos is 0 in the reference pose; physical value = user + qpos. "
        )
    )
    add(root, "compiler", angle="radian", autolimits="true", fusestatic="false")
    _option(root, m, s)
    add(add(root, "custom"), "text", name="written_by", data="mechlab")
    _defaults(root, contacts)
    meshes = _assets(root, files)
    write_tree(root, m, s, plan, loops.loop_ends(m, plan, size), meshes, files, size)
    drives.write_tendons(root, m, s, size)
    loops.write_equalities(root, m, plan, s)
    controls = drives.write_actuators(root, m, size)
    drives.write_sensors(root, m)
    drives.write_home(root, m, plan, controls)
    return text(root)


def _option(root: ET.Element, m: Mechanism, s: Settings) -> None:
    """jacobian="dense": the sparse factorisation of MuJoCo 4.0.0 returns wrong accelerations (its issue 3767)."""
    integrator = s.integrator if s.integrator in MUJOCO_INTEGRATORS else "RK4"
    option = add(root, "option", timestep=s.timestep, gravity=m.gravity, integrator=integrator, jacobian="dense")
    add(option, "flag", clampctrl="disable", autoreset="disable")


def _defaults(root: ET.Element, contacts: bool) -> None:
    section = add(root, "default")
    bits = None if contacts else 0
    add(add(section, "default", class_="looks"), "geom", contype=bits, conaffinity=bits, group=2, mass=0)
    add(add(section, "default", class_="frame"), "site", group=3, rgba=(0.2, 0.7, 0.3, 1.0))
    add(add(section, "default", class_="end"), "site", group=4, rgba=(0.9, 0.5, 0.1, 1.0))


def _assets(root: ET.Element, files: MeshFiles) -> dict[str, str]:
    """A mesh asset for each file; returns file -> asset name."""
    meshes = {f: f.rsplit("/", 1)[-1].rsplit(".", 1)[0] for f in sorted(set(files.values()))}
    if meshes:
        section = add(root, "asset")
        for file, name in meshes.items():
            # the shell inertia of a mesh is always defined; it is not used
            add(section, "mesh", name=name, file=file, inertia="shell")
    return meshes
