"""The kept closer: poses by closed forms, the statuses and modes of the robust search, motions by differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.closer import Closer
from mechlab.engines.protocol import IMPLEMENTATIONS, available, engine
from mechlab.errors import MechlabError, NoSolution
from mechlab.mechanism import Builder, ConstraintSet, Mechanism, TreeKinematics, close, revolute
from mechlab.mechanism.closing import close_many
from mechlab.mechanism.many_rows import ManyRows
from tests.engines.pinocchio.random_mechanisms import random_mechanism
from tests.mechanism.samples import two_chains

ENGINES = [name for name in IMPLEMENTATIONS if not available(name)]
CRANK, COUPLER, ROCKER, GROUND = 0.1, 0.3, 0.25, 0.3


def fourbar(**lengths: float) -> Mechanism:
    """A crank-rocker in the xy plane; the coupler-rocker joint stands above the ground line."""
    crank, coupler, rocker = (lengths.get(n, x) for n, x in (("crank", CRANK), ("coupler", COUPLER), ("rocker", ROCKER)))
    b = Builder("fourbar", gravity=(0, -9.81, 0))
    b.bar("crank", revolute("crank"), crank)
    b.bar("coupler", revolute("coupler"), coupler, parent="crank", at=(crank, 0, 0))
    b.bar("rocker", revolute("rocker"), rocker, at=(GROUND, 0, 0))
    b.loop("pin", "coupler", "rocker", (coupler, 0, 0), (rocker, 0, 0))
    b.frame("tip", "coupler", (0.5 * coupler, 0.05, 0))
    b.drive("crank")
    return b.assemble({"crank": 1.0, "coupler": -0.4, "rocker": 1.5}, hold=["crank"])


def rocker_angle(crank: np.ndarray) -> np.ndarray:
    """By the law of cosines."""
    x, y = CRANK * np.cos(crank) - GROUND, CRANK * np.sin(crank)
    d = np.hypot(x, y)
    return np.arctan2(y, x) - np.arccos((d * d + ROCKER**2 - COUPLER**2) / (2.0 * d * ROCKER))


def turned(x: np.ndarray) -> np.ndarray:
    """Angles from -pi to pi."""
    return (x + np.pi) % (2.0 * np.pi) - np.pi


def translational_delta() -> tuple[Mechanism, dict[str, float]]:
    """Three sliders on vertical rails, and a rod from each to a platform that does not turn (three slides), which is therefore where
    three spheres meet."""
    rail, platform, length = 0.2, 0.05, 0.4
    b = Builder("delta", gravity=(0, 0, -9.81))
    b.body("x", ml.prismatic("px", "x"))
    b.body("y", ml.prismatic("py", "y"), parent="x")
    below = -math.sqrt(length**2 - (rail - platform) ** 2)
    b.body("platform", ml.prismatic("pz", "z"), parent="y", inertia=ml.Inertia.point(1.0), at=(0, 0, below))
    for k in range(3):
        c, s = math.cos(2.0 * math.pi * k / 3.0), math.sin(2.0 * math.pi * k / 3.0)
        b.body(f"slider_{k}", ml.prismatic(f"s{k}", "z"), inertia=ml.Inertia.point(1.0), at=(rail * c, rail * s, 0))
        end = (platform * c, platform * s, 0.0)
        b.close_here(ml.Loop(f"rod_{k}", "distance", f"slider_{k}", "platform", ml.Placement(), ml.Placement(end), length))
        b.drive(f"s{k}")
    return b.build(), {"rail": rail, "platform": platform, "length": length}


def platform_place(sliders: np.ndarray, of: dict[str, float]) -> np.ndarray:
    """(n, 3) lower intersection of three spheres about (r c, r s, slider), r = rail - platform."""
    angle = 2.0 * np.pi * np.arange(3) / 3.0
    r = of["rail"] - of["platform"]
    centres = np.stack([np.broadcast_to(r * np.cos(angle), sliders.shape), np.broadcast_to(r * np.sin(angle), sliders.shape), sliders], -1)
    out = []
    for p in centres:
        normal = np.cross(p[1] - p[0], p[2] - p[0])
        matrix = np.array([2.0 * (p[1] - p[0]), 2.0 * (p[2] - p[0]), normal])
        right = np.array([p[1] @ p[1] - p[0] @ p[0], p[2] @ p[2] - p[0] @ p[0], normal @ p[0]])
        foot = np.linalg.solve(matrix, right)
        height = math.sqrt(of["length"] ** 2 - (foot - p[0]) @ (foot - p[0]))
        ends = [foot + sign * height * normal / np.linalg.norm(normal) for sign in (1.0, -1.0)]
        out.append(min(ends, key=lambda x: x[2]))
    return np.array(out)


@pytest.mark.parametrize("name", ENGINES)
def test_a_turn_of_the_four_bar_is_the_law_of_cosines(name: str) -> None:
    """Pose after pose and as one array; rounding of the closure is 1e-16 m, on bars of 0.1 m and with the slopes met here 1e-14."""
    m = fourbar()
    phi = 1.0 + np.linspace(0.0, 2.0 * np.pi, 120)
    one, many = Closer(m, ["crank"], name), Closer(m, ["crank"], name)
    single = np.array([float(one(crank=x)["rocker"]) for x in phi])
    poses = many(crank=phi)
    assert bool(np.all(poses.closed)) and float(np.max(poses.residual)) <= 1e-12
    assert np.max(np.abs(turned(single - rocker_angle(phi)))) < 1e-13
    assert np.max(np.abs(turned(poses["rocker"] - rocker_angle(phi)))) < 1e-13


@pytest.mark.parametrize("name", ENGINES)
def test_a_delta_is_the_intersection_of_three_spheres(name: str) -> None:
    m, of = translational_delta()
    t = np.linspace(0.0, 2.0 * np.pi, 60)
    sliders = np.stack([0.05 * np.sin(t + k) for k in range(3)], -1)
    given = {f"s{k}": sliders[:, k] for k in range(3)}
    expected = platform_place(sliders, of)
    many, one = Closer(m, [*given], name), Closer(m, [*given], name)
    poses = many(given)
    z0 = -math.sqrt(of["length"] ** 2 - (of["rail"] - of["platform"]) ** 2)
    got = np.stack([poses["px"], poses["py"], poses["pz"] + z0], -1)
    assert np.max(np.abs(got - expected)) < 1e-13
    for k in range(0, 60, 7):
        pose = one({n: float(x[k]) for n, x in given.items()})
        assert np.max(np.abs([pose["px"] - expected[k, 0], pose["py"] - expected[k, 1], pose["pz"] + z0 - expected[k, 2]])) < 1e-13


@pytest.mark.parametrize("name", ENGINES)
def test_rates_and_accelerations_are_the_derivatives_of_the_poses(name: str) -> None:
    m, h = fourbar(), 1e-3
    phi = np.linspace(0.3, 6.0, 9)
    closer = Closer(m, ["crank"], name, ["tip"])
    poses = closer(crank=phi, crank_rate=2.0, crank_accel=-1.5)
    beside = [closer(crank=phi + 2.0 * t - 0.75 * t * t) for t in (-2 * h, -h, h, 2 * h)]
    for key in ("rocker", "coupler", "tip_x", "tip_y"):
        x = [p[key] for p in beside]
        # fourth-order differences: h^4 times a fifth derivative of about 1e3 is 1e-9; rounding 1e-15 / h^2 is 1e-9
        first = (x[0] - 8.0 * x[1] + 8.0 * x[2] - x[3]) / (12.0 * h)
        second = (-x[0] + 16.0 * x[1] - 30.0 * poses[key] + 16.0 * x[2] - x[3]) / (12.0 * h * h)
        np.testing.assert_allclose(poses[f"{key}_rate"], first, atol=1e-8)
        np.testing.assert_allclose(poses[f"{key}_accel"], second, atol=1e-6)


@pytest.mark.parametrize("seed", [0, 2, 4, 7])
def test_random_mechanisms_close_where_the_search_of_one_pose_ends(seed: int) -> None:
    """All joint and loop kinds at once, with redundant rows: a joint that can move closes in the rows of the tree, and where it fixes
    everything it is where the search along the path ends."""
    m = random_mechanism(seed)
    rank = len(ManyRows(m, []).steps.keep)
    choices = [(n, ManyRows(m, [n])) for n in m.scalar_names]
    drive, rows = next((n, r) for n, r in choices if len(r.steps.keep) > rank)
    values = m.zero(drive) + np.array([-0.3, 0.05, 0.2])
    found = close_many(rows, m.reference(), [values])
    assert found.closed.all()
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    for q, x in zip(found.q, values, strict=True):
        assert np.max(np.abs(constraints.residual(tree.set(q)))) <= 1e-12 and abs(float(m.value(drive, q)) - x) < 1e-12
        if len(rows.steps.keep) == m.nv:
            robust = close(m, None, {drive: float(x)}, steps=10)
            assert np.max(np.abs(q - robust.q)) < 1e-10  # Newton leaves 1e-13, and rows have slopes of 1e2


@pytest.mark.parametrize("kind", [*ml.LOOP_ROWS])
@pytest.mark.parametrize("name", ENGINES)
def test_every_kind_of_loop_closes_to_rounding(name: str, kind: str) -> None:
    """Two spatial chains with spherical joints, more freedoms than given values: the rows of the tree close, the values are met."""
    m = two_chains(kind)
    t = np.linspace(0.0, 1.0, 6)
    given = {"r1": m.zero("r1") + 0.3 * t, "r2": m.zero("r2") - 0.2 * t}
    closer = Closer(m, [*given], name)
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    poses = closer(given)
    for k, q in enumerate([*poses.q, *(closer({n: float(x[i]) for n, x in given.items()}).q for i in (5, 3, 0))]):
        at = t[k] if k < 6 else t[(5, 3, 0)[k - 6]]
        assert np.max(np.abs(constraints.residual(tree.set(q)))) <= 1e-12
        assert abs(float(m.value("r1", q) - m.zero("r1")) - 0.3 * at) < 1e-12


@pytest.mark.parametrize("name", ENGINES)
def test_where_no_assembly_exists_the_status_is_that_of_the_engine(name: str) -> None:
    """A double rocker: beyond its limit angle there is no pose; before it, and after it again, there is."""
    m = fourbar(crank=0.3, coupler=0.2, rocker=0.25)
    limit = math.acos((0.3**2 + GROUND**2 - (0.2 + 0.25) ** 2) / (2.0 * 0.3 * GROUND))
    closer = Closer(m, ["crank"], name)
    beyond = np.array([0.9 * limit, limit + 0.05, 0.8 * limit])
    poses = closer(crank=beyond)
    assert np.asarray(poses.closed).tolist() == [True, False, True]
    assert isinstance(poses.status, tuple) and poses.status[1] is engine(name).assemble(m, {"crank": limit + 0.05}).status
    assert np.all(np.isnan(poses.q[1])) and math.isnan(poses["rocker"][1])
    one = closer(crank=limit + 0.05)
    assert not one.closed and one.status.exit_code != 0  # type: ignore[union-attr]
    assert closer(crank=0.9 * limit).closed  # it goes on from the last closed pose


@pytest.mark.parametrize("name", ENGINES)
def test_a_long_way_keeps_the_mode(name: str) -> None:
    """From the reference pose by half a turn at once, back, and from the mirror mode."""
    m = fourbar()
    closer = Closer(m, ["crank"], name)
    assert abs(turned(closer(crank=1.0 + np.pi)["rocker"] - rocker_angle(np.array(1.0 + np.pi)))) < 1e-12
    assert abs(turned(closer(crank=1.0)["rocker"] - rocker_angle(np.array(1.0)))) < 1e-12
    mirrored = m.reference()
    x, y = CRANK * math.cos(1.0) - GROUND, CRANK * math.sin(1.0)
    d = math.hypot(x, y)
    other = math.atan2(y, x) + math.acos((d * d + ROCKER**2 - COUPLER**2) / (2.0 * d * ROCKER))
    mirrored[m.q_slice["rocker"]] = other - m.zero("rocker")
    mirrored[m.q_slice["coupler"]] = -1.5
    start = close(m, mirrored, {"crank": 1.0}).q
    closer.start_from(start)
    poses = closer(crank=np.linspace(1.0, 4.0, 40))
    phi = np.linspace(1.0, 4.0, 40)
    x, y = CRANK * np.cos(phi) - GROUND, CRANK * np.sin(phi)
    d = np.hypot(x, y)
    expected = np.arctan2(y, x) + np.arccos((d * d + ROCKER**2 - COUPLER**2) / (2.0 * d * ROCKER))
    assert np.max(np.abs(turned(poses["rocker"] - expected))) < 1e-12


@pytest.mark.parametrize("name", ENGINES)
def test_a_pose_after_the_other_far_apart(name: str) -> None:
    """Long ways are led in parts; where one ends at a value that is out of reach, the closer goes on from the pose before."""
    m = fourbar()
    closer = Closer(m, ["crank"], name)
    for x in (1.0, 7.0, -3.0, 3.0, 15.0, 0.2):
        assert turned(np.array(closer(crank=x)["rocker"] - rocker_angle(np.array(x)))) == pytest.approx(0.0, abs=1e-11)
    moved = Closer(m, ["rocker"], name)
    before = moved(rocker=m.zero("rocker")).q
    assert not moved(rocker=m.zero("rocker") + 3.0).closed
    assert moved(rocker=m.zero("rocker")).q == pytest.approx(before, abs=1e-11)


@pytest.mark.parametrize("name", ENGINES)
def test_a_change_point_is_not_crossed_silently(name: str) -> None:
    """A parallelogram: at pi its two modes meet. Beyond, what is called an answer is the parallelogram, never the crossed one."""
    m = fourbar(crank=0.2, coupler=GROUND, rocker=0.2)
    for crank in (3.0, math.pi, 3.6):
        pose = Closer(m, ["crank"], name)(crank=crank)
        assert crank > 3.0 or pose.closed
        if pose.closed:
            assert abs(turned(pose["rocker"] - crank)) < 1e-6  # at the change point itself half of the digits are lost


def test_a_mechanism_of_a_micrometre_is_closed_in_its_own_unit() -> None:
    small = 1e-6
    b = Builder("small")
    b.bar("crank", revolute("crank"), CRANK * small)
    b.bar("coupler", revolute("coupler"), COUPLER * small, parent="crank", at=(CRANK * small, 0, 0))
    b.bar("rocker", revolute("rocker"), ROCKER * small, at=(GROUND * small, 0, 0))
    b.loop("pin", "coupler", "rocker", (COUPLER * small, 0, 0), (ROCKER * small, 0, 0))
    b.frame("tip", "rocker", (ROCKER * small, 0, 0))
    m = b.assemble({"crank": 1.0, "coupler": -0.4, "rocker": 1.5}, hold=["crank"])
    phi = np.linspace(1.0, 2.0, 5)
    poses = Closer(m, ["crank"], "numpy", ["tip"])(crank=phi, crank_rate=1.0)
    assert np.max(np.abs(turned(poses["rocker"] - rocker_angle(phi)))) < 1e-12
    angle = poses["rocker"]
    assert np.max(np.abs(poses["tip_x"] / small - GROUND - ROCKER * np.cos(angle))) < 1e-12
    assert np.max(np.abs(poses["tip_x_rate"] / small + ROCKER * np.sin(angle) * poses["rocker_rate"])) < 1e-12


def test_what_is_wrong_is_named() -> None:
    closer = ml.load("fourbar").closer("crank_angle")
    with pytest.raises(MechlabError, match="needs crank_angle"):
        closer()
    with pytest.raises(MechlabError, match="crank_angel"):
        closer(crank_angle=1.0, crank_angel=1.0)
    with pytest.raises(MechlabError, match="finite"):
        closer(crank_angle=math.nan)
    with pytest.raises(MechlabError, match="give rates"):
        closer(crank_angle=1.0)["rocker_angle_rate"]
    with pytest.raises(MechlabError, match="open by"):
        closer.start_from(np.array([0.0, 0.5, 0.0]))
    with pytest.raises(NoSolution, match="contradict"):
        closer(crank_angle=1.0, crank_angle_rate=1.0, rocker_angle_rate=5.0)
    with pytest.raises(MechlabError, match="crnk"):
        ml.load("fourbar").closer("crnk")


def test_values_that_are_no_numbers_are_refused_by_name() -> None:
    closer = ml.load("fourbar").closer("crank_angle")
    for value in (None, "x", 1j, "37mm", [1.0, math.nan], [[1.0]]):
        with pytest.raises(MechlabError, match="crank_angle|shape"):
            closer(crank_angle=value)
    with pytest.raises(MechlabError, match="crank_angle_rate: expected finite"):
        closer(crank_angle=1.0, crank_angle_rate=math.nan)
    with pytest.raises(MechlabError, match=r"one length, got the shapes \(3,\), \(2,\)"):
        closer(crank_angle=[1.0, 2.0], crank_angle_rate=[1.0, 2.0, 3.0])
    with pytest.raises(MechlabError, match="mapping"):
        closer(1.0)  # type: ignore[arg-type]


def test_text_with_a_unit_and_no_poses_at_all() -> None:
    closer = ml.load("fourbar").closer("crank_angle")
    assert closer(crank_angle="45deg").q.tolist() == closer(crank_angle=math.pi / 4.0).q.tolist()
    none = closer(crank_angle=[], crank_angle_rate=1.0)
    assert none["rocker_angle"].shape == none["rocker_angle_rate"].shape == (0,) and none.status == ()


@pytest.mark.parametrize("matrix", [np.zeros((3, 3)), 2.0 * np.eye(3), -np.eye(3), np.eye(2)])
def test_only_rotations_are_rotations(matrix: np.ndarray) -> None:
    closer = ml.load("delta6").closer("D_x", "D_y", "D_z", "D_rotation", fidelity="minimal")
    with pytest.raises(MechlabError, match="rotation matrices"):
        closer(D_x=0.05, D_y=0.0, D_z=0.1, D_rotation=matrix)


def test_a_point_can_be_given() -> None:
    design = ml.load("delta6")
    closer = design.closer("D_x", "D_y", "D_z", "D_rotation", fidelity="minimal", frames=["D"])
    m = design.mechanism("minimal")
    here = m.frame("D")
    rotation = TreeKinematics(m).pose(here.body)[0] @ here.placement.rotation
    origin = TreeKinematics(m).pose(here.body)[1] + TreeKinematics(m).pose(here.body)[0] @ here.placement.translation
    x = origin[0] + np.linspace(0.0, 0.05, 7)
    poses = closer({"D_x": x, "D_y": origin[1], "D_z": origin[2], "D_rotation": rotation})
    assert bool(np.all(poses.closed))
    assert np.max(np.abs(poses["D_x"] - x)) < 1e-12 and np.max(np.abs(poses["D_y"] - origin[1])) < 1e-12
    answers = ml.solve(design, x=float(x[-1]), y=float(origin[1]), z=float(origin[2]), alpha=0.0, beta=0.0, gamma=0.0)
    assert abs(answers["analytic"]["q1"] - poses["q1"][-1]) < 1e-10


def test_a_closer_prints_as_one_line() -> None:
    closer = ml.load("fourbar").closer("crank_angle", engine="numpy", frames=("C",))
    assert repr(closer) == "Closer of fourbar by numpy, given crank_angle, frames C"
