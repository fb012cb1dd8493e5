"""Parameters of an inertial-impulse transmission, the constants of its equations, and the first integral at constant input
speed without a spring, from which phase portraits follow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError


@dataclass(frozen=True)
class Impulse:
    """An inertial-impulse transmission. Set (4) of the source by default.

    J1, J2 input and output shaft, nJ3 all planets about their geometric centres [kg m2]; nm mass of all planets [kg];
    theta = (a alpha + b beta) / (a + b) is the carrier, a + b the radius of the planet axes; h [m] offset of a planet's
    mass centre; q ratio, a planet turns by psi = q (alpha - beta) on the carrier; load M0 + M1 sign(beta') [N m]; motor
    tau Md' = Mn - Md - (alpha' - nominal_speed) / (slip_per_torque no_load_speed), slip_per_torque [1/(N m)], None: the
    value for which the torque vanishes at the no-load speed; c [N m/rad] spring from the output shaft to the frame.
    Raises MechlabError for values that no mechanism can have.
    """

    J1: float = 14.0
    J2: float = 0.5
    nJ3: float = 0.25
    nm: float = 8.0
    a: float = 0.02
    b: float = 0.08
    h: float = 0.083
    q: float = 4.0 / 3.0
    M0: float = 18.0
    M1: float = 750.0
    Mn: float = 150.0
    no_load_speed: float = 220.0
    nominal_speed: float = 215.0
    tau: float = 0.038
    slip_per_torque: float | None = None
    c: float = 0.0

    def __post_init__(self) -> None:
        for f in fields(self):
            x = getattr(self, f.name)
            if x is not None and not math.isfinite(x):
                raise MechlabError(f"impulse: {f.name} must be finite, got {x!r}.")
        if not self.a + self.b > 0:
            raise MechlabError(f"impulse: the radius of the planet axes a + b must be > 0 m, got {self.a + self.b:g}.")
        if self.q == 0:
            raise MechlabError("impulse: the ratio q must not be 0: planets that do not turn give no impulses.")
        least = self.nm * self.h**2
        if self.nJ3 < least * (1.0 - 1e-12):
            raise MechlabError(
                f"impulse: nJ3 = {self.nJ3:g} kg m2 is less than nm h^2 = {least:g}: nJ3 counts about the geometric centre "
                "of the planets and contains the offset of their mass centre. Take a larger nJ3 or a smaller h."
            )
        for name in ("M0", "M1", "nm", "J1", "J2", "tau", "c"):
            if getattr(self, name) < 0:
                raise MechlabError(f"impulse: {name} must be >= 0, got {getattr(self, name):g}.")
        if self.no_load_speed == 0 or self.Mn == 0 or not self.slip > 0:
            raise MechlabError(
                f"impulse: the motor needs a falling characteristic: slip_per_torque = {self.slip_per_torque!r}, "
                f"no_load_speed = {self.no_load_speed:g}, nominal_speed = {self.nominal_speed:g}, Mn = {self.Mn:g} "
                "do not give one. With Mn > 0 the nominal speed lies below the no-load speed."
            )

    @property
    def k(self) -> float:
        """Radius of the planet axes a + b [m]."""
        return self.a + self.b

    @property
    def consistent_slip(self) -> float:
        """The slip per torque [1/(N m)] with which the motor torque vanishes at the no-load speed."""
        if self.Mn == 0 or self.no_load_speed == 0:
            return math.nan
        return (1.0 - self.nominal_speed / self.no_load_speed) / self.Mn

    @property
    def slip(self) -> float:
        """The slip per torque that is used [1/(N m)]."""
        return self.consistent_slip if self.slip_per_torque is None else self.slip_per_torque

    @property
    def speed_per_torque(self) -> float:
        """Loss of speed of the motor per torque in the steady state [rad/(N m s)]."""
        return self.slip * self.no_load_speed


@dataclass(frozen=True)
class OutputConstants:
    """A3 = B3 + b3 cos psi, A5 = a5 sin psi, A6 = a6 sin psi; b3 q / 2 = a5."""

    B3: float
    b3: float
    a5: float
    a6: float


def shape(p: Impulse) -> OutputConstants:
    """The constants of the equation of the output shaft."""
    g = p.b / p.k - p.q
    B3 = p.J2 + p.nm * p.b**2 + g**2 * p.nJ3
    return OutputConstants(B3, 2.0 * p.nm * p.b * p.h * g, p.nm * p.b * p.h * g * p.q, p.nm * p.k * p.h * p.q)


Array = NDArray[np.float64]


def first_integral(p: Impulse, speed: float, psi: ArrayLike, slip: ArrayLike, resisting: ArrayLike) -> Array:
    """E = (q/2) A3(psi) s^2 - R psi - a6 w^2 cos psi [N m], constant while the resisting torque R is.

    slip s = w - beta' (...) [rad/s]; psi (...) [rad], not reduced modulo 2 pi. Holds for c = 0; raises MechlabError else.
    """
    _no_spring(p)
    s = shape(p)
    psi, slip = np.asarray(psi, dtype=float), np.asarray(slip, dtype=float)
    inertia = s.B3 + s.b3 * np.cos(psi)
    return np.asarray(0.5 * p.q * inertia * slip**2 - np.asarray(resisting) * psi - s.a6 * speed**2 * np.cos(psi))


def slip_speed(p: Impulse, speed: float, psi: ArrayLike, energy: ArrayLike, resisting: ArrayLike) -> Array:
    """s = w - beta' >= 0 [rad/s] at psi where the first integral is `energy` [N m]; NaN if no such motion is there."""
    _no_spring(p)
    s = shape(p)
    psi = np.asarray(psi, dtype=float)
    square = 2.0 * (np.asarray(energy) + np.asarray(resisting) * psi + s.a6 * speed**2 * np.cos(psi))
    square = square / (p.q * (s.B3 + s.b3 * np.cos(psi)))
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(square))


def _no_spring(p: Impulse) -> None:
    if p.c != 0.0:
        raise MechlabError(f"impulse: the first integral needs c = 0, got {p.c:g} N m/rad; integrate instead.")
