"""A05: a flyball governor whose stiff spring-dampers make it a stiff problem."""

from __future__ import annotations

import numpy as np

from mechlab.analytic.benchmarks import Governor
from mechlab.catalog.flyball.build import build
from mechlab.catalog.flyball.moving import MOVING
from mechlab.catalog.flyball.parameters import Parameters
from mechlab.experiment.entry import Entry, SceneRecipe
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit import benchmark_parts as parts
from mechlab.kit.own_equations import record_own
from mechlab.mechanism.geometry import Array

CHANNELS: dict[str, parts.Channel] = {"s": ("m", lambda p, recording: recording.channel("slider_height"))}


def _spin(p: Parameters, fidelity: str) -> Scene:
    return Scene(
        "spin",
        fidelity,
        p.duration,
        initial_rates={"shaft_angle": p.start_rate, "slider_height": 0.0, "right_angle": 0.0, "left_angle": 0.0},
        channels=tuple(CHANNELS),
        tolerance=1e-3,
        settings=Settings(integrator="RK4", timestep=2.5e-4),
    )


def reference(p: Parameters, scene: Scene, method: str = "Radau", tolerance: float = 1e-12) -> Recording:
    """Arms and slider, with the angular momentum as a constant; both arms move alike."""
    m = build(p, "full")
    spin = p.slider_mass * p.slider_size**2 / 6.0 + p.density * p.shaft_length * p.section**4 / 6.0
    along, across = p.arm_mass * p.section**2 / 6.0, p.arm_mass * (p.arm_length**2 + p.section**2) / 12.0
    own = Governor(
        p.pivot,
        p.shaft_length,
        p.arm_length,
        p.arm_mass,
        along,
        across,
        p.ball_mass,
        p.slider_mass,
        spin,
        p.spring_stiffness,
        p.damping,
        p.spring_length,
        p.gravity,
    )
    momentum = own.moment(p.start_angle)[0] * scene.initial_rates["shaft_angle"]
    start = np.array([p.start_angle, p.start_height, 0.0, 0.0, 0.0, momentum])

    def states(y: Array) -> tuple[Array, Array]:
        alpha, s, phi, dalpha, ds, h = y.T
        values = {"shaft_angle": phi, "slider_height": s, "right_angle": alpha, "left_angle": alpha}
        turn = h / np.array([own.moment(a)[0] for a in alpha])
        rates = {"shaft_angle": turn, "slider_height": ds, "right_angle": dalpha, "left_angle": dalpha}
        return parts.columns(m, values, rates)

    return record_own(m, scene, own.slope, start, states, method, tolerance)


PRINTED = {1.0: (0.50142092238,), 2.5: (0.735602283079,), 5.0: (0.535563103722,), 10.0: (0.619622917061,)}

ENTRY = Entry(
    name="flyball",
    title="Flyball governor (A05)",
    summary="Benchmark A05: a governor with stiff spring-dampers; explicit methods need tiny steps.",
    parameters=Parameters,
    build=build,
    fidelities={"full": "shaft, slider, two arms"},
    default_fidelity="full",
    scenes={"spin": SceneRecipe(_spin, "full", "let go at the start speed, without a drive")},
    default_scene="spin",
    # RK4 is stable below 2.8 m / c = 0.5 ms: 0.3 s in steps of 0.2 ms
    checks=(
        *parts.checks(build, Parameters, _spin, reference, CHANNELS, PRINTED, 1e-7, 1e-9, share=0.03, steps=1500),
        MOVING,
    ),
    reference=reference,
    channels=CHANNELS,
    chain="R(P, 2 R)",
    formulas="I(alpha) phi' = const; arms and slider by Lagrange, spring force k (l - l0) + c l'.",
    sources=("Gonzalez, Gonzalez & Cuadrado: Benchmarking of multibody dynamics (IFToMM library), A05",),
)
