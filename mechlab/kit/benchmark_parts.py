"""Parts of the benchmark entries: slender bars, tracked channels, checks against references and against printed
values."""

from __future__ import annotations

import cmath
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.mass_check import Particles, solid, spread_of
from mechlab.mechanism import Builder, Mechanism
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.mechanism.inertia import Inertia

THIN = 1e-3
"""Moment of inertia of a slender bar about its axis, relative to that across. Planar motion does not use it; MuJoCo
needs > 0."""

Channel = tuple[str, Callable[[Any, Recording], Array]]


def planar(mass: float, moment: float, x: float = 0.0, y: float = 0.0) -> Inertia:
    """A mass [kg] at (x, y) [m] with a moment about z [kg m2]. The other two moments, 0.6 of it, have no effect in the
    plane."""
    return Inertia(mass, (x, y, 0.0), (0.6 * moment, 0.6 * moment, moment, 0.0, 0.0, 0.0))


def slender(mass: float, length: float) -> Inertia:
    """A uniform slender bar from the origin along +x; moment across the bar m L^2 / 12."""
    across = mass * length**2 / 12.0
    return Inertia(mass, (0.5 * length, 0.0, 0.0), (THIN * across, across, across, 0.0, 0.0, 0.0))


def planar_particles(
    mass: float, moment: float, centre: complex, velocity: complex, angle: float = 0.0, rate: float = 0.0
) -> Particles:
    """The moving body of `planar` as particles; centre of mass [m] and its velocity [m/s] in the plane as x + i y."""
    return _flat(mass, (0.6 * moment, 0.6 * moment, moment), centre, velocity, angle, rate)


def slender_particles(
    mass: float, length: float, start: complex, velocity: complex, angle: float, rate: float
) -> Particles:
    """The moving bar of `slender` as particles; its start point [m] and that point's velocity [m/s] in the plane as x +
    i y."""
    across, middle = mass * length**2 / 12.0, 0.5 * length * cmath.exp(1j * angle)
    return _flat(mass, (THIN * across, across, across), start + middle, velocity + 1j * rate * middle, angle, rate)


def _flat(
    mass: float, moments: tuple[float, float, float], centre: complex, velocity: complex, angle: float, rate: float
) -> Particles:
    axes = axis_rotation((0.0, 0.0, 1.0), angle)
    return solid(mass, in_plane(centre), spread_of(mass, moments), axes, in_plane(velocity), (0.0, 0.0, rate))


def in_plane(z: complex) -> tuple[float, float, float]:
    """The point x + i y of the plane in the world: (x, y, 0)."""
    return z.real, z.imag, 0.0


def with_inertia(b: Builder, inertia: Inertia) -> None:
    """Replaces the inertia of the last body, which the builder derives from its shapes."""
    b.bodies[-1] = replace(b.bodies[-1], inertia=inertia)


def tracked(frame: str, letters: str = "xy", prefix: str = "") -> dict[str, Channel]:
    """Channels x, y (and z) of a frame [m], which a benchmark compares."""

    def follow(letter: str) -> Callable[[Any, Recording], Array]:
        return lambda p, recording: recording.channel(f"{frame}_{letter}")

    return {f"{prefix}{a}": ("m", follow(a)) for a in letters}


Reference = Callable[..., Recording]
Maker = Callable[[Any, str], Scene]


def engine_check(
    build: Callable[[Any, str], Mechanism],
    make: Maker,
    reference: Reference,
    channels: Mapping[str, Channel],
    limit: float,
    share: float = 0.1,
    steps: int = 500,
) -> Callable[[Any], CheckResult]:
    """A check of the tracked channels after a `share` of the scene: MuJoCo and Pinocchio against the reference.

    limit [m]: largest error allowed for `steps` steps of RK4; with default parameters the error is below a tenth of it.
    """

    def check(p: Any) -> CheckResult:
        scene = make(p, "full")
        scene = replace(scene, duration=share * scene.duration)
        h = scene.duration / steps
        m = build(p, "full")
        runs = {e: engine(e).run(m, scene, Settings(engine=e, timestep=h)) for e in ("mujoco", "pinocchio")}
        ends = {n: [float(f(p, r)[-1]) for _, f in channels.values()] for n, r in runs.items()}
        truth = reference(p, scene)
        expected = [float(f(p, truth)[-1]) for _, f in channels.values()]
        return CheckResult(
            ends, limit, expected, f"tracked position [m] after {scene.duration:g} s, {steps} steps of RK4"
        )

    return check


def printed_check(
    parameters: type[Any],
    make: Maker,
    reference: Reference,
    channels: Mapping[str, Channel],
    printed: Mapping[float, tuple[float, ...]],
    tolerance: float,
) -> Callable[[Any], CheckResult]:
    """A check of the reference with default parameters against printed values: time [s] -> channels."""

    def check(p: Any) -> CheckResult:
        default = parameters()
        found = reference(default, make(default, "full"))
        values = {n: f(default, found) for n, (_, f) in channels.items()}
        full = replace(found, channels=found.channels | values)
        got = [[full.at(n, t) for n in channels] for t in printed]
        return CheckResult({"analytic": got}, tolerance, [list(x) for x in printed.values()], "with default parameters")

    return check


def checks(
    build: Callable[[Any, str], Mechanism],
    parameters: type[Any],
    make: Maker,
    reference: Reference,
    channels: Mapping[str, Channel],
    printed: Mapping[float, tuple[float, ...]],
    limit: float,
    tolerance: float = 1e-9,
    share: float = 0.1,
    steps: int = 500,
) -> tuple[Check, Check]:
    """The two checks of every benchmark problem."""
    return (
        Check("B1", "MuJoCo and Pinocchio against own equations",
              engine_check(build, make, reference, channels, limit, share, steps),
              "own equations, DOP853 or Radau, 1e-12"),
        Check("B2", "own equations against printed values",
              printed_check(parameters, make, reference, channels, printed, tolerance), "printed reference solutions"),
    )  # fmt: skip


def columns(mechanism: Mechanism, values: Mapping[str, Array], rates: Mapping[str, Array]) -> tuple[Array, Array]:
    """Coordinates (n, nq) and rates (n, nv) from physical values of the joints by name (all of one coordinate)."""
    q = np.column_stack([np.asarray(values[j.name]) - j.zero for j in mechanism.joints])
    return q, np.column_stack([np.asarray(rates[j.name]) for j in mechanism.joints])
