"""The toolpath of the delta: its time law, the limits of every drive, turns and angle sets, refusals, and a simulated run."""

import json
import math

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from mechlab import api
from mechlab.analytic import delta6 as closed
from mechlab.analytic.bspline import SpeedRamp
from mechlab.catalog.delta6.toolpath import DEFAULT, curve_of, limits, toolpath
from mechlab.errors import MechlabError, NoSolution


def parameters(**given):
    return api.load("delta6", **given).parameters


def write(folder, points, degree=3, knots=None, **more):
    inner = np.linspace(0, 1, len(points) - degree + 1)[1:-1]
    knots = [0.0] * (degree + 1) + list(inner) + [1.0] * (degree + 1) if knots is None else knots
    file = folder / "curve.json"
    file.write_text(
        json.dumps({"degree": degree, "knots": knots, "points": [list(map(float, p)) for p in points], **more})
    )
    return str(file)


@pytest.mark.parametrize(
    ("length", "speed", "acceleration", "jerk"),
    [
        (1.0, 0.5, 2.0, 20.0),
        (0.01, 0.5, 2.0, 20.0),
        (1e-6, 0.5, 2.0, 20.0),
        (1.0, 0.5, 2.0, 5.0),
        (0.26, 0.5, 2.0, 1e6),
        (3.0, 9.0, 2.0, 4.0),
    ],
)
def test_a_ramp_keeps_its_limits_and_arrives(length, speed, acceleration, jerk):
    ramp = SpeedRamp(length, speed, acceleration, jerk)
    t = np.linspace(0, ramp.duration, 20001)
    s, v, a = (ramp.at(t, k) for k in range(3))
    assert s[0] == 0.0 and s[-1] == pytest.approx(length, rel=1e-10)
    assert abs(v[-1]) < 1e-9 * speed + 1e-12 and v.max() <= speed * (1 + 1e-12) and v.min() > -1e-12
    assert np.abs(a).max() <= acceleration * (1 + 1e-12)
    assert set(np.round(ramp.at(t, 3) / jerk).tolist()) <= {-1.0, 0.0, 1.0}
    h = t[1]
    assert np.abs((s[2:] - s[:-2]) / (2 * h) - v[1:-1]).max() <= jerk * h**2  # central differences, jumps of the jerk
    assert np.abs((v[2:] - v[:-2]) / (2 * h) - a[1:-1]).max() <= jerk * h
    np.testing.assert_allclose(s + s[::-1], length, rtol=1e-10)  # a mirror image
    bang = 2 * math.sqrt(length / acceleration)  # no rest-to-rest motion is quicker than this or than at full speed
    assert ramp.duration >= max(bang, length / speed) * (1 - 1e-12)


def test_ramps_are_checked():
    with pytest.raises(MechlabError, match="jerk"):
        SpeedRamp(1.0, 1.0, 1.0, 0.0)


@pytest.mark.parametrize("given", [{}, {"slider_jerk": 20.0}, {"shaft_speed": 2.0, "rod_length": 0.4}])
def test_every_drive_keeps_its_limits(given):
    p = parameters(**given)
    path = toolpath(p)
    fine = np.linspace(0.0, path.t[-1], 8001)
    commanded = make_interp_spline(path.t, path.drives, k=5)  # what the motion tables of the scene are
    used = [np.abs(commanded(fine, nu=k)).max(axis=0) / limits(p)[k - 1] for k in (1, 2, 3)]
    assert np.max(used) <= 1.0
    assert np.max(used) > 0.8  # and the law is not idle: some drive works near a limit
    assert all(np.abs(commanded([0.0, path.t[-1]], nu=k)).max() < 0.02 * limits(p)[k - 1].min() for k in (1, 2))


def test_drives_run_on_over_whole_turns():
    path = toolpath(parameters())
    assert np.ptp(path.angles[:, 2]) > 2 * np.pi  # more than one turn of gamma
    assert np.abs(np.diff(path.drives[:, 3:], axis=0)).max() < 0.2  # no jump of 2 pi k_spur = 8.8 rad
    geom = parameters().geometry
    back = closed.forward(geom, path.drives[:, :3], path.drives[:, 3:])
    np.testing.assert_allclose(back.tool, path.tool, atol=1e-12)
    np.testing.assert_allclose(path.tool[-1], DEFAULT.points[-1][:3], atol=1e-12)


