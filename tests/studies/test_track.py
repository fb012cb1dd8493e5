"""`track`: a mechanism follows a path through its loops, against closed forms and hand-solved least squares."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import mechlab as ml
from mechlab.analytic import delta6 as delta
from mechlab.analytic import fourbar as closed_fourbar
from mechlab.cli import main
from mechlab.errors import MechlabError, NoSolution
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.kinematics import TreeKinematics

ROUNDING = 1e-11
"""Newton stops below 1e-13 of the size; a joint may be a hundred times as sensitive."""


def coupler_path(phi):
    """(n, 3) middle of the coupler of the catalog's four-bar: its links 0.1, 0.3, 0.25, 0.3 m."""
    theta = closed_fourbar.solve(0.1, 0.3, 0.25, 0.3, phi, 0.0, 0.0, mode=1).coupler_angle
    return np.array([0.1 * np.cos(phi) + 0.15 * np.cos(theta), 0 * phi, 0.1 * np.sin(phi) + 0.15 * np.sin(theta)]).T


def gap(m, q):
    """Largest residual of all loops and relations along q (n, nq), by the tree of numpy."""
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    return max(float(np.max(np.abs(constraints.residual(tree.set(x))), initial=0.0)) for x in q)


def slides(*names, ranges=None):
    """Carriages one on the other along x: the tip is at the sum of the joints."""
    b, parent = ml.Builder("slides"), "ground"
    for name in names:
        b.body(
            name,
            ml.prismatic(f"s_{name}", "x", range=(ranges or {}).get(name)),
            parent=parent,
            inertia=ml.Inertia.point(1.0, (0, 0, 0)),
        )
        b.frame(f"at_{name}", name)
        parent = name
    return b.build()


def arm(*lengths, ranges=None):
    """A planar arm in the plane x y: revolutes j1, j2, ...; frame tip at its end."""
    b, parent, at = ml.Builder("arm"), "ground", (0.0, 0.0, 0.0)
    for k, length in enumerate(lengths, 1):
        b.bar(f"link_{k}", ml.revolute(f"j{k}", "z", range=(ranges or {}).get(f"j{k}")), length, parent=parent, at=at)
        parent, at = f"link_{k}", (length, 0.0, 0.0)
    return b.frame("tip", parent, at).build()


def reach(lengths, angles):
    """(n, 2) tip of the arm from its joint angles (n, joints)."""
    turned = np.cumsum(np.atleast_2d(angles), axis=1)
    return np.array([np.cos(turned) @ lengths, np.sin(turned) @ lengths]).T


# -- closed forms --------------------------------------------------------------------------------------------------------


def test_a_coupler_point_follows_its_curve_over_a_whole_turn():
    phi = np.linspace(0.7, 0.7 + 2 * np.pi, 81)
    found = ml.track("fourbar", {"middle": coupler_path(phi)}, duration=2.0)
    assert found.exit_code == 0 and found.targets[0].largest < 1e-12
    np.testing.assert_allclose(found["crank_angle"], phi, atol=ROUNDING)
    np.testing.assert_allclose(found.commands["crank_angle"], phi, atol=ROUNDING)
    assert gap(found.recording.mechanism, found.q) < 1e-12 * 0.304 * 2
    # the parabola through three poses misses the rate by the third derivative times spacing^2 / 6
    np.testing.assert_allclose(found["crank_angle_rate"], np.pi, atol=0.01)


def test_the_tool_of_the_delta_follows_poses_as_its_inverse_kinematics_says():
    t = 2 * np.pi * np.linspace(0.0, 1.0, 25)
    place = np.array([0.05 * np.sin(t), 0.04 * np.cos(t), 0.03 + 0.03 * np.sin(2 * t)]).T
    angles = np.array([0.6 * np.sin(t + 0.3), 0.5 * np.cos(t), 0.4 * np.sin(t)]).T
    design = ml.load("delta6")
    for fidelity in ("minimal", "parts", "full"):
        at_home = design.mechanism(fidelity).frame("D").placement.rotation
        poses = np.tile(np.eye(4), (len(t), 1, 1))
        poses[:, :3, 3] = place
        poses[:, :3, :3] = Rotation.from_euler("ZYX", angles[:, ::-1]).as_matrix() @ at_home
        found = ml.track(design, {"D": poses}, fidelity=fidelity)
        drives = delta.inverse(design.parameters.geometry, place, *angles.T).drives
        assert found.met
        for k, name in enumerate(("q1", "q2", "q3", "phi1", "phi2", "phi3")):
            np.testing.assert_allclose(found[name], drives[:, k], atol=1e-9)
        assert gap(found.recording.mechanism, found.q) < 1e-12


