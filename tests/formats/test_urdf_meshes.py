"""Meshes of a URDF: drawn where the files beside it have them, named where they are missing."""

from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab.formats import from_json, to_json
from mechlab.viewer.from_recording import mechanism_story

pytestmark = pytest.mark.filterwarnings("ignore::mechlab.errors.LeftOutWarning")
ROBOT = """<robot name="r"><link name="base"/>
  <link name="arm"><inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/>
      <geometry><mesh filename="package://r/meshes/block.stl" scale=".001 .001 .001"/></geometry></visual>
    <visual><geometry><mesh filename="meshes/none.stl"/></geometry></visual></link>
  <joint name="j" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
</robot>"""


def test_a_mesh_is_drawn_in_its_scale_and_place(tmp_path: Path) -> None:
    """A block of 100 x 200 x 300 mm, turned by a right angle and lifted by 1 m; single precision."""
    trimesh = pytest.importorskip("trimesh")
    (tmp_path / "meshes").mkdir()
    trimesh.creation.box((100, 200, 300)).export(tmp_path / "meshes" / "block.stl")
    (tmp_path / "robot.urdf").write_text(ROBOT)
    design = ml.load(tmp_path / "robot.urdf")
    story = mechanism_story(design.mechanism())
    (part,) = story.parts
    points = part.vertices @ part.placement[:3, :3].T + part.placement[:3, 3]
    assert points.min(axis=0) == pytest.approx([-0.1, -0.05, 0.85], abs=1e-6)
    assert np.ptp(points, axis=0) == pytest.approx([0.2, 0.1, 0.3], abs=1e-6)
    (left,) = [x for x in design.left_out if x.what == "mesh"]
    assert left.names == ("meshes/none.stl",) and "no such file" in left.why
    assert from_json(to_json(design.mechanism())) == design.mechanism()
