"""What acts is one thing: gravity, springs and the declared drives, in every verb and every engine.

Against closed forms, and scipy's integration of equations written by hand. Files: test_drives_in_files.py.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import mechlab as ml
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.experiment.acting import acting, what_acts
from mechlab.experiment.held_rates import HeldRates, RateHold, ViscousBetween
from mechlab.experiment.laws import Constant, Servo
from mechlab.experiment.motion import Hold, Sine
from mechlab.experiment.scene import Scene
from mechlab.lab.fastest_rate import drive_step
from mechlab.lab.methods import Problem, method
from mechlab.mechanism import Builder, Inertia, prismatic, revolute
from mechlab.studies.chart.run import Budget, chart
from mechlab.studies.chart.score import reference_of
from mechlab.studies.stability.study import study
from tests.studies import driven

INERTIA, STIFFNESS = 0.08, 500.0
OMEGA = math.sqrt(STIFFNESS / INERTIA)
WEIGHTLESS = driven.arm(STIFFNESS, 0.0, gravity=0.0)
"""x'' = -OMEGA^2 x: 79.06 rad/s."""


def swing(t, start, damping=20.0, gravity=9.81, push=0.0):
    """Angle of the arm of `driven` about y, by its equation: I x'' = m g l cos x - k x - c x' + push."""

    def slope(_, y):
        return [y[1], (0.5 * gravity * 0.4 * np.cos(y[0]) - STIFFNESS * y[0] - damping * y[1] + push) / INERTIA]

    found = solve_ivp(slope, (0.0, t[-1]), [start, 0.0], method="DOP853", rtol=1e-12, atol=1e-14, t_eval=t)
    return found.y[0]


# -- by hand -----------------------------------------------------------------------------------------------------------


def test_an_arm_with_a_drive_does_not_fall():
    """Finding: it fell to -1.765 rad; the balance k x = m g l cos x holds it at 3.9 mrad."""
    run = ml.simulate(driven.arm())
    rest = fsolve(lambda x: STIFFNESS * x - 0.5 * 9.81 * 0.4 * np.cos(x), 0.0)[0]
    assert run.final()["q"] == pytest.approx(rest, abs=1e-9) and run.health.trusted
    assert run.final()["q_force"] == pytest.approx(-STIFFNESS * rest, rel=1e-6)
    assert run.acts == "gravity; servo q 500 N m/rad, 20 N m s/rad, held at 0"


def test_the_light_palletizer_stands_at_its_static_balance():
    """Finding: its servos, 2000 N m/rad and 100 N m s/rad on links of .1 kg, are too fast for explicit steps."""
    run = ml.simulate(driven.palletizer())
    q, r, g = run.final()["q"], run.final()["r"], 0.1 * 9.81 * 0.15
    outer = g * math.cos(q + r)
    inner = 0.1 * 9.81 * (0.15 + 0.3) * math.cos(q) + outer
    # rest is reached as exp(-20 t), 2 s: 4e-18
    assert (2000.0 * q, 2000.0 * r) == pytest.approx((inner, outer), rel=1e-6)
    assert run.health.trusted and run.settings.integrator == "discrete"


def test_a_stewart_platform_stands_on_its_drives():
    run = ml.simulate(driven.stewart(), duration=0.5)
    weight = 9.81 * run.mechanism.total_mass
    # six legs of 1e5 N/m, each steeper than 45 degrees: less than a millimetre
    assert 0.0 < -run.final()["p_z"] < weight / (6 * 1e5 * 0.5) and run.health.trusted


@pytest.mark.parametrize(
    ("engine", "error"), [("mujoco", 1e-7), ("pinocchio", 1e-7), ("one_freedom", 1e-7), ("hybrid", 1e-9)]
)
def test_every_engine_gives_the_held_motion(engine, error):
    """RK4 at no more than 1 ms leaves (h lambda)^5 / 120 of a start of .1 rad in a step; hybrid has 1e-10."""
    t = np.linspace(0.0, 0.3, 7)
    run = ml.simulate(driven.arm(), engine=engine, duration=0.3, q_0=0.1, timestep=2e-4, at=t.tolist())
    assert [run.at("q", x) for x in t] == pytest.approx(swing(t, 0.1).tolist(), abs=error)
    assert run.acts.endswith("held at 0") and "q_force" in run.channels


