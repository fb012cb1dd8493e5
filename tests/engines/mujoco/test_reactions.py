"""Reactions and accelerations of MuJoCo runs against the multipliers of dense constrained equations: size and sign."""

from __future__ import annotations

import numpy as np
import pytest

from mechlab.engines.mujoco.runner import run
from mechlab.experiment.laws import Constant
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism import Builder, ConstraintSet, Inertia, TreeKinematics, prismatic, revolute

# The rows are rigid where they are read, to some 1e-6 (SMALL of `hard_rows`); later the states are those of soft rows, a little open and
# with rates that open them more.
START, LATER = 1e-5, 1e-4


def wrench_on_b(lab, m, q, v, tau):
    """Force and moment about the end of the first loop on its body b, world axes, from the rows of the Mechanism."""
    _, multipliers = lab.dense(m, q, v, tau)
    tree, c = TreeKinematics(m, q, v), ConstraintSet(m)
    item = c.items[0]
    ra, _, rb, _ = item.ends(tree)
    force, moment = np.zeros(3), np.zeros(3)
    for row, r in zip(item.rows, multipliers, strict=False):
        code = row.rsplit(".", 1)[1]
        u = ra[:, "xyz".index(code[0])]
        if len(code) == 1:
            force += r * u
        else:
            moment += r * np.cross(rb[:, "xyz".index(code[2])], u)
    return force, moment


def loop_channels(r, name, k):
    force = np.array([r.channels[f"{name}_f{a}"][k] for a in "xyz"])
    if f"{name}_mx" not in r.channels:
        return force, None
    return force, np.array([r.channels[f"{name}_m{a}"][k] for a in "xyz"])


@pytest.mark.parametrize("kind", ["spherical", "revolute", "cylindrical", "universal"])
def test_pin_force_of_a_fourbar(lab, kind):
    m = lab.fourbar(kind)
    r = run(m, Scene("free", "full", 0.25, initial_rates={"crank_angle": 4.0}))
    for k, tolerance in ((0, START), (100, LATER), (-1, LATER)):
        force, _ = wrench_on_b(lab, m, r.q[k], r.v[k], np.zeros(m.nv))
        measured, moment = loop_channels(r, "pin", k)
        assert measured == pytest.approx(force, abs=tolerance * np.abs(force).max())
        if moment is not None:
            assert abs(moment[2]) < 1e-5  # [N m] no joint of these kinds carries a moment about z
    acceleration = lab.dense(m, r.q[0], r.v[0], np.zeros(m.nv))[0]
    told = [r.channels[f"{j.name}_accel"][0] for j in m.joints]
    assert told == pytest.approx(acceleration, abs=START * np.abs(acceleration).max())


@pytest.mark.parametrize("kind", ["prismatic", "cylindrical", "fixed"])
@pytest.mark.parametrize("ground_first", [True, False])
def test_force_and_moment_of_a_guide(lab, kind, ground_first):
    m = lab.slider_crank(kind, ground_first)
    r = run(m, Scene("free", "full", 0.25, initial_rates={"crank_angle": 4.0}))
    for k, tolerance in ((0, START), (100, LATER), (-1, LATER)):
        force, moment = wrench_on_b(lab, m, r.q[k], r.v[k], np.zeros(m.nv))
        measured = loop_channels(r, "guide", k)
        assert measured[0] == pytest.approx(force, abs=tolerance * np.abs(force).max())
        assert measured[1] == pytest.approx(moment, abs=tolerance * np.abs(moment).max())
        assert np.abs(moment).max() > 0.05  # [N m] there is a moment to read


