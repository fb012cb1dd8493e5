"""The map between a Mechanism and its MuJoCo model, and the Plant that laws see."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from mechlab.engines.mujoco.closure import Closure, ExactDynamics
from mechlab.engines.mujoco.model import MujocoMap, passive, to_mujoco
from mechlab.engines.mujoco.plant import MujocoPlant
from mechlab.errors import MechlabError
from mechlab.experiment.scene import Settings
from mechlab.formats.mjcf.write import to_mjcf
from mechlab.mechanism import (
    Builder,
    ConstraintSet,
    Inertia,
    Spring,
    TreeKinematics,
    close,
    floating,
    integrate,
    prismatic,
    revolute,
    universal,
)

KINDS = ["spherical", "revolute", "cylindrical", "universal"]


def robot():
    """A floating body, a universal joint and a slide, with armatures, dampers, springs and a shaft."""
    b = Builder("robot", gravity=(1.0, 2.0, -9.0))
    box = Inertia(2.0, (0.1, -0.2, 0.05), (0.02, 0.03, 0.04, 0.001, -0.002, 0.003))
    b.body("hull", *floating("hull"), inertia=box)
    b.body("arm", *universal("u1", "u2"), parent="hull", at=(0.3, 0, 0.1), inertia=Inertia.rod(1, (0, 0, 0), (0, 0, 1)))
    slide = prismatic("reach", (1.0, 1.0, 0.0), zero=0.2, damping=3.0, armature=0.5, stiffness=7.0, spring_rest=0.1)
    b.body("hand", slide, parent="arm", at=(0, 0, 1), inertia=Inertia.box(0.5, 0.1, 0.1, 0.2))
    b.body("wheel", revolute("wheel", "y", armature=0.01), parent="hull", inertia=Inertia.cylinder(0.3, 0.1, 0.02))
    b.body("rotor", revolute("rotor", "y"), parent="wheel", inertia=Inertia.cylinder(0.1, 0.05, 0.02))
    b.shaft("motor", {"wheel": 30, "rotor": "-7/2"}, inertia=1e-3, damping=0.02)
    b.frame("tool", "hand", (0, 0, 0.2))
    return b.build()


def at_random(m, seed=3):
    rng = np.random.default_rng(seed)
    q = integrate(m, m.reference(), rng.normal(size=m.nv))
    return q, rng.normal(size=m.nv)


def test_plant_terms_are_those_of_the_mechanism():
    m = robot()
    model, data = to_mujoco(m)
    map_ = MujocoMap(m, model)
    q, v = at_random(m)
    data.qpos[:], data.qvel[:] = map_.engine_coordinates(q), map_.engine_rates(data.qpos, v)
    mujoco.mj_forward(model, data)
    plant, tree = MujocoPlant(m, model, data, map_), TreeKinematics(m, q, v)
    # rounding; shafts (tendon armature) and armatures included
    assert plant.mass_matrix() == pytest.approx(tree.mass_matrix(), abs=1e-13)
    passive = np.zeros(m.nv)
    k = m.v_slice["reach"].start
    passive[k] = -3.0 * v[k] - 7.0 * (m.value("reach", q) - 0.1)
    passive -= 0.02 * m.row("motor") * (m.row("motor") @ v)
    assert plant.bias() == pytest.approx(tree.bias_force() - passive, abs=1e-12)
    for name in m.scalar_names:
        assert plant.value(name) == pytest.approx(float(m.value(name, q)), abs=1e-14)
        assert plant.rate(name) == pytest.approx(float(m.row(name) @ v), abs=1e-13)
    assert plant.value("reach") == pytest.approx(0.2 + q[m.q_slice["reach"].start], abs=1e-15)
    with pytest.raises(MechlabError, match="joint or shaft 'weel' does not exist. Did you mean 'wheel'"):
        plant.value("weel")


@pytest.mark.parametrize("kind", [*KINDS, "fixed", "prismatic"])
def test_plant_rows_give_the_accelerations_of_the_mechanism(lab, kind):
    """Other rows than those of the Mechanism, the same constrained accelerations: space and bias are the same."""
    m = lab.slider_crank(kind) if kind in ("fixed", "prismatic") else lab.fourbar(kind)
    q = close(m, None, {"crank_angle": 1.4}, steps=5).q
    c = ConstraintSet(m)
    jacobian = c.jacobian(TreeKinematics(m, q))
    v = np.linalg.lstsq(
        np.vstack([jacobian, m.row("crank_angle")]), np.append(np.zeros(len(c)), 3.0), rcond=1e-11
    )[0]  # fmt: skip
    model, data = to_mujoco(m)
    passive(model)  # without the servo of the file
    map_ = MujocoMap(m, model)
    data.qpos[:] = map_.engine_coordinates(q)
    data.qvel[:] = map_.engine_rates(data.qpos, v)
    mujoco.mj_forward(model, data)
    plant = MujocoPlant(m, model, data, map_)
    rows, bias = plant.jacobian(), plant.constraint_bias()
    expected, _ = lab.dense(m, q, v, np.zeros(m.nv))
    assert rows @ v == pytest.approx(np.zeros(len(rows)), abs=1e-12)
    assert rows @ expected + bias == pytest.approx(np.zeros(len(rows)), abs=1e-10)  # |a| is about 30 rad/s2
    assert np.linalg.matrix_rank(rows, tol=1e-9) == np.linalg.matrix_rank(jacobian, tol=1e-9)
    n = len(rows)
    kkt = np.block([[plant.mass_matrix(), -rows.T], [rows, np.zeros((n, n))]])
    a = np.linalg.lstsq(kkt, np.concatenate([-plant.bias(), -bias]), rcond=1e-12)[0][: m.nv]
    assert a == pytest.approx(expected, abs=1e-9)
    # the same once more in the engine's own rates, connectors included
    exact, _ = ExactDynamics(model).solve(data)
    assert map_.rates(exact) == pytest.approx(expected, abs=1e-8)


def test_plant_rows_follow_the_state_at_once(lab):
    m = lab.fourbar()
    model, data = to_mujoco(m)
    plant = MujocoPlant(m, model, data, MujocoMap(m, model))
    before = plant.jacobian().copy()
    data.qpos[0] += 0.1
    mujoco.mj_forward(model, data)
    assert np.abs(plant.jacobian() - before).max() > 1e-3


@pytest.mark.parametrize("kind", KINDS)
def test_connectors_follow_in_closed_form(lab, kind):
    m = lab.fourbar(kind)
    q = close(m, None, {"crank_angle": 2.9}, steps=10).q
    model, data = to_mujoco(m)
    map_ = MujocoMap(m, model)
    data.qpos[:] = map_.engine_coordinates(q)
    mujoco.mj_forward(model, data)
    assert data.ne and np.abs(data.efc_pos[: data.ne]).max() < 1e-13  # assembled to rounding
    assert np.array_equal(map_.coordinates(data.qpos), q)
    rows, _ = Closure(model).rows(data)
    free = np.linalg.svd(rows)[2][np.linalg.matrix_rank(rows, tol=1e-9) :]
    for direction in free:  # motions that the engine allows keep the rates that it is given
        again = map_.engine_rates(data.qpos, map_.rates(direction))
        assert again == pytest.approx(direction, abs=1e-12)


def test_model_is_a_copy_of_ones_own(lab):
    m = lab.fourbar()
    one, _ = to_mujoco(m)
    gravity = one.opt.gravity.copy()
    one.opt.gravity[:] = 0.0
    two, data = to_mujoco(m)
    assert np.array_equal(two.opt.gravity, gravity) and data.time == 0.0
    assert np.abs(data.qacc).max() > 1.0  # evaluated


def test_addresses_by_name(lab):
    m = lab.planetary()
    model, data = to_mujoco(m)
    map_ = MujocoMap(m, model)
    for k, name in enumerate(m.rate_names):
        assert mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, model.dof_jntid[map_.dof[k]]) == name
    assert len(map_.rows(data, "sun_planet_1")) == 1
    assert set(map_.tendons) == {x.name for x in m.relations}
    with pytest.raises(MechlabError, match="the MuJoCo model: site 'nowhere' does not exist"):
        map_.site("nowhere")
    fourbar = lab.fourbar()
    model, _ = to_mujoco(fourbar)
    assert MujocoMap(fourbar, model).actuators == {"crank_angle": 0}
    assert model.body(MujocoMap(fourbar, model).body("ground")).name == "base"


def stopped():
    """Ends of ranges and dry friction of joints and shafts, a spring with ends, a loop, a gear pair."""
    b = Builder("stopped")
    b.body("a", revolute("a", range=(-1.0, 1.0), friction=0.1), inertia=Inertia.cylinder(1.0, 0.03, 0.02))
    b.body("b", revolute("b", friction=0.2), at=(0.09, 0, 0), inertia=Inertia.cylinder(2.0, 0.06, 0.02))
    b.body("c", revolute("c"), parent="b", at=(0.1, 0, 0), inertia=Inertia.rod(1.0, (0, 0, 0), (0.2, 0, 0)))
    b.body("d", prismatic("d", "x", range=(-0.5, 0.5)), at=(0.39, 0, 0), inertia=Inertia.point(1.0, (0.0, 0, 0)))
    b.gears("mesh", "a", "b", (20, 40))
    b.shaft("sum", {"a": 1, "c": 1}, friction=0.05, range=(-2.0, 2.0))
    b.spring(Spring("spring", "ground", "c", (0, 0.3, 0), (0.1, 0, 0), 8.0, 0.5, 0.3, range=(0.05, 0.9)))
    b.loop("pin", "c", "d", (0.2, 0, 0), (0, 0, 0))
    return b.build()


@pytest.mark.parametrize("settings", [
    Settings(timestep=3.7e-4), Settings(integrator="discrete", timestep=2.5e-4, timeconst=3.0, impedance=0.99),
    Settings(integrator="implicitfast", timeconst=None, impedance=None), Settings(integrator="Euler"),
])  # fmt: skip
def test_a_model_under_settings_is_that_of_its_text(settings):
    """A model is compiled once and then given its settings: every number is that of the text compiled under these settings."""
    for m in (stopped(), robot()):
        made, text = to_mujoco(m, settings)[0], mujoco.MjModel.from_xml_string(to_mjcf(m, settings))
        for name in (n for n in dir(text) if not n.startswith("_") and isinstance(getattr(text, n), np.ndarray)):
            assert np.array_equal(getattr(made, name), getattr(text, name)), name
        for name in (n for n in dir(text.opt) if not n.startswith("_")):
            assert np.array_equal(getattr(made.opt, name), getattr(text.opt, name)), name
