"""A01: the simple pendulum, released from the horizontal."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from mechlab.analytic.benchmarks.planar import Pendulum
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.kit import benchmark_parts as parts
from mechlab.kit import palette
from mechlab.kit.checks import moving_check
from mechlab.kit.mass_check import State, solid
from mechlab.kit.own_equations import record_own
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import IDENTITY, Builder, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.mechanism.inertia import Inertia

SOURCE = "IFToMM benchmark library, A01"
POINT = 1e-12
"""Moment of the point mass about itself, in m L^2: MuJoCo wants one > 0. It shifts the period by half of this share."""


@dataclass(frozen=True)
class Parameters:
    """Rod, mass, gravity, start. P1 is the mass, at length (cos, sin)(angle)."""

    length: float = parameter(1.0, "m", "massless rod", source=SOURCE, low=0, strict=True)
    mass: float = parameter(1.0, "kg", "point mass at its end", source=SOURCE, low=0, strict=True)
    gravity: float = parameter(9.81, "m/s2", "gravity, along -y", source=SOURCE)
    start_angle: float = parameter(math.pi, "rad", "angle from +x at the start", source=SOURCE)
    start_rate: float = parameter(0.0, "rad/s", "rate at the start", source=SOURCE, scene=True)
    duration: float = parameter(10.0, "s", "duration of the scene", source=SOURCE, low=0, strict=True, scene=True)


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """One body, one hinge about z; the reference pose is that of the start."""
    b = Builder("pendulum", gravity=(0.0, -p.gravity, 0.0), summary="simple pendulum, benchmark A01")
    w = 0.03 * p.length
    turn = Placement.of(axis_rotation((0.0, 0.0, 1.0), p.start_angle), (0.0, 0.0, 0.0))
    across = axis_rotation((0.0, 1.0, 0.0), math.pi / 2)
    looks = [
        shape("cylinder", Placement.of(across, (0.5 * p.length, 0.0, 0.0)), palette.BLUE, "rod",
              radius=0.35 * w, length=p.length),
        shape("sphere", Placement((p.length, 0.0, 0.0)), palette.ORANGE, "mass", radius=2.0 * w),
        shape("cylinder", IDENTITY, palette.SLATE, "pin", radius=w, length=2.0 * w),
    ]  # fmt: skip
    small = POINT * p.mass * p.length**2
    point = Inertia(p.mass, (p.length, 0.0, 0.0), (small, small, small, 0.0, 0.0, 0.0))
    b.body("bob", revolute("angle", "z", zero=p.start_angle), turned=turn, inertia=point, shapes=looks)
    b.frame("P1", "bob", (p.length, 0.0, 0.0))
    return b.build()


CHANNELS = parts.tracked("P1")


def _swing(p: Parameters, fidelity: str) -> Scene:
    return Scene(
        "swing", fidelity, p.duration, initial={"angle": p.start_angle}, initial_rates={"angle": p.start_rate},
        channels=tuple(CHANNELS), tolerance=1e-6,
    )  # fmt: skip


def reference(p: Parameters, scene: Scene, method: str = "DOP853", tolerance: float = 1e-13) -> Recording:
    """phi'' = -(g / L) cos phi, from the start of the scene."""
    start = np.array([scene.initial["angle"], scene.initial_rates["angle"]])

    def states(y: Array) -> tuple[Array, Array]:
        return y[:, :1] - p.start_angle, y[:, 1:]

    return record_own(build(p, "full"), scene, Pendulum(p.length, p.gravity).slope, start, states, method, tolerance)


PRINTED = {
    1.0: (0.986291751132, -0.165010853126),
    5.0: (-0.942305435044, -0.334754338414),
    10.0: (-0.275087462576, -0.961419205099),
}


def _check_elliptic(p: Parameters) -> CheckResult:
    """The reference against elliptic functions, at this start, length and gravity."""
    found = reference(p, _swing(p, "full"))
    exact = Pendulum(p.length, p.gravity).in_closed_form(p.start_angle, p.start_rate, found.t)
    # 1e-13 a step, over some hundred steps
    return CheckResult(
        {"equations": np.cos(found.channel("angle"))}, 1e-10, np.cos(exact), "x / L over the whole scene"
    )


def _states(p: Parameters) -> Iterator[State]:
    spread = np.full(3, math.sqrt(0.5 * POINT) * p.length)
    for angle, rate in ((p.start_angle, 1.3), (p.start_angle + 0.9, -0.7)):
        place = cmath.rect(p.length, angle)
        at = parts.in_plane(place)
        bob = solid(p.mass, at, spread, velocity=parts.in_plane(1j * rate * place), turn=(0, 0, rate))
        yield State({"angle": angle}, {"angle": rate}, bob, {"P1": at}, (0.0, -p.gravity, 0.0), 1)


PROBLEM = parts.Benchmark(Parameters, build, _swing, reference, CHANNELS, PRINTED, 1e-7)
ENTRY = PROBLEM.entry(
    bodies="one body, one hinge",
    scene="swing",
    text="released at the start angle",
    name="pendulum",
    title="Simple pendulum (A01)",
    family="benchmark",
    summary="Benchmark A01: a point mass on a massless rod, released from the horizontal.",
    checks=(
        Check("B3", "own equation against elliptic functions", _check_elliptic, "Jacobi's elliptic functions"),
        moving_check("B4", build, "full", _states, from_reference=True),
    ),
    chain="R",
    formulas="phi'' = -(g / L) cos phi; sin(psi / 2) = k sn(sqrt(g / L) t + u0), psi = phi + pi / 2, as long as it swings.",
    sources=("Gonzalez, Gonzalez & Cuadrado: Benchmarking of multibody dynamics (IFToMM library), A01",),
)
