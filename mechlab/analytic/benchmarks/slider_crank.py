"""A centric slider-crank of slender bars, one freedom: the equation of its crank."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.benchmarks.planar import Balance, Jet, arm
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
        """Rate (2,) of y = (phi, phi')."""
        phi = Jet(float(y[0]), 1.0, 0.0)
        pin, psi, slider = self.pose(phi.value.real)
        g = complex(0.0, -self.gravity)
        sums = Balance()
        sums.body(self.crank_mass, self.crank_mass * self.crank**2 / 12.0, arm(phi, 0.5 * self.crank), phi, g)
        sums.body(self.rod_mass, self.rod_mass * self.rod**2 / 12.0, pin + arm(psi, 0.5 * self.rod), psi, g)
        sums.body(self.slider_mass, 0.0, slider, Jet(0.0))
        return np.array([y[1], sums.acceleration(float(y[1]))])

    def states(self, y: Array) -> tuple[Array, Array]:
        """(n, 3) crank angle, rod angle, slider [m], and their rates, along states y (n, 2)."""
        values, rates = [], []
        for angle, speed in y:
            _, psi, slider = self.pose(float(angle))
            values.append([angle, psi.value.real, slider.value.real])
            rates.append([speed, psi.first.real * speed, slider.first.real * speed])
        return np.array(values), np.array(rates)
