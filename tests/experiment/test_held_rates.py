"""The law that holds rates: sliding, sticking without creep, one-way stops, servos, against closed forms."""

import math

import numpy as np
import pytest

from mechlab.errors import MechlabError
from mechlab.experiment.held_rates import HeldRates, RateHold
from mechlab.experiment.laws import Constant, Harmonic
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute

DISC = Inertia.axial(1.0, 0.5, 0.25)


def two_discs(joined: bool = False) -> Mechanism:
    b = Builder("discs", gravity=(0.0, 0.0, 0.0))
    b.body("a", revolute("a"), inertia=DISC).body("b", revolute("b"), at=(1.0, 0.0, 0.0), inertia=DISC)
    if joined:
        b.gears("mesh", "a", "b", (20, 40)).gears("again", "a", "b", (20, 40))
    return b.shaft("slip", {"a": 1, "b": -1}).build()


def run(m: Mechanism, law: HeldRates, engine: str, rates: dict[str, float], duration: float = 1.0) -> Recording:
    from mechlab.engines.mujoco.runner import run as mujoco
    from mechlab.engines.pinocchio.runner import run as pinocchio

    scene = Scene("held", "full", duration, (law,), initial_rates=rates)
    return (mujoco if engine == "mujoco" else pinocchio)(m, scene, Settings(engine=engine, integrator="RK4"))


@pytest.fixture(params=["mujoco", "pinocchio"])
def engine(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def test_dry_friction_slides_then_sticks_without_creep(engine: str) -> None:
    law = HeldRates((RateHold("a", 0.0, -2.0, 2.0),), (Constant("a", 1.0),))
    found = run(two_discs(), law, engine, {"a": 1.0})
    # 0.5 a' = 1 - 2: it stops after 0.5 s; the capture takes some time constants of 1 ms.
    sliding, stuck = found.t < 0.49, found.t > 0.55
    np.testing.assert_allclose(found.channel("a_rate")[sliding], 1.0 - 2.0 * found.t[sliding], atol=1e-9)
    assert np.max(np.abs(found.channel("a_rate")[stuck])) < 1e-9
    assert np.ptp(found.channel("a")[found.t > 0.6]) < 1e-12
    np.testing.assert_allclose(found.channel("a_force")[stuck], 0.0, atol=1e-6)
    assert found.channel("a")[-1] == pytest.approx(0.25, abs=1e-5)


def test_it_breaks_loose_when_the_load_exceeds_the_friction(engine: str) -> None:
    law = HeldRates((RateHold("a", 0.0, -2.0, 2.0),), (Harmonic("a", 3.0, 2.0),))
    found = run(two_discs(), law, engine, {})
    loose = 0.5 * math.asin(2.0 / 3.0)  # 3 sin(2 t) = 2
    assert np.max(np.abs(found.channel("a_rate")[found.t < loose])) < 1e-12
    t = found.t[found.t > loose]
    truth = 2.0 * (1.5 * (math.cos(2 * loose) - np.cos(2 * t)) - 2.0 * (t - loose))
    np.testing.assert_allclose(found.channel("a_rate")[found.t > loose], truth, atol=2e-6)


def test_one_way_stop_and_servo_and_constraint(engine: str) -> None:
    law = HeldRates((RateHold("b", 0.0, 0.0, math.inf), RateHold("a", 3.0)), (Constant("b", -1.0), Constant("a", 5.0)))
    found = run(two_discs(), law, engine, {"a": 3.0})
    np.testing.assert_allclose(found.channel("a_rate"), 3.0, atol=1e-12)
    np.testing.assert_allclose(found.channel("b_rate"), 0.0, atol=1e-12)
    np.testing.assert_allclose(found.channel("a_force"), 0.0, atol=1e-9)
    # Under redundant gear rows too: what holds a is the load of b through the mesh, b = -a/2.
    geared = run(two_discs(True), HeldRates((RateHold("a"),), (Constant("b", 4.0),)), engine, {}, 0.1)
    assert np.max(np.abs(geared.channel("a_rate"))) < 1e-6
    np.testing.assert_allclose(geared.channel("a_force")[50:], 2.0, atol=1e-6)  # after the transient of soft rows


def test_two_discs_rub_on_each_other(engine: str) -> None:
    law = HeldRates((RateHold("slip", 0.0, -1.0, 1.0),))
    found = run(two_discs(), law, engine, {"a": 2.0}, 1.0)
    # Momentum is kept; the slip falls by 4 rad/s2 and is gone after 0.5 s.
    np.testing.assert_allclose(found.channel("a_rate") + found.channel("b_rate"), 2.0, atol=1e-12)
    np.testing.assert_allclose(
        found.channel("slip_rate")[found.t < 0.49], 2.0 - 4.0 * found.t[found.t < 0.49], atol=1e-9
    )
    assert abs(found.channel("slip_rate")[-1]) < 1e-12


def test_bad_bounds() -> None:
    with pytest.raises(MechlabError, match="enclose 0"):
        HeldRates((RateHold("a", 0.0, 1.0, 2.0),))
    with pytest.raises(MechlabError, match="time"):
        HeldRates((), (), 0.0)
