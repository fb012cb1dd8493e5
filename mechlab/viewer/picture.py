"""A still picture of a Story, drawn by MuJoCo's renderer without a window."""

from __future__ import annotations

import importlib
import io
import math
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import EngineMissing, MechlabError
from mechlab.files import write
from mechlab.viewer.framing import THREE_QUARTER, Framing, frame_story
from mechlab.viewer.picture_scene import SUN, Lines, Trails, compile_scene, draw_lines, place_camera
from mechlab.viewer.picture_springs import Springs
from mechlab.viewer.story import Story

SAMPLES = 16
_SUN_X = np.cross(SUN, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(SUN, [0.0, 0.0, 1.0]))
_SUN_Y = np.cross(SUN, _SUN_X)
_SUN_RADIUS = 0.025


def write_png(
    story: Story,
    path: str | os.PathLike[str],
    time: float | None = None,
    size: tuple[int, int] = (1280, 960),
    toward: tuple[float, float, float] | None = None,
    samples: int = SAMPLES,
) -> Path:
    """Writes a picture of the story at the recorded time nearest to `time` [s] (the first one by default);
    returns the path.

    size: width, height [pixels]; toward: direction from the mechanism to the camera, z up (three-quarter view
    by default); samples: pictures to average, more give softer shadows. Raises EngineMissing where MuJoCo or
    its system library is missing, MechlabError for a story without parts.
    """
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(render(story, time, size, toward, samples)).save(buffer, format="png", optimize=True)
    return write(path, buffer.getvalue())


def render(
    story: Story,
    time: float | None = None,
    size: tuple[int, int] = (1280, 960),
    toward: tuple[float, float, float] | None = None,
    samples: int = SAMPLES,
) -> NDArray[np.uint8]:
    """The picture of `write_png` as (height, width, 3) bytes."""
    with Drawing(story, size, toward, story.frame(time)) as drawing:
        return drawing.draw(drawing.first, samples)


class Drawing:
    """A story on MuJoCo's canvas, ready to be drawn frame after frame; a context manager. Raises like `write_png`."""

    def __init__(
        self,
        story: Story,
        size: tuple[int, int],
        toward: tuple[float, float, float] | None = None,
        first: int = 0,
        most_edges: int | None = None,
    ) -> None:
        if not story.parts:
            raise MechlabError(f"story {story.title!r} has no parts, so there is nothing to draw.")
        self.story, self.size, self.first = story, size, first
        self._mujoco = _engine()
        self._framing = frame_story(story)
        direction = np.array(THREE_QUARTER if toward is None else toward, dtype=np.float64)
        self._context = _open_context(*size)
        try:
            mujoco = self._mujoco
            self._trails = Trails(story, self._framing)
            self._model = model = compile_scene(mujoco, story, first, self._framing, size, self._trails)
            data = mujoco.MjData(model)
            mujoco.mj_forward(model, data)
            self._lines = Lines(story, most_edges)
            self._springs = Springs(story, self._framing)
            most = len(story.parts) + self._lines.most + self._springs.most + 10
            self._scene = mujoco.MjvScene(model, maxgeom=most)
            camera = place_camera(mujoco, self._framing, direction, size[0] / size[1])
            everything = mujoco.mjtCatBit.mjCAT_ALL
            mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, everything, self._scene)
            self._solids = self._scene.ngeom
            self._trails.set_looks(mujoco, self._scene, 1 + len(story.parts))  # geom 0 is the floor
            self._movers = _find_movers(mujoco, self._scene, story, first)
            self._renderer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._renderer)
        except BaseException:
            self._context.free()
            raise

    def draw(
        self, frame: int, samples: int = SAMPLES, upto: int | None = None, sun: float = _SUN_RADIUS
    ) -> NDArray[np.uint8]:
        """The picture (height, width, 3) at a recorded frame; traces up to frame `upto` (default: all).
        `sun`: radius of the sun, which softens the shadows, at distance 1."""
        for index, part, offset in self._movers:
            pose = self.story.poses[frame, part] @ offset
            geom = self._scene.geoms[index]
            geom.pos[:] = pose[:3, 3]
            geom.mat[:] = pose[:3, :3]
        self._scene.ngeom = self._solids
        draw_lines(self._mujoco, self._scene, self._lines.at(frame))
        self._springs.draw(self._mujoco, self._scene, frame)
        last = len(self.story.t) - 1
        self._trails.grow(self._mujoco, self._model, self._renderer, last if upto is None else upto)
        return _render_softly(self._mujoco, self._scene, self._renderer, self._framing, self.size, samples, sun)

    def __enter__(self) -> Drawing:
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.free()
        self._context.free()