def test_tooth_load_of_a_pair_is_the_torque_on_its_first_gear(lab):
    b = Builder("pair", gravity=(0.0, 0.0, 0.0))
    b.body("a", revolute("a"), inertia=Inertia.cylinder(1.0, 0.03, 0.02))
    b.body("b", revolute("b"), at=(0.09, 0, 0), inertia=Inertia.cylinder(2.0, 0.06, 0.02))
    m = b.gears("mesh", "a", "b", (20, 40)).build()
    r = run(m, Scene("torque", "full", 0.1, (Constant("a", 0.3),)))
    one, two = 0.5 * 1.0 * 0.03**2, 0.5 * 2.0 * 0.06**2
    acceleration = 0.3 / (one + two / 4.0)
    # by hand: the mesh takes from the torque on a what b needs
    assert r.final()["mesh_load"] == pytest.approx(one * acceleration - 0.3, rel=1e-9)
    multiplier = lab.dense(m, r.q[-1], r.v[-1], np.array([0.3, 0.0]))[1]
    assert r.final()["mesh_load"] == pytest.approx(multiplier[0], rel=1e-9)
    assert r.units["mesh_load"] == "N m"


def test_loads_of_redundant_meshes_are_shared_equally(lab):
    m = lab.planetary()
    r = run(m, Scene("torque", "full", 0.1, (Constant("sun", 0.7),)))
    tau = np.zeros(m.nv)
    tau[m.v_slice["sun"].start] = 0.7
    multipliers = lab.dense(m, r.q[-1], r.v[-1], tau)[1]
    loads = [r.final()[f"{x.name}_load"] for x in m.relations]
    assert loads == pytest.approx(multipliers, rel=1e-6)  # least squares and equal softness share alike by symmetry


def test_distance_loop_has_exact_accelerations_and_load(lab):
    """A four-bar whose coupler is a massless rod. MuJoCo's own row ignores dJ/dt v and would be far off."""
    b = Builder("rod", gravity=(0.0, -9.81, 0.0))
    b.bar("crank", revolute("crank"), 0.1)
    b.bar("rocker", revolute("rocker"), 0.25, at=(0.3, 0, 0))
    b.loop("rod", "crank", "rocker", (0.1, 0, 0), (0.25, 0, 0), kind="distance", length=0.3)
    m = b.assemble({"crank": 0.9, "rocker": 1.5}, hold=["crank"])
    scene, errors = Scene("free", "full", 0.373, initial_rates={"crank": 6.0}), []
    for h in (5e-4, 2.5e-4):
        r = run(m, scene, Settings(timestep=h))
        errors.append(np.abs(r.q[-1] - lab.motion(m, r.q[0], r.v[0], 0.373)[0]).max())
    assert errors[1] < 3e-4 and errors[0] / errors[1] > 3.0  # [rad] second order in h: positions converge
    for k in (0, 150, -1):
        acceleration, load = lab.dense(m, r.q[k], r.v[k], np.zeros(2))
        told = [r.channels["crank_accel"][k], r.channels["rocker_accel"][k]]
        # rounding, and a row per |d| here, per length there: they differ by the gap of 2e-6 m / 0.3 m
        assert told == pytest.approx(acceleration, rel=3e-5)
        assert r.channels["rod_load"][k] == pytest.approx(load[0], rel=3e-5)
    assert "distance" in r.health.finding("distance_loops").sentence


def test_load_of_a_screw_is_a_force_where_its_first_joint_slides():
    from mechlab.mechanism import screw

    b = Builder("screw")
    b.body("nut", prismatic("lift", "z"), inertia=Inertia.point(3.0))
    b.body("spindle", revolute("turn"), inertia=Inertia.cylinder(0.5, 0.01, 0.2))
    m = b.mesh(screw("thread", "turn", "lift", 0.005)).build()
    r = run(m, Scene("fall", "full", 0.1))
    lead = 0.005 / (2 * np.pi)
    effective = 3.0 + 0.5 * 0.5 * 0.01**2 / lead**2
    assert r.units["thread_load"] == "N"
    # the nut falls with m g / m_eff: the thread carries the rest of its weight
    assert r.final()["thread_load"] == pytest.approx(3.0 * 9.81 * (1 - 3.0 / effective), rel=1e-8)
