"""Motion of MuJoCo runs against closed forms and against dense equations integrated on their own."""

from __future__ import annotations

import math
import threading
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mechlab.engines.mujoco.model import _compiled, to_mujoco
from mechlab.engines.mujoco.runner import run
from mechlab.errors import MechlabError
from mechlab.experiment.laws import Constant, Harmonic, Servo, Viscous
from mechlab.experiment.motion import Hold
from mechlab.experiment.scene import Scene, Settings, preset
from mechlab.mechanism import Builder, Inertia, Mechanism, TreeKinematics, mode_sign, prismatic, revolute, spherical

T = 0.373  # [s] no multiple of any timestep used here


def cart() -> Mechanism:
    return Builder("cart").body("cart", prismatic("x", "x", zero=0.5), inertia=Inertia.point(2.0)).build()


def pendulum(**options: object) -> Mechanism:
    b = Builder("pendulum", gravity=(0.0, -9.81, 0.0))
    b.body("bob", revolute("angle", **options), inertia=Inertia.point(1.0, (0.5, 0.0, 0.0)))
    b.frame("tip", "bob", (0.5, 0, 0))
    b.drive("angle", damping=7.0)
    return b.build()


@pytest.mark.parametrize("kind", ["spherical", "revolute", "cylindrical", "universal"])
def test_fourbar_closed_by_every_kind_moves_as_the_dense_equations_say(lab, kind):
    m = lab.fourbar(kind)
    r = run(m, Scene("free", "full", T, initial_rates={"crank_angle": 4.0}))
    q, _ = lab.motion(m, r.q[0], r.v[0], T)
    # RK4 at 1 ms with solref 2h: softness leaves errors of order 1e-6 rad over one swing (anchors: 9e-5 after 1 s)
    assert np.abs(r.q[-1] - q).max() < 1e-5
    assert r.t[-1] == T
    assert r.health.trusted, [f.sentence for f in r.health.findings]
    assert r.health.finding("loop_gap").value < 1e-6  # [m] as measured for RK4 at 1 ms
    assert r.health.finding("energy_balance").value < 1e-4


@pytest.mark.parametrize("kind", ["prismatic", "cylindrical", "fixed"])
@pytest.mark.parametrize("ground_first", [True, False])
def test_slider_crank_with_connectors_moves_as_the_dense_equations_say(lab, kind, ground_first):
    m = lab.slider_crank(kind, ground_first)
    r = run(m, Scene("free", "full", T, initial_rates={"crank_angle": 4.0}))
    q, _ = lab.motion(m, r.q[0], r.v[0], T)
    assert np.abs(r.q[-1] - q).max() < 1e-6  # measured 8e-8
    assert r.health.finding("loop_gap").value < 1e-6


def test_error_falls_with_the_square_of_the_timestep(lab):
    m = lab.fourbar()
    errors = []
    for h in (2e-3, 1e-3, 5e-4):
        r = run(m, Scene("free", "full", T, initial_rates={"crank_angle": 4.0}), Settings(timestep=h))
        errors.append(np.abs(r.q[-1] - lab.motion(m, r.q[0], r.v[0], T)[0]).max())
    # solref 2h: the softness is of second order in h, a factor of 4 a halving; 2.5 leaves room for phase
    assert errors[0] / errors[1] > 2.5 and errors[1] / errors[2] > 2.5


