"""The scene of a still picture: parts, floor, light, camera and lines in MuJoCo."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.shapes.feature_edges import split_at_edges
from mechlab.viewer.framing import FIELD_OF_VIEW, Framing, fit_camera
from mechlab.viewer.pack import geometry_key, quaternions
from mechlab.viewer.story import TRACES, Color, Story
from mechlab.viewer.trails import Trail

SUN = np.array([0.55, 0.6, -1.25]) / math.sqrt(0.55**2 + 0.6**2 + 1.25**2)  # direction in which the light travels
_SHADOW_PIXELS, _SMALL = 4096, 800
"""Side of the map of the shadows; half of it is enough for a picture at most _SMALL pixels wide, at a quarter of its memory."""


def compile_scene(
    mujoco: Any, story: Story, frame: int, framing: Framing, size: tuple[int, int], trails: Trails
) -> Any:
    """A compiled model in which nothing moves: the parts where they are at `frame`, the traces, a floor with the grid,
    and light."""
    spec = mujoco.MjSpec()
    _set_looks(spec, framing, size)
    _add_floor(mujoco, spec, framing)
    names: dict[str, str] = {}
    for part in story.parts:
        key = geometry_key(part)
        if key not in names:
            names[key] = f"mesh{len(names)}"
            mesh = split_at_edges(part.vertices, part.faces)
            spec.add_mesh(
                name=names[key],
                uservert=mesh.vertices.reshape(-1),
                usernormal=mesh.normals.reshape(-1),
                userface=mesh.faces.reshape(-1),
                userfacenormal=mesh.faces.reshape(-1),
                inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
            )
        pose = story.poses[frame, story.bodies.index(part.body)] @ part.placement
        x, y, z, w = quaternions(pose[:3, :3])
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=names[key],
            pos=pose[:3, 3],
            quat=[w, x, y, z],
            rgba=part.color,
            contype=0,
            conaffinity=0,
        )
    trails.add(mujoco, spec)
    return spec.compile()


def _set_looks(spec: Any, framing: Framing, size: tuple[int, int]) -> None:
    visual = spec.visual
    visual.global_.offwidth, visual.global_.offheight = size
    visual.global_.fovy = math.degrees(FIELD_OF_VIEW)
    visual.quality.offsamples = 4
    visual.quality.shadowsize = _SHADOW_PIXELS // 2 if max(size) <= _SMALL else _SHADOW_PIXELS
    visual.headlight.ambient = [0.48, 0.48, 0.49]
    visual.headlight.diffuse = [0.1, 0.1, 0.1]
    visual.headlight.specular = [0.0, 0.0, 0.0]
    # Lengths below are multiples of the extent.
    spec.stat.extent = framing.radius
    spec.stat.center = (framing.low + framing.high) / 2.0
    # A far limit this large spreads the depth bias of the shadows, so that the floor does not shade itself.
    visual.map.znear, visual.map.zfar = 0.02, 1000.0
    visual.map.shadowclip, visual.map.shadowscale = 1.3, 0.9


def _add_floor(mujoco: Any, spec: Any, framing: Framing) -> None:
    white = [1.0, 1.0, 1.0]
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        rgb1=white,
        rgb2=white,
        width=64,
        height=384,
    )
    spec.add_texture(
        name="grid",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        rgb1=white,
        rgb2=white,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        markrgb=[0.72, 0.76, 0.82],
        width=512,
        height=512,
    )
    material = spec.add_material(
        name="floor",
        texuniform=True,
        rgba=[0.75, 0.75, 0.75, 1.0],
        texrepeat=[1.0 / framing.step] * 2,
        emission=0.35,
        specular=0.0,
    )
    textures = list(material.textures)
    textures[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = "grid"
    material.textures = textures
    reach = 60.0 * framing.radius
    centre = (framing.low + framing.high) / 2.0
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[reach, reach, framing.step],
        material="floor",
        pos=[0.0, 0.0, framing.floor],
        contype=0,
        conaffinity=0,
    )
    spec.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=centre - 4.0 * framing.radius * SUN,
        dir=SUN,
        castshadow=True,
        diffuse=[0.55] * 3,
        ambient=[0.0] * 3,
        specular=[0.15] * 3,
    )


def place_camera(mujoco: Any, framing: Framing, toward: NDArray[np.float64], aspect: float) -> Any:
    """A free camera in the direction `toward` (3,) that sees everything the mechanism ever reaches."""
    target, distance = fit_camera(framing.points, toward, aspect)
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = target
    camera.distance = distance
    flat = math.hypot(toward[0], toward[1])
    # Straight from above, x points to the right.
    camera.azimuth = math.degrees(math.atan2(-toward[1], -toward[0])) if flat > 1e-9 * abs(toward[2]) else 90.0
    camera.elevation = -math.degrees(math.atan2(toward[2], flat))
    return camera


TRAIL_RADIUS, TRAIL_ERROR = 0.003, 0.0005
"""Radius of the tube along a path, and how far it may leave the path, relative to the radius of the mechanism."""

Line = tuple[NDArray[np.float64], NDArray[np.float64], Color]


class Trails:
    """The traces of a story, which grow: one mesh each in the MuJoCo model, whose vertices are moved."""

    def __init__(self, story: Story, framing: Framing) -> None:
        made = [Trail(p, TRAIL_RADIUS * framing.radius, TRAIL_ERROR * framing.radius) for p in story.traces.values()]
        self._trails = [(trail, color) for trail, color in zip(made, itertools.cycle(TRACES), strict=False) if len(trail.faces)]

    def add(self, mujoco: Any, spec: Any) -> None:
        """Adds the meshes, whole, to the world of a model."""
        for k, (trail, color) in enumerate(self._trails):
            spec.add_mesh(
                name=f"trail{k}",
                uservert=trail.vertices.reshape(-1),
                usernormal=trail.normals.reshape(-1),
                userface=trail.faces.reshape(-1),
                userfacenormal=trail.faces.reshape(-1),
                inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
            )
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"trail{k}", rgba=color, contype=0, conaffinity=0
            )

    def set_looks(self, mujoco: Any, scene: Any, first: int) -> None:
        """Makes the traces, geoms from number `first` on, lines to look at: bright, and without shadows."""
        for index in range(scene.ngeom):
            geom = scene.geoms[index]
            if geom.objtype == mujoco.mjtObj.mjOBJ_GEOM and geom.objid >= first:
                geom.category, geom.emission = mujoco.mjtCatBit.mjCAT_DECOR, 0.5

    def grow(self, mujoco: Any, model: Any, renderer: Any, frame: int) -> None:
        """Shows the traces up to a recorded frame."""
        for k, (trail, _) in enumerate(self._trails):
            mesh = model.mesh(f"trail{k}").id
            first, turn = model.mesh_vertadr[mesh], np.zeros(9)
            mujoco.mju_quat2Mat(turn, model.mesh_quat[mesh])
            # MuJoCo keeps a mesh in its own centre and axes.
            vertices = (trail.grown(frame) - model.mesh_pos[mesh]) @ turn.reshape(3, 3)
            model.mesh_vert[first : first + len(vertices)] = vertices
            mujoco.mjr_uploadMesh(model, renderer, mesh)


class Lines:
    """Lines that are no geometry of the MuJoCo model: the feature edges of the parts.

    most_edges: number of edges to draw, the longest ones (default: all). `most`: upper limit of the lines.
    """

    def __init__(self, story: Story, most_edges: int | None = None) -> None:
        self.story = story
        self._edges: list[tuple[int, NDArray[np.float64], Color]] = []
        for part in story.parts:
            mesh = split_at_edges(part.vertices, part.faces)
            in_body = mesh.vertices @ part.placement[:3, :3].T + part.placement[:3, 3]
            red, green, blue, opacity = part.color
            color = (0.3 * red, 0.3 * green, 0.3 * blue, 0.7 * opacity)
            self._edges.append((story.bodies.index(part.body), in_body[mesh.edges], color))
        if most_edges is not None:
            lengths = np.concatenate(
                [np.linalg.norm(e[:, 1] - e[:, 0], axis=1) for _, e, _ in self._edges] or [np.zeros(0)]
            )
            limit = np.sort(lengths)[-most_edges] if len(lengths) > most_edges else 0.0
            self._edges = [(b, e[np.linalg.norm(e[:, 1] - e[:, 0], axis=1) >= limit], c) for b, e, c in self._edges]
        self.most = sum(len(e) for _, e, _ in self._edges)

    def at(self, frame: int) -> list[Line]:
        """(start, end, colour) of every line at a recorded frame."""
        found: list[Line] = []
        for body, edges, color in self._edges:
            pose = self.story.poses[frame, body]
            ends = edges @ pose[:3, :3].T + pose[:3, 3]
            found += [(a, b, color) for a, b in ends]
        return found


def draw_lines(mujoco: Any, scene: Any, lines: list[Line]) -> None:
    """Adds the lines to a scene that already has its cameras and space for the lines."""
    eye = np.mean([camera.pos for camera in scene.camera], axis=0)
    kind = mujoco.mjtGeom.mjGEOM_LINE
    for start, end, color in lines:
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(
            geom, kind, np.zeros(3), np.zeros(3), np.eye(3).reshape(-1), np.array(color, dtype=np.float32)
        )
        # An edge lies in its surface; a little nearer to the eye it is not hidden by it.
        nearer = 0.002
        mujoco.mjv_connector(geom, kind, 1.0, start + nearer * (eye - start), end + nearer * (eye - end))
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR
        scene.ngeom += 1