def test_the_platform_on_three_arms_follows_pose_and_angle():
    t = 2 * np.pi * np.linspace(0.0, 1.0, 21)
    x, y, alpha = 0.02 * np.sin(t), 0.02 * np.cos(t), 0.1 * np.sin(t)
    wanted = ml.solve("platform_3rrr", x=x, y=y, alpha=alpha)["analytic"]
    found = ml.track("platform_3rrr", centre_x=x, centre_z=y, alpha=alpha)
    assert found.exit_code == 0
    for name in ("drive_1", "drive_2", "drive_3"):
        apart = np.angle(np.exp(1j * (found[name] - wanted[name])))
        np.testing.assert_allclose(apart, 0.0, atol=1e-9)


THIGH, SHANK, FOOT = 0.42, 0.4, 0.2
KNEE = (0.04, 0.05, 0.045, 0.06)
"""Crank, coupler, rocker, ground [m] of a polycentric knee: the ground is fixed in the thigh, the coupler in the shank."""


def leg():
    """A leg with a four-bar knee in the plane x y: joints hip, crank, pin, rocker, ankle; frames sole, heel."""
    a, b, c, d = KNEE
    made = ml.Builder("leg")
    made.bar("thigh", ml.revolute("hip", "z"), THIGH)
    made.bar("crank", ml.revolute("knee", "z"), a, parent="thigh", at=(THIGH, 0.0, 0.0))
    made.bar("shank", ml.revolute("pin", "z"), SHANK, parent="crank", at=(a, 0.0, 0.0))
    made.bar("rocker", ml.revolute("rocker", "z"), c, parent="thigh", at=(THIGH + d, 0.0, 0.0))
    made.loop("knee_pin", "shank", "rocker", (b, 0.0, 0.0), (c, 0.0, 0.0))
    made.bar("foot", ml.revolute("ankle", "z"), FOOT, parent="shank", at=(SHANK, 0.0, 0.0))
    made.frame("sole", "foot", (FOOT, 0.0, 0.0))
    for joint in ("hip", "knee", "ankle"):
        made.drive(joint, 100.0, 1.0)
    start = closed_fourbar.solve(*KNEE, 1.2, 0.0, 0.0, mode=1)
    guess = {"knee": 1.2, "pin": float(start.coupler_angle) - 1.2, "rocker": float(start.rocker_angle)}
    return made.assemble(guess, hold=["knee"])


def test_a_whole_looped_leg_follows_the_pose_of_its_sole():
    s = 2 * np.pi * np.linspace(0.0, 1.0, 31)
    hip, knee, ankle = -1.4 + 0.3 * np.sin(s), 1.2 + 0.4 * (1 - np.cos(s)) / 2, 0.5 + 0.2 * np.sin(2 * s)
    bars = closed_fourbar.solve(*KNEE, knee, 0.0, 0.0, mode=1)
    a = KNEE[0]

    def ray(angle, length):
        return length * np.exp(1j * angle)

    shank = hip + bars.coupler_angle
    sole = ray(hip, THIGH) + ray(hip + knee, a) + ray(shank, SHANK) + ray(shank + ankle, FOOT)
    poses = np.tile(np.eye(4), (len(s), 1, 1))
    poses[:, :3, :3] = Rotation.from_rotvec(np.outer(shank + ankle, [0, 0, 1])).as_matrix()
    poses[:, 0, 3], poses[:, 1, 3] = sole.real, sole.imag
    m = leg()
    found = ml.track(m, {"sole": poses, "hip_0": -1.4, "ankle_0": 0.5})
    assert found.exit_code == 0 and "no drives" not in str(found)
    for name, values in (("hip", hip), ("knee", knee), ("ankle", ankle)):
        np.testing.assert_allclose(found[name], values, atol=1e-9)


