"""The workspace verb: the source's counts, brute force, clauses, maps, surfaces, comparison, and questions asked anywhere."""

import json
import sys

import numpy as np
import pytest

from mechlab import api
from mechlab.analytic import delta6
from mechlab.analytic.regions import Clause
from mechlab.cli import main
from mechlab.cli.options import options_of
from mechlab.errors import EngineMissing, MechlabError, NoSolution, UsageError
from mechlab.experiment.entry import WorkspaceMap
from mechlab.studies.workspace.grid import WorkspaceGrid, grid_of
from mechlab.studies.workspace.plan import plan
from mechlab.studies.workspace.study import surface
from mechlab.studies.workspace.survey import map_over, survey
from mechlab.values import Range

SMALL = {"x": Range(-0.3, 0.3, 31), "y": Range(-0.3, 0.3, 31), "z": Range(-0.3, 0.4, 36)}
AXES = tuple(f"{k}={r}" for k, r in SMALL.items())


def said(capsys, *arguments):
    code = main(["workspace", *arguments, "--json"])
    return code, json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    ("given", "nodes", "voxels"),
    [((), 811, 18724), (("bend_limit=60deg",), 362, 10885), (("bend_limit=45deg",), 55, 2003)],
)
def test_the_sources_grid(capsys, given, nodes, voxels):
    code, found = said(capsys, "delta6", *given)
    assert code == 0 and (found["xy_nodes"], found["voxels"]) == (nodes, voxels)
    assert found["volume"] == pytest.approx(1e-6 * voxels, rel=1e-12) and found["units"]["volume"] == "m3"
    size = 201**3
    assert sum(c["decides_inside"] for c in found["clauses"].values()) == voxels
    assert sum(c["decides_outside"] for c in found["clauses"].values()) == size - voxels
    if not given:  # the dexterity of the source of the numbers: largest .553, median .394, smallest .013
        dexterity = found["maps"]["inverse_condition"]
        assert [round(dexterity[k], 3) for k in ("largest", "median", "smallest")] == [0.553, 0.394, 0.013]


def test_an_empty_workspace_is_no_solution(capsys):
    code, found = said(capsys, "delta6", "bend_limit=35deg", "x=-0.2:0.2:41", "y=-0.2:0.2:41", "z=-0.2:0.3:51")
    assert code == 4 and found["voxels"] == 0 and "'bend'" in found["message"]


def test_any_parameters_against_the_counts_of_the_closed_form():
    rng = np.random.default_rng(8)
    for _ in range(2):
        given = {"rod_length": rng.uniform(0.3, 0.5), "radial_offset": rng.uniform(0.1, 0.25), "slider_min": 0.2,
                 "slider_max": rng.uniform(0.45, 0.8), "bend_limit": rng.uniform(0.8, 1.4)}  # fmt: skip
        found = api.workspace("delta6", given).survey
        p = api.load("delta6", **given).parameters
        counts = delta6.workspace_counts(p.geometry, p.slider_min, p.slider_max, p.bend_limit)
        assert (found.columns, found.voxels) == (counts.xy_nodes, counts.voxels)


def test_clauses_against_brute_force():
    given = {"least_condition": 0.35, "least_clearance": 0.09, "bend_limit": 1.0}
    result = api.workspace("delta6", SMALL | given)
    nodes = [np.linspace(r.low, r.high, r.count) for r in SMALL.values()]
    o = np.stack(np.meshgrid(*nodes, indexing="ij"), -1)
    geom = api.load("delta6").parameters.geometry
    drives, margins = delta6.inverse_position(geom, o), delta6.pose_margins(geom, o)
    tests = {
        "reach": drives.reachable, "bend": np.nan_to_num(margins.largest_bend, nan=9.0) <= 1.0,
        "condition": margins.inverse_condition >= 0.35, "clearance": delta6.clearance(geom, o) >= 0.09,
    }  # fmt: skip
    for name, holds in tests.items():
        assert result.survey.clauses[name].keeps == holds.sum(), name
    inside = np.logical_and.reduce(
        [*tests.values(), *np.moveaxis((drives.drives >= 0.25) & (drives.drives <= 0.65), -1, 0)]
    )
    assert result.survey.voxels == inside.sum() > 0
    where = np.argwhere(inside)
    for k, axis in enumerate("xyz"):
        ends = nodes[k][where[:, k].min()], nodes[k][where[:, k].max()]
        assert result.survey.bounds[axis] == pytest.approx(ends, abs=1e-12)
    np.testing.assert_allclose(result.survey.centroid, o[inside].mean(axis=0), atol=1e-12)
    without = np.logical_and.reduce([t for n, t in tests.items() if n != "condition"])
    sliders = np.all((drives.drives >= 0.25) & (drives.drives <= 0.65), -1)
    assert result.survey.clauses["condition"].alone == (without & sliders & ~tests["condition"]).sum()


