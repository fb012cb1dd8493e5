"""A03: Andrews' squeezer, seven bodies and three loops in one plane, at 1000 rad/s within milliseconds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.catalog.andrews.build import build
from mechlab.catalog.andrews.moving import MOVING
from mechlab.catalog.andrews.parameters import JOINTS, SOURCE, Parameters, own
from mechlab.experiment.entry import Check, CheckResult, Entry, SceneRecipe
from mechlab.experiment.laws import Constant
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit import benchmark_parts as parts
from mechlab.kit.own_equations import record_own
from mechlab.mechanism.geometry import Array

CHANNELS = parts.tracked("F", "xy", "F_")


def _squeeze(p: Parameters, fidelity: str) -> Scene:
    laws = (Constant("beta", p.torque),) if p.torque else ()
    return Scene(
        "squeeze", fidelity, p.duration, laws, {"beta": p.start_angle}, {"beta": p.start_rate}, tuple(CHANNELS),
        tolerance=1e-5, settings=Settings(timestep=1e-5),
    )  # fmt: skip


def reference(p: Parameters, scene: Scene, method: str = "DOP853", tolerance: float = 1e-13) -> Recording:
    """The equation of the crank alone; dyads give the other six angles."""
    m, equation = build(p, "full"), own(p)

    def states(y: Array) -> tuple[Array, Array]:
        values, rates = equation.states(y)
        return parts.columns(m, dict(zip(JOINTS, values.T, strict=True)), dict(zip(JOINTS, rates.T, strict=True)))

    start = np.array([scene.initial["beta"], scene.initial_rates["beta"]])
    return record_own(m, scene, equation.slope, start, states, method, tolerance)


PRINTED = {
    0.005: (0.00684464175425, 0.001466587623),
    0.025: (0.00627478524952, -0.00310275201593),
    0.05: (-0.00520850472225, 0.00467669526036),
}
TEST_SET = (
    15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
    0.5347301163226948, 1.048080741042263,
)  # fmt: skip
TEST_SET_RATES = (
    1139.920302151208, -1424.379294994111, 11.03291221937134, 19.29337464421385, 0.5735699284790808,
    -19.29337464421385, 0.3231791658026955,
)  # fmt: skip


def _check_test_set(p: Parameters) -> CheckResult:
    default = replace(Parameters(), duration=0.03)
    found = reference(default, _squeeze(default, "full"))
    q = [found.channel(n)[-1] for n in JOINTS]
    v = [found.channel(f"{n}_rate")[-1] / 1e3 for n in JOINTS]
    # Printed by PSIDE at 1e-14; coordinates agree to 1.4e-9, rates to 5e-8 relative (measured with DOP853 at 1e-13).
    expected = [*TEST_SET, *(x / 1e3 for x in TEST_SET_RATES)]
    return CheckResult({"analytic": [*q, *v]}, 1e-7, expected, "seven angles [rad] and rates [1000 rad/s] at 0.03 s")


ENTRY = Entry(
    name="andrews",
    title="Andrews' squeezer (A03)",
    summary="Benchmark A03: seven bodies, three loops, tiny lengths and high speed.",
    parameters=Parameters,
    build=build,
    fidelities={"full": "seven bars, three loops"},
    default_fidelity="full",
    scenes={"squeeze": SceneRecipe(_squeeze, "full", "a constant torque on the crank, from rest")},
    default_scene="squeeze",
    checks=(
        *parts.checks(build, Parameters, _squeeze, reference, CHANNELS, PRINTED, 1e-6),
        Check("B3", "own equation against the Test Set's solution at 0.03 s", _check_test_set, source=SOURCE),
        MOVING,
    ),
    reference=reference,
    channels=CHANNELS,
    chain="7R, 3 loops",
    formulas="dyads K2-K3, K5-K4, K7-K6 give the pose; J b'' + J'/2 b'^2 = torque + spring (Eksergian).",
    sources=("Schiehlen 1990", "Mazzia & Magherini: Test Set for IVP Solvers (Bari)", "Hairer & Wanner 1996, VII.7"),
)
