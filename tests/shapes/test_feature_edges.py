"""Splitting at creases: the right corners stay together, the normals are those of the surface."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mechlab import shapes
from mechlab.shapes import split_at_edges


def prism(sides: int, radius: float = 0.1, height: float = 0.3) -> tuple[np.ndarray, np.ndarray]:
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    low, high = np.c_[ring, np.zeros(sides)], np.c_[ring, np.full(sides, height)]
    faces = []
    for k in range(sides):
        n = (k + 1) % sides
        faces += [
            [k, n, sides + n],
            [k, sides + n, sides + k],
            [2 * sides, n, k],
            [2 * sides + 1, sides + k, sides + n],
        ]
    return np.concatenate([low, high, [[0.0, 0.0, 0.0], [0.0, 0.0, height]]]), np.array(faces)


def test_a_box_has_three_normals_at_every_corner_and_twelve_edges() -> None:
    box = shapes.mesh("box", {"x": 0.1, "y": 0.2, "z": 0.3})
    mesh = split_at_edges(box.vertices, box.faces)
    assert mesh.vertices.shape == (24, 3)
    assert mesh.edges.shape == (12, 2)
    np.testing.assert_allclose(np.abs(mesh.normals).max(axis=1), 1.0)
    assert np.all(np.einsum("ij,ij->i", mesh.normals, mesh.vertices) > 0.0)


def test_a_round_side_is_smooth_and_only_its_rims_are_drawn() -> None:
    mesh = split_at_edges(*prism(48))
    side = np.abs(mesh.normals[:, 2]) < 0.5
    radial = mesh.vertices[side, :2] / np.linalg.norm(mesh.vertices[side, :2], axis=1)[:, None]
    np.testing.assert_allclose(mesh.normals[side, :2], radial, atol=1e-6)
    np.testing.assert_allclose(mesh.normals[~side, :2], 0.0, atol=1e-6)
    assert len(mesh.edges) == 2 * 48
    assert len(mesh.vertices) == 4 * 48 + 2


def test_the_angle_decides_what_is_a_crease() -> None:
    vertices, faces = prism(8)
    assert len(split_at_edges(vertices, faces).edges) == 24
    assert len(split_at_edges(vertices, faces, math.radians(50.0)).edges) == 16


def test_order_of_vertices_and_faces_does_not_matter() -> None:
    rng = np.random.default_rng(3)
    vertices, faces = prism(12)
    order = rng.permutation(len(vertices))
    shuffled = np.argsort(order)[faces][rng.permutation(len(faces))]
    one, two = split_at_edges(vertices, faces), split_at_edges(vertices[order], shuffled)
    for a, b in ((one.vertices, two.vertices), (one.normals, two.normals)):
        np.testing.assert_allclose(np.sort(a.round(6), axis=0), np.sort(b.round(6), axis=0), atol=1e-6)
    assert len(one.edges) == len(two.edges)


def test_loose_triangles_are_welded_and_empty_ones_dropped() -> None:
    vertices, faces = prism(24)
    loose = vertices[faces].reshape(-1, 3)
    numbered = np.concatenate([np.arange(len(loose)).reshape(-1, 3), [[0, 0, 1]]])
    assert len(split_at_edges(loose, numbered).edges) == 2 * 24


def test_every_edge_index_names_an_end_of_that_edge() -> None:
    mesh = split_at_edges(*prism(24))
    ends = mesh.vertices[mesh.edges]
    np.testing.assert_allclose(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1), 0.2 * math.sin(math.pi / 24), rtol=1e-5)


@pytest.mark.parametrize("count", [1, 2])
def test_an_open_sheet_shows_its_border(count: int) -> None:
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    assert len(split_at_edges(square, np.array([[0, 1, 2], [0, 2, 3]])[:count]).edges) == (3, 4)[count - 1]
