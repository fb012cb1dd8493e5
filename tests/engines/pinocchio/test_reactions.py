"""Inverse dynamics: drive forces, tooth loads, loop and joint wrenches, from statics by hand and from power balance."""

import numpy as np
import pytest
from random_mechanisms import random_mechanism
from samples import fourbar, planetary, scara

from mechlab.engines.pinocchio.dynamics import PinPlant
from mechlab.engines.pinocchio.given_rates import rates
from mechlab.engines.pinocchio.reactions import inverse_dynamics, joint_wrenches, loop_wrenches
from mechlab.errors import NoSolution
from mechlab.mechanism import Builder, ConstraintSet, Inertia, TreeKinematics, revolute
from mechlab.mechanism.structure import null_space


def test_arm_holds_its_weight():
    m = scara()
    found = inverse_dynamics(m, m.reference(), np.zeros(2))
    tree = TreeKinematics(m)
    com = [tree.origins[i] + tree.rotations[i] @ np.array(b.inertia.com) for i, b in enumerate(m.bodies)]
    weight = [b.inertia.mass * 9.81 for b in m.bodies]
    elbow = tree.origins[1]
    assert found.drive_forces["elbow"] == pytest.approx(weight[1] * (com[1][0] - elbow[0]), rel=1e-12)
    assert found.drive_forces["shoulder"] == pytest.approx(weight[0] * com[0][0] + weight[1] * com[1][0], rel=1e-12)
    assert np.allclose(found.joints["shoulder"].force, [0, sum(weight), 0], atol=1e-12)
    assert found.joints["shoulder"].moment[2] == pytest.approx(found.drive_forces["shoulder"], rel=1e-12)
    assert found.joints["elbow"].local[1][2] == pytest.approx(found.drive_forces["elbow"], rel=1e-12)


def test_fourbar_joints_are_in_balance():
    """Each body by itself: its joint forces, moments and weight give m a and the rate of angular momentum."""
    m = fourbar()
    v = rates(m, m.reference(), {"crank_angle": 5.0})
    found = inverse_dynamics(m, m.reference(), v, {"crank_angle": -3.0})
    tree = TreeKinematics(m, m.reference(), v)
    pin, rocker = found.loops["pin"], found.joints["rocker_angle"]
    body = m.body("rocker")
    i = tree.index["rocker"]
    com = tree.origins[i] + tree.rotations[i] @ np.array(body.inertia.com)
    acceleration = (tree.bias("rocker", com) + tree.jacobian("rocker", com) @ found.accelerations)[:3]
    spin = found.accelerations[2] * (tree.rotations[i] @ body.inertia.matrix() @ tree.rotations[i].T)[2, 2]
    total = pin.force + rocker.force + body.inertia.mass * np.array(m.gravity)
    assert np.allclose(total, body.inertia.mass * acceleration, atol=1e-12)
    moment = np.cross(pin.point - com, pin.force) + np.cross(rocker.point - com, rocker.force) + rocker.moment
    assert moment[2] == pytest.approx(spin, abs=1e-12)
    assert rocker.moment[2] == pytest.approx(0.0, abs=1e-12)  # a free pin carries no moment about its axis
    power = found.drive_forces["crank_angle"] * 5.0
    plant = PinPlant(m, m.reference(), v)
    assert power == pytest.approx(v @ (plant.mass_matrix() @ found.accelerations + plant.bias()), rel=1e-10)


@pytest.mark.parametrize("seed", range(8))
def test_wrenches_project_onto_the_joints(seed):
    """The wrench through each joint, along its axis, is what springs, dampers and drives do there."""
    m = random_mechanism(seed)
    rng = np.random.default_rng(seed)
    q = m.reference()
    basis = null_space(ConstraintSet(m).jacobian(TreeKinematics(m, q)))
    v = basis @ rng.normal(size=basis.shape[1])
    tau = rng.normal(size=m.nv)
    plant = PinPlant(m, q, v)
    a, r = plant.accelerations(tau)
    wrenches = joint_wrenches(plant, a, r)
    along = np.zeros(m.nv)
    for joint in m.joints:
        force, moment = wrenches[joint.name].local
        axis = np.eye(3) if joint.kind == "spherical" else np.array([joint.axis])
        along[m.v_slice[joint.name]] = axis @ (force if joint.kind == "prismatic" else moment)
    shafts = sum(s.inertia * np.outer(m.row(s.name), m.row(s.name)) for s in m.shafts)
    armature = np.diag([j.armature for j in m.joints for _ in range(j.nv)]) + shafts
    springs = sum(-spring for spring in _spring_forces(plant))
    relations = plant.constraints.relations
    tail = r[len(r) - len(relations) :]
    internal = plant.passive.force(v) - springs
    scale = max(1.0, np.abs(along).max())
    assert np.allclose(along + armature @ a, tau - internal + relations.T @ tail, atol=1e-8 * scale)


def _spring_forces(plant):
    from mechlab.mechanism.statics import spring_force

    return [spring_force(plant.kin, s) for s in plant.mechanism.springs]


def test_tooth_load_of_a_gear_pair():
    b = Builder("pair")
    b.body("pinion", revolute("pinion"), inertia=Inertia.cylinder(1, 0.03, 0.02))
    b.body("wheel", revolute("wheel"), at=(0.09, 0, 0), inertia=Inertia.cylinder(4, 0.06, 0.02))
    b.gears("mesh", "pinion", "wheel", (20, 40))
    b.drive("pinion")
    m = b.build()
    found = inverse_dynamics(m, m.reference(), np.zeros(2), {"pinion": 10.0})
    wheel = 4 * 0.06**2 / 2
    assert found.loads["mesh"] == pytest.approx(-wheel * 10 / 4, rel=1e-12)  # torque on the pinion, ratio 1/2 twice
    assert found.drive_forces["pinion"] == pytest.approx(0.5 * 0.03**2 * 10 + wheel * 10 / 4, rel=1e-12)


def test_planets_share_the_load():
    m = planetary()
    found = inverse_dynamics(m, m.reference(), np.zeros(6), {"sun": 50.0, "carrier": 0.0}, ["sun", "carrier"])
    loads = [found.loads[f"sun_planet_{i}"] for i in range(3)]
    assert np.allclose(loads, loads[0], rtol=1e-10)


def test_spherical_and_welded_loops_give_moments():
    """A bar held at both ends by fixed loops: one more support than needed, and equal shares by symmetry."""
    m = random_mechanism(2)
    plant = PinPlant(m, m.reference(), np.zeros(m.nv))
    _, r = plant.accelerations(np.zeros(m.nv))
    wrenches = loop_wrenches(plant, r)
    total = np.zeros(m.nv)
    for loop in m.loops:
        w = wrenches[loop.name]
        column = np.concatenate([w.force, w.moment])
        total += column @ plant.kin.jacobian(loop.body_b, w.point) - column @ plant.kin.jacobian(loop.body_a, w.point)
        force_local = w.local[0]
        if loop.kind == "cylindrical":
            assert abs(force_local[2]) < 1e-9  # free along its axis
    slices = plant.constraints.slices
    first = slices[m.relations[0].name].start if m.relations else len(r)
    assert np.allclose(total, plant.jacobian()[:first].T @ r[:first], atol=1e-9)


def test_too_few_drives_are_told():
    m = scara()
    with pytest.raises(NoSolution, match="no forces of these drives"):
        inverse_dynamics(m, m.reference(), np.zeros(2), {"shoulder": 1.0, "elbow": 0.0}, ["elbow"])
