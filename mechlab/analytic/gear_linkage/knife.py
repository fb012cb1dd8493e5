"""A knife driven by a three-gear four-bar: slider-crank on the output gear, and the torque that a cut asks of the main shaft.

The output gear turns by out = i phi - (i + j) coupler + (1 + j) rocker (absolute angles); its pin of radius `throw` stands at
out + `mount` from the frame line, the knife at y = throw sin(out + mount) - sqrt(rod^2 - throw^2 cos^2(out + mount)) along the
normal to the frame line through D. It cuts on its way down through the last `stack` above its lowest place.
The alternative is a clutch of periodic turning: while it holds, the pin turns k times as fast as the main shaft, k = 2 pi / (2 pi - rest).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.blocks import FloatArray
from mechlab.analytic.gear_linkage.linkage import GearLinkage, angles, motion
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Knife:
    """Throw of the pin, connecting rod and height of the stack [m]; raises MechlabError unless stack < 2 throw and throw < rod."""

    throw: float
    rod: float
    stack: float

    def __post_init__(self) -> None:
        if not (0.0 < self.throw < self.rod and 0.0 < self.stack < 2.0 * self.throw):
            raise MechlabError(
                f"knife: expected 0 < throw < rod and 0 < stack < 2 throw, got {self.throw:g}, {self.rod:g}, {self.stack:g} m"
            )

    @property
    def lowest(self) -> float:
        """The lowest place of the knife [m]."""
        return -self.throw - self.rod

    def place(self, pin: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Place of the knife [m] and its derivative [m/rad] by the angle of the pin."""
        sine, cosine = np.sin(np.asarray(pin, dtype=float)), np.cos(np.asarray(pin, dtype=float))
        across = np.sqrt(self.rod**2 - (self.throw * cosine) ** 2)
        return self.throw * sine - across, self.throw * cosine * (1.0 - self.throw * sine / across)

    def cuts(self, place: ArrayLike, rate: ArrayLike) -> FloatArray:
        """1.0 where it cuts: in the stack, on its way down; else 0.0."""
        inside = np.asarray(place) < self.lowest + self.stack
        return np.where(inside & (np.asarray(rate) < 0.0), 1.0, 0.0)


def pin_angle(g: GearLinkage, phi: ArrayLike, mount: float = 0.0) -> FloatArray:
    """Angle of the pin [rad]; continuous in phi."""
    psi, chi, _ = angles(g, phi)
    i, j = g.ratio, g.idler_ratio
    return np.asarray(i * np.asarray(phi, dtype=float) - (i + j) * psi + (1.0 + j) * chi + mount)


def cutting_torque(g: GearLinkage, knife: Knife, mount: ArrayLike, phi: ArrayLike) -> FloatArray:
    """Torque on the main shaft [N m] for a cutting force of 1 N at the crank angles phi: the power of the force at a rate of 1.
    mount and phi broadcast."""
    place, slope = knife.place(pin_angle(g, phi) + np.asarray(mount, dtype=float))
    rate = slope * motion(g, phi).output_rate
    return np.asarray(-rate * knife.cuts(place, rate))


def clutch_pace(rest: float) -> float:
    """How many times as fast as the main shaft a clutch of periodic turning drives while it holds, if it rests for `rest` [rad] a turn."""
    if not 0.0 <= rest < 2.0 * math.pi:
        raise MechlabError(f"rest = {rest:g} rad: expected at least 0 and less than a turn")
    return 2.0 * math.pi / (2.0 * math.pi - rest)


def clutch_torque(knife: Knife, rest: float) -> float:
    """Largest torque on the main shaft [N m] for a cutting force of 1 N, driven through a clutch that rests for `rest` [rad] a turn."""
    pace = clutch_pace(rest)
    place, slope = knife.place(np.linspace(0.0, 2.0 * math.pi, 14401))
    return float(np.max(-slope * knife.cuts(place, slope))) * pace


def crank_inertia(knife: Knife, pins: ArrayLike, crankshaft: float, knife_mass: float, rod_mass: float) -> float:
    """Inertia [kg m2] about its axis of a crankshaft with a slider-crank at each angle of its pins (k,) [rad], rods as uniform bars, at
    these angles: the sum of mass x (velocity at a rate of 1)^2; a bar with the end velocities a, b has m (a^2 + a b + b^2) / 3."""
    pin = np.asarray(pins, dtype=float)
    slope = knife.place(pin)[1]
    ends = np.square(knife.throw) + knife.throw * np.cos(pin) * slope + slope**2
    return float(crankshaft + np.sum(knife_mass * slope**2 + rod_mass * ends / 3.0))


def engagement(driving: float, driven: float, slip: float, torque: float) -> tuple[float, float]:
    """Energy [J] that a clutch loses as it brings two inertias [kg m2] with a difference of speeds [rad/s] to one speed, and the time
    [s] for which it slips with its torque [N m]: J w^2 / 2 and J w / torque with J = J1 J2 / (J1 + J2). The loss is the same for
    every torque, that of teeth that engage at once included."""
    inertia = driving * driven / (driving + driven)
    return 0.5 * inertia * slip**2, inertia * slip / torque


PHI = np.linspace(0.0, 2.0 * math.pi, 1441)


def torque_factor(g: GearLinkage, knife: Knife, mount: ArrayLike, rest: float) -> FloatArray:
    """How many times the clutch asks more torque of the main shaft in the cut than the linkage does. mount (...) -> (...).

    Raises MechlabError for gears that do not bring the output round once in a turn: the knife would not cut in each.
    """
    if abs(g.ratio - 1.0) > 1e-9:
        raise MechlabError(f"knife: the output must turn once in a turn of the crank (coupler = rocker), its ratio is {g.ratio:g}")
    most = np.max(cutting_torque(g, knife, np.asarray(mount, dtype=float)[..., None], PHI), axis=-1)
    return np.asarray(clutch_torque(knife, rest) / most)


def best_mount(g: GearLinkage, knife: Knife, rest: float) -> tuple[float, float]:
    """The mount [rad] with the largest `torque_factor`, to a degree, and that factor."""
    mounts = np.linspace(0.0, 2.0 * math.pi, 361)
    factors = torque_factor(g, knife, mounts, rest)
    return float(mounts[np.argmax(factors)]), float(np.max(factors))
