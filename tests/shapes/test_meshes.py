"""What can be done to a mesh: gather, shade, draw its edges, write it; and triangulating outlines with holes."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechlab import shapes
from mechlab.errors import MechlabError
from mechlab.shapes.polygon import around_circles, circle, signed_area, triangulate


def area_of(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(points[faces], 1, 0)
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


@given(st.integers(3, 40), st.integers(0, 7), st.integers(3, 24), st.integers(0, 2**32 - 1))
def test_triangles_cover_a_star_with_holes(corners: int, holes: int, hole_corners: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = 2.0 * math.pi * np.arange(corners) / corners
    outer = np.column_stack([np.cos(turn), np.sin(turn)]) * rng.uniform(2.5, 4.0, corners)[:, None]
    inside = [
        circle(0.1, hole_corners, (0.6 * math.cos(t), 0.6 * math.sin(t)))
        for t in 2.0 * math.pi * np.arange(holes) / max(holes, 1)
    ]
    loops = [outer, *inside]
    starts = np.cumsum([0] + [len(p) for p in loops])
    index = [np.arange(a, b) for a, b in zip(starts, starts[1:], strict=False)]
    points = np.concatenate(loops)
    faces = triangulate(points, index[0], index[1:])
    areas = area_of(points, faces)
    assert len(faces) == len(points) - 2 + 2 * holes  # Euler
    assert (areas > 0.0).all()
    assert areas.sum() == pytest.approx(signed_area(outer) - sum(map(signed_area, inside)), rel=1e-12)


def test_a_hole_outside_its_outline_is_refused() -> None:
    points = np.concatenate([circle(1.0, 12), circle(0.5, 8, (0.9, 0.0))])
    with pytest.raises(MechlabError, match="make the holes smaller"):
        triangulate(points, np.arange(12), [np.arange(12, 20)])


def test_belt_around_circles_touches_exactly() -> None:
    belt = around_circles([(0.0, 0.0), (5.0, 0.0)], [1.0, 2.0], 96)
    beta = math.asin((2.0 - 1.0) / 5.0)
    exact = 2.0 * 5.0 * math.cos(beta) * 1.5 + 1.0**2 * (math.pi / 2 - beta) + 2.0**2 * (math.pi / 2 + beta)
    assert signed_area(belt) == pytest.approx(exact, rel=2e-3)
    tangents = [np.linalg.norm(q - p) for p, q in zip(belt, np.roll(belt, -1, axis=0), strict=True)]
    assert sorted(tangents)[-2:] == pytest.approx([5.0 * math.cos(beta)] * 2, rel=1e-12)


def split(mesh: shapes.Mesh, angle: float = math.radians(30.0)) -> shapes.SplitMesh:
    return shapes.split_faces(mesh.faces.astype(np.int64), mesh.corners, mesh.normals, angle)


def edges(mesh: shapes.Mesh, angle: float = math.radians(30.0)) -> np.ndarray:
    """(k, 2, 3) end points of the feature edges."""
    found = split(mesh, angle)
    return found.vertices[found.edges]


def test_edges_of_a_box_and_of_smooth_parts() -> None:
    box = shapes.mesh("box", {"x": 1.0, "y": 2.0, "z": 3.0})
    lines = edges(box)
    assert lines.shape == (12, 2, 3)
    assert np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum() == pytest.approx(4 * (1 + 2 + 3))
    assert len(edges(shapes.mesh("sphere", {"radius": 1.0}))) == 0
    assert len(edges(shapes.mesh("cylinder", {"radius": 1.0, "length": 1.0}))) == 2 * 48
    assert len(edges(box, math.radians(91.0))) == 0


def test_split_keeps_flat_faces_flat() -> None:
    gear = shapes.mesh("spur_gear", {"teeth": 18, "module": 0.004, "width": 0.02, "bore": 0.008})
    found = split(gear)
    assert np.array_equal(found.vertices[found.faces], gear.corners)
    assert np.allclose(np.linalg.norm(found.normals, axis=1), 1.0)
    lid = np.abs(gear.normals[:, 2]) > 0.999
    assert np.allclose(found.normals[found.faces[lid]], gear.normals[lid][:, None])
    agree = np.einsum("ijk,ik->ij", found.normals[found.faces], gear.normals)
    assert agree.min() > math.cos(math.radians(30.0))
    assert len(split(shapes.mesh("box", {"x": 1.0, "y": 1.0, "z": 1.0})).vertices) == 24
    ball = split(shapes.mesh("sphere", {"radius": 1.0}))
    assert np.allclose(ball.normals, ball.vertices, atol=0.02)


def test_merge_and_bounds() -> None:
    box = shapes.mesh("box", {"x": 1.0, "y": 1.0, "z": 1.0})
    there = np.eye(4)
    there[:3, 3] = (5.0, 0.0, 0.0)
    both = shapes.merge([box, (box, there)])
    assert shapes.volume(both) == pytest.approx(2.0)
    assert shapes.is_watertight(both)
    assert np.allclose(shapes.bounds(both), [[-0.5, -0.5, -0.5], [5.5, 0.5, 0.5]])
    assert len(shapes.merge([]).vertices) == 0
    with pytest.raises(MechlabError, match=r"\(4, 4\), got \(3, 3\)"):
        shapes.merge([(box, np.eye(3))])
    with pytest.raises(MechlabError, match="no vertices"):
        shapes.bounds(shapes.merge([]))


def test_files_are_the_same_bytes_and_their_readers_agree(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    gear = shapes.mesh("bevel_gear", {"teeth": 16, "module": 0.003, "pitch_angle": 0.5, "width": 0.015})
    shapes.write_obj(gear, tmp_path / "gear.obj")
    assert (tmp_path / "gear.obj").read_text(encoding="ascii") == shapes.obj_text(gear)
    rebuilt = shapes.KINDS["bevel_gear"].build(
        **shapes.KINDS["bevel_gear"].sizes({"width": 0.015, "pitch_angle": 0.5, "module": 0.003, "teeth": 16})
    )
    assert rebuilt is not gear
    assert shapes.obj_text(rebuilt) == shapes.obj_text(gear)
    loaded = trimesh.load(tmp_path / "gear.obj", force="mesh")
    assert len(loaded.faces) == len(gear.faces)
    assert loaded.volume == pytest.approx(shapes.volume(gear), rel=1e-5)
    loaded.merge_vertices(merge_norm=True)
    assert loaded.is_watertight


@pytest.mark.parametrize("factor", [1.0, 1e-5, 3e4])
def test_an_obj_holds_the_mesh_to_its_grid(tmp_path: Path, factor: float) -> None:
    """Places to half a unit of the grid, all triangles, volume and area; quadrangles are flat, so either diagonal will do."""
    trimesh = pytest.importorskip("trimesh")
    size = {"teeth": 30, "module": 0.002 * factor, "width": 0.01 * factor}
    ring = shapes.mesh("internal_gear", size)
    text = shapes.obj_text(ring)
    lines = [line.split() for line in text.splitlines()]
    places = np.array([[float(x) for x in words] for kind, *words in lines if kind == "v"])
    faces = [[int(corner.split("//")[0]) - 1 for corner in words] for kind, *words in lines if kind == "f"]
    assert np.abs(places - ring.vertices).max() <= 0.51 * 2e-5 * np.ptp(ring.vertices, axis=0).max()
    assert sum(len(f) - 2 for f in faces) == len(ring.faces)
    fours = [f for f in faces if len(f) == 4]
    assert len(fours) > 0.35 * len(ring.faces)  # bands and teeth are all quadrangles
    for a, b, c, d in ring.vertices[np.array(fours)]:
        over, across = np.cross(b - a, c - a), np.cross(c - a, d - a)
        assert min(np.linalg.norm(over), np.linalg.norm(across)) > 0.0
        assert over @ across == pytest.approx(np.linalg.norm(over) * np.linalg.norm(across), rel=1e-7)
    shapes.write_obj(ring, tmp_path / "ring.obj")
    loaded = trimesh.load(tmp_path / "ring.obj", force="mesh")
    assert loaded.volume == pytest.approx(shapes.volume(ring), rel=1e-4)
    sides = np.diff(ring.corners, axis=1)
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()
    assert loaded.area == pytest.approx(area, rel=1e-4)


def test_a_thin_rod_keeps_its_section() -> None:
    """1 m long, 1 mm thick: the grid follows the smallest extent too."""
    rod = shapes.mesh("cylinder", {"radius": 0.0005, "length": 1.0})
    lines = shapes.obj_text(rod).splitlines()
    places = np.array([[float(x) for x in line.split()[1:]] for line in lines if line[:2] == "v "])
    radii = np.linalg.norm(places[:, :2], axis=1)
    assert np.abs(radii[radii > 1e-6] - 0.0005).max() < 1e-6


def test_mujoco_reads_the_files(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    for kind, size in (("fork", {"span": 0.08, "pin": 0.008}), ("rod", {"length": 0.1, "radius": 0.005})):
        shapes.write_obj(shapes.mesh(kind, size), tmp_path / f"{kind}.obj")
        spec = mujoco.MjSpec()
        spec.add_mesh(name=kind, file=str(tmp_path / f"{kind}.obj"))
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=kind)
        assert spec.compile().mesh_facenum[0] == len(shapes.mesh(kind, size).faces)


@pytest.mark.parametrize(
    ("vertices", "faces", "words"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], r"shape \(n, 3\), got shape \(3, 2\)"),
        (np.full((3, 3), np.nan), [[0, 1, 2]], "finite"),
        (np.zeros((3, 3)), [[0, 1, 3]], "outside 0..2"),
        (np.zeros((3, 3)), [[0, 1]], r"\(m, 3\)"),
    ],
)
def test_a_bad_mesh_is_refused(vertices: np.ndarray, faces: list[list[int]], words: str) -> None:
    with pytest.raises(MechlabError, match=words):
        shapes.Mesh(vertices, np.array(faces))