def test_laws_are_evaluated_at_the_stages_of_a_step():
    """A pendulum under a harmonic torque: fourth order. A force held over the step would be of first order."""
    law = Harmonic("angle", 6.0, 9.0, 0.3)
    t_end = 0.519

    def rhs(t, y):
        return [y[1], (6.0 * math.sin(9.0 * t + 0.3) - 9.81 * 0.5 * math.cos(y[0])) / 0.25]

    exact = solve_ivp(rhs, (0.0, t_end), [0.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    errors = []
    for n in (30, 60, 120):  # h = 17.3 ms, 8.65 ms, 4.3 ms: divides no period
        r = run(pendulum(), Scene("driven", "full", t_end, (law,)), Settings(timestep=t_end / n))
        errors.append(np.hypot(r.q[-1, 0] - exact[0], r.v[-1, 0] - exact[1]))
        assert r.cost.steps == n and r.cost.evaluations == 4 * n
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 3.7), (errors, orders)  # 4 in the limit


def test_planetary_stage_accelerates_as_its_energy_says(lab):
    m = lab.planetary()
    torque, t_end = 0.7, 0.2
    r = run(m, Scene("torque", "full", t_end, (Constant("sun", torque),)))
    inertia = {b.name: b.inertia for b in m.bodies}
    i_sun, i_carrier, i_ring, i_planet = (inertia[n].tensor[2] for n in ("sun", "carrier", "ring", "planet_0"))
    # rates of ring and of a planet in the base from those of sun and carrier (Willis)
    ring = np.array([-24 / 84, 1 + 24 / 84])
    planet = np.array([-24 / 30, 1 + 24 / 30])
    mass = np.diag([i_sun, i_carrier + 3 * inertia["planet_0"].mass * 0.054**2])
    mass = mass + i_ring * np.outer(ring, ring) + 3 * i_planet * np.outer(planet, planet)
    sun, carrier = np.linalg.solve(mass, [torque, 0.0])
    end = r.final()
    # the motion is uniformly accelerated; the soft rows reach their steady slip within a few ms (solref 2 ms)
    assert end["sun_accel"] == pytest.approx(sun, rel=1e-9)
    assert end["carrier_accel"] == pytest.approx(carrier, rel=1e-9)
    assert end["sun_rate"] == pytest.approx(sun * t_end, rel=1e-5)
    slip = r.health.finding("relation_softness").value
    measured = r.health.finding("relation_residual").value
    # in steady acceleration the predicted slip is the slip; its transient overshoots nothing (critical damping)
    assert slip == pytest.approx(measured, rel=0.05)


def test_energy_is_told_from_work_of_laws_and_dampers():
    laws = (Harmonic("angle", 3.0, 11.0), Viscous("angle", 0.2))
    for settings in (preset("accurate"), preset("stiff")):
        r = run(pendulum(damping=0.1), Scene("driven", "full", 1.0, laws), settings)
        # RK4: rounding of Simpson's rule for the damper; first order for the other
        assert r.health.finding("energy_balance").value < (1e-6 if settings.integrator == "RK4" else 5e-3)


def test_servos_of_the_file_do_not_act():
    """The drive of the pendulum is a damper in the file; a free swing must not feel it."""
    r = run(pendulum(), Scene("free", "full", 1.0))
    energy = 0.5 * 0.25 * r.v[:, 0] ** 2 + 9.81 * 0.5 * np.sin(r.q[:, 0])
    assert np.ptp(energy) < 1e-9  # [J] of 4.9: RK4 at 1 ms


def test_ball_joint_spins_as_euler_says():
    """A body on a ball joint, its wheel driven from inside, no gravity: the angular momentum in the base is kept."""
    b = Builder("top", gravity=(0.0, 0.0, 0.0))
    b.body("top", spherical("turn"), inertia=Inertia(1.0, (0, 0, 0), (0.02, 0.03, 0.045, 0.004, -0.003, 0.002)))
    m = b.body("wheel", revolute("wheel", "x"), parent="top", inertia=Inertia.cylinder(0.1, 0.05, 0.01)).build()
    r = run(m, Scene("spin", "full", 1.0, (Constant("wheel", 1e-3),), initial_rates={"wheel": 40.0}))
    assert r.health.trusted and r.q.shape[1] == 5 and r.v.shape[1] == 4
    momentum = []
    for q, v in zip(r.q, r.v, strict=True):
        tree = TreeKinematics(m, q, v)
        parts = [(tree.pose(x.name)[0], x.inertia.matrix(), tree.velocity(x.name, np.zeros(3))[3:]) for x in m.bodies]
        momentum.append(sum(rotation @ tensor @ rotation.T @ w for rotation, tensor, w in parts))
    assert np.abs(momentum[0]).max() > 1e-3  # [N m s]
    assert np.ptp(momentum, axis=0).max() < 1e-10  # RK4 at 1 ms: (w h)^4


def test_every_sample_is_of_its_own_state():
    m = pendulum()
    r = run(m, Scene("free", "full", T, initial={"angle": 0.3}, initial_rates={"angle": -2.0}))
    expected = -9.81 / 0.5 * np.cos(r.channel("angle"))
    # rounding; an acceleration that lags by a step would be off by 4e-2
    assert np.abs(r.channel("angle_accel") - expected).max() < 1e-11
    assert np.abs(r.channel("tip_x") - 0.5 * np.cos(r.channel("angle"))).max() < 1e-14
    force = run(m, Scene("h", "full", T, (Harmonic("angle", 1.0, 20.0),))).channel("angle_force")
    t = run(m, Scene("h", "full", T, (Harmonic("angle", 1.0, 20.0),))).t
    assert np.abs(force - np.sin(20.0 * t)).max() < 1e-11


def test_sampling_does_not_change_the_motion(lab):
    m = lab.fourbar()
    scene = Scene("driven", "full", T, (Harmonic("crank_angle", 0.2, 5.0),))
    a = run(m, scene)
    b = run(m, scene, sample_times=[0.0512345, 0.2, 0.33333])
    assert len(b.t) > 0 and np.array_equal(a.q[-1], b.q[-1]) and np.array_equal(a.v[-1], b.v[-1])


def test_samples_stand_at_or_around_the_times_that_are_asked():
    m = cart()
    scene = Scene("push", "full", 7.0003, (Harmonic("x", 3.0, 40.0),))
    r = run(m, scene, sample_times=[1.0, 2.34567])
    assert len(r.t) < 1100 and r.t[0] == 0.0 and r.t[-1] == 7.0003 and np.all(np.diff(r.t) > 0)
    assert 1.0 in r.t
    for t in (1.0, 2.34567, 7.0003):
        exact = 0.5 + 1.5 / 40.0 * (t - math.sin(40.0 * t) / 40.0)
        # RK4 is Simpson's rule here: (wh)^4 / 2880 = 9e-10 relative; the cubic adds (h^4/24) F w^2/m = 1e-10
        assert r.at("x", t) == pytest.approx(exact, abs=1e-9)
    with pytest.raises(MechlabError, match="sample times"):
        run(m, scene, sample_times=[8.0])


def test_a_blow_up_ends_the_run_and_says_when_and_why(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    m = pendulum()
    scene = Scene("hard", "full", 2.0, (Servo("angle", Hold(0.5), 1e7, 1e3),))
    r = run(m, scene)
    assert not r.health.trusted and r.health.exit_code == 3
    found = r.health.finding("blow_up")
    assert found.severity == "error" and 0.0 < found.value < 0.5
    assert "angle" in found.sentence and "t = " in found.sentence and "timestep" in found.sentence
    assert r.t[-1] < found.value and np.all(np.isfinite(r.q)) and np.all(np.isfinite(r.v))
    assert not any(np.any(~np.isfinite(c)) for c in r.channels.values())
    assert r.cost.steps < 2000
    assert list(tmp_path.iterdir()) == [] and capfd.readouterr().err == ""  # no MUJOCO_LOG.TXT, no chatter
    finer = run(m, Scene("hard", "full", 0.1, scene.laws), Settings(timestep=1e-4))
    assert finer.health.trusted  # the advice helps


def test_errors_of_laws_surface_and_the_callback_goes():
    class Broken:
        kind = "broken"

        def force(self, t, plant):
            raise ZeroDivisionError("mine")

        def targets(self):
            return ("angle",)

    with pytest.raises(ZeroDivisionError, match="mine"):
        run(pendulum(), Scene("bad", "full", 0.1, (Broken(),)))
    assert mujoco.get_mjcb_control() is None and mujoco.get_mju_user_warning() is None
    with pytest.raises(MechlabError, match="the force nan at t = 0"):
        run(pendulum(), Scene("bad", "full", 0.1, (Constant("angle", math.nan),)))
    with pytest.raises(MechlabError, match="joint or shaft 'angel' does not exist"):
        run(pendulum(), Scene("bad", "full", 0.1, (Constant("angel", 1.0),)))
    assert mujoco.get_mjcb_control() is None


def test_runs_in_threads_do_not_see_each_other(lab):
    m = lab.fourbar()
    scenes = [Scene(str(k), "full", 0.3, (Constant("crank_angle", 0.1 * k),)) for k in range(3)]
    scenes.append(Scene("free", "full", 0.3))
    alone = [run(m, s, Settings(timestep=1e-3 + 1e-6 * k)).q[-1] for k, s in enumerate(scenes)]
    _compiled.cache_clear()  # MuJoCo compiles, too, while other threads run with their laws
    together: dict[int, np.ndarray] = {}

    def work(k: int) -> None:
        together[k] = run(m, scenes[k], Settings(timestep=1e-3 + 1e-6 * k)).q[-1]

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(alone[k], together[k]) for k in range(4))
    assert mujoco.get_mjcb_control() is None


def test_a_law_cannot_compile_a_model(lab):
    class Curious:
        kind = "curious"

        def force(self, t, plant):
            to_mujoco(replace(plant.mechanism, gravity=(0.0, 0.0, -1.62)))
            return {}

        def targets(self):
            return ("angle",)

    with pytest.raises(MechlabError, match="cannot compile"):
        run(pendulum(), Scene("s", "full", 0.1, (Curious(),)))


def test_health_tells_what_one_must_know():
    scene = Scene("s", "full", 0.2, (Servo("x", Hold(5.0), 100.0, 1.0, limit=2.0),))
    r = run(cart(), scene, preset("draft"))
    assert r.health.finding("settings").severity == "warning"
    assert r.health.finding("saturation").value > 0.9
    assert "velocit" not in r.health.finding("engine_warnings").sentence
    assert "(v+ - v) / h" in run(cart(), scene, preset("stiff")).health.finding("accelerations").sentence
    assert r.versions["mujoco"] == mujoco.__version__ and r.units["x_accel"] == "m/s2" and r.units["x_force"] == "N"
    b = Builder("stop").body("cart", prismatic("x", "x", range=(-0.1, 0.1)), inertia=Inertia.point(1.0))
    hit = run(b.build(), Scene("s", "full", 0.3, initial_rates={"x": 1.0}))
    assert hit.health.finding("range").severity == "warning" and hit.health.trusted
    with pytest.raises(MechlabError, match="engine 'pinocchio'"):
        run(cart(), scene, Settings(engine="pinocchio"))
    with pytest.raises(MechlabError, match="duration"):
        run(cart(), Scene("s", "full", 0.0))


def test_a_law_that_meets_a_lost_state_ends_the_run(capfd: pytest.CaptureFixture[str]) -> None:
    """This crank cannot turn fully: driven past its limit by inverse dynamics, the run is lost, and no least squares complain."""
    from mechlab import api

    recording = api.simulate("class4_linkage", DE=0.88017912841304247)
    found = recording.health.finding("blow_up")
    assert found.severity == "error" and 0.4 < recording.t[-1] < 0.6
    assert "DLASCL" not in "".join(capfd.readouterr())


def test_a_run_ends_at_the_first_sample_in_another_assembly_mode(lab):
    """Samples are looked at in blocks; the run ends where the mode changes, told pose by pose, and is the same up to there."""
    m = lab.fourbar()
    scene = Scene("free", "full", 0.6, initial_rates={"crank_angle": 8.0})
    whole, kept = run(m, scene), run(m, replace(scene, keep_mode=("rocker_angle",)))
    signs = [mode_sign(m, q, ["rocker_angle"]) for q in whole.q]
    end = next(k for k, sign in enumerate(signs) if sign * signs[0] < 0)
    assert 40 < end < len(whole.t) - 40 and end % 32
    assert len(kept.t) == end + 1 and kept.cost.steps == round(kept.t[-1] / kept.settings.timestep)
    for a, b in ((kept.t, whole.t), (kept.q, whole.q), (kept.v, whole.v), *((kept[n], whole[n]) for n in kept.channels)):
        assert np.array_equal(a, b[: end + 1])
    assert not kept.health.trusted and kept.health.finding("assembly_mode").severity == "error"
    assert "blow_up" not in [f.name for f in kept.health.findings]
