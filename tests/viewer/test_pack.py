"""What the page reads is what the story said."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from mechlab.viewer import Part, Story, from_poses
from mechlab.viewer.pack import ByteBlock, pack


def read(block: bytes, reference: dict[str, Any]) -> np.ndarray:
    values = np.frombuffer(block, "<" + reference["kind"], reference["count"], reference["at"])
    return np.cumsum(values, dtype=values.dtype) if reference.get("steps") else values


def test_poses_come_back(story: Story) -> None:
    from scipy.spatial.transform import Rotation

    document, block = pack(story)
    for k, motion in enumerate(document["motion"]):
        position = read(block, motion["position"]).reshape(-1, 3)
        rotation = Rotation.from_quat(read(block, motion["quaternion"]).reshape(-1, 4)).as_matrix()
        np.testing.assert_array_equal(np.broadcast_to(position, (201, 3)), story.poses[:, k, :3, 3])
        np.testing.assert_allclose(np.broadcast_to(rotation, (201, 3, 3)), story.poses[:, k, :3, :3], atol=2e-7)
    assert [motion["position"]["count"] for motion in document["motion"]] == [3, 603, 603]


def test_the_document_holds_plain_values_only(story: Story) -> None:
    document, _ = pack(story)
    assert json.loads(json.dumps(document, allow_nan=False)) == document


def test_differences_of_integers_add_up_to_them() -> None:
    block, values = ByteBlock(), np.random.default_rng(3).integers(0, 0xFFFF, 1000)
    found = [(kind, block.add(values, kind, steps=True)) for kind in ("u2", "u4")]
    for kind, reference in found:
        assert reference["steps"] is True and reference["kind"] == kind
        np.testing.assert_array_equal(read(block.bytes(), reference), values)


def test_equal_parts_share_their_geometry(story: Story) -> None:
    document, _ = pack(story)
    assert [part["geometry"] for part in document["parts"]] == [0, 1, 2, 2]
    assert len(document["geometries"]) == 3


def test_every_array_starts_on_eight_bytes() -> None:
    block = ByteBlock()
    references = [block.add(np.arange(n), kind) for n, kind in ((3, "u2"), (5, "f4"), (2, "f8"), (1, "i2"))]
    assert all(reference["at"] % 8 == 0 for reference in references)
    for reference in references:
        np.testing.assert_array_equal(read(block.bytes(), reference), np.arange(reference["count"]))


def test_a_large_mesh_takes_wide_indices() -> None:
    rng = np.random.default_rng(0)
    count = 25_000
    soup = Part("a", "soup", rng.normal(size=(3 * count, 3)), np.arange(3 * count).reshape(-1, 3))
    document, block = pack(from_poses("soup", {"a": np.eye(4)}, (soup,)))
    faces = read(block, document["geometries"][0]["faces"])
    assert document["geometries"][0]["faces"]["kind"] == "u4"
    assert faces.max() == 3 * count - 1
