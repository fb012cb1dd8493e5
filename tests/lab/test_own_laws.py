"""Laws, commands of drives and scenes from Python, held against closed forms of one rotor."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechlab as ml
from mechlab.cli import main

INERTIA = 0.02
RK4 = 1e-9  # RK4 at 1 ms on motions with rates of change of some 10/s: (10 h)^4 of the motion, 1e-8, times a constant below 1/10


def rotor(inertia: float = INERTIA, stiffness: float = 0.0, damping: float = 0.0, limit: float | None = None) -> ml.Mechanism:
    """A wheel on one axis, without weight."""
    b = ml.Builder("rotor", gravity=(0.0, 0.0, 0.0))
    b.body("wheel", ml.revolute("turn"), inertia=ml.Inertia(1.0, (0.0, 0.0, 0.0), (inertia, inertia, inertia, 0.0, 0.0, 0.0)))
    b.frame("tip", "wheel", (0.1, 0.0, 0.0))
    b.drive("turn", stiffness=stiffness, damping=damping, limit=limit)
    return b.build()


def turned(recording: ml.Recording) -> np.ndarray:
    return recording["turn"]


def test_a_function_of_time_is_integrated_twice() -> None:
    run = ml.simulate(rotor(), laws={"turn": lambda t, plant: 0.3 * math.cos(4.0 * t)}, duration=1.0)
    expected = 0.3 / INERTIA * (1.0 - np.cos(4.0 * run.t)) / 16.0
    assert np.max(np.abs(turned(run) - expected)) < RK4
    assert run.health.trusted


def test_a_function_of_the_state_is_evaluated_at_every_stage() -> None:
    """A spring by hand: 0.8 N m/rad gives cos(sqrt(0.8 / I) t); a force held over the step would leave an error of order h, 1e-3."""
    run = ml.simulate(rotor(), laws={"turn": lambda t, plant: -0.8 * plant.value("turn")}, duration=1.0, turn_0=0.5)
    assert np.max(np.abs(turned(run) - 0.5 * np.cos(math.sqrt(0.8 / INERTIA) * run.t))) < RK4


def damped(t: float, plant: ml.Plant) -> float:
    return -0.05 * plant.rate("turn")


@pytest.mark.parametrize("engine", ["mujoco", "pinocchio", "hybrid"])
def test_every_engine_calls_it(engine: str) -> None:
    run = ml.simulate(rotor(), laws={"turn": damped}, duration=0.5, turn_rate_0=3.0, engine=engine)
    rate = 3.0 * np.exp(-0.05 / INERTIA * run.t)
    assert np.max(np.abs(run["turn_rate"] - rate)) < RK4
    assert "the user's function damped on turn" in run.acts


def test_a_tolerated_error_may_be_asked_for() -> None:
    run = ml.simulate(rotor(), laws={"turn": damped}, duration=0.5, turn_rate_0=3.0, max_error=1e-7)
    truth = 3.0 * INERTIA / 0.05 * (1.0 - math.exp(-0.05 / INERTIA * 0.5))
    assert abs(turned(run)[-1] - truth) < 1e-7 and run.health.trusted


def test_a_motor_by_a_list_with_units() -> None:
    motor = ml.Motor("turn", "200 N mm", "300rpm")  # type: ignore[arg-type]
    run = ml.simulate(rotor(), laws=[motor], duration=0.4)
    free = 300.0 * 2.0 * math.pi / 60.0
    assert np.max(np.abs(run["turn_rate"] - free * (1.0 - np.exp(-0.2 / free / INERTIA * run.t)))) < RK4


def test_units_in_the_laws_of_a_scene() -> None:
    scene = ml.Scene(duration=0.4, laws=[ml.Motor("turn", 0.2, "300rpm")])  # type: ignore[arg-type]
    run = ml.simulate(rotor(), scene=scene)
    assert run["turn_rate"][-1] == pytest.approx(31.41593 * (1.0 - math.exp(-0.2 / 31.41593 / INERTIA * 0.4)), abs=1e-5)


def test_a_number_is_a_constant_load() -> None:
    run = ml.simulate(rotor(), laws={"turn": "20 N mm"}, duration=0.5)
    assert abs(turned(run)[-1] - 0.5 * 0.02 / INERTIA * 0.25) < RK4


# -- drives over time ------------------------------------------------------------------------------------------------------


def servo_truth(target: float, rate: float, k: float, c: float, t: np.ndarray) -> np.ndarray:
    """I x'' = k (target sin(rate t) - x) + c (target rate cos(rate t) - x'), by scipy to 1e-12."""

    def f(time: float, y: np.ndarray) -> list[float]:
        wanted, speed = target * math.sin(rate * time), target * rate * math.cos(rate * time)
        return [y[1], (k * (wanted - y[0]) + c * (speed - y[1])) / INERTIA]

    return solve_ivp(f, (0.0, float(t[-1])), [0.0, 0.0], "DOP853", t, rtol=1e-12, atol=1e-13).y[0]


@pytest.mark.parametrize("target", [lambda t: 0.4 * math.sin(5.0 * t), ml.Sine(0.4, 5.0)])
def test_a_servo_follows_a_target_over_time(target: object) -> None:
    run = ml.simulate(rotor(stiffness=4.0, damping=0.2), drives={"turn": target}, duration=1.0)  # type: ignore[dict-item]
    assert np.max(np.abs(turned(run) - servo_truth(0.4, 5.0, 4.0, 0.2, run.t))) < 1e-8  # eigenvalue 14/s: (14 h)^4 / 120 = 3e-10 a period


def test_a_target_with_a_unit_and_a_table() -> None:
    there = ml.simulate(rotor(stiffness=4.0, damping=0.5), drives={"turn": "30deg"}, duration=2.0)
    assert abs(turned(there)[-1] - math.radians(30.0)) < 1e-6  # exp(-12.5 t) at 2 s: 1e-11
    table = ([0.0, 1.0, 2.0], [0.0, 0.1, 0.0])
    run = ml.simulate(rotor(stiffness=400.0, damping=4.0), drives={"turn": table}, duration=2.0)
    assert abs(turned(run)[np.searchsorted(run.t, 1.0)] - 0.1) < 2e-3  # lags by inertia x acceleration / stiffness


def test_a_drive_with_damping_alone_follows_a_rate() -> None:
    run = ml.simulate(rotor(damping=0.3), drives={"turn": 7.0}, duration=0.5)
    assert np.max(np.abs(run["turn_rate"] - 7.0 * (1.0 - np.exp(-0.3 / INERTIA * run.t)))) < 1e-7


def test_a_bare_drive_is_commanded_by_its_force_within_its_limit() -> None:
    run = ml.simulate(rotor(limit=0.05), drives={"turn": lambda t: 0.2 * t}, duration=1.0)
    turn = np.where(run.t < 0.25, 0.2 * run.t**3 / 6.0, 0.05 * (run.t - 0.25) ** 2 / 2 + 0.00625 * (run.t - 0.25) + 0.2 * 0.25**3 / 6)
    assert np.max(np.abs(turned(run) - turn / INERTIA)) < 1e-6  # the kink lies on a step: no jump within a step


def test_a_voltage_over_time() -> None:
    b = ml.Builder("rotor", gravity=(0.0, 0.0, 0.0))
    b.body("wheel", ml.revolute("turn"), inertia=ml.Inertia(1.0, (0.0, 0.0, 0.0), (0.02, 0.02, 0.02, 0.0, 0.0, 0.0)))
    from mechlab.mechanism.parts import Winding

    b.drive("turn", winding=Winding(0.1, 2.0, 0.004))
    run = ml.simulate(b.build(), drives={"turn": lambda t: 12.0 * t}, duration=0.5)

    def f(t: float, y: np.ndarray) -> list[float]:
        return [0.1 * y[1] / 0.02, (12.0 * t - 2.0 * y[1] - 0.1 * y[0]) / 0.004]

    truth = solve_ivp(f, (0.0, 0.5), [0.0, 0.0], "DOP853", run.t, rtol=1e-12, atol=1e-13).y[0]
    assert np.max(np.abs(run["turn_rate"] - truth)) < 1e-6


# -- scenes ----------------------------------------------------------------------------------------------------------------


def test_a_scene_of_ones_own() -> None:
    scene = ml.Scene("spin", duration=0.5, laws=(ml.Constant("turn", 0.02),), initial={"turn": 1.0}, initial_rates={"turn": 2.0})
    run = ml.simulate(rotor(), scene=scene)
    assert np.max(np.abs(turned(run) - (1.0 + 2.0 * run.t + 0.5 * 0.02 / INERTIA * run.t**2))) < RK4
    assert run.scene == "spin"


def test_a_law_replaces_that_of_the_scene_and_says_so() -> None:
    run = ml.simulate("fourbar", scene="driven-crank", laws={"crank_angle": 0.0}, duration=0.1)
    assert run.scene == "driven-crank with laws" and "crank_angle" in run.acts
    with pytest.raises(ml.MechlabError, match=r"one law \(computed_torque\) commands q1.*Give laws for .*too, or choose another scene"):
        ml.simulate("delta6", scene="head-tracking", laws={"q1": 1.0}, duration=0.01)


FILE = '''
from dataclasses import dataclass
import mechlab as ml

def wheel(inertia=ml.parameter(0.02, "kg m2", "of the wheel", low=0.0, strict=True), width=0.1):
    """A wheel."""
    b = ml.Builder("wheel", gravity=(0, 0, 0))
    b.body("wheel", ml.revolute("turn"), inertia=ml.Inertia(1.0, (0, 0, 0), (inertia,) * 3 + (0, 0, 0)))
    return b.build()

@ml.scene(of=wheel, default=True, inertia=0.04)
def spin_up(p):
    """A torque in proportion to the inertia."""
    return ml.Scene(duration=1.0, laws={"turn": 3.0 * p.inertia})

@dataclass(frozen=True)
class Wheel:
    """The wheel once more."""
    inertia: float = ml.parameter(0.02, "kg m2", "of the wheel", low=0.0)

    def build(self):
        return wheel.__wrapped__(self.inertia) if hasattr(wheel, "__wrapped__") else wheel(self.inertia)

    @ml.scene
    def kick(self):
        """A push at the start."""
        return ml.Scene(duration=0.5, initial_rates={"turn": 0.1 / self.inertia})
'''


@pytest.fixture
def own(tmp_path: Path) -> str:
    (tmp_path / "own.py").write_text(FILE)
    return str(tmp_path / "own.py")


def test_a_file_declares_scenes(own: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", f"{own}:wheel", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["final"]["turn"] == pytest.approx(1.5, abs=RK4)
    assert main(["simulate", f"{own}:wheel", "inertia=0.5", "--scene", "spin-up", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["final"]["turn"] == pytest.approx(1.5, abs=RK4) and document["parameters"]["inertia"] == 0.5
    assert main(["simulate", f"{own}:Wheel", "--scene", "kick", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["final"]["turn"] == pytest.approx(2.5, abs=RK4)
    assert main(["show", f"{own}:wheel"]) == 0
    shown = capsys.readouterr().out
    assert "spin-up" in shown and "A torque in proportion to the inertia." in shown and "kg m2" in shown


def test_limits_and_units_of_a_function(own: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", f"{own}:wheel", "width=120mm", "--json"]) == 0
    assert main(["show", f"{own}:wheel", "inertia=-1"]) == 1
    assert "inertia" in capsys.readouterr().err
    assert main(["show", f"{own}:wheel", "inertia=3mm"]) == 1
    assert "3mm" in capsys.readouterr().err


def test_units_where_solve_takes_joints() -> None:
    for answer in ml.solve(rotor(), turn="37deg").answers.values():
        assert answer.values["tip_y"] == pytest.approx(0.1 * math.sin(math.radians(37.0)), abs=1e-12)


@dataclass(frozen=True)
class NoBuild:
    crank: float = 0.1


def bad(t: float, plant: ml.Plant) -> None:
    return None


WRONG = [
    ({"laws": {"trun": 1.0}}, "joint or shaft 'trun' does not exist. Did you mean 'turn'"),
    ({"laws": {"turn": bad}}, "the function bad on 'turn' must return one number .* it returned None at t = 0 s"),
    ({"laws": [ml.Motor]}, "laws: .*got <class"),
    ({"laws": [damped]}, "a function needs its joint"),
    ({"laws": "turn"}, "laws: expected a list"),
    ({"laws": {"turn": lambda t: 1.0}}, r"laws: 'turn': <lambda>\(t\) must take the time and the plant, as f\(t, plant\)"),
    ({"scene": {"duration": 1.0}}, "scene: expected the name of a scene or an ml.Scene"),
    ({"laws": {"turn": ml.Constant("turn", 1.0)}}, "give a list of laws"),
    ({"laws": {"turn": "5mm"}}, "law constant on turn: value: expected a torque .*got 5mm"),
    ({"drives": {"turn": "5mm"}}, "command of drive 'turn': expected .*got 5mm"),
    ({"drives": {"crank": 1.0}}, "drive 'crank' does not exist"),
    ({"drives": {"turn": lambda t: "fast"}}, "must return one number, or value, rate and acceleration; it returned 'fast'"),
    ({"drives": {"turn": (1.0, 2.0, 3.0)}}, r"expected a number, a motion, a function of time or \(times, values\)"),
    ({"laws": {"turn": lambda t, plant: math.nan}}, "the force nan at t = 0"),
]


@pytest.mark.parametrize(("asked", "words"), WRONG)
def test_what_is_wrong_is_named(asked: dict[str, object], words: str) -> None:
    with pytest.raises(ml.MechlabError, match=words):
        ml.simulate(rotor(), **({"duration": 0.01} | asked))  # type: ignore[arg-type]


def test_times_take_units_and_a_builder_is_no_mechanism() -> None:
    run = ml.simulate(rotor(), duration="20ms", timestep="0.5ms")  # type: ignore[arg-type]
    assert run.t[-1] == pytest.approx(0.02, abs=1e-15) and run.settings.timestep == pytest.approx(5e-4, abs=1e-18)
    with pytest.raises(ml.MechlabError, match="duration: expected a time"):
        ml.simulate(rotor(), duration="20mm")  # type: ignore[arg-type]
    with pytest.raises(ml.MechlabError, match=r"bare: a Builder is no mechanism yet; end it with .build\(\)"):
        ml.simulate(ml.Builder("bare"))  # type: ignore[arg-type]


def test_a_class_without_build_is_refused() -> None:
    with pytest.raises(ml.MechlabError, match=r"NoBuild: a class of parameters is a dataclass .* with a method build"):
        ml.load(NoBuild)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (ml.Motor("turn", "2kg", 30.0), "stall: expected a torque .*, got 2kg"),  # type: ignore[arg-type]
        (ml.Motor("turn", "2N", 30.0), "stall: expected a torque"),  # type: ignore[arg-type]
        (ml.Motor("turn", 2.0, "30mm/s"), "no_load_rate: expected a rate of turning"),  # type: ignore[arg-type]
        (ml.Harmonic("turn", 1.0, "2Hz"), "frequency: expected a rate of turning .*, got 2Hz"),  # type: ignore[arg-type]
        (ml.Viscous("turn", "1Ns/m"), "coefficient: expected"),  # type: ignore[arg-type]
        (ml.Constant("turn", "1N"), "value: expected a torque"),  # type: ignore[arg-type]
    ],
)
def test_a_unit_that_does_not_fit_the_joint_is_refused_in_every_law(law: ml.Law, said: str) -> None:
    for call in (lambda: ml.simulate(rotor(), laws=[law]), lambda: ml.simulate(rotor(), scene=ml.Scene(laws=(law,)))):
        with pytest.raises(ml.MechlabError, match=said):
            call()


def test_a_motor_whose_torque_grows_with_the_rate_is_refused() -> None:
    for stall, rate in ((2.0, -30.0), (-2.0, 30.0), (2.0, 0.0)):
        with pytest.raises(ml.MechlabError, match="of one sign"):
            ml.Motor("turn", stall, rate)
    with pytest.raises(ml.MechlabError, match="of one sign"):
        ml.simulate(rotor(), laws=[ml.Motor("turn", "2Nm", "-300rpm")])  # type: ignore[arg-type]
    assert ml.Motor("turn", -2.0, -30.0).stall == -2.0  # it turns the other way
