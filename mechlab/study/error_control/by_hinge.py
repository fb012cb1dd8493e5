"""One hinge under a weight alone: a physical pendulum, whose motion is known in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mechlab.analytic.physical_pendulum import PhysicalPendulum
from mechlab.errors import NoSolution
from mechlab.mechanism.geometry import Array
from mechlab.study.error_control.conservative import OneJoint
from mechlab.study.error_control.judged import Asked, Found, judged
from mechlab.study.error_control.measure import compared
from mechlab.study.error_control.motion import States
from mechlab.study.error_control.result import Result
from mechlab.study.error_control.rules import RULES

ELLIPTIC = "elliptic functions"
EPSILON = 2.2e-16


@dataclass(frozen=True)
class HingeMotion:
    """The motion of the hinge: `pendulum` about the coordinate `lowest` of its lowest position."""

    pendulum: PhysicalPendulum
    lowest: float

    @staticmethod
    def of(energies: OneJoint, q0: float, v0: float) -> HingeMotion:
        """V = c - A cos(q - lowest), w^2 = A / J. Raises NoSolution where other forces act or nothing pulls it down."""
        if not energies.turns or energies.load or energies.springs or len(energies.stiffness):
            raise NoSolution("not a hinge under a weight alone")
        pull = math.hypot(energies.by_sine, energies.by_rest)
        if not (pull > 0.0 and energies.inertia > 0.0):
            raise NoSolution("nothing turns the hinge")
        lowest = math.atan2(-energies.by_sine, energies.by_rest)
        return HingeMotion(PhysicalPendulum(math.sqrt(pull / energies.inertia), q0 - lowest, v0), lowest)

    def states(self, t: Array, accelerations: bool = False) -> States:
        """q, v (P, 1) at times t (P,); a where it is asked for."""
        theta, rate = self.pendulum.motion(t)
        a = -(self.pendulum.frequency**2) * np.sin(theta) if accelerations else None
        return States((theta + self.lowest)[:, None], rate[:, None], None if a is None else a[:, None])

    def cruder(self) -> HingeMotion:
        """The motion of a pendulum that is another one by a few units in the last place."""
        p, more = self.pendulum, 1.0 + RULES.rounding * EPSILON
        return HingeMotion(PhysicalPendulum(p.frequency * more, p.angle * more, p.rate * more), self.lowest)

    def rounding(self, t: Array, states: States) -> Array:
        """(P, 1) what a few units in the last place of energy, frequency and time do to the poses, at most."""
        m, units = self.pendulum.modulus_squared, RULES.rounding * EPSILON
        later, other = self.pendulum.sensitivity()
        energy = units * max(m, math.sqrt(m))
        away = (units + later * energy) * np.abs(states.v) * t[:, None]
        return np.asarray(away + other * energy)


def by_hinge(asked: Asked, energies: OneJoint) -> Result:
    """The scene of a hinge under a weight alone. Raises NoSolution where it is not one, or its motion has no period."""
    motion = HingeMotion.of(energies, float(asked.q0[0]), float(asked.v0[0]))
    states = motion.states(asked.t)
    tracked, rounding = compared(asked.measure, asked.t, states, motion.rounding(asked.t, states))
    chosen = (
        f"{ELLIPTIC}, because the mechanism is one hinge under its weight alone, a physical pendulum; it "
        f"{'goes over' if motion.pendulum.goes_over else 'swings'}"
    )
    found = Found(
        motion, states, tracked, rounding, rounding, chosen, ELLIPTIC, 0.0, "closed form", len(asked.t), "elliptic"
    )
    return judged(asked, found)
