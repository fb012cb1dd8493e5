"""The order of the error and the error that the timestep leaves: against known orders and exact motions (MuJoCo 4.0.0)."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.mujoco.runner import run
from mechlab.experiment.errors import (
    SAFETY,
    SAFETY_SEEN,
    error_between,
    error_from_coarser,
    error_from_finer,
    expected_order,
    observed_order,
    order_finding,
    step_error_finding,
)
from mechlab.experiment.laws import Constant, Harmonic, Plant, register
from mechlab.experiment.recording import Finding
from mechlab.experiment.scene import PRESETS, Scene, Settings
from mechlab.lab.order_check import with_order
from mechlab.lab.step_error import with_step_error
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute
from tests.mechanism.samples import fourbar


def pendulum(**options: Any) -> Mechanism:
    b = Builder("pendulum", gravity=(0, -9.81, 0))
    b.body("bob", revolute("angle", **options), inertia=Inertia.point(1.0, (0.5, 0, 0)))
    return b.build()


def order_of(mechanism: Mechanism, scene: Scene, settings: Settings) -> Finding:
    return with_order(run(mechanism, scene, settings), scene).health.finding("order")


@pytest.mark.parametrize("order", [1, 2, 4])
def test_observed_order_is_that_of_the_error(order: int) -> None:
    found = observed_order(lambda h: np.array([[0.0], [1.0 + 3.0 * h**order]]), 0.1, order)
    assert found.measured == pytest.approx(order, abs=1e-9) and not found.lost
    assert observed_order(lambda h: np.array([[1.0 + 3.0 * h**order]]), 0.1, order + 1).lost
    # Richardson: the changes against twice and four times the step give order and error, exactly, for one power of h.
    error = 3.0 * 0.1**order
    twice, fourfold = ((k**order - 1.0) * error for k in (2.0, 4.0))
    assert error_from_coarser(twice, fourfold, 4) == pytest.approx(SAFETY * error)
    assert error_from_finer(error * (1.0 - 0.5**order), 0.5) == pytest.approx(SAFETY * error * (1.0 - 0.5**order) / 0.5)
    # Where h and 2 h agree by accident, the change against 4 h counts.
    assert error_from_coarser(1e-9, fourfold, order) >= SAFETY * error * (1.0 - 1e-9)


def test_what_cannot_be_told_is_said() -> None:
    exact = order_finding(observed_order(lambda h: np.ones((3, 1)), 0.1, 4), 0.1)
    assert exact.severity == "ok" and "rounding" in exact.sentence
    broken = order_finding(observed_order(lambda h: np.ones((3 if h > 0.05 else 2, 1)), 0.1, 4), 0.1)
    assert broken.severity == "warning" and "did not come through" in broken.sentence


def test_a_step_error_beyond_the_tolerance_is_an_error() -> None:
    assert step_error_finding(2e-3, 1e-3, "").severity == "error"
    assert step_error_finding(1e-3, 1e-3, "").severity == "ok"


def test_expected_orders() -> None:
    assert expected_order(Settings(), rows=False) == 4 and expected_order(Settings(), rows=True) == 2
    assert expected_order(Settings(engine="pinocchio"), rows=True) == 4
    assert {
        expected_order(replace(Settings(), integrator=i), False) for i in ("Euler", "implicitfast", "discrete")
    } == {1}


@pytest.mark.parametrize(
    ("settings", "order"),
    [
        (Settings(timestep=5e-3), 4),
        (Settings(timestep=5e-3, integrator="implicitfast"), 1),
        (Settings(engine="pinocchio", timestep=1e-2), 4),
        (Settings(engine="pinocchio", integrator="semi_implicit_Euler"), 1),
    ],
    ids=["RK4", "implicitfast", "pinocchio RK4", "pinocchio Euler"],
)
def test_a_pendulum_has_the_order_of_the_method(settings: Settings, order: int) -> None:
    scene = Scene("swing", "full", 1.0)
    from mechlab.engines.pinocchio.runner import run as run_pinocchio

    done = (run if settings.engine == "mujoco" else run_pinocchio)(pendulum(), scene, settings)
    found = with_order(done, scene).health.finding("order")
    assert found.severity == "ok" and found.value == pytest.approx(order, abs=0.25), found.sentence


def test_loops_of_mujoco_are_of_second_order() -> None:
    found = order_of(fourbar(), Scene("fall", "full", 0.4), Settings())
    assert found.severity == "ok" and found.value == pytest.approx(2.0, abs=0.3), found.sentence


@register("held_for_the_test")
@dataclass(frozen=True)
class Held:
    """A servo that looks at the state once in a step and holds its force: what a controller outside the engine does."""

    on: str
    timestep: list[float]
    seen: list[float] = field(default_factory=lambda: [-math.inf, 0.0])
    kind: ClassVar[str]

    def __hash__(self) -> int:
        return id(self)

    def targets(self) -> tuple[str, ...]:
        return (self.on,)

    def force(self, t: float, plant: Plant) -> dict[str, float]:
        if t < self.seen[0] or t >= self.seen[0] + self.timestep[0] * (1 - 1e-9):
            self.seen[:] = [t, -4.0 * plant.value(self.on)]
        return {self.on: self.seen[1]}


def test_a_held_law_loses_the_order_and_one_at_every_stage_does_not() -> None:
    step = [2e-3]
    scene = Scene("held", "full", 0.4, (Held("angle", step),))
    settings = Settings(timestep=2e-3)
    from mechlab.engines.mujoco.trace import trace

    def states(h: float) -> np.ndarray:
        step[0] = h
        return trace(pendulum(), scene, replace(settings, timestep=h), 20).q

    found = observed_order(states, 2e-3, 4)
    assert found.lost and found.measured == pytest.approx(1.0, abs=0.3)
    sentence = order_finding(found, 2e-3, ("a held law",)).sentence
    assert "expected 4, measured 1" in sentence or "expected 4, measured 0.9" in sentence
    smooth = Scene("smooth", "full", 1.0, (Harmonic("angle", 2.0, 9.0),))
    assert order_of(pendulum(), smooth, Settings(timestep=5e-3)).severity == "ok"


def test_dry_friction_loses_the_order_of_rk4() -> None:
    """It swings back and stands after .3 s: MuJoCo's frictionloss is a soft row with a corner."""
    scene = Scene("rub", "full", 0.4, (), {"angle": -1.2})
    rubbed = order_of(pendulum(friction=1.5), scene, Settings())
    assert (
        rubbed.severity == "warning" and "expected 4" in rubbed.sentence and "dry friction of angle" in rubbed.sentence
    )
    assert order_of(pendulum(damping=1.5), scene, Settings(timestep=5e-3)).severity == "ok"


