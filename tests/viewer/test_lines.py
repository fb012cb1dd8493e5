"""Bodies without shapes: lines from joint to joint, in pictures only."""

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import mechlab as ml
from mechlab.mechanism import Mechanism, TreeKinematics
from mechlab.viewer import write_page
from mechlab.viewer.from_recording import mechanism_story
from mechlab.viewer.lines import lines

ROBOT = """<robot name="three">
  <link name="base"/>
  <link name="upper"><inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tool"/>
  <joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="9" velocity="9"/></joint>
  <joint name="b" type="prismatic"><origin xyz="0.3 0 0.1"/><parent link="upper"/><child link="lower"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1" effort="9" velocity="9"/></joint>
  <joint name="c" type="fixed"><origin xyz="0.2 0 -0.2"/><parent link="lower"/><child link="tool"/></joint>
</robot>"""


def bare(m: Mechanism) -> Mechanism:
    shafts = tuple(replace(s, shapes=()) for s in m.shafts)
    return replace(m, bodies=tuple(replace(b, shapes=()) for b in m.bodies), ground_shapes=(), shafts=shafts)


@pytest.mark.parametrize("name", ["fourbar", "andrews", "delta6", "stephenson"])
def test_lines_end_where_joints_and_loops_are(name: str) -> None:
    m = bare(ml.load(name).mechanism())
    tree = TreeKinematics(m)
    ends = []
    for part in mechanism_story(m).parts:
        if part.name.startswith("line_"):
            along = part.vertices[:, 2]
            assert np.ptp(along) > 5 * np.ptp(part.vertices[:, 0])
            radius = np.ptp(part.vertices[:, 0]) / 2  # half spheres round both ends
            tip = part.placement @ [0.0, 0.0, along.max() - radius, 1.0]
            ends.append((tree.matrix(part.body) @ tip)[:3])
    points = [(x.body_a, x.placement_a) for x in m.loops] + [
        (b.parent, b.placement) for b in m.bodies if b.parent != "ground"
    ]
    for body, placement in points:
        there = tree.matrix(body)[:3, :3] @ placement.translation + tree.matrix(body)[:3, 3]
        origin = tree.matrix(body)[:3, 3]
        if body == "ground" or np.linalg.norm(there - origin) < 1e-3:
            continue
        # the half spheres of the mesh are polygons: their ends are off by less than a percent of the radius
        assert min(np.linalg.norm(e - there) for e in ends) < 1e-3 * np.linalg.norm(there - origin)


def test_files_and_drawn_bodies_stay_as_they_are() -> None:
    m = ml.load("fourbar").mechanism()
    assert lines(m) == {}
    assert "line_" not in ml.to_json(bare(m)) + ml.to_mjcf(bare(m)) + ml.to_urdf(bare(m))
    one = replace(m, bodies=(replace(m.bodies[0], shapes=()), *m.bodies[1:]))
    assert set(lines(one)) == {m.bodies[0].name}


def test_a_single_body_in_a_point_is_seen() -> None:
    m = ml.Builder("a").body("x", ml.revolute("q"), inertia=ml.Inertia.box(1, 0.1, 0.1, 0.1)).build()
    assert [s.kind for s in lines(m)["x"]] == ["cylinder"]


@pytest.mark.browser
def test_the_page_of_a_robot_without_visuals_is_not_empty(look: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(ROBOT)
    with pytest.warns(UserWarning, match="effort or velocity"):  # a URDF needs these limits, a mechanism does not hold them
        made = ml.load(tmp_path / "robot.urdf").mechanism()
    page = look(write_page(mechanism_story(made), tmp_path / "page.html").as_uri())
    clip = page.locator("canvas").first.bounding_box()
    pixels = np.asarray(Image.open(io.BytesIO(page.screenshot(clip=clip))).convert("RGB")).astype(int)
    orange = (pixels[..., 0] > 150) & (pixels[..., 0] - pixels[..., 2] > 60)
    blue = (pixels[..., 2] - pixels[..., 0] > 20) & (pixels.sum(axis=2) < 450)
    assert orange.sum() > 30 and blue.sum() > 100  # none of either on a page without parts
    assert page.errors == []
