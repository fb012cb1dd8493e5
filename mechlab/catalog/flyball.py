"""A05: a flyball governor whose stiff spring-dampers make it a stiff problem."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from mechlab.analytic.benchmarks.spatial import Governor
from mechlab.experiment.entry import PlotRecipe
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit import benchmark_parts as parts
from mechlab.kit import mass_check, palette
from mechlab.kit.checks import moving_check
from mechlab.kit.own_equations import COLLOCATION, record_own
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Mechanism, Placement, Spring, prismatic, revolute, shape
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.mechanism.inertia import Inertia

SOURCE = "IFToMM benchmark library, A05"


@dataclass(frozen=True)
class Parameters:
    """Bars of square section on a shaft along z, a slider on the shaft, two arms with balls."""

    spring_stiffness: float = parameter(8e5, "N/m", "springs between slider and arms", source=SOURCE, low=0)
    damping: float = parameter(4e4, "N s/m", "dampers beside them", source=SOURCE, low=0)
    spring_length: float = parameter(0.5, "m", "length of the springs without force", source=SOURCE, low=0)
    ball_mass: float = parameter(5.0, "kg", "point mass at the end of each arm", source=SOURCE, low=0, strict=True)
    start_rate: float = parameter(2 * math.pi, "rad/s", "speed of the shaft at the start", source=SOURCE, scene=True)
    density: float = parameter(3000.0, "kg/m3", "density of shaft, slider and arms", source=SOURCE, low=0, strict=True)
    arm_length: float = parameter(1.0, "m", "arms", source=SOURCE, low=0, strict=True)
    section: float = parameter(0.01, "m", "width of shaft and arms", source=SOURCE, low=0, strict=True)
    shaft_length: float = parameter(1.0, "m", "shaft; the arms hang at its top", source=SOURCE, low=0, strict=True)
    slider_size: float = parameter(0.1, "m", "edge of the slider, a cube", source=SOURCE, low=0, strict=True)
    pivot: float = parameter(0.05, "m", "distance of the pivots from the axis", source=SOURCE, low=0, strict=True)
    start_angle: float = parameter(math.radians(30.0), "rad", "arms below the horizontal at the start", source=SOURCE)
    start_height: float = parameter(0.5, "m", "height of the slider at the start", source=SOURCE)
    gravity: float = parameter(9.81, "m/s2", "gravity, along -z", source=SOURCE)
    duration: float = parameter(10.0, "s", "duration of the scene", source=SOURCE, low=0, strict=True, scene=True)

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


STATES = ((0.4, 0.62, 0.5, 0.8), (1.3, -0.4, 0.9, -0.7)), ((-1.1, 0.31, 0.95, 0.2), (0.6, 0.5, -1.2, 0.3))
"""Shaft angle, slider height, right and left arm angle, then their rates: both arms are free to differ."""


def moving(p: Parameters, at: tuple[float, ...], rates: tuple[float, ...]) -> mass_check.State:
    """Shaft, slider, arms and balls as particles, placed in axes that turn with the shaft; springs by their length."""
    names = ("shaft_angle", "slider_height", "right_angle", "left_angle")
    (turned, height, *angles), (turn, climb, *swings) = at, rates
    spin, shaft = np.array([0.0, 0.0, turn]), axis_rotation((0.0, 0.0, 1.0), turned)
    e = p.slider_size / math.sqrt(12.0)
    slender = np.array([p.arm_length, p.section, p.section]) / math.sqrt(12.0)
    post = p.density * p.shaft_length * p.section**2
    post_spread = np.array([p.section, p.section, p.shaft_length]) / math.sqrt(12.0)
    particles = mass_check.solid(post, (0.0, 0.0, 0.5 * p.shaft_length), post_spread, shaft, turn=spin)
    particles += mass_check.solid(p.slider_mass, (0.0, 0.0, height), (e, e, e), shaft, (0.0, 0.0, climb), spin)
    points, stored, lost = {"S": np.array([0.0, 0.0, height])}, 0.0, 0.0
    for side, name, angle, swing in zip((1.0, -1.0), ("right", "left"), angles, swings, strict=True):
        along = shaft @ [side * math.cos(angle), 0.0, -math.sin(angle)]
        across = shaft @ [0.0, side, 0.0]  # the arm falls about it
        pivot, omega = shaft @ [side * p.pivot, 0.0, p.shaft_length], spin + swing * across
        axes = np.column_stack([along, across, np.cross(along, across)])
        arm, hung = p.arm_length * along, np.cross(spin, pivot)
        middle, drift = pivot + 0.5 * arm, hung + 0.5 * np.cross(omega, arm)
        ball, fly = pivot + arm, hung + np.cross(omega, arm)
        particles += mass_check.solid(p.arm_mass, middle, slender, axes, drift, omega)
        particles += mass_check.solid(p.ball_mass, ball, velocity=fly)
        end = shaft @ [side * p.pivot, 0.0, height]
        way, speed = middle - end, drift - np.cross(spin, end) - [0.0, 0.0, climb]
        length = float(np.linalg.norm(way))
        stretch = float(way @ speed) / length
        stored += p.spring_stiffness * (length - p.spring_length) * stretch
        lost += p.damping * stretch**2
        points[f"{name}_ball"] = ball
    values, speeds = (dict(zip(names, x, strict=True)) for x in (at, rates))
    return mass_check.State(values, speeds, particles, points, (0.0, 0.0, -p.gravity), 4, stored=stored, lost=lost)


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


def reference(p: Parameters, scene: Scene, method: str = COLLOCATION, tolerance: float = 1e-12) -> Recording:
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
        turn = h / own.moment(alpha)[0]
        rates = {"shaft_angle": turn, "slider_height": ds, "right_angle": dalpha, "left_angle": dalpha}
        return parts.columns(m, values, rates)

    return record_own(m, scene, own.slope, start, states, method, tolerance)


PRINTED = {1.0: (0.50142092238,), 2.5: (0.735602283079,), 5.0: (0.535563103722,), 10.0: (0.619622917061,)}

# RK4 is stable below 2.8 m / c = 0.5 ms: 0.3 s in steps of 0.2 ms; DOP853 takes as short steps, in which its error is small
EXACT = Settings("pinocchio", integrator="DOP853", tolerance=1e-8)
PROBLEM = parts.Benchmark(Parameters, build, _spin, reference, CHANNELS, PRINTED, 1e-7, 1e-9, share=0.03, steps=1500, exact=EXACT)
ENTRY = PROBLEM.entry(
    bodies="shaft, slider, two arms",
    scene="spin",
    text="let go at the start speed, without a drive",
    name="flyball",
    title="Flyball governor (A05)",
    family="balance",
    summary="Benchmark A05: a governor with stiff spring-dampers; explicit methods need tiny steps.",
    plots=(
        PlotRecipe("height of the sleeve", ("slider_height",)),
        PlotRecipe("speed of the shaft", ("shaft_angle_rate",)),
    ),
    checks=(moving_check("B3", build, "full", lambda p: (moving(p, *state) for state in STATES)),),
    chain="R(P, 2 R)",
    formulas="I(alpha) phi' = const; arms and slider by Lagrange, spring force k (l - l0) + c l'.",
    sources=("Gonzalez, Gonzalez & Cuadrado: Benchmarking of multibody dynamics (IFToMM library), A05",),
)
