"""The leg at a moving state in particles: a walk down the chain in complex numbers, x forwards + i z up, and the check on it."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np

from mechlab.catalog.prosthetic_leg.build import FREE, build
from mechlab.catalog.prosthetic_leg.parameters import HEEL, Parameters, body
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit import mass_check
from mechlab.kit.mass_check import NOTHING, Particles, State, solid, spread_of
from mechlab.mechanism.geometry import Array

STATE = {
    "trunk_x": (0.3, 0.7), "trunk_z": (-0.1, 0.4), "trunk": (0.2, -0.5), "hitch": (-0.02, 0.3), "hip": (0.5, 1.1),
    "thigh": (0.01, -0.2), "knee": (-0.8, -1.7), "shin": (-0.015, 0.25), "ankle": (0.15, 0.9),
}  # fmt: skip
"""Value and rate of every joint [m, rad, m/s, rad/s]."""


@dataclass(frozen=True)
class Place:
    """A frame of the plane: where it stands, how fast, its angle and turning rate (counter-clockwise from x to z)."""

    at: complex = 0j
    velocity: complex = 0j
    angle: float = 0.0
    rate: float = 0.0

    def point(self, arm: complex) -> tuple[complex, complex]:
        """World place and velocity of a point fixed in the frame."""
        z = arm * cmath.rect(1.0, self.angle)
        return self.at + z, self.velocity + 1j * self.rate * z

    def slid(self, way: complex, value: float, rate: float) -> Place:
        """The frame moved along its own direction `way` by a joint."""
        at, velocity = self.point(way * value)
        return Place(at, velocity + way * rate * cmath.rect(1.0, self.angle), self.angle, self.rate)

    def turned(self, start: float, value: float = 0.0, rate: float = 0.0, arm: complex = 0j) -> Place:
        """The frame of a part hung at a point of this one, turned by `start` and by a joint."""
        return Place(*self.point(arm), self.angle + start + value, self.rate + rate)

    def part(self, mass: float, moments: tuple[float, float, float], centre: complex) -> Particles:
        """A part in this frame: moments about its x, the normal of the plane (world -y), and its z; about its centre."""
        at, velocity = (_upright(z) for z in self.point(centre))
        c, s = math.cos(self.angle), math.sin(self.angle)
        axes = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
        return solid(mass, at, spread_of(mass, moments), axes, velocity, (0.0, -self.rate, 0.0))


def state(p: Parameters, fidelity: str) -> State:
    """The joints of a fidelity as in STATE, the others held. A bar's moment along it is a tenth of that across; the trunk's
    along it three tenths."""
    free, size, quarter = FREE[fidelity], body(p), 0.5 * math.pi
    joints = {n: STATE[n] if n in free else (0.0, 0.0) for n in STATE}
    hip = Place().slid(1.0, *joints["trunk_x"]).slid(1j, *joints["trunk_z"]).turned(0.0, *joints["trunk"])
    particles = NOTHING
    if "trunk" in free:
        across = size.trunk.inertia
        particles = hip.part(size.trunk.mass, (across, across, 0.3 * across), 1j * size.trunk.com)
    carriage = hip.slid(1j, *joints["hitch"])
    particles = particles + carriage.part(size.hitch_mass, (size.hitch_inertia,) * 3, 0j)
    above, points = carriage.turned(-quarter, *joints["hip"]), {}
    for segment, slide, below, start in ((size.thigh, "thigh", "knee", 0.0), (size.shin, "shin", "ankle", quarter)):
        tube, end = above.slid(1.0, *joints[slide]), complex(segment.length)
        for half, host in zip(segment.halves, (above, tube), strict=True):
            bar = (0.1 * half.inertia, half.inertia, half.inertia)
            particles = particles + host.part(half.mass, bar, complex(half.com))
        points[f"{below}_point"] = tube.point(end)[0]
        above = tube.turned(start, *joints[below], arm=end)
    foot, moment = size.foot, size.foot.inertia
    particles = particles + above.part(
        foot.mass, (0.1 * moment, moment, moment), complex(size.foot_forward, -size.foot_drop)
    )
    points |= {
        "heel": above.point(complex(-HEEL, -size.sole))[0],
        "toe": above.point(complex(foot.length - HEEL, -size.sole))[0],
    }
    springs = {"hitch": p.C_hitch, "thigh": p.C_thigh, "shin": p.C_shin, "ankle": p.ankle_stiffness}
    stored = sum(c * joints[n][0] * joints[n][1] for n, c in springs.items())
    dampers = {**dict.fromkeys(("hitch", "thigh", "shin"), p.slider_damping), "ankle": p.ankle_damping}
    lost = sum(b * joints[n][1] ** 2 for n, b in dampers.items())
    values, rates = ({n: joints[n][k] for n in free} for k in (0, 1))
    places = {n: _upright(z) for n, z in points.items()}
    return State(values, rates, particles, places, (0.0, 0.0, -p.gravity), len(free), stored=stored, lost=lost)


def _upright(z: complex) -> Array:
    return np.array([z.real, 0.0, z.imag])


def _moving(p: Parameters) -> CheckResult:
    return mass_check.compare([(build(p, f), state(p, f)) for f in FREE])


MOVING = Check("L8", mass_check.TEXT, _moving, mass_check.SOURCE)
