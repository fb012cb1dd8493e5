"""A centric slider-crank of slender bars, one freedom: the equation of its crank."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.benchmarks.planar import Jet, arm
from mechlab.errors import NoSolution

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SliderCrank:
    """Crank r turns about the origin, rod l, slider on the x axis at r cos(phi) + l cos(psi), l sin(psi) = -r sin(phi).

    Masses in kg, gravity along -y, SI units. Bars are uniform and slender.
    """

    crank: float
    rod: float
    crank_mass: float
    rod_mass: float
    slider_mass: float
    gravity: float

    def rod_angle(self, phi: Jet) -> Jet:
        """Angle of the rod from +x, with derivatives; raises NoSolution when the rod is too short."""
        pin = arm(phi, self.crank)
        sine = -pin.value.imag / self.rod
        if abs(sine) >= 1.0:
            raise NoSolution(f"slider-crank: the rod of {self.rod:g} m cannot follow a crank of {self.crank:g} m.")
        cosine = math.sqrt(1.0 - sine * sine)
        first = -pin.first.imag / (self.rod * cosine)
        second = (-pin.second.imag / self.rod + sine * first * first) / cosine
        return Jet(math.asin(sine), first, second)

    def pose(self, angle: float) -> tuple[Jet, Jet, Jet]:
        """Crank pin, rod angle and slider position (a point) at a crank angle, with derivatives by it."""
        phi = Jet(angle, 1.0, 0.0)
        pin, psi = arm(phi, self.crank), self.rod_angle(phi)
        return pin, psi, pin + arm(psi, self.rod)

    def slope(self, t: float, y: Array) -> Array:
        """Rate (2,) of y = (phi, phi'): J w' + J'/2 w^2 = Q in plain floats, the points of `pose` written out."""
        phi, speed = float(y[0]), float(y[1])
        r, rod, half = self.crank, self.rod, 0.5 * self.rod
        s, c = math.sin(phi), math.cos(phi)
        sine = -r * s / rod
        if abs(sine) >= 1.0:
            raise NoSolution(f"slider-crank: the rod of {rod:g} m cannot follow a crank of {r:g} m.")
        cosine = math.sqrt(1.0 - sine * sine)
        turn = -r * c / (rod * cosine)
        bend = (r * s / rod + sine * turn * turn) / cosine
        # derivatives by phi of e^(i psi), then of the middle of the rod and of the slider
        along, across = -turn * sine, turn * cosine
        along2, across2 = -bend * sine - turn * turn * cosine, bend * cosine - turn * turn * sine
        x, z = -r * s + half * along, r * c + half * across
        x2, z2 = -r * c + half * along2, -r * s + half * across2
        out, out2 = -r * s + rod * along, -r * c + rod * along2
        spin = self.rod_mass * rod * rod / 12.0
        inertia = self.crank_mass * r * r / 3.0 + self.rod_mass * (x * x + z * z) + spin * turn * turn
        inertia += self.slider_mass * out * out
        half_slope = self.rod_mass * (x * x2 + z * z2) + spin * turn * bend + self.slider_mass * out * out2
        force = -self.gravity * (0.5 * self.crank_mass * r * c + self.rod_mass * z)
        return np.array([speed, (force - half_slope * speed * speed) / inertia])

    def states(self, y: Array) -> tuple[Array, Array]:
        """(n, 3) crank angle, rod angle, slider [m], and their rates, along states y (n, 2)."""
        values, rates = [], []
        for angle, speed in y:
            _, psi, slider = self.pose(float(angle))
            values.append([angle, psi.value.real, slider.value.real])
            rates.append([speed, psi.first.real * speed, slider.first.real * speed])
        return np.array(values), np.array(rates)
