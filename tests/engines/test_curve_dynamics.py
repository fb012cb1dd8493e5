"""Motion with a curve: Pinocchio and MuJoCo against the equation of the one freedom, integrated by scipy with the closed law of the cam.

A cam of inertia I lifts a mass m against a spring and gravity by s(a):

    (I + m s'^2) a'' + m s' s'' a'^2 + (k (s - s0) + m g) s' = torque        force on the follower = m s'' + k (s - s0) + m g
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechlab as ml
from mechlab.analytic.cams import rise_and_fall
from mechlab.analytic.geneva import engaged_from
from mechlab.engines.mujoco.batch import why_not_together
from mechlab.engines.mujoco.fleet import Fleet
from mechlab.engines.peers.engine import INTEGRATORS, not_expressible
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.laws import Constant
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.profiles import cam_curve, geneva_curve
from mechlab.mechanism import Builder, Inertia, Mechanism, prismatic, revolute

INERTIA, MASS, STIFFNESS, REST, GRAVITY = 0.02, 0.8, 3000.0, -0.01, 9.81
PARTS = (0.03, 2.0, 0.7, 1.8)
"""Lift [m]; rise, top, fall [rad]."""


def cam() -> Mechanism:
    """The cam at the bottom; its law of motion is smooth."""
    b = Builder("cam", gravity=(0.0, 0.0, -GRAVITY))
    b.body("disc", revolute("a", "y"), inertia=Inertia(1.0, (0.0, 0.0, 0.0), (0.01, INERTIA, 0.01, 0.0, 0.0, 0.0)))
    b.body("rod", prismatic("s", "z", stiffness=STIFFNESS, spring_rest=REST), inertia=Inertia(MASS, (0, 0, 0), (0.01, 0.01, 0.01, 0, 0, 0)))
    return b.curve("contact", "s", "a", cam_curve("cycloidal", *PARTS)).build()


def law(a: float) -> tuple[float, float, float]:
    s, v, w = rise_and_fall("cycloidal", np.array([a]), *PARTS)
    return float(s[0]), float(v[0]), float(w[0])


def force(a: float, v: float, acceleration: float) -> float:
    """On the follower from the cam."""
    s, slope, bend = law(a)
    return MASS * (slope * acceleration + bend * v * v) + STIFFNESS * (s - REST) + MASS * GRAVITY


def acceleration(a: float, v: float, torque: float) -> float:
    s, slope, bend = law(a)
    return (torque - (MASS * bend * v * v + STIFFNESS * (s - REST) + MASS * GRAVITY) * slope) / (INERTIA + MASS * slope**2)


def truth(duration: float, v0: float, torque: float) -> tuple[float, float]:
    found = solve_ivp(
        lambda t, y: (y[1], acceleration(y[0], y[1], torque)), (0.0, duration), (0.3, v0), method="DOP853", rtol=1e-12, atol=1e-13
    )
    return float(found.y[0, -1]), float(found.y[1, -1])


TIME, SPEED, TORQUE = 0.9, 20.0, 0.4


def run(name: str, settings: Settings, scene: Scene | None = None) -> Recording:
    scene = scene or Scene("turn", "full", TIME, (Constant("a", TORQUE),), {"a": 0.3}, {"a": SPEED})
    return engine(name).run(cam(), scene, settings)


@pytest.mark.parametrize("name", ["pinocchio", "mujoco"])
def test_accelerations_and_reaction_at_states(name: str) -> None:
    """MuJoCo's rows are soft: they miss (1 - d) = 1e-4 of the acceleration that they hold back. The law is sampled to 1e-6 of its second
    derivative."""
    m, e = cam(), engine(name)
    for a, v in ((0.5, 3.0), (1.1, -8.0), (2.4, 5.0), (3.4, 11.0), (7.0, 4.0)):
        q, rates = np.array([a, law(a)[0]]), np.array([v, law(a)[1] * v])
        found = e.accelerations(m, q, rates, np.array([TORQUE, 0.0]))
        wanted = acceleration(a, v, TORQUE)
        both = np.array([wanted, law(a)[1] * wanted + law(a)[2] * v * v])
        soft = 0.0 if name == "pinocchio" else 2e-4 * abs(force(a, v, wanted)) / MASS
        np.testing.assert_allclose(found, both, atol=1e-5 * max(1.0, abs(wanted)) + soft)


def test_pinocchio_follows_the_equation_of_the_one_freedom() -> None:
    """RK4 of 1 ms, projected on the curve: 1e-7; the reaction is the force on the follower."""
    found = run("pinocchio", Settings("pinocchio", timestep=1e-3))
    a, v = truth(TIME, SPEED, TORQUE)
    assert a > 2.5 * math.pi  # more than a turn
    np.testing.assert_allclose([found.channel("a")[-1], found.channel("a_rate")[-1]], [a, v], atol=2e-7)
    for k in range(0, len(found.t), 97):
        wanted = force(*(float(found.channel(n)[k]) for n in ("a", "a_rate", "a_accel")))
        assert found.channel("contact_load")[k] == pytest.approx(wanted, abs=2e-3)
    assert found.health.trusted


def test_mujoco_converges_with_the_square_of_its_softness() -> None:
    """Softness and timestep halved together: the error falls fourfold, as that of loops and gears; nothing lags by a stage, which
    would make it halve. Reactions are those of the follower at every stage, the first included."""
    a, v = truth(TIME, SPEED, TORQUE)
    errors = []
    for h in (2e-3, 1e-3, 5e-4):
        found = run("mujoco", Settings(timestep=h, timeconst=2.0))
        errors.append(abs(float(found.channel("a")[-1]) - a) + 0.1 * abs(float(found.channel("a_rate")[-1]) - v))
    assert errors[0] / errors[1] > 3.0 and errors[1] / errors[2] > 3.0 and errors[2] < 2e-5, errors
    for k in (0, 300, len(found.t) - 1):
        wanted = force(*(float(found.channel(n)[k]) for n in ("a", "a_rate", "a_accel")))
        assert found.channel("contact_load")[k] == pytest.approx(wanted, rel=2e-3)


@pytest.mark.parametrize(("name", "drift"), [("pinocchio", 1e-7), ("mujoco", 2e-4)])
def test_energy_is_kept_over_many_turns(name: str, drift: float) -> None:
    """A free turn: the cam loads the spring and the spring drives the cam; the energy stays, to the error of RK4 and of soft rows."""
    scene = Scene("free", "full", 4.0, (), {"a": 0.3}, {"a": 30.0})
    found = run(name, Settings(name, timestep=5e-4), scene)
    m = cam()
    assert float(found.channel("a")[-1]) > 12.0 * math.pi
    total = []
    for k in range(0, len(found.t), 25):
        a, v, s, u = (float(found.channel(n)[k]) for n in ("a", "a_rate", "s", "s_rate"))
        total.append(0.5 * INERTIA * v * v + 0.5 * MASS * u * u + 0.5 * STIFFNESS * (s - REST) ** 2 + MASS * GRAVITY * s)
    assert m.nv == 2 and np.ptp(total) < drift * total[0]


def test_work_of_the_cam_is_the_work_of_the_follower() -> None:
    """Over a rise at constant rate: torque x turn = spring + weight, by inverse dynamics of both witnesses; the load is the force."""
    m, rate = cam(), 5.0
    a = np.linspace(0.0, 2.0, 401)
    s, v, w = rise_and_fall("cycloidal", a, *PARTS)
    q, rates = np.stack([a, s], axis=1), rate * np.stack([np.ones(401), v], axis=1)
    for name in ("pinocchio", "mujoco"):
        found = engine(name).motion_forces(m, q, rates, "a", 0.0, np.zeros(2))
        np.testing.assert_allclose(found.drive, v * (MASS * rate**2 * w + STIFFNESS * (s - REST) + MASS * GRAVITY), atol=3e-6)
        work = float(np.sum(0.5 * (found.drive[1:] + found.drive[:-1]) * np.diff(a)))
        lift = PARTS[0]
        # trapezoidal rule of a smooth integrand that vanishes at both ends: its error is far below 1e-6
        assert work == pytest.approx(0.5 * STIFFNESS * ((lift - REST) ** 2 - REST**2) + MASS * GRAVITY * lift, rel=1e-6)


def test_the_jump_of_a_geneva_wheel_is_met_in_time() -> None:
    """A free crank turns the wheel: I_c a'^2 + I_w b'^2 stays; the pin enters at rest of the wheel, so that nothing is lost there."""
    b = Builder("geneva", gravity=(0, 0, 0)).body("crank", revolute("a", "z"), inertia=Inertia(1.0, (0, 0, 0), (0.01, 0.01, 0.01, 0, 0, 0)))
    b.body("wheel", revolute("b", "z"), at=(0.1, 0, 0), inertia=Inertia(1.0, (0, 0, 0), (0.005, 0.005, 0.005, 0, 0, 0)))
    m = b.curve("slot", "b", "a", geneva_curve(4)).build()
    start = -engaged_from(4) - 0.5
    scene = Scene("free", "full", 1.0, (), {"a": start}, {"a": 6.0})
    # the step in which the acceleration jumps is of second order: 1e-5 for Pinocchio's 1 ms
    for name, settings, allowed in (("pinocchio", Settings("pinocchio", timestep=1e-3), 1e-5), ("mujoco", Settings(timestep=2.5e-4), 2e-4)):
        found = engine(name).run(m, scene, settings)
        energy = 0.5 * 0.01 * found.channel("a_rate") ** 2 + 0.5 * 0.005 * found.channel("b_rate") ** 2
        assert found.channel("a")[-1] > engaged_from(4)
        assert np.max(np.abs(energy / energy[0] - 1.0)) < allowed, name


def test_a_session_follows_the_curve_and_runs_side_by_side_say_why_not() -> None:
    driven = Builder.of(cam()).drive("a", stiffness=50.0, damping=1.0).build()
    with ml.session(driven, hold=0.01) as s:
        for k in range(80):
            s.step({"a": min(0.04 * k, 2.2)})
        found = s.recording()
        a, lift = found["a"], found["s"]
        assert a[-1] > 1.5
        # softness: r = (1 - d) tc^2 A f, below 1e-5 m here
        np.testing.assert_allclose(lift, rise_and_fall("cycloidal", a, *PARTS)[0], atol=1e-5)
        with pytest.raises(MechlabError, match="curves are followed in a callback"):
            Fleet(s, 2)
    scene = Scene("turn", "full", 1.0)
    assert "curves" in why_not_together(driven, scene, Settings(timestep=1e-3))
    assert "curve contact" in not_expressible("drake", INTEGRATORS["drake"][0], driven, scene)
