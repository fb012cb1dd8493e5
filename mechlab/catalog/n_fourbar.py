"""A02: N four-bars in a row, N + 1 rockers and N couplers, passing through their singular position twice a turn."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from mechlab.analytic.benchmarks.planar import ParallelogramChain
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit import benchmark_parts as parts
from mechlab.kit import mass_check, palette
from mechlab.kit.checks import moving_check
from mechlab.kit.own_equations import record_own
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Mechanism, Placement, revolute
from mechlab.mechanism.geometry import Array

SOURCE = "IFToMM benchmark library, A02"


@dataclass(frozen=True)
class Parameters:
    """Uniform slender bars in the plane of x and y."""

    N: int = parameter(2, "", "number of four-bars", source=SOURCE, low=1, high=200)
    rocker_length: float = parameter(1.0, "m", "rockers", source=SOURCE, low=0, strict=True)
    coupler_length: float = parameter(
        1.0, "m", "couplers, and the distance of the ground pivots", source=SOURCE, low=0, strict=True
    )
    rocker_mass: float = parameter(1.0, "kg", "mass of each rocker", source=SOURCE, low=0, strict=True)
    coupler_mass: float = parameter(1.0, "kg", "mass of each coupler", source=SOURCE, low=0, strict=True)
    gravity: float = parameter(9.81, "m/s2", "gravity, along -y", source=SOURCE)
    start_speed: float = parameter(1.0, "m/s", "speed of B0 along +x at the start, all rockers upright", source=SOURCE, scene=True)
    duration: float = parameter(10.0, "s", "duration of the scene", source=SOURCE, low=0, strict=True, scene=True)


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """2 N + 1 bars, N pins that close the loops; the reference pose has all rockers upright."""
    b = Builder("n_fourbar", gravity=(0.0, -p.gravity, 0.0), summary=f"{p.N} four-bars in a row, benchmark A02")
    width = 0.06 * min(p.rocker_length, p.coupler_length)
    for k in range(p.N + 1):
        at = (k * p.coupler_length, 0.0, 0.0)
        up = revolute(f"rocker_{k}", "z", zero=math.pi / 2)
        b.bar(f"rocker_{k}", up, p.rocker_length, at=at, width=width, color=palette.BLUE)
        parts.with_inertia(b, parts.slender(p.rocker_mass, p.rocker_length))
        _turn(b, math.pi / 2)
        if k < p.N:
            joint = revolute(f"coupler_{k}", "z", zero=-math.pi / 2)
            b.bar(f"coupler_{k}", joint, p.coupler_length, parent=f"rocker_{k}", at=(p.rocker_length, 0.0, 0.0),
                  width=width, color=palette.ORANGE, layer=0.5 * width)  # fmt: skip
            parts.with_inertia(b, parts.slender(p.coupler_mass, p.coupler_length))
            _turn(b, -math.pi / 2)
            end = (p.coupler_length, 0.0, 0.0)
            b.loop(f"pin_{k}", f"coupler_{k}", f"rocker_{k + 1}", end, (p.rocker_length, 0.0, 0.0))
        b.frame(f"B{k}", f"rocker_{k}", (p.rocker_length, 0.0, 0.0))
    return b.build()


def _turn(b: Builder, angle: float) -> None:
    """Turn the last body about z by a quarter, exactly: an angle of pi / 2 has a cosine of 6e-17."""
    s = math.copysign(1.0, angle)
    quarter = Placement.of(
        np.array([[0.0, -s, 0.0], [s, 0.0, 0.0], [0.0, 0.0, 1.0]]), b.bodies[-1].placement.translation
    )
    b.bodies[-1] = replace(b.bodies[-1], placement=quarter)


CHANNELS = parts.tracked("B0")


def _fall(p: Parameters, fidelity: str) -> Scene:
    rates = {f"rocker_{k}": -p.start_speed / p.rocker_length for k in range(p.N + 1)}
    # the passes through the singular position, where all bars lie in one line, want a finer step than the swing between
    return Scene(
        "fall", fidelity, p.duration, initial_rates=rates, channels=tuple(CHANNELS), tolerance=1e-3,
        settings=Settings(timestep=5e-4),
    )  # fmt: skip


def reference(p: Parameters, scene: Scene, method: str = "DOP853", tolerance: float = 1e-13) -> Recording:
    """The equation of the one freedom: couplers translate as long as the four-bars stay parallelograms."""
    m = build(p, "full")
    own = ParallelogramChain(p.N, p.rocker_length, p.rocker_mass, p.coupler_mass, p.gravity)
    sign = np.array([-1.0 if j.name.startswith("rocker") else 1.0 for j in m.joints])

    def states(y: Array) -> tuple[Array, Array]:
        return y[:, :1] * sign, y[:, 1:] * sign

    start = np.array([0.0, -scene.initial_rates["rocker_0"]])
    return record_own(m, scene, own.slope, start, states, method, tolerance)


def _states(p: Parameters) -> Iterator[mass_check.State]:
    """Rockers turn alike about their pivots; couplers go along without turning."""
    for angle, rate in ((1.1, 1.3), (2.5, -0.7)):
        tip = cmath.rect(p.rocker_length, angle)
        values, rates, points = dict[str, float](), dict[str, float](), dict[str, tuple[float, float, float]]()
        particles = mass_check.NOTHING
        for k in range(p.N + 1):
            at = k * p.coupler_length
            values |= {f"rocker_{k}": angle, f"coupler_{k}": -angle}
            rates |= {f"rocker_{k}": rate, f"coupler_{k}": -rate}
            points[f"B{k}"] = parts.in_plane(at + tip)
            particles += parts.slender_particles(p.rocker_mass, p.rocker_length, at, 0.0, angle, rate)
            if k < p.N:
                particles += parts.slender_particles(
                    p.coupler_mass, p.coupler_length, at + tip, 1j * rate * tip, 0.0, 0.0
                )
        yield mass_check.State(values, rates, particles, points, (0.0, -p.gravity, 0.0), 1)


PRINTED = {
    1.0: (-0.19502030195, -0.980799205662),
    5.0: (-0.811310461003, -0.584615545352),
    10.0: (0.328458111536, 0.94451853818),
}

# The engines need not pass the singular position for check B1: a tenth of 10 s ends before the second passage.
PROBLEM = parts.Benchmark(Parameters, build, _fall, reference, CHANNELS, PRINTED, 1e-3)
ENTRY = PROBLEM.entry(
    bodies="2 N + 1 bars, N loops",
    scene="fall",
    text="falls from upright, pushed at B0",
    name="n_fourbar",
    title="N four-bars (A02)",
    family="benchmark",
    summary="Benchmark A02: a row of N parallelograms that passes its singular position again and again.",
    checks=(moving_check("B3", build, "full", _states),),
    chain="N x RRRR",
    formulas="theta'' = (g / L) sin(theta) [(N + 1) m_r / 2 + N m_c] / [(N + 1) m_r / 3 + N m_c], theta from upright.",
    sources=("Gonzalez, Gonzalez & Cuadrado: Benchmarking of multibody dynamics (IFToMM library), A02",),
)
