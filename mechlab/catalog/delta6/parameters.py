"""Parameters of the 6-DOF delta, names of its drives and coordinates, and the three legs at home."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TypeVar

import numpy as np

from mechlab.analytic.delta6 import Delta6, cardan_bend
from mechlab.errors import MechlabError
from mechlab.experiment.parameters import parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

T = TypeVar("T")

CENTRE = ("O_x", "O_y", "O_z")
"""Coordinates of the head centre O."""
ANGLES = ("alpha", "beta", "gamma")
"""Angles of the output link, R = Rz(gamma) Ry(beta) Rx(alpha)."""
HEAD_POSE = (*CENTRE, *ANGLES)
"""The six coordinates that fix where the head is and how the output link is turned."""
SLIDERS = ("q1", "q2", "q3")
ROTARY = ("phi1", "phi2", "phi3")
DRIVES = (*SLIDERS, *ROTARY)

_READ = "read in the source"
_FITTED = "fitted to the source's velocity example"
_ASSUMED = "assumed; the source is silent"


def _positive(default: T, unit: str, text: str, source: str = _ASSUMED) -> T:
    """A parameter above 0."""
    return parameter(default, unit, text, source=source, low=0, strict=True)


@dataclass(frozen=True)
class Delta6Parameters:
    """Flat parameters of the delta; SI units."""

    rod_length: float = _positive(0.37, "m", "length of the six rods", _FITTED)
    radial_offset: float = parameter(0.228, "m", "guide axis outside its platform joint", source=_FITTED)
    tangential_offset: float = parameter(0.003315, "m", "guide axis beside its platform joint", source=_FITTED)
    platform_radius: float = _positive(0.06, "m", "platform centre to lower cross")
    platform_height: float = parameter(0.06, "m", "lower cross above the head centre O", source=_ASSUMED)
    slider_height: float = parameter(0.05, "m", "slider reading above its upper cross", source=_ASSUMED)
    leg_azimuths: tuple[float, ...] = parameter(
        (-math.pi / 6, math.pi / 2, 7 * math.pi / 6), "rad", "azimuths of the three legs", source=_FITTED
    )
    head_offset: float = parameter(0.05, "m", "head centre O to output link centre D", source=_READ)
    k_spur: Fraction = _positive(Fraction(7, 5), "", "turns of drives 1 and 2 per turn of gamma", _READ)
    k_transfer: Fraction = _positive(Fraction(783, 1000), "", "turns of drives 1 and 2 per turn of beta", _READ)
    k_bevel: Fraction = _positive(
        Fraction(1), "", "turns of the double bevels per turn of alpha", "inferred from equal coefficients"
    )
    slider_min: float = parameter(0.25, "m", "lowest slider reading", source=_ASSUMED)
    slider_max: float = parameter(0.65, "m", "highest slider reading", source=_ASSUMED)
    bend_limit: float | None = parameter(
        None, "rad", "largest bend of the cardans (none: not limited)", source=_ASSUMED, low=0, high=math.pi / 2
    )
    rod_spacing: float = _positive(0.04, "m", "plain rod beside the cardan rod")
    slider_mass: float = _positive(0.35, "kg", "slider with its motor")
    rod_mass: float = _positive(0.06, "kg", "each of the six rods")
    rod_radius: float = _positive(0.003, "m", "radius of gyration times sqrt 2 of a rod about its own axis")
    cross_mass: float = _positive(0.012, "kg", "each cardan cross")
    platform_mass: float = _positive(0.45, "kg", "platform without gears")
    output_mass: float = _positive(0.15, "kg", "output link, centre of mass at D")
    rotor_inertia: float = _positive(2e-3, "kg m2", "rotor of each rotary drive, at its shaft")
    position_gain: float = parameter(480.0, "1/s2", "head control: gain on the angle error", source=_READ, low=0)
    velocity_gain: float = parameter(240.0, "1/s", "head control: gain on the rate error", source=_READ, low=0)
    curve: str = parameter(
        "", "", "file of a B-spline for the scene toolpath (empty: a built-in curve)", source=_ASSUMED
    )
    slider_speed: float = _positive(0.5, "m/s", "toolpath: largest speed of a slider")
    slider_acceleration: float = _positive(5.0, "m/s2", "toolpath: largest acceleration of a slider")
    slider_jerk: float = _positive(200.0, "m/s3", "toolpath: largest jerk of a slider")
    shaft_speed: float = _positive(12.0, "rad/s", "toolpath: largest speed of a rotary drive")
    shaft_acceleration: float = _positive(120.0, "rad/s2", "toolpath: largest acceleration of a rotary drive")
    shaft_jerk: float = _positive(5000.0, "rad/s3", "toolpath: largest jerk of a rotary drive")

    def __post_init__(self) -> None:
        if self.slider_min >= self.slider_max:
            raise MechlabError(
                f"delta6: slider_min = {self.slider_min:g} m must be below slider_max = {self.slider_max:g} m."
            )
        _ = self.geometry

    @property
    def geometry(self) -> Delta6:
        """The closed-form geometry; raises MechlabError when the lengths do not fit."""
        a, b, c = self.leg_azimuths
        return Delta6(
            rod_length=self.rod_length, radial_offset=self.radial_offset, tangential_offset=self.tangential_offset,
            platform_radius=self.platform_radius, platform_height=self.platform_height, slider_height=self.slider_height,
            leg_azimuths=(a, b, c), head_offset=self.head_offset, k_spur=float(self.k_spur),
            k_transfer=float(self.k_transfer), k_bevel=float(self.k_bevel)
        )  # fmt: skip

    @property
    def home_bend(self) -> float:
        """Bend of the cardans in the home pose [rad]."""
        return float(cardan_bend(self.geometry, np.zeros(3))[0])

    @property
    def home_reading(self) -> float:
        """Reading of the sliders in the home pose [m]."""
        return self.geometry.home_height + self.platform_height + self.slider_height


SOURCE = Delta6Parameters()
"""The parameters of the source: its printed numbers are always compared with these, whatever the user has chosen."""


@dataclass(frozen=True)
class Leg:
    """One leg in the home pose O = 0: unit vectors and points, all (3,) in the base frame."""

    index: int
    radial: Array
    tangent: Array
    upper: Array
    lower: Array
    span: Array
    fork_a: Array
    fork_b: Array

    @property
    def home(self) -> float:
        """Height of the upper cross at home [m]."""
        return float(self.upper[2])


def legs(p: Delta6Parameters) -> tuple[Leg, ...]:
    """The three legs at home. span = lower - upper cross; fork_b = z x span / |.|, fork_a = z x fork_b: the first cross
    pin lies along fork_a (in the shaft's fork), the second along fork_b (in the rod's fork)."""
    out = []
    z = np.array([0.0, 0.0, 1.0])
    for i, psi in enumerate(p.leg_azimuths):
        r = np.array([math.cos(psi), math.sin(psi), 0.0])
        t = np.array([-math.sin(psi), math.cos(psi), 0.0])
        g = -p.radial_offset * r + p.tangential_offset * t
        height = math.sqrt(p.rod_length**2 - float(g @ g))
        lower = p.platform_radius * r + p.platform_height * z
        span = g - height * z
        level = float(np.hypot(g[0], g[1]))
        b = np.array([-g[1], g[0], 0.0]) / level if level > 0.0 else -t
        a = np.array([-b[1], b[0], 0.0])
        out.append(Leg(i + 1, r, t, lower - span, lower, span, a, b))
    return tuple(out)