def test_geared_joints_move_at_the_ratio_of_their_teeth():
    b = ml.Builder("pair")
    b.bar("wheel", ml.revolute("wheel", "z"), 0.1).bar("pinion", ml.revolute("pinion", "z"), 0.05, at=(0.15, 0.0, 0.0))
    m = b.gears("mesh", "wheel", "pinion", (40, 20)).frame("rim", "wheel", (0.1, 0.0, 0.0)).build()
    phi = np.linspace(0.0, 1.5, 16)
    found = ml.track(m, {"rim": np.array([0.1 * np.cos(phi), 0.1 * np.sin(phi), 0 * phi]).T})
    assert found.met
    np.testing.assert_allclose(found["pinion"], -2.0 * phi, atol=1e-12)


def test_a_floating_body_follows_a_pose():
    b = ml.Builder("free")
    b.body("box", *ml.floating("p"), inertia=ml.Inertia.point(1.0, (0, 0, 0)) + ml.Inertia.axial(1.0, 0.1, 0.1))
    m = b.frame("corner", "box", (0.1, 0.2, 0.3)).build()
    t = np.linspace(0.0, 1.0, 9)
    turns = Rotation.from_rotvec(np.outer(t, [1.0, 2.0, -0.5]))
    poses = np.tile(np.eye(4), (9, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = turns.as_matrix(), np.outer(t, [1.0, 0.5, -1.0])
    found = ml.track(m, {"corner": poses})
    assert found.met
    origin = poses[:, :3, 3] - turns.apply([0.1, 0.2, 0.3])
    np.testing.assert_allclose(np.array([found[f"p_{a}"] for a in "xyz"]).T, origin, atol=1e-9)


# -- priorities ----------------------------------------------------------------------------------------------------------


def test_the_least_motion_shares_a_task_evenly():
    found = ml.track(slides("a", "b", "c"), {"at_c_x": [0.0, 0.3]})
    np.testing.assert_allclose(found.q, [[0, 0, 0], [0.1, 0.1, 0.1]], atol=1e-12)


def test_a_wish_yields_to_what_comes_first():
    m = slides("a", "b", "c")
    found = ml.track(m, {"at_c_x": 0.3, "at_b_x": 1.0}, wishes=["at_b_x"], duration=0.1)
    assert found.met and found.targets[1].largest < 1e-12  # both can be had: c goes back
    np.testing.assert_allclose(found["s_c"], -0.7, atol=1e-12)
    both = ml.track(m, {"at_c_x": 0.3}, [ml.FrameTask("at_c", 1.0, "x", priority=1)])
    assert both.met and both.targets[1].largest == pytest.approx(0.7, abs=1e-12)


def test_weights_share_what_the_first_task_leaves():
    # min (a - 1)^2 + 4 b^2 with a + b = 0.3: a - 1 = 4 b, so a = 0.44, b = -0.14
    wishes = [ml.PostureTask({"s_a": 1.0}), ml.PostureTask({"s_b": 0.0}, weight=2.0)]
    found = ml.track(slides("a", "b"), {"at_b_x": 0.3}, wishes)
    np.testing.assert_allclose(found.q[-1], [0.44, -0.14], atol=1e-10)


def test_a_redundant_arm_takes_the_nearest_posture():
    lengths, rest = np.array([0.5, 0.4, 0.3]), np.array([0.3, 0.6, 0.4])
    tip = reach(lengths, [0.5, 0.5, 0.5])[0]
    m = arm(*lengths)
    posture = ml.PostureTask(dict(zip(("j1", "j2", "j3"), rest, strict=True)))
    found = ml.track(m, {"tip": (*tip, 0.0), "j1_0": 0.4, "j2_0": 0.6, "j3_0": 0.4}, [posture])
    best = minimize(
        lambda q: np.sum((q - rest) ** 2), rest, method="SLSQP", options={"ftol": 1e-16, "maxiter": 200},
        constraints={"type": "eq", "fun": lambda q: reach(lengths, q)[0] - tip},
    )  # fmt: skip
    assert found.met and best.success
    np.testing.assert_allclose(found.q[-1], best.x, atol=1e-7)  # SLSQP ends at about the root of rounding


def test_the_centre_of_mass_is_led():
    found = ml.track(slides("a", "b"), {}, [ml.CenterOfMassTask(np.linspace(0.0, 0.3, 4), "x")])
    # equal masses at a and a + b: the centre is a + b / 2; the least motion goes along (1, 1/2)
    np.testing.assert_allclose(found.q[-1], [0.24, 0.12], atol=1e-12)


# -- limits --------------------------------------------------------------------------------------------------------------


def test_a_limit_holds_and_the_rest_comes_as_near_as_it_can():
    m = arm(0.5, 0.4, ranges={"j2": (0.6, 2.5)})
    found = ml.track(m, {"tip": [[0.5, 0.5, 0.0], [0.85, 0.2, 0.0]], "j1_0": 0.2, "j2_0": 1.0})
    # with the elbow at its end the tip is on a circle about the base: nearest where the ray to the target meets it
    radius = math.sqrt(0.5**2 + 0.4**2 + 2 * 0.5 * 0.4 * math.cos(0.6))
    assert found.exit_code == 3 and found["j2"][-1] == pytest.approx(0.6, abs=1e-9)
    tip = np.array([found["tip_x"][-1], found["tip_y"][-1]])
    np.testing.assert_allclose(tip, radius * np.array([0.85, 0.2]) / math.hypot(0.85, 0.2), atol=1e-8)
    assert found.targets[0].error[-1] == pytest.approx(math.hypot(0.85, 0.2) - radius, abs=1e-9)
    limit = found.limits[-1]
    assert (limit.kind, limit.of, limit.first, limit.last) == ("range", "j2", 1, 1)
    assert "lower end 0.6 rad" in found.message and "held by" in found.message


def test_the_conditions_of_karush_kuhn_and_tucker_hold_at_limits():
    """grad f = -sum of multiplier x outward normal of the active ends, multipliers positive; f = |tip - target|^2 / 2."""
    lengths, ends = np.array([0.5, 0.4, 0.3]), {"j1": (-0.2, 0.4), "j2": (0.1, 0.5), "j3": (-2.0, 2.0)}
    target = np.array([-0.1, 1.0])
    found = ml.track(arm(*lengths, ranges=ends), {"tip": (*target, 0.0), "j1_0": 0.1, "j2_0": 0.3, "j3_0": 0.2})
    q, h = found.q[-1] + [0.0, 0.0, 0.0], 1e-6
    values = np.array([found[n][-1] for n in ends])

    def miss(x):
        return 0.5 * np.sum((reach(lengths, x)[0] - target) ** 2)

    slope = np.array([(miss(values + h * e) - miss(values - h * e)) / (2 * h) for e in np.eye(3)])
    active = {(x.of, "upper" in x.sentence) for x in found.limits if x.last == len(found.t) - 1}
    assert active == {("j1", True), ("j2", True)} and len(q) == 3
    np.testing.assert_allclose(values[:2], [0.4, 0.5], atol=1e-9)
    assert slope[0] < -1e-3 and slope[1] < -1e-3  # at an upper end the miss would fall beyond it
    assert abs(slope[2]) < 1e-6  # the free joint is stationary


def test_rates_are_kept():
    found = ml.track(slides("a"), {"at_a_x": [0.0, 1.0, 1.0, 1.0]}, duration=0.3, max_rate={"s_a": 4.0})
    np.testing.assert_allclose(found["s_a"], [0.0, 0.4, 0.8, 1.0], atol=1e-12)
    assert found.exit_code == 3 and "largest rate" in found.message
    np.testing.assert_array_equal(found.targets[0].missed, [False, True, True, False])


def test_a_clearance_keeps_away_from_a_singular_pose():
    lengths = (0.5, 0.5)
    path = np.array([[0.6, 0.0, 0.0], [0.9, 0.0, 0.0], [0.999, 0.0, 0.0]])
    start = {"tip": path, "j1_0": -0.6, "j2_0": 1.2}
    free = ml.track(arm(*lengths), start)
    kept = ml.track(arm(*lengths), start, [ml.SingularityLimit(0.1, "targets")])

    def smallest(q):
        """Smallest singular value of the tip's Jacobian in sizes of the arm (1 m), from the formula of two links."""
        a, b = q[0], q[0] + q[1]
        second = np.array([-0.5 * np.sin(b), 0.5 * np.cos(b)])
        return np.linalg.svd(np.array([[-0.5 * np.sin(a), 0.5 * np.cos(a)] + second, second]).T)[1][-1]

    assert free.met and smallest([free["j1"][-1], free["j2"][-1]]) < 0.03
    assert kept.exit_code == 3 and "singularity" in kept.message
    assert smallest([kept["j1"][-1], kept["j2"][-1]]) == pytest.approx(0.1, abs=1e-6)
    assert kept.distances["targets"][-1] == pytest.approx(0.1, abs=1e-6)


def test_the_drives_lose_their_hold_where_coupler_and_rocker_stretch():
    """Links 0.3, 0.2, 0.2, 0.35: the crank stops where coupler and rocker lie on one line, at 0.4 from crank pin to pivot."""
    links = {"crank": 0.3, "coupler": 0.2, "rocker": 0.2, "ground": 0.35}
    end = math.acos((0.3**2 + 0.35**2 - 0.4**2) / (2 * 0.3 * 0.35))
    path = np.linspace(0.6, end, 12)
    found = ml.track("fourbar", links | {"crank_angle": path, "crank_angle_0": 0.6})
    held = found.distances["drives"]
    assert found.met and held[0] > 0.1 and held[-1] < 1e-5 and np.all(np.diff(held[4:]) < 0)
    beyond = ml.track("fourbar", links | {"crank_angle": (0.6, end, end + 0.1), "crank_angle_0": 0.6})
    assert beyond.exit_code == 3 and beyond.targets[0].error[-1] == pytest.approx(0.1, abs=1e-7)
    kept = ml.track(
        "fourbar", links | {"crank_angle": path, "crank_angle_0": 0.6}, [ml.SingularityLimit(0.1, "drives")]
    )
    assert kept.exit_code == 3 and kept.distances["drives"][-1] == pytest.approx(0.1, abs=1e-8)
    assert "the distance from singularity (drives) at its least, 0.1" in kept.message


def test_a_start_beyond_a_limit_comes_back_or_is_named():
    back = ml.track(slides("a"), {"at_a_x": [0.1, 0.2], "s_a_0": 0.5}, [ml.RangeLimit({"s_a": (0.0, 0.3)})])
    assert back.met and back["s_a"][-1] == pytest.approx(0.2, abs=1e-12)
    never = ml.track("fourbar", {"crank_angle": 1.0}, [ml.SingularityLimit(3.0)])
    assert never.exit_code == 3 and "distance from singularity (closure) is beyond its limit by" in never.message


# -- what cannot be had ----------------------------------------------------------------------------------------------------


def test_out_of_reach_says_where_and_by_how_much():
    x = np.linspace(0.6, 1.2, 13)  # the arm reaches 0.9
    found = ml.track(arm(0.5, 0.4), {"tip": np.array([x, 0 * x, 0 * x]).T, "j1_0": -0.5, "j2_0": 1.0}, duration=1.2)
    assert found.exit_code == 3
    np.testing.assert_allclose(found.targets[0].error, np.maximum(0.0, x - 0.9), atol=1e-9)
    assert "tip is missed by up to 0.3 m (at 1.2 s), from 0.7 to 1.2 s: out of reach" in found.message
    assert not found.recording.health.trusted


def test_a_stretched_arm_finds_out_how_to_bend():
    found = ml.track(arm(0.5, 0.4), {"tip": np.array([[0.9, 0.0, 0.0], [0.6, 0.0, 0.0]])})
    assert found.met  # the Jacobian of the start has no direction towards the target
    assert math.cos(found["j2"][-1]) == pytest.approx((0.36 - 0.25 - 0.16) / 0.4, abs=1e-9)


def test_a_start_that_does_not_close():
    with pytest.raises(NoSolution, match=r"start does not close \(crank_angle_0=0.5, rocker_angle_0=-3\)"):
        ml.track("fourbar", {"crank_angle": 1.0, "crank_angle_0": 0.5, "rocker_angle_0": -3.0})


@pytest.mark.parametrize(
    ("values", "options", "words"),
    [
        ({}, {}, "no target is given.*middle"),
        ({"midle_x": 1.0}, {}, "'midle_x' does not exist. Did you mean 'middle_x'"),
        ({"middle": [1.0, 2.0]}, {}, r"middle: expected a target of shape \(3,\).*got \(2,\)"),
        ({"middle_x": [0.1, 0.2], "middle_z": [0.1, 0.2, 0.3]}, {}, "as many values.*middle_x has 2"),
        ({"middle_x": [0.1, math.nan]}, {}, "middle_x: expected finite numbers"),
        ({"middle_rotation": 2.0 * np.eye(3)}, {}, "rotation matrices"),
        ({"middle_x": "3rad"}, {}, "middle_x: expected a length"),
        ({"crank_angle": 1.0}, {"max_rate": {"crank": 1.0}}, "'crank' does not exist"),
        ({"crank_angle": 1.0}, {"max_rate": {"crank_angle": -1.0}}, "must be positive"),
        ({"crank_angle": 1.0}, {"wishes": ["middle_x"]}, "wishes"),
        ({"crank_angle": 1.0}, {"duration": 0.0}, "duration"),
        ({"crank_angle": 1.0}, {"tolerance": -1.0}, "tolerance"),
        ({"crank_angle": [1.0, 2.0]}, {"times": [0.0, 0.0]}, "increasing"),
        ({"crank_angle": 1.0}, {"tasks": ml.PostureTask({})}, "list of tasks"),
        ({"crank_angle": 1.0}, {"tasks": [ml.SingularityLimit(math.nan)]}, "at_least"),
        ({"crank_angle": 1.0}, {"tasks": [ml.SingularityLimit(0.1, "loops")]}, "'loops' does not exist"),
        ({"crank_angle": 1.0}, {"tasks": [ml.RangeLimit({"crank_angle": (1.0, 0.0)})]}, "from low to high"),
        ({"crank_angle": 1.0}, {"tasks": [ml.RangeLimit({"crank_angle": 1.0})]}, r"expected two numbers \(low, high\)"),
        ({"crank_angle": 1.0}, {"tasks": [ml.RateLimit({"crank_angle": "fast"})]}, "expected a number, got 'fast'"),
        ({"crank_angle": 1.0}, {"tasks": [ml.RateLimit(3.0)]}, "names of joints or shafts"),
        ({"crank_angle": 1.0}, {"tasks": [ml.SingularityLimit("x")]}, "at_least: expected a number"),
        ({"crank_angle": 1.0}, {"tasks": [ml.PostureTask({"crank_angle": 1.0}, priority=-1)]}, "priority"),
        ({"crank_angle": 1.0}, {"tasks": [ml.PostureTask({"crank_angle": 1.0}, weight=0.0)]}, "weight"),
        ({"middle": lambda t: np.zeros(3 if t < 0.5 else 2)}, {}, "middle: expected numbers in an array"),
        ({"crank_angle": 1.0}, {"tasks": ["middle"]}, "expected tasks and limits"),
        ({"crank_angle": 1.0}, {"tasks": [ml.FrameTask("middle", 1.0, "q")]}, "axes"),
    ],
)
def test_what_makes_no_sense_is_refused(values, options, words):
    with pytest.raises(MechlabError, match=words):
        ml.track("fourbar", values, **options)


# -- other ways ------------------------------------------------------------------------------------------------------------


def test_functions_of_time_and_arrays_mean_the_same():
    t = np.linspace(0.0, 0.5, 11)

    def path(x):
        return coupler_path(np.array([1.0 + x]))[0]

    by_function = ml.track("fourbar", {"middle": path}, times=t)
    by_array = ml.track("fourbar", {"middle": coupler_path(1.0 + t)}, times=t)
    by_keys = ml.track(
        "fourbar", middle_x=coupler_path(1.0 + t)[:, 0], middle_z=coupler_path(1.0 + t)[:, 2], duration=0.5
    )
    np.testing.assert_allclose(by_function.q, by_array.q, atol=1e-14)
    np.testing.assert_allclose(by_keys.q, by_array.q, atol=ROUNDING)


@pytest.mark.parametrize("scale", [1e-6, 1e4])
def test_the_size_of_the_mechanism_does_not_matter(scale):
    phi = np.linspace(0.8, 2.0, 9)
    lengths = {k: scale * x for k, x in (("crank", 0.1), ("coupler", 0.3), ("rocker", 0.25), ("ground", 0.3))}
    found = ml.track("fourbar", lengths | {"middle": scale * coupler_path(phi)})
    assert found.met
    np.testing.assert_allclose(found["crank_angle"], phi, atol=1e-10)


def test_two_kinematics_give_one_motion():
    from mechlab.studies.track.read import goals_of, tasks_of_keys, wanted_of
    from mechlab.studies.track.study import track

    m, t = ml.load("fourbar").mechanism(), np.linspace(0.0, 1.0, 9)
    tasks, _ = tasks_of_keys(m, {"middle": coupler_path(1.0 + t)}, ())
    wanted = wanted_of(m, tasks)
    a, b = (track(m, lambda unit: goals_of(m, wanted, t, None, unit), t, engine=name) for name in ("numpy", "pinocchio"))
    np.testing.assert_allclose(a.q, b.q, atol=ROUNDING)


def test_a_gear_linkage_is_led_by_its_output():
    phi = np.linspace(0.5, 1.5, 21)
    output = ml.solve("gear_linkage", crank_angle=phi)["analytic"]["output_angle"]
    assert np.all(np.diff(output) < 0) or np.all(np.diff(output) > 0)  # one crank angle for each
    found = ml.track("gear_linkage", output_angle=output, crank_angle_0=0.5)
    assert found.met
    np.testing.assert_allclose(found["crank_angle"], phi, atol=1e-9)


def test_the_command_line_answers_and_writes(tmp_path, capsys):
    file = tmp_path / "run.npz"
    assert main(["track", "fourbar", "crank_angle=1:2:5", "--duration", "2", "-o", str(file), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["status"] == "answered" and document["targets"][0]["met"]
    assert document["commands"]["crank_angle"] == pytest.approx([1.0, 1.25, 1.5, 1.75, 2.0])
    recording = ml.load_recording(file)
    np.testing.assert_allclose(recording["crank_angle"], [1.0, 1.25, 1.5, 1.75, 2.0])
    page = ml.view(file, html=tmp_path / "run.html")
    assert page.exit_code == 0 and (tmp_path / "run.html").stat().st_size > 1e5
    assert main(["track", "fourbar", "middle_x=0.1:0.9:5"]) == 3
    said = capsys.readouterr()
    assert "middle_x is missed by up to" in said.out and said.err.startswith("mechlab: middle_x is missed")
    assert main(["track", "fourbar", "crank_angle=1", "crank_angle_0=0.5", "rocker_angle_0=-3"]) == 4
    assert main(["track", "fourbar", "crank_angle=1m"]) == 1


def test_all_numbers_as_json(tmp_path):
    found = ml.track("fourbar", crank_angle=(1.0, 2.0), out=tmp_path / "a.json")
    assert json.loads((tmp_path / "a.json").read_text())["joints"]["crank_angle"] == [1.0, 2.0]
    assert repr(found).startswith("Track of fourbar, 1 s, 2 times: 1 target met at 2 times")
    with pytest.raises(MechlabError, match=r"\.npz.*\.json"):
        found.save(tmp_path / "a.csv")
