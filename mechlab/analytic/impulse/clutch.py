"""The transmission with a one-way clutch between its output shaft and the housing, at constant input speed and without a spring.

The clutch lets beta' >= 0 pass and takes the backward impulse into the housing. From the first integral, with K = (a6 - a5) w^2 and
R = M0 + M1: the output shaft starts at psi_a, K sin(psi_a) = R, and comes to rest at psi_b > psi_a, where
K (cos psi_a - cos psi_b) = R (psi_b - psi_a); until psi_a + 2 pi it stands. The clutch takes hold at rest, so that nothing is lost in it:
over a cycle the motor does the work of R alone, and the mean torques differ by what the housing takes.
"""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic.impulse.dry_friction import ConstantSpeed
from mechlab.analytic.impulse.model import Impulse, shape
from mechlab.analytic.impulse.regime import STALLS, half_time
from mechlab.analytic.roots import brentq
from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class ClutchedCycle:
    """A cycle with the clutch: psi_a, psi_b [rad]; times forward and at rest [s]; mean output speed [rad/s]; mean torques [N m] of the
    motor, and of clutch and friction together that hold the output shaft at rest."""

    psi_a: float
    psi_b: float
    forward_time: float
    rest_time: float
    mean_speed: float
    motor_torque: float
    holding_torque: float


def clutched(p: Impulse, speed: float) -> ClutchedCycle:
    """The cycle in closed form. Raises MechlabError unless speed > 0, q > 0, c = 0 and M0 + M1 > 0, NoSolution where the impulses do not
    overcome the resistance (M0 + M1 >= K), and where the output shaft would reach the input speed."""
    strength, resisting = _checked(p, speed)
    psi_a = math.asin(resisting / strength)

    def gap(psi: float) -> float:
        return strength * (math.cos(psi_a) - math.cos(psi)) - resisting * (psi - psi_a)

    # The drive falls below the resistance at pi - psi_a; the kinetic energy of the slip is spent before psi_a + 2 pi.
    psi_b = brentq(gap, math.pi - psi_a, psi_a + 2.0 * math.pi, xtol=1e-14, rtol=1e-15)
    forward = float(half_time(p, speed, *(np.asarray(x) for x in (psi_a, psi_b, resisting))))
    if not math.isfinite(forward):
        raise NoSolution(f"impulse: {STALLS}.")
    rest = (psi_a + 2.0 * math.pi - psi_b) / (p.q * speed)
    mean = speed - 2.0 * math.pi / (p.q * (forward + rest))
    motor = resisting * mean / speed
    # Angular momentum: the mean torques cancel, the load always, the friction of M1 while the shaft moves, the hold while it stands.
    held = p.M0 + p.M1 * forward / (forward + rest) - motor
    return ClutchedCycle(psi_a, psi_b, forward, rest, mean, motor, held)


def simulated(p: Impulse, speed: float, rtol: float = 1e-11) -> ClutchedCycle:
    """The same cycle by integration of the equation of motion, of the motor torque and of the holding torque over psi; it does not use the
    first integral. Raises as `clutched`."""
    from scipy.integrate import solve_ivp

    strength, resisting = _checked(p, speed)
    problem, still = ConstantSpeed(p, speed), np.zeros(4)
    modes = (1,) if p.M1 else ()

    def drive(psi: float) -> float:  # torque that would turn the standing shaft, less what resists
        return -float(ConstantSpeed.holding(problem, psi, still, (0,))[0]) - p.M1

    psi_a = brentq(drive, 0.0, 0.5 * math.pi, xtol=1e-14, rtol=1e-15)

    def stops(psi: float, y: np.ndarray) -> float:
        return float(y[1])

    stops.terminal, stops.direction = True, -1.0  # type: ignore[attr-defined]
    done = solve_ivp(
        lambda psi, y: problem.slope(psi, y, modes), (psi_a, psi_a + 2.0 * math.pi), still, "DOP853", events=stops, rtol=rtol,
        atol=1e-13, first_step=1e-3,
    )  # fmt: skip
    if done.status != 1:
        raise NoSolution(f"impulse: {STALLS}.")
    psi_b, (turned, _, forward, work) = float(done.t[-1]), (float(x) for x in done.y[:, -1])
    rest = (psi_a + 2.0 * math.pi - psi_b) / (p.q * speed)
    # At rest the motor holds the input shaft against A4 w^2; the integrands are sines, which these nodes integrate exactly.
    x, weight = np.polynomial.legendre.leggauss(24)
    half = 0.5 * (psi_a + 2.0 * math.pi - psi_b)
    psi = psi_b + half * (x + 1.0)
    at_rest = half * float(weight @ [problem.slope(x, still, (0,))[3] for x in psi])
    held = half * float(weight @ [-drive(x) - p.M1 for x in psi]) / (p.q * speed)
    total = forward + rest
    return ClutchedCycle(psi_a, psi_b, forward, rest, turned / total, (work + at_rest) / total, held / total)


def _checked(p: Impulse, speed: float) -> tuple[float, float]:
    """K and R [N m]."""
    s, resisting = shape(p), p.M0 + p.M1
    if not (speed > 0.0 and p.q > 0.0 and p.c == 0.0 and resisting > 0.0):
        raise MechlabError(
            f"impulse: a clutch to the housing needs an input speed > 0, q > 0, c = 0 and a resistance M0 + M1 > 0, got {speed:g} rad/s, "
            f"q = {p.q:g}, c = {p.c:g} N m/rad, M0 + M1 = {resisting:g} N m."
        )
    strength = (s.a6 - s.a5) * speed**2
    if not resisting < strength:
        raise NoSolution(
            f"impulse: the impulses reach {strength:.6g} N m at {speed:g} rad/s and do not overcome the resistance "
            f"M0 + M1 = {resisting:g} N m."
        )
    return strength, resisting