@pytest.mark.parametrize("engine", [None, "pinocchio"])
def test_the_error_that_is_asked_for_is_that_of_the_held_motion(engine):
    run = ml.simulate(WEIGHTLESS, engine=engine, duration=0.3, q_0=0.1, max_error=1e-6)
    assert run.final()["q"] == pytest.approx(0.1 * math.cos(0.3 * OMEGA), abs=1e-6)


def test_a_load_of_the_user_adds_to_the_drive():
    run = ml.simulate(driven.arm(gravity=0.0), q_force=10.0)
    assert run.final()["q"] == pytest.approx(10.0 / STIFFNESS, rel=1e-9)
    assert "servo q 500" in run.acts and "constant torque 10 N m on q" in run.acts and "in place" not in run.acts


def test_a_free_motion_is_a_scene_of_its_name():
    t = np.array([0.0, 0.2])
    found = solve_ivp(lambda _, y: [y[1], 9.81 / 0.4 * np.cos(y[0])], (0, 0.2), [0, 0], rtol=1e-12, atol=1e-14)
    run = ml.simulate(driven.arm(), scene="free-motion", duration=t[-1])
    assert run.final()["q"] == pytest.approx(found.y[0, -1], abs=1e-8)
    assert run.acts == "gravity; drive q released" and "q_force" not in run.channels


def test_a_law_takes_the_place_of_the_drive_and_it_is_said():
    m = driven.arm(gravity=0.0)
    scene = acting(m, Scene("pushed", "full", 1.0, (Constant("q", 2.0),)))
    assert scene.laws == (Constant("q", 2.0),) and acting(m, scene) == scene
    assert what_acts(m, scene) == "no gravity; constant torque 2 N m on q in place of its drive"
    assert acting(m, Scene("x", "full", 1.0, drives="free")).laws == ()
    held = acting(m, Scene("x", "full", 1.0))
    assert held.laws == (Servo("q", Hold(0.0), 500.0, 20.0, drive="q"),) and acting(m, held) == held
    moving = acting(m, Scene("x", "full", 1.0, (Servo("q", Sine(0.1, 3.0), 50.0, 1.0),)))
    assert what_acts(m, moving) == "no gravity; servo q 50 N m/rad, 1 N m s/rad, on its motion in place of its drive"
    with pytest.raises(MechlabError, match=r"drives .*loose.*hold"):
        Scene("x", "full", 1.0, drives="loose")


def test_two_of_three_drives_hold_where_a_law_has_the_third():
    b = Builder("three", gravity=(0.0, 0.0, -10.0))
    for k in range(3):
        b.body(f"mass_{k}", prismatic(f"z{k}"), at=(k, 0.0, 0.0), inertia=Inertia.point(2.0, (0.0, 0.0, 0.0)))
        b.drive(f"z{k}", 400.0, 40.0)
    m = b.build()
    d = ml.load(m)
    entry = replace(
        d.entry,
        scenes={
            "lifted": replace(
                d.entry.scenes["hold"], make=lambda p, f: Scene("lifted", f, 3.0, (Constant("z1", 21.0),))
            )
        },
        default_scene="lifted",
    )
    run = ml.simulate(replace(d, entry=entry))
    # 20 N on 400 N/m; 1 N lifts 2 kg for 3 s
    assert [run.final()[f"z{k}"] for k in range(3)] == pytest.approx([-0.05, 0.5 * 0.5 * 9.0, -0.05], rel=1e-6)
    assert run.acts == (
        "gravity; servos z0, z2 400 N/m, 40 N s/m, held at 0; constant force 21 N on z1 in place of its drive"
    )


def test_a_limit_and_a_zero_of_the_drive_count():
    """A servo that is limited to 1 N m lets 2 N m through; one on a joint with zero .7 holds .7."""
    run = ml.simulate(driven.arm(gravity=0.0, limit=1.0), q_force=2.0, duration=0.5)
    assert run.final()["q"] > 1.0 and run.final()["q_force"] == pytest.approx(1.0)  # 2 - 1 N m
    b = Builder("off", gravity=(0.0, 0.0, 0.0))
    b.body("arm", driven.revolute("q", "y", zero=0.7), inertia=Inertia.point(0.5, (0.4, 0.0, 0.0)))
    found = ml.simulate(b.drive("q", 500.0, 20.0).build(), q_0=0.8)
    assert found.final()["q"] == pytest.approx(0.7, abs=1e-9) and "held at 0.7 rad" in found.acts


