"""A slider-crank of slender bars that runs freely: fast spin, no springs, one loop."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from mechlab.analytic.benchmarks.planar import Jet, SliderCrank
from mechlab.experiment.entry import PlotRecipe
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit import benchmark_parts as parts
from mechlab.kit import palette
from mechlab.kit.checks import moving_check
from mechlab.kit.mass_check import State
from mechlab.kit.own_equations import record_own
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Mechanism, Placement, prismatic, revolute, shape
from mechlab.mechanism.geometry import Array


@dataclass(frozen=True)
class Parameters:
    """Lengths and masses; the slider runs on the x axis, its position is counted from the crank pivot."""

    crank: float = parameter(0.1, "m", "crank", low=0, strict=True)
    rod: float = parameter(0.3, "m", "connecting rod", low=0, strict=True)
    crank_mass: float = parameter(1.0, "kg", "uniform slender crank", low=0, strict=True)
    rod_mass: float = parameter(2.0, "kg", "uniform slender rod", low=0, strict=True)
    slider_mass: float = parameter(1.5, "kg", "slider", low=0, strict=True)
    gravity: float = parameter(9.81, "m/s2", "gravity, along -y")
    start_angle: float = parameter(math.radians(60.0), "rad", "crank angle at the start")
    start_rate: float = parameter(10.0, "rad/s", "crank speed at the start", scene=True)
    duration: float = parameter(5.0, "s", "duration of the scene", low=0, strict=True, scene=True)


ALONG = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Turns a rail along z with its head at +y to one along x with its head at +z, where the rod lies."""


def _own(p: Parameters) -> SliderCrank:
    return SliderCrank(p.crank, p.rod, p.crank_mass, p.rod_mass, p.slider_mass, p.gravity)


def _width(p: Parameters) -> float:
    """How wide the bars are drawn [m]."""
    return 0.16 * p.crank + 0.03 * p.rod


def _slider_moment(p: Parameters) -> float:
    """Moment of inertia of the slider about its centre [kg m2]; the slider does not turn, so it has no effect."""
    return p.slider_mass * _width(p) ** 2


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """Crank, rod, slider; the loop is closed by the pin between rod and slider."""
    b = Builder("slider_crank", gravity=(0.0, -p.gravity, 0.0), summary="slider-crank, running freely")
    width = _width(p)
    b.bar("crank", revolute("crank_angle", "z"), p.crank, width=width, color=palette.BLUE)
    parts.with_inertia(b, parts.slender(p.crank_mass, p.crank))
    b.bar("rod", revolute("rod_joint", "z"), p.rod, parent="crank", at=(p.crank, 0.0, 0.0), width=width,
          color=palette.ORANGE, layer=0.5 * width)  # fmt: skip
    parts.with_inertia(b, parts.slender(p.rod_mass, p.rod))
    low, high = max(p.rod - p.crank, 0.0), p.rod + p.crank
    foot = Placement.of(ALONG, (0.0, 0.0, -0.65 * width))
    looks = [
        shape("carriage", foot, palette.TEAL, "slider", length=2.0 * width, width=1.5 * width, height=0.9 * width, rail_width=0.5 * width)
    ]
    begin = Placement.of(np.eye(3), (low - 1.6 * width, 0.0, 0.0))
    b.ground(shape("rail", begin @ foot, palette.STEEL, "rail", length=high - low + 3.2 * width, width=0.5 * width))
    block = parts.planar(p.slider_mass, _slider_moment(p))
    b.body("slider", prismatic("slider_position", "x"), inertia=block, shapes=looks)
    b.loop("pin", "rod", "slider", (p.rod, 0.0, 0.0))
    b.frame("B", "crank", (p.crank, 0.0, 0.0)).frame("C", "slider")
    _, psi, slider = _own(p).pose(p.start_angle)
    guess = {
        "crank_angle": p.start_angle,
        "rod_joint": psi.value.real - p.start_angle,
        "slider_position": slider.value.real,
    }
    return b.assemble(guess, hold=["crank_angle"])


