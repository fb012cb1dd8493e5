"""A Mechanism as MJCF for MuJoCo, and the scene file that shows it in MuJoCo's viewer with light, floor and a camera.

Numbers have 17 significant digits; the text is the same byte for byte every time. qpos of every joint is the coordinate
of the Mechanism: 0 in the reference pose; the physical value is user[0] + qpos. Parts of the file: `write_tree` bodies,
`write_loops` equalities and connector bodies, `write_drives` tendons, actuators, sensors and the keyframe.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

import numpy as np

from mechlab.errors import explained
from mechlab.experiment.scene import MUJOCO_INTEGRATORS, Settings
from mechlab.formats.mjcf import write_drives as drives
from mechlab.formats.mjcf import write_loops as loops
from mechlab.formats.mjcf.write_loops import spread
from mechlab.formats.mjcf.write_tree import MeshFiles, write_tree
from mechlab.formats.xml_text import add, text
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism


def scene_mjcf(m: Mechanism) -> str:
    """MJCF text of scene.xml, which includes NAME.xml from the same folder.

    The floor lies below the mechanism; where gravity does not act along -z, the camera looks from above and the floor
    serves as a drawing board.
    """
    size = spread(TreeKinematics(m))
    low, centre = _extent(m)
    upright = m.gravity[2] < 0.0
    floor = min(0.0, low) - (0.35 if upright else 0.15) * size
    root = ET.Element("mujoco", {"model": f"{m.name} scene"})
    add(root, "include", file=f"{m.name}.xml")
    add(root, "statistic", center=_rounded(centre), extent=float(f"{2.2 * size:.3g}"))
    visual = add(root, "visual")
    azimuth, elevation = (130.0, -20.0) if upright else (90.0, -70.0)
    add(visual, "global", azimuth=azimuth, elevation=elevation, offwidth=1920, offheight=1080)
    add(visual, "headlight", ambient=(0.3, 0.3, 0.3), diffuse=(0.3, 0.3, 0.3), specular=(0.1, 0.1, 0.1))
    add(visual, "rgba", haze=(0.93, 0.95, 0.97, 1.0))
    assets = add(root, "asset")
    sky, far = (0.93, 0.95, 0.97), (0.72, 0.8, 0.88)
    add(assets, "texture", type="skybox", builtin="gradient", rgb1=sky, rgb2=far, width=256, height=1536)
    one, two = (0.86, 0.88, 0.9), (0.82, 0.84, 0.87)
    add(
        assets, "texture", type="2d", name="scene:grid", builtin="checker", rgb1=one, rgb2=two, mark="edge",
        markrgb=(0.75, 0.78, 0.82), width=300, height=300,
    )  # fmt: skip
    repeat = _tiles(size)
    add(assets, "material", name="scene:grid", texture="scene:grid", texuniform="true", texrepeat=(repeat, repeat),
        reflectance=0.05)  # fmt: skip
    world = add(root, "worldbody")
    # nearly upright and near the model: MuJoCo's shadow map is coarse elsewhere
    down = np.array([0.1, 0.15, -1.0])
    add(world, "light", name="scene:sun", pos=_rounded(centre - 6.0 * size * down), dir=down.tolist(),
        type="directional", diffuse=(0.45, 0.45, 0.45))  # fmt: skip
    add(world, "geom", name="scene:floor", type="plane", size=(0.0, 0.0, 0.05), pos=(0.0, 0.0, float(f"{floor:.3g}")),
        material="scene:grid", contype=0, conaffinity=0)  # fmt: skip
    return text(root)


def _extent(m: Mechanism) -> tuple[float, Array]:
    """Lowest z and the middle of bodies, centres of mass and shapes in the reference pose."""
    tree = TreeKinematics(m)
    points = []
    for body in m.bodies:
        r, p = tree.pose(body.name)
        points += [p, p + r @ np.array(body.inertia.com)]
        points += [p + r @ s.placement.translation for s in body.shapes]
    points += [s.placement.translation for s in m.ground_shapes]
    cloud = np.array(points)
    return float(cloud[:, 2].min()), (cloud.min(axis=0) + cloud.max(axis=0)) / 2.0


def _rounded(point: Array) -> tuple[float, ...]:
    return tuple(float(f"{x:.3g}") for x in point)


def _tiles(size: float) -> float:
    """Tiles per metre, a power of ten times 1, 2 or 5: about four along the mechanism."""
    wanted = 2.0 / size
    power = 10.0 ** math.floor(math.log10(wanted))
    return max(k * power for k in (1, 2, 5) if k * power <= wanted)


@explained
def to_mjcf(
    m: Mechanism, settings: Settings | None = None, contacts: bool = False, mesh_files: MeshFiles | None = None,
    bare: bool = False,
) -> str:  # fmt: skip
    """The mechanism as MJCF text.

    `settings` give timestep, integrator and the softness of the constraints (default: the preset accurate). `contacts`:
    let the shapes collide. `mesh_files`: the file of each shape that has one, relative to the MJCF file; shapes without
    are drawn if they are boxes, cylinders or spheres. bare: without shapes, sensors, keyframe and
    sliders that reach its controls, for a model that is only stepped.
    """
    s = settings or Settings()
    files = mesh_files or {}
    plan = loops.connectors(m)
    tree = TreeKinematics(m)
    size = loops.spread(tree)
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
    held = loops.holders(tree, size)
    write_tree(root, m, s, plan, held, loops.loop_ends(m, plan, size, held), meshes, files, size, not bare)
    drives.write_tendons(root, m, s, size)
    loops.write_equalities(root, m, plan, s)
    controls = drives.write_actuators(root, m, size, not bare)
    if not bare:
        drives.write_sensors(root, m)
        drives.write_home(root, m, plan, controls)
    return text(root)


def _option(root: ET.Element, m: Mechanism, s: Settings) -> None:
    """The <option> element. jacobian="dense", because the sparse factorization of MuJoCo 4.0.0 returns wrong accelerations (its issue
    3767). diagexact for curves, whose softness would else not know their slope."""
    integrator = s.integrator if s.integrator in MUJOCO_INTEGRATORS else "RK4"
    option = add(root, "option", timestep=s.timestep, gravity=m.gravity, integrator=integrator, jacobian="dense")
    exact = "enable" if m.curves else None
    add(option, "flag", clampctrl=None if drives.clamps(m) else "disable", autoreset="disable", diagexact=exact)


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