def test_slabs_do_not_matter():
    made = plan(api.load("delta6"), SMALL)
    whole = survey(made.region, made.grid)
    for slab in (1, 500, 7000, 10**9):
        assert survey(made.region, made.grid, slab) == whole
    covered = np.zeros(made.grid.shape, dtype=int)
    for cut in made.grid.slabs(500):
        covered[cut] += 1
    assert np.all(covered == 1)


def test_margins_are_distances():
    """Reach horizontally, slider stops along Z: anything nearer than the margin is inside."""
    result = api.workspace("delta6", SMALL)
    at, margin, region = np.array(result.survey.deepest), result.survey.margin, result.plan.region
    assert region.margin(dict(zip("xyz", at[:, None], strict=True)))[0] == pytest.approx(margin)
    turn = np.linspace(0, 2 * np.pi, 100)
    circle = np.stack([np.cos(turn), np.sin(turn)])
    reach = region.clauses[0]
    for share, inside in ((0.999, True), (1.001, False)):
        around = at[:2, None] + share * reach.margin({"x": at[0], "y": at[1]}) * circle
        assert bool(np.all(reach.margin({"x": around[0], "y": around[1]}) >= 0)) is inside
        for clause, sign in zip(region.clauses[1:], (-1, 1), strict=True):
            step = share * sign * clause.margin(dict(zip("xyz", at, strict=True)))
            assert bool(clause.margin({"x": at[0], "y": at[1], "z": at[2] + step}) >= 0) is inside


def test_a_slice_with_a_fixed_coordinate():
    cut = api.workspace("delta6", {"z": 0.0, "x": SMALL["x"], "y": SMALL["y"]})
    full = api.workspace("delta6", SMALL)
    z = list(np.round(full.survey.grid.nodes[2], 9)).index(0.0)
    points = full.survey.grid.points()
    assert cut.survey.voxels == full.plan.region.decide(points).inside[..., z].sum()
    assert cut.volume_unit == "m2" and cut.survey.columns is None


def test_two_designs(capsys):
    code, found = said(capsys, "delta6", *AXES, "bend_limit=60deg", "--against", "rod_length=0.4,bend_limit=50deg")
    parts = found["against"]["voxels"]
    first, second = (api.workspace("delta6", SMALL | v).survey.voxels
                     for v in ({"bend_limit": np.pi / 3}, {"bend_limit": np.radians(50), "rod_length": 0.4}))  # fmt: skip
    assert code == 0 and found["voxels"] == first == parts["both"] + parts["only_first"]
    assert parts["both"] + parts["only_second"] == second
    assert parts["union"] == first + second - parts["both"]
    assert found["against"]["volumes"]["union"] == pytest.approx(8e-6 * parts["union"])
    against = next(o for o in options_of(api.workspace, {}) if o.flag == "--against")
    assert against.read(["a=1,b=2,3,c=4"]) == {"a": 1.0, "b": (2.0, 3.0), "c": 4.0}
    with pytest.raises(UsageError, match="--against"):
        against.read(["rod"])


def ball(radius, centre=(0.0, 0.0, 0.0)):
    return Clause("ball", lambda p: radius - np.sqrt(sum((p[a] - c) ** 2 for a, c in zip("xyz", centre, strict=True))))


def test_the_surface_of_a_ball():
    pytest.importorskip("skimage")
    grid = WorkspaceGrid(dict.fromkeys("xyz", (-1.0, 1.0, 81)))
    region = ball(0.7, (0.1, 0.0, -0.1))
    shape = surface(region, grid, survey(region, grid))
    radii = np.linalg.norm(shape.vertices - [0.1, 0.0, -0.1], axis=1)
    # linear interpolation of a distance along an edge of 25 mm: off by h^2 / 8 r = 1e-4
    np.testing.assert_allclose(radii, 0.7, atol=1.5e-4)
    assert shape.volume == pytest.approx(4 / 3 * np.pi * 0.343, rel=3e-3)
    half = ball(0.7, (1.0, 0.0, 0.0))  # leaves the grid: closed by its side
    assert surface(half, grid, survey(half, grid)).volume == pytest.approx(2 / 3 * np.pi * 0.343, rel=0.02)