CHANNELS: dict[str, parts.Channel] = {"slider": ("m", lambda p, recording: recording.channel("slider_position"))}


def _run(p: Parameters, fidelity: str) -> Scene:
    return Scene(
        "free-run", fidelity, p.duration, initial={"crank_angle": p.start_angle},
        initial_rates={"crank_angle": p.start_rate}, channels=tuple(CHANNELS), tolerance=1e-4, settings=Settings(timestep=2.5e-4),
    )  # fmt: skip


def reference(p: Parameters, scene: Scene, method: str = "DOP853", tolerance: float = 1e-13) -> Recording:
    """The equation of the crank alone (Eksergian)."""
    m, own = build(p, "full"), _own(p)

    def states(y: Array) -> tuple[Array, Array]:
        values, rates = own.states(y)
        named = {"crank_angle": values[:, 0], "rod_joint": values[:, 1] - values[:, 0], "slider_position": values[:, 2]}
        speeds = {"crank_angle": rates[:, 0], "rod_joint": rates[:, 1] - rates[:, 0], "slider_position": rates[:, 2]}
        return parts.columns(m, named, speeds)

    start = np.array([scene.initial["crank_angle"], scene.initial_rates["crank_angle"]])
    return record_own(m, scene, own.slope, start, states, method, tolerance)


def _states(p: Parameters) -> Iterator[State]:
    found = _own(p).states(np.array([[p.start_angle, p.start_rate], [-p.start_angle, -3.0]]))
    for (phi, psi, x), (rate, turn, speed) in zip(*(a.tolist() for a in found), strict=True):
        tip = cmath.rect(p.crank, phi)
        particles = (
            parts.slender_particles(p.crank_mass, p.crank, 0.0, 0.0, phi, rate)
            + parts.slender_particles(p.rod_mass, p.rod, tip, 1j * rate * tip, psi, turn)
            + parts.planar_particles(p.slider_mass, _slider_moment(p), x, speed)
        )
        values = {"crank_angle": phi, "rod_joint": psi - phi, "slider_position": x}
        rates = {"crank_angle": rate, "rod_joint": turn - rate, "slider_position": speed}
        points = {"B": parts.in_plane(tip), "C": parts.in_plane(x)}
        yield State(values, rates, particles, points, (0.0, -p.gravity, 0.0), 1)


def _warnings(p: Parameters) -> tuple[str, ...]:
    _own(p).rod_angle(Jet(p.start_angle, 1.0))
    return () if p.rod > p.crank else ("the rod is not longer than the crank: the crank cannot turn all the way",)


PRINTED = {0.5: (0.240887929432,), 2.5: (0.236243942209,), 5.0: (0.242074089597,)}

PROBLEM = parts.Benchmark(Parameters, build, _run, reference, CHANNELS, PRINTED, 1e-4)
ENTRY = PROBLEM.entry(
    bodies="crank, rod, slider; one loop",
    scene="free-run",
    text="the crank is let go at full speed",
    name="slider_crank",
    title="Slider-crank",
    family="engine",
    summary="A slider-crank that runs freely from 10 rad/s: first-order methods lose its phase.",
    sliders=("crank", "rod"),
    plots=(
        PlotRecipe("stroke of the slider", ("slider_position",)),
        PlotRecipe("speed of the slider", ("slider_position_rate",)),
        PlotRecipe("speed of the crank", ("crank_angle_rate",)),
    ),
    checks=(moving_check("B3", build, "full", _states, from_reference=True),),
    warnings=_warnings,
    chain="RRRP",
    formulas="J w' + J'/2 w^2 = Q, J(phi) = sum m |dz/dphi|^2 + I (dtheta/dphi)^2 (Eksergian).",
    sources=("Eksergian 1930",),
)
