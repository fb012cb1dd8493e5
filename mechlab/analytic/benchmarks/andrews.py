"""A03: Andrews' squeezer, seven planar bodies of one freedom: the equation of its crank.

Geometry and names as in the Bari Test Set for IVP solvers (Mazzia & Magherini): crank K1 (O-F), K2 (F-E), K3 (B-E, spring
at D), K5 (A-G) with K4 (G-E), K7 (A-H) with K6 (H-E); all of K2, K3, K4, K6 meet in E.
"""

from __future__ import annotations

import cmath
import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.benchmarks.planar import Balance, Jet, arm, dyad
from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Squeezer:
    """masses, inertias (7,) of K1 to K7; pivots A, B and spring anchor C (x, y); lengths [m] as in the Test Set; `start`
    (7,) gives the assembly mode: beta, Theta, gamma, Phi, delta, Omega, epsilon. gravity along -y."""

    masses: tuple[float, ...]
    inertias: tuple[float, ...]
    a: tuple[float, float]
    b: tuple[float, float]
    c: tuple[float, float]
    d: float
    da: float
    e: float
    ea: float
    rr: float
    ra: float
    ss: float
    sa: float
    sb: float
    sc: float
    sd: float
    zt: float
    ta: float
    tb: float
    u: float
    ua: float
    ub: float
    zf: float
    fa: float
    torque: float
    spring_stiffness: float
    spring_length: float
    gravity: float
    start: tuple[float, ...]

    @cached_property
    def _sides(self) -> tuple[int, int, int]:
        """On which side of its base the pin of each dyad lies, at the start."""
        beta, theta, gamma, phi, delta, omega, eps = self.start
        f = self.rr * cmath.exp(1j * beta)
        meeting = f - self.d * cmath.exp(1j * (beta + theta))
        a, b = complex(*self.a), complex(*self.b)
        g = a + self.zt * cmath.exp(1j * delta)
        h = a - 1j * self.u * cmath.exp(1j * eps)
        return _side(f, b, meeting), _side(a, meeting, g), _side(a, meeting, h)

    def pose(self, angle: float) -> tuple[dict[str, Jet], dict[str, Jet]]:
        """Absolute angles of the directions below and points F, E, G, H, with derivatives.

        Directions: K1 O->F, K2 F->E, K3 B->E, K4 G->E, K5 A->G, K6 H->E, K7 A->H.
        """
        one = Jet(angle, 1.0, 0.0)
        f, a, b = arm(one, self.rr), Jet(complex(*self.a)), Jet(complex(*self.b))
        first, second, third = self._sides
        k2, k3 = dyad(f, b, self.d, self.ss, first, "andrews: K2 and K3")
        meeting = f + arm(k2, self.d)
        k5, k4 = dyad(a, meeting, self.zt, self.e, second, "andrews: K5 and K4")
        k7, k6 = dyad(a, meeting, self.u, self.zf, third, "andrews: K7 and K6")
        # the dyad gives the second bar's direction from its own end; K4 and K6 are measured from G and H towards E
        turn = Jet(math.pi)
        angles = {"K1": one, "K2": k2, "K3": k3, "K4": k4 + turn, "K5": k5, "K6": k6 + turn, "K7": k7}
        return angles, {"F": f, "E": meeting, "G": a + arm(k5, self.zt), "H": a + arm(k7, self.u)}

    def slope(self, t: float, y: Array) -> Array:
        """Rate (2,) of y = (beta, beta')."""
        k, points = self.pose(float(y[0]))
        a, b, c = Jet(complex(*self.a)), Jet(complex(*self.b)), complex(*self.c)
        centres = {
            "K1": arm(k["K1"], self.ra),
            "K2": points["F"] + arm(k["K2"], self.da),
            "K3": b + arm(k["K3"], complex(self.sa, self.sb)),
            "K4": points["G"] + arm(k["K4"], self.e - self.ea),
            "K5": a + arm(k["K5"], complex(self.ta, self.tb)),
            "K6": points["H"] + arm(k["K6"], self.zf - self.fa),
            "K7": a + arm(k["K7"], complex(self.ua, self.ub)),
        }
        sums = Balance()
        for (name, centre), mass, spin in zip(centres.items(), self.masses, self.inertias, strict=True):
            sums.body(mass, spin, centre, k[name], complex(0.0, -self.gravity))
        end = b + arm(k["K3"], complex(self.sc, self.sd))
        pull = end.value - c
        length = abs(pull)
        tension = self.spring_stiffness * (length - self.spring_length)
        sums.force -= tension * (pull.conjugate() * end.first).real / length
        return np.array([y[1], sums.acceleration(float(y[1]), self.torque)])

    def states(self, y: Array) -> tuple[Array, Array]:
        """(n, 7) Test-Set coordinates beta, Theta, gamma, Phi, delta, Omega, epsilon and their rates along y (n, 2)."""
        values, rates = [], []
        for angle, speed in y:
            k, _ = self.pose(float(angle))
            half = 0.5 * math.pi
            gamma, eps = k["K3"].value.real + half, k["K7"].value.real + half
            delta = k["K5"].value.real
            rows = [
                (angle, 1.0),
                (k["K2"].value.real + math.pi - angle, k["K2"].first.real - 1.0),
                (gamma, k["K3"].first.real),
                (k["K4"].value.real + half - delta, k["K4"].first.real - k["K5"].first.real),
                (delta, k["K5"].first.real),
                (k["K6"].value.real - eps, k["K6"].first.real - k["K7"].first.real),
                (eps, k["K7"].first.real),
            ]
            values.append([v for v, _ in rows])
            rates.append([r * speed for _, r in rows])
        q = np.unwrap(np.array(values), axis=0)
        q[:, 0] = np.asarray(y)[:, 0]
        return q + 2.0 * np.pi * np.round((np.array(self.start) - q[0]) / (2.0 * np.pi)), np.array(rates)


def _side(start: complex, end: complex, pin: complex) -> int:
    return 1 if ((end - start).conjugate() * (pin - start)).imag > 0.0 else -1
