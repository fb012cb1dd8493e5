"""The declared drives act in a run as in the file that is written: gravity, springs and drives against plain mj_step."""

import math

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab import catalog
from mechlab.errors import MechlabError
from mechlab.experiment.acting import held_drives, what_acts
from mechlab.experiment.laws import Constant
from mechlab.formats import from_json, from_mjcf, to_json, to_mjcf
from mechlab.lab.run import run_scene
from mechlab.mechanism import Builder, Inertia
from mechlab.mechanism.parts import Control, Winding
from tests.benchmarks.drives_agree import EXACT, INTEGRATORS, Case, compare, difference, save
from tests.studies import driven


@pytest.mark.parametrize("build", driven.ALL, ids=lambda f: f.__name__)
def test_the_default_scene_moves_as_the_written_file(build):
    """The same steps of the same engine, the file read from disk with its controls at 0: to rounding."""
    gap, run = difference(Case(build(), "hold", {}, {}))
    assert run.scene == "hold" and gap < EXACT
    assert run.t[-1] == pytest.approx(0.25)


def test_a_motor_with_inductance_agrees_with_the_file_in_first_order():
    """MuJoCo integrates the current in first order, the lab in fourth: at h / 4 a quarter of the difference is left."""
    b = Builder("motor").body("arm", driven.revolute("q", "y"), inertia=Inertia.point(1.0, (0.3, 0.0, 0.0)))
    case = Case(b.drive("q", winding=Winding(0.8, 0.5, 0.02)).build(), "hold", {}, {})
    coarse, fine = difference(case)[0], difference(case, 2.5e-4)[0]
    assert 0.0 < coarse < 1e-2 and fine == pytest.approx(coarse / 4.0, rel=0.1)


@pytest.mark.parametrize("seed", [0, 3, 6, 7, 9, 10, 11, 13, 15, 16, 18, 21, 23, 25, 29])
def test_random_scenes_with_drives_agree_with_the_file(seed):
    verdict, _, line = compare(seed)
    assert verdict in ("agrees", "agrees in first order"), line


@pytest.mark.parametrize("name", catalog.NAMES)
def test_the_default_scene_of_the_catalog_moves_as_the_written_file(name, tmp_path):
    """Every drive of a catalog scene is released or has a law in its place, so the actuators of the file are off. Constant
    laws (or none) go in by their formula: to rounding. The forces of other laws are replayed from the recording, linear
    between samples: the error of that is of second order in the timestep, and of a run of 50 steps small."""
    d = ml.load(name)
    scene = d.scene(d.default_scene)
    if d.for_scene(d.default_scene).mechanism(scene.fidelity).curves:
        pytest.skip("a file holds a curve as its local quartic, and says so: plain MuJoCo leaves it after some degrees")
    constant = all(isinstance(law, Constant) for law in scene.laws)
    step = 2e-4 if scene.settings.engine != "mujoco" else scene.settings.timestep
    duration = 50 * step
    run = run_scene(d, engine="mujoco", timestep=step, duration=duration, estimate=False)
    m, s = run.mechanism, run.settings
    save(d, tmp_path, run.fidelity)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / f"{m.name}.xml"))
    model.opt.integrator, model.opt.timestep = INTEGRATORS[s.integrator], s.timestep
    model.opt.disableactuator, model.actuator_damping[:] = 1, 0.0
    if s.solref is not None:
        model.eq_solref[:], model.dof_solref[:] = s.solref, s.solref
    data = mujoco.MjData(model)
    start(m, model, data, run)
    laws = {n.removesuffix("_force") for n in run.channels if n.removesuffix("_force") in m.scalar_names}
    laws = sorted(n for n in laws if f"{n}_force" in run.channels)
    rows = {n: m.row(n) for n in laws}
    dof = [k for j in m.joints for k in range(model.joint(j.name).dofadr[0], model.joint(j.name).dofadr[0] + j.nv)]
    count = round(duration / s.timestep)
    for k in range(count):
        data.qfrc_applied[dof] = 0.0
        for n in laws:
            middle = np.interp((k + 0.5) * s.timestep, run.t, run.channel(f"{n}_force"))
            force = sum(law.value for law in scene.laws if law.on == n) if constant else middle
            data.qfrc_applied[dof] += force * rows[n]
        mujoco.mj_step(model, data)
    joints = [j for j in m.joints if j.nv == 1]
    theirs = np.array([data.qpos[model.joint(j.name).qposadr[0]] + j.zero for j in joints])
    ours = np.array([run.channel(j.name)[-1] for j in joints])
    moved = max(float(np.ptp(run.channel(j.name))) for j in joints)
    assert np.max(np.abs(theirs - ours)) <= (EXACT if constant else 1e-3) * max(moved, 1e-3)