def test_files_of_the_surface(tmp_path):
    pytest.importorskip("skimage")
    import trimesh

    files = {k: tmp_path / f"w.{k}" for k in ("stl", "glb", "html")}
    result = api.workspace("delta6", SMALL, against={"rod_length": 0.4}, maps=tmp_path / "m.npz", **files)
    for kind in ("stl", "glb"):
        solid = trimesh.load(files[kind], force="mesh")
        assert solid.is_watertight and solid.volume == pytest.approx(result.surface_volume, rel=1e-4)
    assert result.surface_volume == pytest.approx(result.survey.volume, rel=0.05)  # cells of 20 mm at the border
    page = files["html"].read_text()
    assert "workspace of the other design" in page and "only_second" in page
    with np.load(tmp_path / "m.npz") as arrays:
        assert arrays["inverse_condition"].shape == (31, 31) == arrays["largest_bend"].shape
        assert np.nanmax(arrays["inverse_condition"]) == result.maps["inverse_condition"].largest
    with pytest.raises(MechlabError, match="file type '.step'"):
        api.workspace("delta6", SMALL, stl=tmp_path / "w.step")


def test_without_scikit_image_the_message_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "skimage", None)
    monkeypatch.setitem(sys.modules, "skimage.measure", None)
    with pytest.raises(EngineMissing, match=r"pip install 'mechanism-lab\[workspace\]'"):
        api.workspace("delta6", SMALL, stl=tmp_path / "w.stl")
    assert api.workspace("delta6", SMALL).survey.voxels > 0


def test_no_surface():
    grid = WorkspaceGrid({"x": (0.0, 1.0, 5), "y": (0.0, 1.0, 5)})
    flat = Clause("flat", lambda p: p["x"] + p["y"], ("x", "y"))
    with pytest.raises(MechlabError, match="three axes"):
        surface(flat, grid, survey(flat, grid))
    cube = WorkspaceGrid(dict.fromkeys("xyz", (0.0, 1.0, 5)))
    nowhere = ball(-1.0)
    with pytest.raises(NoSolution, match="empty"):
        surface(nowhere, cube, survey(nowhere, cube))
    assert map_over(nowhere, cube, WorkspaceMap(lambda p: p["x"], ("x", "y", "z"))) is None


def test_a_platform_is_asked_its_question(capsys):
    axes = ("platform_3rrr", "x=-0.3:0.3:7", "y=-0.3:0.3:7", "alpha=0.1")
    code, found = said(capsys, *axes)
    assert code == 0 and found["answered_by"] == "analytic" and found["units"]["volume"] == "m2"
    inside = 0
    drives = []
    for x in np.linspace(-0.3, 0.3, 7):
        for y in np.linspace(-0.3, 0.3, 7):
            answer = api.load("platform_3rrr").entry.questions[1].witnesses["analytic"](
                api.load("platform_3rrr").parameters,
                {f"{n}{s}": v if not s else 0.0 for n, v in (("x", x), ("y", y), ("alpha", 0.1)) for s in ("", "_rate", "_accel")},
            )  # fmt: skip
            inside += bool(answer.values)
            drives += [float(answer.values["drive_1"])] if answer.values else []
    assert found["voxels"] == inside == found["statuses"]["solved"] > 5
    code, limited = said(capsys, *axes, "drive_1=0.5:1.5")
    assert limited["voxels"] == sum(0.5 <= d <= 1.5 for d in drives) > 0
    assert limited["clauses"]["solved"]["keeps"] == inside


