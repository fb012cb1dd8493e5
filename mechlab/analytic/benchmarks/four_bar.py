"""The crank of a four-bar of uniform slender bars as a scalar equation, for integration at sharp tolerances.

`mechlab.analytic.fourbar` gives the same for arrays; this evaluates one state in plain floats, thirty times faster.
"""

from __future__ import annotations

from dataclasses import dataclass

from mechlab.analytic.benchmarks.planar import Balance, Jet, arm, dyad


@dataclass(frozen=True)
class FourbarCrank:
    """Lengths [m]; mode +1: the joint lies left of the vector from crank pin to rocker pivot; gravity [m/s2] along -y.

    moments: of crank, coupler, rocker about their centres [kg m2]; None: slender rods, m L^2 / 12.
    """

    crank: float
    coupler: float
    rocker: float
    ground: float
    mode: int
    mass_per_length: float
    gravity: float
    moments: tuple[float, float, float] | None = None

    def acceleration(self, phi: float, rate: float, torque: float) -> float:
        """Crank acceleration [rad/s2] under a torque [N m]. Raises NoSolution where the loop does not close."""
        drive, pivot = Jet(phi, 1.0), Jet(complex(self.ground))
        pin = arm(drive, self.crank)
        coupler, rocker = dyad(pin, pivot, self.coupler, self.rocker, self.mode, "fourbar: coupler and rocker")
        sums = Balance()
        g = complex(0.0, -self.gravity)
        lengths = (self.crank, self.coupler, self.rocker)
        moments = self.moments or tuple(self.mass_per_length * x**3 / 12.0 for x in lengths)
        bars = zip((Jet(0.0), pin, pivot), (drive, coupler, rocker), lengths, moments, strict=True)
        for start, angle, length, moment in bars:
            sums.body(self.mass_per_length * length, moment, start + arm(angle, 0.5 * length), angle, g)
        return sums.acceleration(rate, torque)