def _find_movers(mujoco: Any, scene: Any, story: Story, first: int) -> list[tuple[int, int, NDArray[np.float64]]]:
    """(geom of the scene, body, geom to body) for every part. MuJoCo moves a mesh to its own centre and axes, so where a
    geom stands in its body is read from the scene."""
    movers = []
    for index in range(scene.ngeom):
        geom = scene.geoms[index]
        if geom.objtype != mujoco.mjtObj.mjOBJ_GEOM or not 1 <= geom.objid <= len(story.parts):
            continue
        body = story.bodies.index(story.parts[geom.objid - 1].body)  # geom 0 is the floor
        seen = np.eye(4)
        seen[:3, :3], seen[:3, 3] = np.asarray(geom.mat).reshape(3, 3), geom.pos
        movers.append((index, body, np.linalg.inv(story.poses[first, body]) @ seen))
    return movers


def _render_softly(
    mujoco: Any, scene: Any, renderer: Any, framing: Framing, size: tuple[int, int], samples: int, sun_radius: float
) -> NDArray[np.uint8]:
    """The mean of several pictures, each with the sun at another point of a small disc: shadows get a soft
    border."""
    width, height = size
    viewport = mujoco.MjrRect(0, 0, width, height)
    pixels = np.zeros((height, width, 3), dtype=np.uint8)
    total = np.zeros((height, width, 3), dtype=np.float32)
    centre = (framing.low + framing.high) / 2.0
    pixel = [2.0 * (eye.frustum_top - eye.frustum_bottom) / 2.0 / height for eye in scene.camera]
    start = [(eye.frustum_center, eye.frustum_bottom, eye.frustum_top) for eye in scene.camera]
    sun = next(light for light in scene.lights if light.castshadow)
    for k in range(samples):
        # Points spread evenly over a disc (a spiral of golden angles), for the sun; and over a pixel, against
        # jagged borders.
        radius, angle = sun_radius * math.sqrt((k + 0.5) / samples), k * math.pi * (3.0 - math.sqrt(5.0))
        direction = SUN + radius * (math.cos(angle) * _SUN_X + math.sin(angle) * _SUN_Y)
        sun.dir[:] = direction / np.linalg.norm(direction)
        sun.pos[:] = centre - 4.0 * framing.radius * sun.dir
        across, down = (k + 0.5) / samples - 0.5, (k * 0.381966) % 1.0 - 0.5
        for eye, (middle, bottom, top), unit in zip(scene.camera, start, pixel, strict=True):
            eye.frustum_center = middle + across * unit
            eye.frustum_bottom, eye.frustum_top = bottom + down * unit, top + down * unit
        mujoco.mjr_render(viewport, scene, renderer)
        mujoco.mjr_readPixels(pixels, None, viewport, renderer)
        total += pixels
    for eye, (middle, bottom, top) in zip(scene.camera, start, strict=True):  # the next picture starts from here
        eye.frustum_center, eye.frustum_bottom, eye.frustum_top = middle, bottom, top
    return np.flipud(np.rint(total / samples).astype(np.uint8))


def _engine() -> Any:
    try:
        return importlib.import_module("mujoco")
    except ImportError as error:
        raise EngineMissing("Pictures are drawn by MuJoCo, which is not installed. Try: pip install mujoco") from error


def _open_context(width: int, height: int) -> Any:
    """A current OpenGL context without a window: the one that MUJOCO_GL asks for, else the first that works
    here."""
    fallback = {"linux": ("egl", "osmesa"), "darwin": ("cgl",)}.get(sys.platform, ("glfw",))
    asked = os.environ.get("MUJOCO_GL", "").lower().strip()
    reasons = []
    for name in (asked,) if asked in ("egl", "osmesa", "glfw", "cgl") else fallback:
        try:
            context = importlib.import_module(f"mujoco.{name}").GLContext(width, height)
            context.make_current()
            return context
        except Exception as error:  # the libraries raise many kinds, from AttributeError to their own
            reasons.append(f"{name}: {error}")
    raise EngineMissing(
        "No way to draw without a window was found. On Debian or Ubuntu, install one of the system packages "
        f"libegl1 (with libgl1-mesa-dri) or libosmesa6. What was tried: {'; '.join(reasons)}."
    )