# -- the verbs ---------------------------------------------------------------------------------------------------------


def test_modes_of_a_held_arm():
    found = ml.modes(WEIGHTLESS)
    assert len(found.answering) == 3
    for witness in found.answering.values():
        assert [m.omega for m in witness.modes] == pytest.approx([OMEGA], rel=1e-8)
    assert found.acts == "no gravity; servo q 500 N m/rad, held at 0" and f"what acts: {found.acts}" in found.text()
    by_scene = ml.modes(WEIGHTLESS, scene="hold")
    assert by_scene.modes[0].omega == pytest.approx(OMEGA, rel=1e-8)
    hanging = ml.modes(driven.arm(), scene="free-motion")  # about the rest below
    assert hanging.modes[0].omega == pytest.approx(math.sqrt(9.81 / 0.4), rel=1e-8)
    sagging = ml.modes(driven.arm())
    rest = fsolve(lambda x: STIFFNESS * x - 0.5 * 9.81 * 0.4 * np.cos(x), 0.0)[0]
    assert sagging.equilibrium["q"] == pytest.approx(rest, abs=1e-10)


def test_a_sweep_runs_the_held_arm():
    found = ml.sweep(WEIGHTLESS, {"q_0": [0.05, 0.1, 0.2]}, ["q"], duration=0.2, timestep=2e-4)
    values = np.asarray(found.flat)[:, 0]
    assert values == pytest.approx(np.array([0.05, 0.1, 0.2]) * math.cos(0.2 * OMEGA), abs=1e-6)


def test_a_chart_is_of_the_held_arm():
    d = ml.load(WEIGHTLESS)
    made = d.scene(None, duration=0.2, extra={"q_0": 0.1})
    truth = reference_of(Problem(d, made))
    times = np.linspace(0.0, 0.2, len(truth.values))
    assert np.ravel(truth.values) == pytest.approx(0.1 * np.cos(OMEGA * times), abs=1e-9)
    methods = [method("MuJoCo RK4, defaults"), method("MuJoCo discrete, defaults")]
    drawn = chart(d, duration=0.2, methods=methods, budget=Budget(0.05, 0.5, 0.0, 1))
    assert drawn.acts == "no gravity; servo q 500 N m/rad, held at 0" and drawn.acts in drawn.text()


@pytest.mark.parametrize(("name", "order"), [("MuJoCo RK4, defaults", 4), ("MuJoCo discrete, defaults", 1)])
def test_methods_of_a_chart_follow_the_held_arm(name, order):
    """Error over the amplitude, h = .5 ms: RK4 OMEGA t (h OMEGA)^4 / 120, discrete OMEGA t (h OMEGA) / 2 at most."""
    d = ml.load(WEIGHTLESS)
    problem = Problem(d, d.scene(None, duration=0.2, extra={"q_0": 0.1}))
    found = method(name).run(problem, 5e-4)
    exact = 0.1 * math.cos(0.2 * OMEGA)
    bound = 0.1 * OMEGA * 0.2 * ((5e-4 * OMEGA) ** 4 / 120 if order == 4 else 5e-4 * OMEGA / 2)
    assert abs(found.q[-1, 0] - exact) <= 1.2 * bound


def test_stability_of_a_held_arm():
    """RK4 stands up to h = 2.83 / omega; the drive is an actuator, which `discrete` takes implicitly: no limit."""
    names = ["MuJoCo RK4, defaults", "MuJoCo discrete, defaults"]
    d = ml.load(WEIGHTLESS)
    entry = replace(
        d.entry,
        scenes={"hold": replace(d.entry.scenes["hold"], make=lambda p, f: Scene("hold", f, 1.0, initial={"q": 0.1}))},
    )
    found = study(replace(d, entry=entry), kinds=["stiffness"], methods=names, budget=6.0)
    assert found.acts == "no gravity; servo q 500 N m/rad, held at 0"
    shown = found.map("stiffness")
    (line,) = [t for t in shown.theory if names[0] in t.methods]
    assert not [t for t in shown.theory if names[1] in t.methods]
    at = dict(zip(line.y, line.x, strict=True))
    for factor, limit in at.items():
        assert limit == pytest.approx(2.0 * math.sqrt(2.0) / (OMEGA * math.sqrt(factor)), rel=2e-3)
    blown = {"blown up"}
    steps = shown.x.values
    checked = 0
    for k, factor in enumerate(shown.y.values):
        rk4, discrete = shown.panel(names[0]).cells[k], shown.panel(names[1]).cells[k]
        assert not blown & {c.outcome.value for c in discrete}
        for h, cell in zip(steps, rk4, strict=True):
            if h > 1.3 * at[factor] and cell.outcome.value != "not run":
                checked += cell.outcome.value in ("blown up", "wrong")
                assert cell.outcome.value in ("blown up", "wrong")
    assert checked


