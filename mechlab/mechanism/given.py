"""Numbers as users give them to the Builder: plain SI, or text with a unit ("100mm", "30deg"). Everything kept is SI."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields

from mechlab.errors import MechlabError, unknown
from mechlab.mechanism.geometry import Vector
from mechlab.values import parse_number

Number = float | str
"""A number in SI, or text with a unit."""


def si(value: object, what: str, unit: str = "", low: float = -math.inf, above: float = -math.inf) -> float:
    """`value` in the SI `unit`; text is read with its unit. Raises MechlabError that names `what` for anything else, for
    what is not finite, is less than `low` or not greater than `above`."""
    if isinstance(value, str):
        number = parse_number(what, value, unit)
    else:
        try:
            number = float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            raise MechlabError(f"{what}: expected a number{_in(unit)}, got {value!r}.") from None
    if not math.isfinite(number):
        raise MechlabError(f"{what}: expected a finite number, got {value!r}.")
    if number < low or number <= above:
        bound = f"at least {low:g}" if number < low else "positive" if above == 0.0 else f"greater than {above:g}"
        raise MechlabError(f"{what} must be {bound}, got {value!r}{f' {unit}' if unit else ''}.")
    return number


DOUBTFUL_ANGLE = 4.0 * math.pi
"""Angles [rad] beyond two turns are rare among positions; 15, 30, 45, 60, 90 are common in degrees."""


def many_turns(name: str, value: object) -> str:
    """A sentence on an angle that is given as a plain whole number of more than two turns, most likely meant in degrees; "" on others."""
    if not isinstance(value, int | float) or not DOUBTFUL_ANGLE < abs(value) < math.inf or value != round(value):
        return ""
    return f"{name} = {value:g} rad is {abs(value) / math.tau:.1f} turns; if degrees are meant, write {name}={value:g}deg"


def _in(unit: str) -> str:
    return f" in {unit}" if unit else ""


def point(value: object, what: str) -> Vector:
    """Three lengths [m]; raises MechlabError that names `what`."""
    if isinstance(value, str) or not isinstance(value, Iterable) or len(numbers := list(value)) != 3:
        raise MechlabError(f"{what}: expected three numbers (x, y, z) in m, got {value!r}.")
    x, y, z = (si(v, what, "m") for v in numbers)
    return x, y, z


def pair(value: object, what: str, unit: str) -> tuple[float, float]:
    """Two numbers (low, high); raises MechlabError that names `what`."""
    if isinstance(value, str) or not isinstance(value, Sequence) or len(value) != 2:
        raise MechlabError(f"{what}: expected two numbers (low, high) in {unit}, got {value!r}.")
    return si(value[0], what, unit), si(value[1], what, unit)


def options_of(cls: type, given: Mapping[str, object], what: str, fixed: Sequence[str] = ()) -> None:
    """Raise MechlabError, listing what exists, for a key that is no field of a dataclass or is one of the `fixed`."""
    names = [f.name for f in fields(cls) if f.name not in fixed]
    for key in given:
        if key not in names:
            raise unknown(f"{what}: option", key, names)
