"""A05: a flyball governor whose stiff spring-dampers make it a stiff problem."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mechlab.analytic.benchmarks import Governor
from mechlab.catalog import benchmark_parts as parts
from mechlab.catalog import palette
from mechlab.experiment.entry import Entry, SceneRecipe
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import Settings
from mechlab.mechanism import Builder, Mechanism, Placement, Spring, prismatic, revolute, shape
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.inertia import Inertia
from mechlab.study.own_equations import record_own

SOURCE = "IFToMM benchmark library, A05"


@dataclass(frozen=True)
class Parameters:
    """Bars of square section on a shaft along z, a slider on the shaft, two arms with balls."""

    spring_stiffness: float = parameter(8e5, "N/m", "springs between slider and arms", source=SOURCE, low=0)
    damping: float = parameter(4e4, "N s/m", "dampers beside them", source=SOURCE, low=0)
    spring_length: float = parameter(0.5, "m", "length of the springs without force", source=SOURCE, low=0)
    ball_mass: float = parameter(5.0, "kg", "point mass at the end of each arm", source=SOURCE, low=0, strict=True)
    start_rate: float = parameter(2 * math.pi, "rad/s", "speed of the shaft at the start", source=SOURCE)
    density: float = parameter(3000.0, "kg/m3", "density of shaft, slider and arms", source=SOURCE, low=0, strict=True)
    arm_length: float = parameter(1.0, "m", "arms", source=SOURCE, low=0, strict=True)
    section: float = parameter(0.01, "m", "width of shaft and arms", source=SOURCE, low=0, strict=True)
    shaft_length: float = parameter(1.0, "m", "shaft; the arms hang at its top", source=SOURCE, low=0, strict=True)
    slider_size: float = parameter(0.1, "m", "edge of the slider, a cube", source=SOURCE, low=0, strict=True)
    pivot: float = parameter(0.05, "m", "distance of the pivots from the axis", source=SOURCE, low=0, strict=True)
    start_angle: float = parameter(math.radians(30.0), "rad", "arms below the horizontal at the start", source=SOURCE)
    start_height: float = parameter(0.5, "m", "height of the slider at the start", source=SOURCE)
    gravity: float = parameter(9.81, "m/s2", "gravity, along -z", source=SOURCE)
    duration: float = parameter(10.0, "s", "duration of the scene", source=SOURCE, low=0, strict=True)

    @property
    def arm_mass(self) -> float:
        """Mass of an arm without its ball [kg]."""
        return self.density * self.arm_length * self.section**2

    @property
    def slider_mass(self) -> float:
        """Mass of the slider [kg]."""
        return self.density * self.slider_size**3


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """A tree: shaft, slider and two arms on it; the reference pose is that of the start."""
    b = Builder("flyball", gravity=(0.0, 0.0, -p.gravity), summary="flyball governor, benchmark A05")
    thick = max(p.section, 0.015 * p.shaft_length)
    rod = p.density * p.shaft_length * p.section**2
    half = 0.5 * p.shaft_length
    post = [
        shape("cylinder", Placement((0.0, 0.0, half)), palette.SLATE, "post", radius=0.6 * thick, length=p.shaft_length)
    ]
    post.append(
        shape(
            "box", Placement((0.0, 0.0, p.shaft_length)), palette.SLATE, "yoke", x=2 * p.pivot, y=2 * thick, z=2 * thick
        )
    )
    upright = Inertia.box(rod, p.section, p.section, p.shaft_length, (0.0, 0.0, half))
    b.body("shaft", revolute("shaft_angle", "z"), inertia=upright, shapes=post)
    cube = Inertia.box(p.slider_mass, p.slider_size, p.slider_size, p.slider_size)
    e = p.slider_size
    b.body(
        "slider",
        prismatic("slider_height", "z", zero=p.start_height),
        parent="shaft",
        at=(0.0, 0.0, p.start_height),
        inertia=cube,
        shapes=[shape("box", color=palette.TEAL, name="slider", x=e, y=e, z=e)],
    )
    lowered = _lowered(p.start_angle)
    for name, side in (("right", 1.0), ("left", -1.0)):
        bar = Inertia.box(p.arm_mass, p.arm_length, p.section, p.section, (0.5 * p.arm_length, 0.0, 0.0))
        ball = Inertia.point(p.ball_mass, (p.arm_length, 0.0, 0.0))
        looks = [
            shape(
                "box",
                Placement((0.5 * p.arm_length, 0.0, 0.0)),
                palette.BLUE,
                f"{name}_bar",
                x=p.arm_length,
                y=thick,
                z=thick,
            ),
            shape(
                "sphere",
                Placement((p.arm_length, 0.0, 0.0)),
                palette.ORANGE,
                f"{name}_ball",
                radius=0.07 * p.arm_length,
            ),
        ]
        turn = lowered if side > 0 else np.diag([-1.0, -1.0, 1.0]) @ lowered
        b.body(
            f"{name}_arm",
            revolute(f"{name}_angle", "y", zero=p.start_angle),
            parent="shaft",
            at=(side * p.pivot, 0.0, p.shaft_length),
            turned=Placement.of(turn, (0.0, 0.0, 0.0)),
            inertia=bar + ball,
            shapes=looks,
        )
        b.spring(
            Spring(
                f"{name}_spring",
                "slider",
                f"{name}_arm",
                (side * p.pivot, 0.0, 0.0),
                (0.5 * p.arm_length, 0.0, 0.0),
                p.spring_stiffness,
                p.damping,
                p.spring_length,
            )
        )
        b.frame(f"{name}_ball", f"{name}_arm", (p.arm_length, 0.0, 0.0))
    b.frame("S", "slider")
    return b.build()


def _lowered(angle: float) -> Array:
    """Rotation about y that lowers +x by `angle`."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


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
    checks=parts.checks(build, Parameters, _spin, reference, CHANNELS, PRINTED, 1e-7, 1e-9, share=0.03, steps=1500),
    reference=reference,
    channels=CHANNELS,
    chain="R(P, 2 R)",
    formulas="I(alpha) phi' = const; arms and slider by Lagrange, spring force k (l - l0) + c l'.",
    sources=("Gonzalez, Gonzalez & Cuadrado: Benchmarking of multibody dynamics (IFToMM library), A05",),
)
