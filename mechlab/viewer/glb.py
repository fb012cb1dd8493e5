"""A Story as one animated GLB file (glTF 2.0), which any glTF viewer plays: parts, edges, traces, motion."""

from __future__ import annotations

import itertools
import json
import os
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.files import write
from mechlab.shapes.feature_edges import SplitMesh, split_at_edges
from mechlab.viewer.pack import geometry_key, quaternions
from mechlab.viewer.story import TRACES, Color, Part, Story

Array = NDArray[np.float64]

FLOAT, UINT16, UINT32 = 5126, 5123, 5125
VERTICES, INDICES = 34962, 34963
LINES, LINE_STRIP, TRIANGLES = 1, 3, 4
# glTF has y up: x -> x, y -> -z, z -> y.
_Z_UP = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]


def write_glb(story: Story, path: str | os.PathLike[str]) -> Path:
    """Writes `story_to_glb` to `path`, whole or not at all, and returns the path. Raises OSError."""
    return write(path, story_to_glb(story))


def story_to_glb(story: Story) -> bytes:
    """The story as the bytes of a GLB file.

    One node turns z up into y up; below it stands one node for each body, with its parts. Colours become linear,
    quaternions keep their sign from frame to frame, times start at 0 and are 32-bit, as glTF requires.
    """
    return _Writer(story).finish()


def linear(srgb: float) -> float:
    """An sRGB value in 0..1 as linear light in 0..1 (IEC 61966-2-1)."""
    return srgb / 12.92 if srgb <= 0.04045 else float(((srgb + 0.055) / 1.055) ** 2.4)


def continuous(rotation: Array) -> Array:
    """Quaternions (n, 4) of rotations (n, 3, 3), each in the hemisphere of the one before it."""
    q = quaternions(rotation)
    flips = np.sign(np.einsum("ij,ij->i", q[1:], q[:-1]))
    q[1:] *= np.cumprod(np.where(flips < 0, -1.0, 1.0))[:, None]
    return q


