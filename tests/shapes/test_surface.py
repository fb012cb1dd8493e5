"""Surfaces of files as texts and back, made coarser, and read from mesh files; against numbers known beforehand."""

import base64
import math
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mechlab.shapes as shapes
from mechlab.errors import MechlabError
from mechlab.mechanism.model import Mechanism
from mechlab.shapes.mesh_file import found_file, surface_of_file
from mechlab.shapes.surface import MOST_FACES, coarser, surface_mesh, surface_text

TETRAHEDRON = (
    np.array([[0, 0, 0], [0.5, 0, 0], [0, 0.25, 0], [0, 0, 0.125]]),
    [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
)


def ball(rings: int, radius: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """A sphere as a grid of rings x 2 rings quads."""
    across, along = np.meshgrid(np.linspace(0, 2 * math.pi, 2 * rings + 1), np.linspace(0, math.pi, rings + 1))
    points = radius * np.stack([np.cos(across) * np.sin(along), np.sin(across) * np.sin(along), np.cos(along)], axis=-1)
    k = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    a, b, c, d = (x.reshape(-1) for x in (k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]))
    return points.reshape(-1, 3), np.concatenate([np.stack([a, d, c], 1), np.stack([a, c, b], 1)])


def test_a_surface_comes_back_from_its_text() -> None:
    """Its numbers are representable in single precision, so nothing may change."""
    made = surface_mesh(surface_text(*TETRAHEDRON))
    assert made.vertices.tolist() == TETRAHEDRON[0].tolist()
    assert shapes.volume(made) == pytest.approx(0.5 * 0.25 * 0.125 / 6.0, abs=0.0)
    assert shapes.mesh("mesh", {}, surface_text(*TETRAHEDRON)) is made


def test_vertices_that_no_face_uses_are_left_out() -> None:
    vertices, faces = TETRAHEDRON
    made = surface_mesh(surface_text(np.vstack([[[9.0, 9.0, 9.0]], vertices]), np.array(faces) + 1))
    assert made.vertices.tolist() == vertices.tolist()


@pytest.mark.parametrize("text", ["", "no base64!", "AAAA", surface_text(*TETRAHEDRON)[:-8]])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(MechlabError, match="mesh: its data"):
        surface_mesh(text)


def test_a_bomb_is_not_unpacked() -> None:
    with pytest.raises(MechlabError, match="mesh: its data"):
        surface_mesh(base64.b64encode(zlib.compress(bytes(10**8))).decode())


def test_fine_surfaces_become_coarser_and_keep_their_form() -> None:
    """A sphere of 125 000 faces: at most the allowed number stays; a cell is 1/70 of the diameter, so that no vertex moves by more
    than sqrt(3) cells and the volume changes by less than 3 / 70 of three radii."""
    vertices, faces = ball(250)
    made = surface_mesh(surface_text(vertices, faces))
    assert MOST_FACES / 3 < len(made.faces) <= MOST_FACES
    radius = np.linalg.norm(made.vertices, axis=1)
    assert radius.min() > 0.97 and radius.max() < 1.0 + 1e-6
    assert shapes.volume(made) == pytest.approx(4.0 / 3.0 * math.pi, rel=0.05)
    small = shapes.Mesh(*TETRAHEDRON)
    assert coarser(small, 4) is small


def test_mesh_files_are_read_with_their_scale(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    for suffix in ("stl", "obj", "ply"):
        trimesh.Trimesh(*TETRAHEDRON, process=False).export(tmp_path / f"part.{suffix}")
        made = surface_mesh(surface_of_file(tmp_path / f"part.{suffix}", (2.0, 2.0, 2.0)))
        assert shapes.volume(made) == pytest.approx(8 * 0.5 * 0.25 * 0.125 / 6.0, rel=1e-6)
        mirrored = surface_mesh(surface_of_file(tmp_path / f"part.{suffix}", (-1.0, 1.0, 1.0)))
        assert shapes.volume(mirrored) > 0.0  # its faces still look outwards
    (tmp_path / "broken.stl").write_bytes(b"solid nothing")
    (tmp_path / "pointer.stl").write_bytes(b"version https://git-lfs.github.com/spec/v1\nsize 3\n")
    for name, words in (
        ("pointer.stl", "Git LFS"),
        ("broken.stl", "broken.stl"),
        ("none.stl", "there is no file"),
        ("part.step", "meshes are read from"),
    ):
        with pytest.raises(MechlabError, match=words):
            surface_of_file(tmp_path / name)


def test_mesh_files_are_found_where_a_model_file_names_them(tmp_path: Path) -> None:
    folder = tmp_path / "robot" / "urdf"
    folder.mkdir(parents=True)
    (tmp_path / "robot" / "meshes").mkdir()
    file = tmp_path / "robot" / "meshes" / "arm.stl"
    file.write_bytes(b"")
    for name in (
        "../meshes/arm.stl",
        "package://robot/meshes/arm.stl",
        "package:///robot/meshes/arm.stl",
        f"file://{file}",
    ):
        found = found_file(name, folder)
        assert found is not None and found.samefile(file)
    assert found_file("package://other/meshes/leg.stl", folder) is None
    assert found_file("arm.stl", folder) is None


def test_a_mechanism_with_a_surface_is_written_and_read_again(tmp_path: Path) -> None:
    import mechlab as ml
    from mechlab.formats import from_json, to_json
    from mechlab.mechanism.parts import Shape

    b = ml.Builder("one")
    b.bar("arm", ml.revolute("turn"), 0.2)
    made = b.build()
    arm = made.bodies[0]
    data = surface_text(*TETRAHEDRON)
    whole: Mechanism = replace(made, bodies=(replace(arm, shapes=(Shape("mesh", data=data),)),))
    again = from_json(to_json(whole))
    assert again == whole and hash(again) == hash(whole)
    assert '"data"' not in to_json(made)
    ml.load(whole).save(tmp_path)
    trimesh = pytest.importorskip("trimesh")
    assert trimesh.load_mesh(tmp_path / "meshes" / "mesh_arm.obj").volume == pytest.approx(
        0.5 * 0.25 * 0.125 / 6.0, rel=1e-6
    )
