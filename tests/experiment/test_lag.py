"""The predicted lag of soft gear rows against MuJoCo 4.0.0, and the warning that offers `minimal`."""

import numpy as np
import pytest

from mechlab.engines.mujoco.runner import run
from mechlab.experiment.lag import lag_findings, predicted_lags, softness
from mechlab.experiment.laws import ComputedTorque, Constant, Harmonic
from mechlab.experiment.motion import Sine
from mechlab.experiment.scene import PRESETS, Scene, Settings, preset
from mechlab.mechanism import Builder, Mechanism, revolute
from mechlab.mechanism.reduction import reduce
from tests.mechanism.trains import closed_differential, disc


def pair(ratio: int, first: float, second: float) -> Mechanism:
    b = Builder("pair", gravity=(0, 0, 0))
    b.body("a", revolute("a"), inertia=disc(first)).body("b", revolute("b"), at=(0.1, 0, 0), inertia=disc(second))
    b.gears("mesh", "a", "b", (1, ratio))
    return b.build()


def pulled(torque: float, duration: float = 0.5) -> Scene:
    return Scene("pull", "full", duration, (Constant("a", torque),))


@pytest.mark.parametrize(("ratio", "first", "second"), [(10, 1e-4, 1.0), (1000, 1e-6, 1.0), (1, 1e-6, 1.0)])
@pytest.mark.parametrize(
    "settings",
    [
        PRESETS["accurate"],
        PRESETS["defaults"],
        PRESETS["stiff"],
        preset("accurate", integrator="implicitfast"),
        preset("stiff", timeconst=5.0),
    ],
    ids=["accurate", "defaults", "stiff", "implicitfast", "discrete, tc = 5 h"],
)
def test_law_within_one_per_cent(ratio: int, first: float, second: float, settings: Settings) -> None:
    m, scene = pair(ratio, first, second), pulled(1.0 / ratio)
    predicted = predicted_lags(m, scene, settings)[0]
    measured = abs(float(m.coefficient_row(m.relations[0].coefficients) @ run(m, scene, settings).q[-1]))
    # 0.5 s is 25 of the longest time constants; what remains of the onset is below 1e-4.
    assert predicted.lag == pytest.approx(measured, rel=2e-4)


def test_lag_of_a_motion_that_is_followed_is_that_of_its_acceleration() -> None:
    """By inverse dynamics through 2 rad: feedback upon the initial state would be 1e4 / s2 times 2 rad, five hundred times the load."""
    m = pair(2, 1e-4, 1e-2)
    swing = Sine(1.0, 2 * np.pi, -0.5 * np.pi, 1.0)
    law = ComputedTorque(("a",), (("a", swing),), ((1e4, 200.0),))
    scene = Scene("followed", "full", 1.0, (law,), initial={"a": swing.at(0.0)[0]}, initial_rates={"a": swing.at(0.0)[1]})
    predicted = predicted_lags(m, scene, Settings())[0]
    rows = run(m, scene, Settings(), np.linspace(0.0, 1.0, 101)).q @ m.coefficient_row(m.relations[0].coefficients)
    assert predicted.lag == pytest.approx(float(np.max(np.abs(rows))), rel=0.02)


def test_softness_of_the_specification() -> None:
    assert softness(PRESETS["defaults"]) == pytest.approx(2.0e-5, rel=1e-12)
    assert softness(Settings()) == pytest.approx(4e-10, rel=1e-9)  # 0.0001 (2 ms)^2
    assert softness(Settings(integrator="discrete")) == pytest.approx(2.25 * 4e-10, rel=1e-9)


def test_inertia_ratio_of_a_million_is_flagged_and_right_in_minimal() -> None:
    """Torque on the light gear that holds the heavy one: A = 1 / J_light; 15 N m lag 6 mrad in the accurate preset."""
    m, scene = pair(1, 1e-6, 1.0), pulled(15.0, 0.1)
    found = lag_findings(m, scene, Settings())
    assert [f.severity for f in found] == ["warning"] and "'minimal'" in found[0].sentence
    assert found[0].value == pytest.approx(6e-3, rel=1e-3)
    record = run(m, scene)
    assert record.health.finding("predicted_lag").severity == "warning"
    small = reduce(m).mechanism
    assert lag_findings(small, scene, Settings()) == ()
    end = run(small, scene).channel("b_rate")[-1]
    assert end == pytest.approx(-15.0 * 0.1 / (1.0 + 1e-6), rel=1e-12)


def test_ratio_of_a_thousand_is_harmless_and_exact_in_minimal() -> None:
    m, scene = pair(1000, 1e-6, 1.0), pulled(1e-3, 0.3)
    assert lag_findings(m, scene, Settings())[0].severity == "ok"
    end = run(reduce(m).mechanism, scene).channel("b_rate")[-1]
    assert end == pytest.approx(-1.0 * 0.3 / 2.0, rel=1e-12)  # reflected 1e-6 x 1000^2 = 1


def test_closed_differential_with_light_planets_is_flagged() -> None:
    """Specification 3.3: with planet inertias scaled down, the default softness lags by radians without a warning."""
    scene = Scene(
        "s", "full", 0.5, (Constant("H1", 100.0), Constant("H2", -200.0)), initial_rates={"H1": 100.0, "H2": 50.0}
    )
    finding = lag_findings(closed_differential(3), scene, PRESETS["defaults"])[0]
    assert finding.severity == "warning" and finding.value > 1e-2
    assert lag_findings(closed_differential(3), scene, Settings())[0].severity == "ok"


def test_largest_load_of_a_law_in_time_counts() -> None:
    m = pair(2, 1e-3, 1.0)
    steady = predicted_lags(m, pulled(3.0), Settings())[0]
    swinging = Scene("swing", "full", 0.5, (Harmonic("a", 3.0, 2 * np.pi),))
    assert predicted_lags(m, swinging, Settings())[0].load == pytest.approx(steady.load, rel=1e-2)
    assert predicted_lags(m, swinging, Settings(engine="pinocchio")) == ()
