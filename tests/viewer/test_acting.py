"""Where the arrows stand: at the motors of what is drawn, in the layer of the part that they act on."""

from __future__ import annotations

import numpy as np
import pytest

from mechlab import api
from mechlab.mechanism import GROUND


def test_drives_of_the_delta_act_at_their_motors() -> None:
    """The rotary drives of the reduced model are drawn on the sliders: each stays at a fixed point of its slider."""
    recording = api.simulate("delta6", duration=0.3)
    story = api.story(recording)
    for k in (1, 2, 3):
        arrow = next(a for a in story.arrows if a.name == f"phi{k} (drive)")
        assert (arrow.on, arrow.by) == (f"stub_{k}", f"slider_{k}")
        pose = story.poses[:, story.bodies.index(f"slider_{k}")]
        local = np.einsum("nji,nj->ni", pose[:, :3, :3], arrow.points - pose[:, :3, 3])
        np.testing.assert_allclose(local, local[:1].repeat(len(local), axis=0), atol=1e-12)
        # The size of the arrow is the recorded torque, along the axis of the stub.
        forces = np.array([recording.at(f"phi{k}_force", float(t)) for t in story.t])
        np.testing.assert_allclose(np.linalg.norm(arrow.vectors, axis=1), np.abs(forces), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["fourbar", "quick_return", "stephenson"])
def test_arrows_of_planar_mechanisms_stand_in_the_layer_of_their_part(name: str) -> None:
    """Across the plane, an arrow lies within the thickness of a part of the body that it acts on; in the plane, at its joint."""
    story = api.story(api.simulate(name, duration=0.1))
    assert story.arrows and story.model is not None
    joints = {x.name: x for x in story.model.loops}
    for arrow in story.arrows:
        parts = [p for p in story.parts if p.body == arrow.on]
        extents = []
        for part in parts:
            pose = story.poses[0, story.bodies.index(arrow.on)] @ part.placement
            y = part.vertices @ pose[1, :3] + pose[1, 3]
            extents.append((y.min(), y.max()))
        assert any(low < arrow.points[0, 1] < high for low, high in extents), arrow.name
        if arrow.name in joints:
            loop = joints[arrow.name]
            pose = np.eye(4) if loop.body_b == GROUND else story.poses[0, story.bodies.index(loop.body_b)]
            place = pose[:3, :3] @ loop.placement_b.translation + pose[:3, 3]
            np.testing.assert_allclose(arrow.points[0, [0, 2]], place[[0, 2]], atol=1e-12)