def test_the_nearer_set_of_angles_is_taken(tmp_path):
    points = np.array(
        [
            [0, 0, 0, 0, 0, 0],
            [0.02, 0, 0, 0.2, 0.1, 0.3],
            [0.03, 0.02, 0, 0.3, 0.3, 0.5],
            [0.03, 0.03, 0.01, 0.1, 0.4, 0.6],
        ]
    )
    plain = toolpath(parameters(curve=write(tmp_path, points)))
    twin = points.copy()
    twin[:, 3:] = np.column_stack([points[:, 3] + np.pi, np.pi - points[:, 4], points[:, 5] + 3 * np.pi])
    other = toolpath(parameters(curve=write(tmp_path, twin)))
    assert not plain.twin and other.twin
    np.testing.assert_allclose(other.drives, plain.drives, atol=1e-9)
    turned = [closed.rotation_matrix(*a.T) for a in (points[:, 3:], twin[:, 3:])]
    np.testing.assert_allclose(*turned, atol=1e-12)  # the two files describe one motion


def test_positions_alone_keep_the_head_still(tmp_path):
    p = parameters(
        curve=write(tmp_path, 20 * np.array([[0, 0, 0], [1, 0, 0], [2, 1, 0], [2, 2, 1], [1, 2, 1]]), unit="mm")
    )
    path = toolpath(p)
    assert len(curve_of(p).points[0]) == 6 and not np.any(path.angles) and not np.any(path.drives[:, 3:])
    np.testing.assert_allclose(path.tool[-1], [0.02, 0.04, 0.02], atol=1e-12)


@pytest.mark.parametrize(
    ("points", "more", "given", "error", "said"),
    [
        ([[0, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0], [0.1, 0, 0]], {}, {}, MechlabError, "stands still at u = 0.5.*infinite"),
        ([[0, 0, 0], [0.05, 0, 0], [0.05, 0.05, 0]], {"degree": 1}, {}, MechlabError, "knot 0.5.*degree 1"),
        ([[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0], [0.3, 0, 0]], {}, {}, NoSolution, "out of reach by 0.0"),
        ([[0, 0, 0], [0, 0, 0.1], [0, 0, 0.2], [0, 0, 0.3]], {}, {}, NoSolution, "q[123] = .* leaves 0.25 to 0.65 m"),
        ([[0, 0, 0], [0.02, 0, 0], [0.04, 0, 0], [0.06, 0, 0]], {}, {"bend_limit": math.radians(42)}, NoSolution, "bends 4"),
        ([[0, 0], [1, 0], [2, 0], [3, 0]], {}, {}, MechlabError, "expected 3 or 6 coordinates, got 2"),
    ],
)  # fmt: skip
def test_what_cannot_be_followed_is_named(tmp_path, points, more, given, error, said):
    file = write(tmp_path, points, **more)
    with pytest.raises(error, match=said) as caught:
        toolpath(parameters(curve=file, **given))
    assert file in str(caught.value)


def test_the_scene_follows_its_curve(tmp_path):
    """MuJoCo's run of a short curve against the commanded path."""
    points = [
        [0, 0, 0, 0, 0, 0],
        [0, 0, 0.01, 0.1, 0, 0],
        [0.01, 0.01, 0.01, 0.2, 0.1, 0.2],
        [0.02, 0, 0, 0.1, 0.1, 0.3],
    ]
    file = write(tmp_path, points)
    run = api.simulate("delta6", scene="toolpath", curve=file)
    path = toolpath(parameters(curve=file))
    assert run.health.trusted and run.t[-1] == pytest.approx(path.law.duration)
    tool = np.stack([run.channel(f"D_{a}") for a in "xyz"], -1)
    wanted = make_interp_spline(path.t, path.tool, k=5)(run.t)
    # softness of MuJoCo's loops: (1 - d) tc^2 x acceleration = 4e-10 x 5 m/s2, times the levers of the rods
    assert np.abs(tool - wanted).max() < 1e-6
    angles = np.stack([run.channel(a) for a in ("alpha", "beta", "gamma")], -1)
    assert np.abs(angles - make_interp_spline(path.t, path.angles, k=5)(run.t)).max() < 1e-5
    np.testing.assert_allclose(tool[-1], points[-1][:3], atol=1e-6)
