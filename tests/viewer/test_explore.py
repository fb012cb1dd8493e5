"""Explore mode without a browser: drives, reached poses, the reach, variants."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mechlab import api
from mechlab.analytic.delta6 import workspace_counts
from mechlab.api import pages
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.mechanism import Builder, ConstraintSet, Inertia, TreeKinematics
from mechlab.values import Range
from mechlab.viewer import Story
from mechlab.viewer.explore import explore, reached_poses
from mechlab.viewer.pack import pack
from mechlab.viewer.reach import border


def test_a_page_to_move_knows_drives_rates_and_reached_poses() -> None:
    """Every reached pose closes; the crank has gone round, and a double rocker's stays within its limits (law of cosines)."""
    found = api.explore("fourbar", vary={})
    assert found.explore is not None and found.model is not None
    assert found.explore.drives == ("crank_angle",)
    assert found.explore.rates == {"crank_angle": pytest.approx(2 * np.pi)}
    m = found.model
    q = reached_poses(m, ("crank_angle",), 0.5)
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    assert max(np.abs(constraints.residual(tree.set(x))).max() for x in q) < 1e-11
    assert np.ptp(m.value("crank_angle", q)) == pytest.approx(2 * np.pi, abs=1e-9)
    a, b, c, d = 0.3, 0.25, 0.28, 0.6
    rocker = api.load("fourbar", crank=a, coupler=b, rocker=c, ground=d).mechanism()
    limit = np.arccos((a**2 + d**2 - (b + c) ** 2) / (2 * a * d))
    values = rocker.value("crank_angle", reached_poses(rocker, ("crank_angle",), 0.5))
    assert np.abs(values).max() < limit


def test_what_cannot_move_is_refused() -> None:
    b = Builder("still")
    b.body("block", inertia=Inertia(mass=1.0, com=(0.0, 0.0, 0.0), tensor=(1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0)))
    with pytest.raises(MechlabError, match="no drive, joint or shaft that could be moved"):
        explore(b.build(), lambda q: q, 1.0)


def test_the_border_of_a_ball() -> None:
    """Surface nets lie within h^2 / (8 r) of a sphere's chords, and its faces look outwards."""
    found = border(
        "ball", lambda x, y, z: 0.3 - np.sqrt((x - 0.1) ** 2 + y**2 + z**2), np.full(3, -1.0), np.full(3, 1.0)
    )
    assert found is not None
    radius = np.linalg.norm(found.vertices - [0.1, 0.0, 0.0], axis=1)
    np.testing.assert_allclose(radius, 0.3, atol=1e-3)
    assert volume(found.vertices, found.faces) == pytest.approx(4 / 3 * np.pi * 0.3**3, rel=1e-2)
    assert border("nothing", lambda x, y, z: -1.0 - x**2 - y**2 - z**2, np.full(3, -1.0), np.full(3, 1.0)) is None


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def test_the_reach_of_the_delta_is_as_large_as_its_count() -> None:
    """The volume inside the drawn surface is that of the 0.01 m nodes that the source counts (to a voxel layer)."""
    reach = pages._reach(api.load("delta6"))
    assert reach is not None
    counted = workspace_counts(api.load("delta6").parameters.geometry).voxels * 1e-6
    assert volume(reach.vertices, reach.faces) == pytest.approx(counted, rel=0.03)


def test_variants_are_designs_of_their_own() -> None:
    told = api.explore("fourbar", vary={"crank": Range(0.08, 0.12, 3), "ground": (0.2, 0.3, 0.9)})
    crank, ground = told.variants
    assert (crank.key, crank.unit, crank.home) == ("crank", "m", 1)
    np.testing.assert_allclose(crank.values, (0.08, 0.1, 0.12), atol=1e-15)
    assert isinstance(crank.stories[1], Story) and crank.stories[1].explore is told.explore
    third, alone = crank.stories[2], api.explore("fourbar", {"crank": 0.12}, vary={})
    assert isinstance(third, Story) and third.model is not None
    assert third.model == alone.model != told.model
    assert isinstance(ground.stories[2], str) and "0.9" in ground.stories[2]
    document = pack(told)[0]
    assert [type(x).__name__ for x in document["variants"][1]["choices"]] == ["dict", "dict", "str"]
    assert json.dumps(document, allow_nan=False)


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ({"crankk": None}, "parameter crankk does not exist; can be varied: crank, coupler"),
        ({"crank": Range(0.1, 0.2, 400)}, "crank has 400 values to vary over; expected 2 to 41"),
        ({"crank": None, "coupler": None, "rocker": None}, "3 parameters to vary; expected at most 2"),
    ],
)
def test_what_cannot_be_varied_is_told(vary: dict[str, Range], message: str) -> None:
    with pytest.raises(MechlabError, match=message):
        api.explore("fourbar", vary=vary)


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (["--explore", "--vary", "crank=0.1"], 2, "expected a range such as crank=80mm:120mm:9"),
        (["--explore", "--vary", "crank"], 2, "expected KEY=LO:HI:N"),
        (["--vary", "crank=0.1:0.2"], 2, "--vary needs --explore"),
        (["--explore", "--vary", "crnk=0.1:0.2"], 1, "parameter crnk does not exist"),
    ],
)
def test_the_command_names_what_is_wrong(
    options: list[str], code: int, message: str, tmp_path: object, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", "fourbar", "--html", f"{tmp_path}/x.html", *options]) == code
    assert message in capsys.readouterr().err
