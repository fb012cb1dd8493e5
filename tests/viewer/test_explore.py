"""Explore mode without a browser: closed samples, folds, change points, forces, the reach, variants."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from mechlab import api
from mechlab.analytic.delta6 import workspace_counts
from mechlab.api import pages
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.mechanism import ConstraintSet, TreeKinematics
from mechlab.values import Range
from mechlab.viewer import Story
from mechlab.viewer.explore import Load, border
from mechlab.viewer.pack import pack


def test_a_sweep_ends_exactly_in_the_fold() -> None:
    """A double rocker: coupler and rocker are stretched in one line there (law of cosines), and every sample closes."""
    a, b, c, d = 0.3, 0.25, 0.28, 0.6
    found = api.explore("fourbar", {"crank": a, "coupler": b, "rocker": c, "ground": d}, vary={}).explore
    assert found is not None
    sweep = found.sweeps[0]
    limit = np.arccos((a**2 + d**2 - (b + c) ** 2) / (2 * a * d))
    # The value is stationary along the curve: an error e of the arc is e^2 in the value.
    np.testing.assert_allclose(sweep.values[[0, -1]], [-limit, limit], atol=1e-12)
    assert np.all(np.diff(sweep.values) > 0)
    assert sweep.closeness[-1] < 1e-6 and sweep.error < 1e-7
    m = api.load("fourbar", crank=a, coupler=b, rocker=c, ground=d).mechanism()
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    assert max(np.abs(constraints.residual(tree.set(q))).max() for q in sweep.q) < 1e-11


def test_a_sweep_stops_before_a_change_point() -> None:
    """Parallelograms can fold over when all their bars are in line, at 0 and at pi: beyond, the mode cannot be told."""
    found = api.explore("n_fourbar").explore
    assert found is not None
    sweep = found.sweeps[0]
    np.testing.assert_allclose(sweep.values[[0, -1]], [0.0, np.pi], atol=0.02)
    assert sweep.values[0] > 0 and sweep.values[-1] < np.pi
    assert "assembly modes meet" in sweep.low_reason and "assembly modes meet" in sweep.high_reason
    assert sweep.error < 1e-7


def test_forces_on_a_part_give_it_its_acceleration() -> None:
    """Newton's law for the coupler: reactions and weight are m a; a is taken from the samples by a spline."""
    found = api.explore("fourbar", vary={}).explore
    assert found is not None
    sweep, m = found.sweeps[0], api.load("fourbar").mechanism()
    body = next(b for b in m.bodies if b.name == "coupler")
    k = found.bodies.index("coupler")
    centre = (sweep.poses[:, k] @ np.append(body.inertia.com, 1.0))[:, :3]
    acceleration = CubicSpline(sweep.values, centre).derivative(2)(sweep.values) * sweep.rate**2
    total = np.sum([_on(x, "coupler") for x in sweep.loads], axis=0)
    inside = slice(6, -6)  # the spline knows nothing of what lies beyond its ends
    scale = np.abs(body.inertia.mass * acceleration).max()
    # A cubic spline's second derivative is off by h^2 f''''/12: with h = 0.07 here about 1e-3.
    np.testing.assert_allclose(total[inside], (body.inertia.mass * acceleration)[inside], atol=3e-3 * scale)
    assert sweep.rate == pytest.approx(2 * np.pi)


def _on(load: Load, body: str) -> np.ndarray:
    sign = 1.0 if load.on == body else -1.0 if load.by == body else 0.0
    return sign * load.vectors if load.kind == "force" else np.zeros_like(load.vectors)


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
    assert isinstance(third, Story) and third.explore is not None and alone.explore is not None
    np.testing.assert_allclose(third.explore.sweeps[0].poses, alone.explore.sweeps[0].poses, atol=1e-12)
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
