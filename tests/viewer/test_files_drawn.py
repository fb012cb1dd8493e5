"""The page of a stranger's file shows its floor, meshes and solids where MuJoCo has them."""

import base64
import json
import re
import zlib
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.viewer.framing import frame_story
from mechlab.viewer.from_recording import mechanism_story
from mechlab.viewer.story import Story

pytestmark = pytest.mark.filterwarnings("ignore::mechlab.errors.LeftOutWarning")
WEDGE = "0 0 0  .4 0 0  0 .3 0  0 0 .2"
FILE = f"""<mujoco model="drawn">
  <asset><mesh name="wedge" vertex="{WEDGE}"/><material name="red" rgba=".8 .1 .1 1"/>
    <hfield name="hill" nrow="2" ncol="3" size="1 2 .5 .1" elevation="0 .5 0 1 0 0"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 .1" pos="0 0 -.3" rgba=".2 .4 .6 1"/>
    <geom name="ramp" type="plane" size="1 2 .1" pos="3 0 0" euler="0 20 0"/>
    <geom name="hill" type="hfield" hfield="hill" pos="5 0 0"/>
    <body name="part" pos=".1 .2 .3" euler="10 20 30"><joint name="turn" axis="0 0 1"/>
      <geom name="wedge" type="mesh" mesh="wedge" material="red" mass="1"/>
      <geom name="egg" type="ellipsoid" size=".1 .05 .02" pos="0 0 .4" mass="1"/>
      <geom name="hidden" type="box" size=".5 .5 .5" group="3" contype="0" conaffinity="0" mass="0"/></body>
  </worldbody>
</mujoco>"""


def told(folder: Path) -> tuple[Story, mujoco.MjModel, mujoco.MjData]:
    path = folder / "drawn.xml"
    path.write_text(FILE)
    model = mujoco.MjModel.from_xml_string(FILE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return mechanism_story(ml.load(path).mechanism()), model, data


def in_world(story: Story, k: int) -> np.ndarray:
    part = story.parts[k]
    pose = story.poses[0, story.bodies.index(part.body)] @ part.placement
    return part.vertices @ pose[:3, :3].T + pose[:3, 3]


def test_meshes_stand_where_the_engine_has_them(tmp_path: Path) -> None:
    """The corners of the wedge in the world, by the placement that the file gives; its colour is that of the material."""
    story, model, data = told(tmp_path)
    found = [k for k, p in enumerate(story.parts) if p.color == (0.8, 0.1, 0.1, 1.0) or np.allclose(p.color[:3], (0.8, 0.1, 0.1))]
    assert len(found) == 1
    corners = np.array([float(x) for x in WEDGE.split()]).reshape(4, 3)
    body = data.body("part")
    wanted = corners @ body.xmat.reshape(3, 3).T + body.xpos
    for corner in wanted:  # the mesh is kept in single precision
        assert np.min(np.linalg.norm(in_world(story, found[0]) - corner, axis=1)) < 1e-6


def test_ellipsoids_and_terrain_have_their_extent(tmp_path: Path) -> None:
    story, model, data = told(tmp_path)
    egg = next(k for k, p in enumerate(story.parts) if p.body == "part" and np.ptp(p.vertices, axis=0).max() < 0.25)
    local = (in_world(story, egg) - data.geom("egg").xpos) @ data.geom("egg").xmat.reshape(3, 3)
    assert np.abs(local).max(axis=0) == pytest.approx([0.1, 0.05, 0.02], rel=0.02)
    hill = next(k for k, p in enumerate(story.parts) if p.body == "ground")
    points = in_world(story, hill)
    assert points.min(axis=0) == pytest.approx([4.0, -2.0, 0.0], abs=1e-6)
    assert points.max(axis=0) == pytest.approx([6.0, 2.0, 0.5], abs=1e-6)
    assert not any(np.ptp(p.vertices, axis=0).max() > 0.9 for p in story.parts if p.body == "part")  # group 3 is hidden


def test_floors_are_floors(tmp_path: Path) -> None:
    """Of no weight in the framing; the level one gives the height of the ground."""
    story, _, data = told(tmp_path)
    level, ramp = story.floors
    assert (level.x, level.y, level.level) == (0.0, 0.0, -0.3)
    assert (ramp.x, ramp.y, ramp.level) == (2.0, 4.0, None)
    assert ramp.placement[:3, :3] == pytest.approx(data.geom("ramp").xmat.reshape(3, 3), abs=1e-12)
    framing = frame_story(story)
    assert framing.floor == -0.3 and framing.radius < 0.6  # the hill is farther off than three times the moving part's size


def test_the_page_holds_each_surface_once(tmp_path: Path) -> None:
    """Two bodies with one mesh: one geometry in the page."""
    two = FILE.replace(
        "  </worldbody>",
        '<body><joint name="two" axis="0 0 1"/><geom type="mesh" mesh="wedge" mass="1"/></body></worldbody>',
    )
    (tmp_path / "two.xml").write_text(two)
    ml.view(ml.simulate(tmp_path / "two.xml", duration=0.1), html=tmp_path / "two.html")
    page = (tmp_path / "two.html").read_text()
    story = json.loads(re.search(r'id="story"[^>]*>(.*?)</script>', page, re.S).group(1))  # type: ignore[union-attr]
    block = zlib.decompress(base64.b64decode(re.search(r'id="block"[^>]*>(.*?)</script>', page, re.S).group(1)))  # type: ignore[union-attr]
    moving = [p["geometry"] for p in story["parts"] if story["bodies"][p["body"]] != "ground"]
    wedges = [g for g in moving if story["geometries"][g]["faces"]["count"] == 12]
    assert len(wedges) == 2 and len(set(wedges)) == 1
    at = story["geometries"][wedges[0]]["positions"]
    points = np.frombuffer(block, "<f4", at["count"], at["at"]).reshape(-1, 3)
    assert np.ptp(points, axis=0).max() > 0.3
    assert len(story["floors"]) == 2