MOTOR = """<mujoco><compiler angle="radian"/><option timestep="0.001" integrator="RK4" gravity="0 0 0"/>
<worldbody><body><joint name="a" type="hinge" axis="0 0 1"/><inertial pos="0.3 0 0" mass="1" diaginertia=".1 .1 .1"/></body>
</worldbody><actuator><dcmotor name="m" joint="a" motorconst="2" resistance="1" {state} input="voltage"/></actuator>
<keyframe><key name="home" ctrl="3"/></keyframe></mujoco>"""


@pytest.mark.parametrize(("state", "lost"), [('inductance=".1"', True), ("", False)])
def test_a_motor_with_a_state_in_the_engine_makes_rk4_first_order(tmp_path: Path, state: str, lost: bool) -> None:
    """The current is an activation; without inductance the same motor is a straight line and RK4 keeps its order."""
    from mechlab.engines.mujoco.model_file.trace import file_order, read_model, trace_file

    path = tmp_path / "motor.xml"
    path.write_text(MOTOR.format(state=state))
    model = read_model(path)

    def runs(integrator: str, hard: bool, each: int) -> object:
        return trace_file(model, integrator, hard, 0.5, 25, each)

    found = file_order(runs, model.model, False, 0.5 / 25)
    assert (found.severity == "warning") is lost, found.sentence
    if lost:
        assert "expected 4, measured" in found.sentence and "activation" in found.sentence
        assert found.value == pytest.approx(1.0, abs=0.2)
    else:
        assert found.value > 3.5


def test_the_step_error_is_the_error() -> None:
    """Constant torque on a disc: implicitfast is off by a t h / 2 in position, RK4 by nothing."""
    b = Builder("disc", gravity=(0, 0, 0))
    b.body("disc", revolute("disc"), inertia=Inertia.axial(1.0, 0.5, 0.3))
    scene = Scene("push", "full", 2.0, (Constant("disc", 3.0),), tolerance=1e-4)
    rough = with_step_error(run(b.build(), scene, Settings(integrator="implicitfast")), scene).health.finding(
        "step_error"
    )
    # beyond the tolerance half the step decides, and twice the step shows that the order is the first
    assert rough.severity == "error" and rough.value == pytest.approx(SAFETY_SEEN * 0.5 * 6.0 * 2.0 * 1e-3, rel=1e-6)
    exact = with_step_error(run(b.build(), scene, Settings()), scene).health.finding("step_error")
    assert exact.severity == "ok" and exact.value < 1e-12


def test_step_error_at_the_edge_of_stability_looks_the_other_way() -> None:
    """At 2 h the run blows up (h = 2.4 / omega, RK4 holds up to 2.83): the estimate comes from h / 2."""
    b = Builder("oscillator", gravity=(0, 0, 0))
    b.body("disc", revolute("disc", stiffness=1e4), inertia=Inertia.axial(1.0, 1.0, 0.6))
    scene = Scene("ring", "full", 5.0, (), {"disc": 0.1}, tolerance=1e-4)
    done = with_step_error(run(b.build(), scene, Settings(timestep=2.4e-2)), scene)
    found = done.health.finding("step_error")
    assert found.severity == "error" and "0.012" in found.sentence


def test_step_error_is_by_tolerance_where_steps_are_controlled_and_left_out_where_the_run_ended() -> None:
    from mechlab.engines.pinocchio.runner import run as run_pinocchio

    scene = Scene("swing", "full", 0.5)
    sharp = run_pinocchio(pendulum(), scene, Settings(engine="pinocchio", integrator="DOP853"))
    loose = with_step_error(sharp, scene)
    assert loose.health.finding("step_error").severity == "ok" and set(loose.errors) == set(sharp.channels)
    assert "controls its steps" in with_order(sharp, scene).health.finding("order").sentence
    blown = run(pendulum(stiffness=1e9), replace(scene, initial={"angle": 0.1}), PRESETS["accurate"])
    assert not blown.health.trusted and with_step_error(blown, scene) is blown


def test_every_run_carries_the_estimate_and_an_order_on_demand() -> None:
    done = ml.simulate("pendulum", duration=0.5, timestep=0.02, order_check=True)
    assert done.health.finding("order").value == pytest.approx(4.0, abs=0.3)
    assert done.health.finding("step_error").severity in ("ok", "warning")


@pytest.mark.parametrize("order", [1, 2])
def test_a_finer_and_a_coarser_run_show_the_order(order: int) -> None:
    """x(h) = x + C h^p: changes C h^p (1 - 2^-p) and C h^p (2^p - 1)."""
    error = 3e-5
    half, twice = error * (1.0 - 0.5**order), error * (2.0**order - 1.0)
    assert error_between(half, twice, 4) == pytest.approx(SAFETY_SEEN * error)