def start(m, model, data, run):
    """Puts the first sample of a run into the data; the connectors of loops follow from the closure of the engine."""
    from mechlab.engines.mujoco.model import MujocoMap

    map_ = MujocoMap(m, model)
    data.qpos[:] = map_.engine_coordinates(run.q[0])
    data.qvel[:] = map_.engine_rates(data.qpos, run.v[0])


def test_no_scene_of_the_catalog_has_a_drive_that_holds():
    """Their numbers are those of before: a scene that leaves a drive out says that it is free."""
    for name in catalog.NAMES:
        d = ml.load(name)
        for scene in d.entry.scenes:
            made = d.scene(scene)
            assert not held_drives(made.laws)
            m = d.for_scene(scene).mechanism(made.fidelity)
            words = what_acts(m, made)
            holding = any(x.stiffness or x.damping for x in m.drives)  # others have nothing to release
            assert ("released" in words) == (made.drives == "free" and holding)
            assert made.drives == "hold" or "free" in scene or not holding


STRANGE = """<mujoco model="strange"><default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <body><joint name="q" axis="0 1 0" ref="20"/><geom type="capsule" fromto="0 0 0 .4 0 0" size=".02" mass="1"/></body>
    <body pos="0 1 0"><joint name="r" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .4 0 0" size=".02" mass="1"/></body>
    <body pos="0 2 0"><joint name="s" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .4 0 0" size=".02" mass="1"/></body>
    <body pos="0 3 0"><joint name="u" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .4 0 0" size=".02" mass="1"/></body>
    <body pos="0 4 0"><joint name="w" axis="0 1 0" range="20 90"/>
      <geom type="capsule" fromto="0 0 0 .4 0 0" size=".02" mass="1"/></body>
  </worldbody>
  <actuator>
    <position joint="q" kp="200" kv="5"/> <position joint="r" kp="200" kv="5" ctrlrange=".2 1"/>
    <velocity joint="s" kv="9" forcerange="-1 1"/>
    <general joint="u" gear="2" gainprm="50" biastype="affine" biasprm="5 -50 -2"/>
    <position joint="w" kp="300" kv="9" inheritrange="1" forcerange="-30 30"/>
  </actuator>
</mujoco>"""


def test_actuators_of_strangers_do_what_they_do_in_their_own_file(tmp_path):
    """A ref, a ctrlrange without 0, a bounded velocity servo, a general actuator with gear and offset, an inherited range: the
    file as it came and mechlab's run of it, at 1 ms by RK4, to rounding; the joint w leaves the stop of its range at once,
    whose softness mechlab writes with a time constant of its own."""
    (tmp_path / "strange.xml").write_text(STRANGE)
    model = mujoco.MjModel.from_xml_string(STRANGE)
    model.opt.timestep, model.opt.integrator = 1e-3, mujoco.mjtIntegrator.mjINT_RK4
    model.jnt_solref[:] = 2e-3, 1.0
    model.jnt_solimp[:] = 0.9999, 0.9999, 0.001, 0.5, 2.0
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=250)
    run = ml.simulate(tmp_path / "strange.xml", engine="mujoco", duration=0.25, timestep=1e-3)
    ours = [run.final()[n] for n in "qrsu"]
    assert ours == pytest.approx(data.qpos[:4].tolist(), abs=1e-10)
    assert [
        law.motion.at(0.0)[0] for law in held_drives(ml.load(tmp_path / "strange.xml").scene().laws)
    ] == pytest.approx([0.0, 0.2, 0.0, 0.05, math.radians(20.0)])
    for drive in run.mechanism.drives:  # written and read again
        assert drive in from_json(to_json(run.mechanism)).drives
        again = from_mjcf(to_mjcf(run.mechanism)).drives
        (same,) = [d for d in again if d.name == drive.name]
        assert (same.stiffness, same.damping, same.limit) == (drive.stiffness, drive.damping, drive.limit)
        assert (
            same.target == pytest.approx(drive.target, abs=1e-15) if drive.target is not None else same.target is None
        )


def test_a_target_is_for_servos_alone():
    with pytest.raises(MechlabError, match="only a servo"):
        Builder("x").bar("arm", driven.revolute("q", "y"), 0.4).drive("q", damping=1.0, target=0.1).build()
    pushing = STRANGE.replace('<velocity joint="s" kv="9" forcerange="-1 1"/>', '<velocity joint="s" ctrlrange="1 2"/>')
    assert from_mjcf(pushing).drives[2].control == Control(range=(1.0, 2.0))