def test_settings_follow_the_fastest_drive():
    """I x'' = -c x': .08 / 20 = 4 ms; half of that, rounded down to 1, 2 or 5, is 2 ms: 1 ms stays."""
    d = ml.load(driven.arm(0.0, 20.0))
    assert drive_step(d.mechanism(), d.scene()) == pytest.approx(2e-3)
    stiff = ml.load(driven.arm(STIFFNESS * 1e4, 0.0))
    assert drive_step(stiff.mechanism(), stiff.scene()) == pytest.approx(5e-5)  # .5 / 7906 = 6.3e-5
    assert drive_step(d.mechanism(), d.scene("free-motion")) == math.inf


# -- saying so ---------------------------------------------------------------------------------------------------------


USER_FILE = """
from mechlab.mechanism import Builder, Inertia, revolute


def arm(stiffness=500.0):
    b = Builder("arm")
    b.body("arm", revolute("q", "y"), inertia=Inertia.point(0.5, (0.4, 0.0, 0.0)))
    if stiffness:
        b.drive("q", stiffness=stiffness, damping=20.0)
    return b.build()
"""


def test_the_line_stands_in_text_json_recording_and_page(tmp_path, capsys):
    source = tmp_path / "own.py"
    source.write_text(USER_FILE)
    line = "gravity; servo q 500 N m/rad, 20 N m s/rad, held at 0; constant torque 3 N m on q"
    saved = tmp_path / "run.npz"
    assert main(["simulate", f"{source}:arm", "q_force=3", "--duration", "0.05", "-o", str(saved)]) == 0
    assert f"what acts: {line}" in capsys.readouterr().out
    assert main(["simulate", f"{source}:arm", "q_force=3", "--duration", "0.05", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["acts"] == line and document["scene"] == "hold"
    assert ml.load_recording(saved).acts == line
    page = tmp_path / "page.html"
    ml.view(str(saved), html=page)
    assert "held at 0; constant torque 3 N m on q" in page.read_text()


def test_held_rates_are_named_by_what_their_bounds_mean():
    """Dry friction where they are opposite, a stop where one of them is 0, a kept rate where there is none; the laws inside as well."""
    b = Builder("two", gravity=(0.0, 0.0, 0.0))
    b.body("arm", revolute("q", "y"), inertia=Inertia.point(0.5, (0.4, 0.0, 0.0)))
    b.body("block", prismatic("x", "x"), inertia=Inertia.point(1.0, (0.0, 0.0, 0.0)))
    m = b.build()
    holds = (
        RateHold("x", low=-7.0, high=7.0), RateHold("q", low=0.0), RateHold("x", 2.0, high=0.0), RateHold((("q", 1.0), ("x", -2.0)), 3.0),
        RateHold("q", 1.0, -4.0, 5.0),
    )  # fmt: skip
    law = HeldRates(holds, (Constant("q", 3.0), ViscousBetween("q", "x", 0.5)))
    said = what_acts(m, acting(m, Scene("x", "full", 1.0, (law,))))
    assert said.split("; ") == [
        "no gravity", "constant torque 3 N m on q", "drag 0.5 N m s/rad between q and x", "dry friction 7 N on x",
        "one-way stop: rate of q at least 0 rad/s", "one-way stop: rate of x at most 2 m/s", "rate of q - 2 x held at 3 rad/s",
        "rate of q held at 1 rad/s by -4 to 5 N m",
    ]  # fmt: skip


def test_without_drives_the_default_is_the_free_motion(tmp_path, capsys):
    source = tmp_path / "own.py"
    source.write_text(USER_FILE)
    assert main(["simulate", f"{source}:arm", "stiffness=0", "--duration", "0.05", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["scene"] == "free-motion" and document["acts"] == "gravity"
    assert main(["show", f"{source}:arm"]) == 0
    assert "hold (default)" in capsys.readouterr().out
