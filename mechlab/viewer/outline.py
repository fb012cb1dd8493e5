"""True outlines of flat parts that are hollow or slotted, such as ring gears: the boundary of the plane face that is turned to the eye."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from mechlab.viewer.story import Array, Part

MOST = 72
"""Most points of a loop; of more, those are left out first that move it least."""
FULL = 0.75
"""A face that covers so much of its convex outline is drawn as this."""
FLAT = 0.999
"""Cosine of the angle between the normals of a face and of the part."""
EDGE_ON, FACE_ON, THICK = 0.3, 0.95, 0.25
"""Cosine below which a face is seen too much from its edge, and that from which a part may be thicker than this share of its width."""
TOOTHED, ROUND = 0.3, 48
"""Radii that differ by less than this share are teeth on a circle, which is drawn with so many points."""


def hollow_outline(part: Part, eye: Array) -> list[Array]:
    """Loops (n, 3) around and within the largest plane face of a part towards the eye (3,), in its own axes; empty where there is no such
    face, and where its convex outline shows it as well."""
    points, faces = _merged(part)
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = 0.5 * np.linalg.norm(normals, axis=1)
    unit = normals / np.maximum(2.0 * areas, 1e-300)[:, None]
    axis = np.eye(3)[np.argmax(((np.abs(unit) > FLAT) * areas[:, None]).sum(axis=0))]
    axis = axis * (1.0 if axis @ eye > 0.0 else -1.0)
    size = float(np.ptp(points, axis=0).max())
    cap = (unit @ axis > FLAT) & (areas > 0.0)
    thick = float(np.ptp(points @ axis)) > THICK * size
    if abs(axis @ eye) < (FACE_ON if thick else EDGE_ON) or not np.any(cap):
        return []
    heights = corners.mean(axis=1) @ axis
    levels = np.rint(heights / (1e-4 * size)).astype(int)
    best = max(set(levels[cap].tolist()), key=lambda k: float(areas[cap & (levels == k)].sum()))
    cap &= levels == best
    flat = np.delete(points, int(np.argmax(np.abs(axis))), axis=1)
    try:
        hull = ConvexHull(flat).volume
    except QhullError:
        return []
    if areas[cap].sum() > FULL * hull:
        return []
    return [_thinned(points[loop]) for loop in _loops(faces[cap])]


def _merged(part: Part) -> tuple[Array, NDArray[np.int64]]:
    """Points and faces with one point at each place: meshes have a point for each normal."""
    size = max(float(np.ptp(part.vertices, axis=0).max()), 1e-300)
    _, first, index = np.unique(np.rint(part.vertices / (1e-6 * size)), axis=0, return_index=True, return_inverse=True)
    return part.vertices[first], np.asarray(index.reshape(-1)[part.faces], dtype=np.int64)


def _loops(faces: NDArray[np.int64]) -> list[list[int]]:
    """The boundary of faces as closed loops of points; empty where it is none."""
    edges = {(int(a), int(b)) for f in faces for a, b in ((f[0], f[1]), (f[1], f[2]), (f[2], f[0]))}
    after = dict[int, int]()
    for a, b in edges:
        if (b, a) not in edges:
            if a in after:
                return []
            after[a] = b
    out = list[list[int]]()
    while after:
        loop = [next(iter(after))]
        while loop[-1] in after:
            loop.append(after.pop(loop[-1]))
        if loop[0] != loop[-1]:
            return []
        out.append(loop[:-1])
    return out


def _thinned(loop: Array) -> Array:
    """At most MOST of the points: a circle for a row of teeth, else less those with the smallest triangles to their neighbours."""
    if len(loop) <= MOST:
        return loop
    middle = 0.5 * (loop.min(axis=0) + loop.max(axis=0))
    radii = np.linalg.norm(loop - middle, axis=1)
    if np.ptp(radii) < TOOTHED * radii.max():
        flat = np.eye(3)[np.argsort(-np.ptp(loop, axis=0), kind="stable")[:2]]
        turn = np.linspace(0.0, 2.0 * np.pi, ROUND + 1)[:-1]
        return np.asarray(middle + radii.mean() * (np.cos(turn)[:, None] * flat[0] + np.sin(turn)[:, None] * flat[1]))
    kept = list(range(len(loop)))
    while len(kept) > MOST:
        p = loop[kept]
        size = np.linalg.norm(np.cross(p - np.roll(p, 1, axis=0), np.roll(p, -1, axis=0) - p), axis=1)
        kept.pop(int(np.argmin(size)))
    return np.asarray(loop[kept])
