"""MuJoCo as a witness: assembly, rates and accelerations against the numpy mechanism and against differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mechlab.engines.mujoco.solve_newton import accelerations_of, assemble, frame_motion, rates
from mechlab.errors import MechlabError, NoSolution
from mechlab.mechanism import Builder, Inertia, Status, TreeKinematics, close, floating, integrate, revolute

KINDS = ["spherical", "revolute", "cylindrical", "universal"]


@pytest.mark.parametrize("kind", KINDS)
def test_assembly_is_that_of_the_mechanism(lab, kind):
    m = lab.fourbar(kind)
    for angle in (0.2, 1.7, 3.3, 6.0):
        found = assemble(m, {"crank_angle": angle})
        assert found.status is Status.SOLVED and found.residual < 1e-12
        assert found.q == pytest.approx(close(m, None, {"crank_angle": angle}, steps=10).q, abs=1e-11)
    again = assemble(m, {"crank_angle": 6.0}, start=found.q)
    assert again.iterations == 0  # a closed start is answered as it is


@pytest.mark.parametrize("kind", [*KINDS, "prismatic", "fixed"])
def test_rates_and_accelerations_are_the_derivatives_of_assembly(lab, kind):
    m = lab.slider_crank(kind) if kind in ("prismatic", "fixed") else lab.fourbar(kind)
    angle, rate, accel, h = 1.3, 2.0, -3.0, 1e-4
    x = [
        assemble(m, {"crank_angle": angle + rate * t + accel * t * t / 2}).q for t in (-2 * h, -h, 0.0, h, 2 * h)
    ]  # fmt: skip
    v = rates(m, x[2], {"crank_angle": rate})
    # fourth-order differences: h^4 = 1e-16 times a fifth derivative, rounding 1e-13 / h
    assert v == pytest.approx((x[0] - 8 * x[1] + 8 * x[3] - x[4]) / (12 * h), abs=1e-8)
    a = accelerations_of(m, x[2], v, {"crank_angle": accel})
    second = (-x[0] + 16 * x[1] - 30 * x[2] + 16 * x[3] - x[4]) / (12 * h * h)
    assert a == pytest.approx(second, abs=1e-4)  # rounding 1e-13 / h^2 = 1e-5


def test_a_frame_can_be_given_and_told(lab):
    m = lab.fourbar()
    q = close(m, None, {"crank_angle": 1.5}, steps=5).q
    pose, _, _ = frame_motion(m, "pin_point", q)
    found = assemble(m, {"pin_point_x": pose[0, 3]})
    assert found.closed and found.q == pytest.approx(q, abs=1e-10)
    v = rates(m, q, {"crank_angle": 2.0})
    a = accelerations_of(m, q, v, {"crank_angle": 0.5})
    _, velocity, acceleration = frame_motion(m, "pin_point", q, v, a)
    tree = TreeKinematics(m, q, v)
    point = pose[:3, 3]
    assert velocity == pytest.approx(tree.velocity("coupler", point), abs=1e-12)
    expected = tree.bias("coupler", point) + tree.jacobian("coupler", point) @ a
    assert acceleration == pytest.approx(expected, abs=1e-11)
    assert rates(m, q, {"pin_point_x": velocity[0]}) == pytest.approx(v, abs=1e-11)
    assert accelerations_of(m, q, v, {"pin_point_wz": acceleration[5]}) == pytest.approx(a, abs=1e-10)


def test_an_orientation_can_be_given():
    b = Builder("free").body("stand", revolute("yaw"), at=(0, 0, 0.3), inertia=Inertia.box(1, 0.1, 0.1, 0.1))
    b.body("part", *floating("part"), parent="stand", inertia=Inertia.box(1, 0.1, 0.2, 0.3))
    m = b.frame("tool", "part", (0.1, 0.2, 0.0)).build()
    rng = np.random.default_rng(4)
    q = integrate(m, m.reference(), rng.normal(size=m.nv))
    pose, _, _ = frame_motion(m, "tool", q)
    given = {"yaw": float(q[0]), "tool_rotation": pose[:3, :3]}
    given |= {f"tool_{axis}": float(pose[k, 3]) for k, axis in enumerate("xyz")}
    found = assemble(m, given)
    assert found.closed
    assert frame_motion(m, "tool", found.q)[0] == pytest.approx(pose, abs=1e-12)
    with pytest.raises(MechlabError, match="no rotation"):
        assemble(m, {"tool_rotation": np.diag([1.0, 2.0, 1.0])})


def test_what_cannot_be_is_said(lab):
    m = lab.fourbar()
    out = assemble(m, {"rocker_angle": 0.1})  # the rocker cannot get there
    assert not out.closed and out.status in (Status.CHANGE_POINT, Status.NOT_CONVERGED) and np.all(np.isfinite(out.q))
    with pytest.raises(MechlabError, match="quantity 'crank' does not exist. Did you mean 'crank_angle'"):
        assemble(m, {"crank": 1.0})
    with pytest.raises(MechlabError, match="crank_angle: expected a finite number"):
        assemble(m, {"crank_angle": math.nan})
    with pytest.raises(MechlabError, match="the start has shape"):
        assemble(m, {"crank_angle": 1.0}, start=[0.0])
    with pytest.raises(NoSolution, match="contradict the constraints"):
        rates(m, m.reference(), {"crank_angle": 1.0, "rocker_angle": 5.0})
    with pytest.raises(NoSolution, match="contradict the constraints"):
        accelerations_of(m, m.reference(), np.zeros(3), {"crank_angle": 1.0, "rocker_angle": 5.0})


def test_another_mode_is_not_taken_for_an_answer(lab):
    m = lab.fourbar()
    mirrored = close(m, np.array([0.0, 1.9, 2.2]), {"crank_angle": 0.9})  # Newton met the other mode and says so
    assert mirrored.status is Status.WRONG_MODE or mirrored.closed
    there = assemble(m, {"crank_angle": 1.2}, start=mirrored.q)
    here = assemble(m, {"crank_angle": 1.2})
    assert there.closed and here.closed
    assert np.abs(there.q - here.q).max() > 0.5  # each keeps the mode of its start


def test_gears_are_solved_too(lab):
    m = lab.planetary()
    found = assemble(m, {"sun": 1.0, "ring": 0.0})
    assert found.closed
    assert m.value("carrier", found.q) == pytest.approx(24 / 108, abs=1e-13)
    v = rates(m, found.q, {"sun": 1.0, "ring": 0.0})
    assert v[m.v_slice["planet_1"].start] == pytest.approx(-24 / 30 * (1 - 24 / 108), abs=1e-13)