class _Writer:
    def __init__(self, story: Story) -> None:
        self.story = story
        self.pieces: list[bytes] = []
        self.length = 0
        self.gltf: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "mechlab"},
            "scene": 0,
            "scenes": [{"name": story.title, "nodes": [0]}],
            "nodes": [{"name": "z up", "rotation": _Z_UP, "children": []}],
        }
        self.materials: dict[tuple[Color, bool], int] = {}
        self.geometries: dict[str, tuple[SplitMesh, dict[str, int]]] = {}
        self.meshes: dict[tuple[str, Color], int] = {}
        body_nodes = [self._body(k) for k in range(len(story.bodies))]
        for part in story.parts:
            node = self.gltf["nodes"][body_nodes[story.bodies.index(part.body)]]
            node.setdefault("children", []).append(self._part(part))
        for (name, points), color in zip(story.traces.items(), itertools.cycle(TRACES), strict=False):
            if np.ptp(points, axis=0).max() > 0.0:
                self._child(0, {"name": f"trace {name}", "mesh": self._trace(name, points, color)})
        self._animate(body_nodes)

    def finish(self) -> bytes:
        """The file: a header, the JSON chunk, the binary chunk."""
        binary = b"".join(self.pieces)
        if binary:
            self.gltf["buffers"] = [{"byteLength": len(binary)}]
        if not self.gltf["nodes"][0]["children"]:
            del self.gltf["nodes"][0]["children"]
        text = json.dumps(self.gltf, allow_nan=False, ensure_ascii=False, separators=(",", ":")).encode("utf-8")
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        if binary:
            chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def _add(self, kind: str, item: dict[str, Any]) -> int:
        self.gltf.setdefault(kind, []).append(item)
        return len(self.gltf[kind]) - 1

    def _child(self, parent: int, node: dict[str, Any]) -> int:
        index = self._add("nodes", node)
        self.gltf["nodes"][parent].setdefault("children", []).append(index)
        return index

    def _accessor(self, values: NDArray[Any], component: int, target: int | None = None, limits: bool = False) -> int:
        kinds = {FLOAT: "<f4", UINT16: "<u2", UINT32: "<u4"}
        array = np.ascontiguousarray(values, dtype=kinds[component])
        data = array.tobytes()
        view: dict[str, Any] = {"buffer": 0, "byteOffset": self.length, "byteLength": len(data)}
        if target is not None:
            view["target"] = target
        padded = data + bytes(-len(data) % 4)
        self.pieces.append(padded)
        self.length += len(padded)
        width = 1 if array.ndim == 1 else array.shape[1]
        accessor: dict[str, Any] = {
            "bufferView": self._add("bufferViews", view), "componentType": component, "count": len(array),
            "type": {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[width],
        }  # fmt: skip
        if limits:
            columns = array.reshape(len(array), -1)
            accessor["min"] = [float(x) for x in columns.min(axis=0)]
            accessor["max"] = [float(x) for x in columns.max(axis=0)]
        return self._add("accessors", accessor)

    def _material(self, color: Color, line: bool) -> int:
        if (color, line) not in self.materials:
            share = 0.12 if line else 1.0
            rgb = [share * linear(x) for x in color[:3]]
            item: dict[str, Any] = {
                "pbrMetallicRoughness": {
                    "baseColorFactor": [*rgb, color[3]], "metallicFactor": 0.05, "roughnessFactor": 0.6
                },
                "doubleSided": True,
            }  # fmt: skip
            if color[3] < 0.999:
                item["alphaMode"] = "BLEND"
            self.materials[color, line] = self._add("materials", item)
        return self.materials[color, line]

    def _geometry(self, part: Part) -> tuple[SplitMesh, dict[str, int]]:
        key = geometry_key(part)
        if key not in self.geometries:
            mesh = split_at_edges(part.vertices, part.faces)
            wide = UINT16 if len(mesh.vertices) < 0xFFFF else UINT32
            found = {
                "POSITION": self._accessor(mesh.vertices, FLOAT, VERTICES, limits=True),
                "NORMAL": self._accessor(mesh.normals, FLOAT, VERTICES),
                "faces": self._accessor(mesh.faces.reshape(-1), wide, INDICES),
            }
            if len(mesh.edges):
                found["edges"] = self._accessor(mesh.edges.reshape(-1), wide, INDICES)
            self.geometries[key] = (mesh, found)
        return self.geometries[key]

    def _part(self, part: Part) -> int:
        key = (geometry_key(part), part.color)
        if key not in self.meshes:
            _, found = self._geometry(part)
            attributes = {"POSITION": found["POSITION"], "NORMAL": found["NORMAL"]}
            solid = {"attributes": attributes, "indices": found["faces"], "mode": TRIANGLES}
            primitives: list[dict[str, Any]] = [solid | {"material": self._material(part.color, False)}]
            if "edges" in found:
                primitives.append(
                    {
                        "attributes": {"POSITION": found["POSITION"]},
                        "indices": found["edges"],
                        "mode": LINES,
                        "material": self._material(part.color, True),
                    }
                )
            self.meshes[key] = self._add("meshes", {"name": part.name, "primitives": primitives})
        return self._add("nodes", {"name": part.name, "mesh": self.meshes[key]} | _transform(part.placement))

    def _trace(self, name: str, points: Array, color: Color) -> int:
        attributes = {"POSITION": self._accessor(points, FLOAT, VERTICES, limits=True)}
        line = {"attributes": attributes, "mode": LINE_STRIP, "material": self._material(color, False)}
        return self._add("meshes", {"name": f"trace {name}", "primitives": [line]})

    def _body(self, k: int) -> int:
        return self._child(0, {"name": self.story.bodies[k]} | _transform(self.story.poses[0, k]))

    def _animate(self, nodes: list[int]) -> None:
        story = self.story
        times, first = np.unique((story.t - story.t[0]).astype(np.float32), return_index=True)
        if len(times) < 2:
            return
        channels: list[dict[str, Any]] = []
        samplers: list[dict[str, Any]] = []
        clock: int | None = None
        for k, node in enumerate(nodes):
            poses = story.poses[first, k]
            if np.all(poses == poses[0]):
                continue
            clock = self._accessor(times, FLOAT, limits=True) if clock is None else clock
            for path, values in (("translation", poses[:, :3, 3]), ("rotation", continuous(poses[:, :3, :3]))):
                samplers.append({"input": clock, "output": self._accessor(values, FLOAT), "interpolation": "LINEAR"})
                channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})
        if channels:
            self._add("animations", {"name": story.title, "channels": channels, "samplers": samplers})


def _transform(pose: Array) -> dict[str, Any]:
    """Translation and rotation of a node, left out where they are the identity."""
    out: dict[str, Any] = {}
    if np.any(pose[:3, 3] != 0.0):
        out["translation"] = pose[:3, 3].tolist()
    if np.any(pose[:3, :3] != np.eye(3)):
        out["rotation"] = quaternions(pose[None, :3, :3])[0].tolist()
    return out
