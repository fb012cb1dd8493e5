"""The units that people may write behind a number, as data. Everything inside mechlab is SI and radians."""

from __future__ import annotations

import math
from fractions import Fraction

from mechlab.lazy_dataclass import dataclass

SYSTEM = {
    "length": "m",
    "angle": "rad",
    "time": "s",
    "mass": "kg",
    "force": "N",
    "torque": "N m",
    "energy": "J",
}


@dataclass(frozen=True)
class Unit:
    """One unit: `factor` (exact; times pi where `circular`) of the SI unit `si`."""

    si: str
    factor: Fraction = Fraction(1)
    circular: bool = False

    def to_si(self, number: Fraction) -> float:
        """`number` of this unit in SI, rounded once, twice where pi comes in. Raises OverflowError."""
        value = float(number * self.factor)
        return value * math.pi if self.circular else value


_MILLI, _KILO = Fraction(1, 1000), Fraction(1000)
_PER_DEGREE = Fraction(1, 180)

UNITS: dict[str, Unit] = {
    "rad": Unit("rad"),
    "mrad": Unit("rad", _MILLI),
    "deg": Unit("rad", _PER_DEGREE, circular=True),
    "°": Unit("rad", _PER_DEGREE, circular=True),
    "rev": Unit("rad", Fraction(2), circular=True),
    "rad/s": Unit("rad/s"),
    "deg/s": Unit("rad/s", _PER_DEGREE, circular=True),
    "rev/s": Unit("rad/s", Fraction(2), circular=True),
    "rpm": Unit("rad/s", Fraction(1, 30), circular=True),
    "rad/s2": Unit("rad/s2"),
    "deg/s2": Unit("rad/s2", _PER_DEGREE, circular=True),
    "m": Unit("m"),
    "cm": Unit("m", Fraction(1, 100)),
    "mm": Unit("m", _MILLI),
    "um": Unit("m", _MILLI**2),
    "m/s": Unit("m/s"),
    "mm/s": Unit("m/s", _MILLI),
    "km/h": Unit("m/s", Fraction(10, 36)),
    "m/s2": Unit("m/s2"),
    "mm/s2": Unit("m/s2", _MILLI),
    "s": Unit("s"),
    "ms": Unit("s", _MILLI),
    "us": Unit("s", _MILLI**2),
    "min": Unit("s", Fraction(60)),
    "Hz": Unit("Hz"),
    "kHz": Unit("Hz", _KILO),
    "kg": Unit("kg"),
    "g": Unit("kg", _MILLI),
    "t": Unit("kg", _KILO),
    "kgm2": Unit("kg m2"),
    "gm2": Unit("kg m2", _MILLI),
    "kgmm2": Unit("kg m2", _MILLI**2),
    "N": Unit("N"),
    "mN": Unit("N", _MILLI),
    "kN": Unit("N", _KILO),
    "Nm": Unit("N m"),
    "mNm": Unit("N m", _MILLI),
    "Nmm": Unit("N m", _MILLI),
    "kNm": Unit("N m", _KILO),
    "N/m": Unit("N/m"),
    "N/mm": Unit("N/m", _KILO),
    "kN/m": Unit("N/m", _KILO),
    "Nm/rad": Unit("N m/rad"),
    "Ns/m": Unit("N s/m"),
    "Nms/rad": Unit("N m s/rad"),
    "J": Unit("J"),
    "W": Unit("W"),
    "kW": Unit("W", _KILO),
    "V": Unit("V"),
    "A": Unit("A"),
    "ohm": Unit("ohm"),
    "%": Unit("", Fraction(1, 100)),
}


def compact(text: str) -> str:
    """A unit as the table spells it: `m/s^2`, `m/s²` and `N m` become `m/s2`, `m/s2` and `Nm`."""
    return text.translate({ord("^"): None, ord("*"): None, ord("·"): None, ord(" "): None, ord("²"): "2"})


_DIMENSIONS = {
    "rad": "an angle",
    "rad/s": "a rate of turning",
    "rad/s2": "an angular acceleration",
    "m": "a length",
    "m/s": "a speed",
    "m/s2": "an acceleration",
    "s": "a time",
    "kg": "a mass",
    "kg m2": "a moment of inertia",
    "N": "a force",
    "N m": "a torque",
    "N/m": "a stiffness",
    "N m/rad": "a stiffness",
    "J": "an energy",
    "W": "a power",
}


def described(si: str) -> str:
    """What an SI unit measures, and how people may write it: "an angle (rad, mrad, deg, ...)"."""
    if not si:
        return "a number without a unit"
    names = [name for name, unit in UNITS.items() if unit.si == si] or [si]
    listed = ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
    return f"{_DIMENSIONS.get(si, 'a number')} ({listed})"
