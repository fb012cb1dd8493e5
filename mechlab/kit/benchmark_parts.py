"""Parts of the benchmark entries: slender bars, tracked channels, checks against references and against printed
values."""

from __future__ import annotations

import cmath
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.experiment.entry import Check, CheckResult, Entry, SceneRecipe
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.checks import EXACT
from mechlab.kit.mass_check import Particles, solid, spread_of
from mechlab.lazy_dataclass import dataclass
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


@dataclass(frozen=True)
class Benchmark:
    """A benchmark problem: a model and its scene, tracked channels, own equations as reference, printed values.

    make(p, "full") -> Scene; reference(p, scene) -> Recording. printed: time [s] -> the channels with default parameters, which
    the reference meets to `tolerance`. limit [m]: largest error allowed over a `share` of the scene to MuJoCo in `steps` steps of
    RK4, and to Pinocchio with the settings `exact`; with default parameters the error is below a tenth of it.
    """

    parameters: type[Any]
    build: Callable[[Any, str], Mechanism]
    make: Maker
    reference: Reference
    channels: Mapping[str, Channel]
    printed: Mapping[float, tuple[float, ...]]
    limit: float
    tolerance: float = 1e-9
    share: float = 0.1
    steps: int = 500
    exact: Settings = EXACT

    def against_engines(self, p: Any) -> CheckResult:
        """The tracked channels after a share of the scene: MuJoCo and Pinocchio against the reference."""
        scene = self.make(p, "full")
        scene = replace(scene, duration=self.share * scene.duration)
        m = self.build(p, "full")
        settings = (Settings(timestep=scene.duration / self.steps), self.exact)
        runs = {s.engine: engine(s.engine).at_times(m, scene, s, [scene.duration]) for s in settings}
        ends = {n: [float(f(p, r)[-1]) for _, f in self.channels.values()] for n, r in runs.items()}
        truth = self.reference(p, scene)
        expected = [float(f(p, truth)[-1]) for _, f in self.channels.values()]
        note = f"tracked position [m] after {scene.duration:g} s, {self.steps} steps of RK4, or DOP853"
        return CheckResult(ends, self.limit, expected, note)

    def against_printed(self, p: Any) -> CheckResult:
        """The reference with default parameters against the printed values, whatever the parameters p are."""
        default = self.parameters()
        found = self.reference(default, self.make(default, "full"))
        values = {n: f(default, found) for n, (_, f) in self.channels.items()}
        full = replace(found, channels=found.channels | values)
        got = [[full.at(n, t) for n in self.channels] for t in self.printed]
        expected = [list(x) for x in self.printed.values()]
        return CheckResult({"analytic": got}, self.tolerance, expected, "with default parameters")

    def entry(self, bodies: str, scene: str, text: str, checks: Sequence[Check] = (), **more: Any) -> Entry:
        """The Entry of the problem. bodies: what its model is made of; scene, text: name of the scene and what happens in it;
        checks: those besides the two of every benchmark; more: what else an `Entry` takes."""
        engines, source = "MuJoCo and Pinocchio against own equations", "own equations, DOP853 or collocation, 1e-12"
        both = (
            Check("B1", engines, self.against_engines, source),
            Check("B2", "own equations against printed values", self.against_printed, "printed reference solutions"),
        )
        return Entry(
            parameters=self.parameters,
            build=self.build,
            fidelities={"full": bodies},
            default_fidelity="full",
            scenes={scene: SceneRecipe(self.make, "full", text)},
            default_scene=scene,
            checks=(*both, *checks),
            reference=self.reference,
            channels=self.channels,
            **more,
        )


def columns(mechanism: Mechanism, values: Mapping[str, Array], rates: Mapping[str, Array]) -> tuple[Array, Array]:
    """Coordinates (n, nq) and rates (n, nv) from physical values of the joints by name (all of one coordinate)."""
    q = np.column_stack([np.asarray(values[j.name]) - j.zero for j in mechanism.joints])
    return q, np.column_stack([np.asarray(rates[j.name]) for j in mechanism.joints])
