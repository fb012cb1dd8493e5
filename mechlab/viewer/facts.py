"""Values of parameters in words, as pages show them: few digits, angles with their degrees, units with raised powers."""

from __future__ import annotations

import math
import re
from typing import Any

DIGITS = 6
RAISED = str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079")


def unit_words(unit: str) -> str:
    """m/s2 as m/s², N m as N·m."""
    powers = re.sub(r"(?<=[A-Za-z])-?\d+", lambda found: found[0].translate(RAISED), unit)
    return re.sub(r"(?<=\S) (?=\S)", "\u00b7", powers)


def value_words(value: Any, unit: str = "") -> str:
    """A value or a tuple of values with its unit once; None is "none", without a unit."""
    if value is None:
        return "none"
    values = value if isinstance(value, tuple) else (value,)
    if not values:
        return "none"
    text = ", ".join(_one(x) for x in values)
    numbers = [x for x in values if isinstance(x, int | float) and not isinstance(x, bool)]
    if not unit or len(numbers) < len(values):
        return text
    degrees = ""
    if unit == "rad" and any(numbers):
        degrees = f" ({', '.join(_one(round(math.degrees(x), 2)) for x in numbers)}\u00b0)"
    return f"{text} {unit_words(unit)}{degrees}"


def _one(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return value_words(value)
    text = f"{value:.{DIGITS}g}" if isinstance(value, float) else str(value)
    if not isinstance(value, int | float):
        return text
    text = re.sub(r"e[+-]\d+", lambda found: f"\u00b710{str(int(found[0][1:])).translate(RAISED)}", text)
    return text.replace("-", "\u2212")