def test_any_points_by_an_engine():
    """The five-bar has no question for its point: Pinocchio is asked, and agrees with two circles."""
    result = api.workspace("fivebar", {"P_x": Range(-0.3, 0.3, 4), "P_z": Range(0.26, 0.36, 2)})
    x, z = np.meshgrid(*result.survey.grid.nodes, indexing="ij")
    legs = [(np.hypot(x - base, z) <= 0.4) & (np.hypot(x - base, z) >= 0.2) for base in (0.0, 0.2)]
    assert result.plan.how == "pinocchio"
    assert result.survey.voxels <= (legs[0] & legs[1]).sum()  # nothing beyond both annuli; modes may part it further
    assert result.survey.voxels >= 2


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("fivebar",), "no axis is given"),
        (("delta6", "xx=0:1:5"), "'xx' does not exist"),
        (("delta6", "x=0:1:5", "alpha=0"), "also needs y, z, beta, gamma"),
        (("delta6", "x=1:0:5"), "low < high"),
        (("delta6", "least_condition=2"), "least_condition"),
        (("delta6", "least_clearance=3deg"), "expected a length (m, "),
        (("delta6", "bend_limit=120deg"), "bend_limit"),
        (
            ("delta6", "--witness", "nobody", "x=0:1:3", "y=0", "z=0", "alpha=0", "beta=0", "gamma=0"),
            "witness 'nobody'",
        ),
        (("fivebar", "left_angle=0:1:3", "right_angle=1", "P_x=0:1:5"), "limit it with a range"),
        (("nothing", "x=0:1:5"), "mechanism 'nothing'"),
    ],
)
def test_bad_input_is_named(capsys, arguments, text):
    assert main(["workspace", *arguments]) == 1
    err = capsys.readouterr().err
    assert text in err and err.count("\n") == 1


def test_grids():
    grid = grid_of({"x": Range(-1.0, 1.0, 201)})
    assert np.array_equal(grid.nodes[0], np.arange(-100, 101) / 100)  # the source's nodes, bit for bit
    assert grid_of({"x": Range(0.0, 1.0)}).shape == (41,)
    with pytest.raises(MechlabError, match="too many"):
        grid_of(dict.fromkeys("xyz", Range(0.0, 1.0, 10**5)))
    with pytest.raises(MechlabError, match="one to three axes"):
        WorkspaceGrid({})


def test_the_bend_limit_acts_where_a_pose_is_asked_too(capsys):
    """acos(h / L) of the rods by hand, with h from the positions of the guides; sliders in their range."""
    limit, nodes = (
        np.radians(45.0),
        [np.linspace(*ends) for ends in ((-0.06, 0.06, 5), (-0.06, 0.06, 5), (-0.3, 0.3, 9))],
    )
    p = api.load("delta6").parameters
    inside = 0
    for x, y, z in np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1).reshape(-1, 3):
        good = True
        for psi in p.leg_azimuths:
            r, t = np.array([np.cos(psi), np.sin(psi)]), np.array([-np.sin(psi), np.cos(psi)])
            g = np.array([x - p.head_offset, y]) - p.radial_offset * r + p.tangential_offset * t
            size = np.hypot(*g)
            rise = np.sqrt(p.rod_length**2 - size**2)
            slider = z + p.platform_height + p.slider_height + rise
            good &= size <= p.rod_length * np.sin(limit) and p.slider_min <= slider <= p.slider_max
        inside += bool(good)
    axes = ("x=-.06:.06:5", "y=-.06:.06:5", "z=-.3:.3:9")
    code, found = said(capsys, "delta6", *axes, "alpha=0", "beta=0", "gamma=0", "bend_limit=45deg")
    assert code == 0 and found["voxels"] == inside
    assert inside < said(capsys, "delta6", *axes, "alpha=0", "beta=0", "gamma=0")[1]["voxels"]


def test_a_pose_beyond_the_bend_limit_is_out_of_reach_for_every_witness():
    pose = {"x": 0.02, "y": 0.01, "z": -0.1, "alpha": 0.1, "beta": 0.2, "gamma": 0.3}
    free = api.solve("delta6", **pose)
    p = api.load("delta6").parameters
    axis = np.cos(0.2) * np.array([np.cos(0.3), np.sin(0.3)])  # of the output link, seen from above
    o = np.array([pose["x"], pose["y"]]) - p.head_offset * axis
    spans = [
        np.hypot(*(o - p.radial_offset * np.array([np.cos(a), np.sin(a)]) + p.tangential_offset * np.array([-np.sin(a), np.cos(a)])))
        for a in p.leg_azimuths
    ]  # fmt: skip
    bend = float(np.arcsin(max(spans) / p.rod_length))
    drives = {f"{k}": float(v) for k, v in free["analytic"].items()}
    for given in (pose, drives):
        within, beyond = (api.solve("delta6", **given, bend_limit=bend + d) for d in (1e-6, -1e-6))
        assert within.exit_code == 0 and within.max_difference < 1e-8
        assert beyond.exit_code == 4 and not any(a.values for a in beyond.answers.values())
        assert all("more than bend_limit" in a.notes[0] for a in beyond.answers.values())
