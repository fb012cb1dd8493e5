"""Values as people write them: `37deg`, `5mm`, `17/22`, `a,b,c`, `lo:hi:n`. Text in, neutral values out.

A value knows nothing of the parameter it is meant for: converting it is for whoever declared the parameter.
Plain numbers are SI. A number with a unit becomes a `Quantity`, a float in SI that remembers its SI unit, so
that `rod_length=37deg` can be refused.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import Any, Protocol, SupportsFloat

from mechlab.errors import MechlabError, explained, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.units import UNITS, compact, described

_NUMBER = re.compile(r"([+-]?(?:\d+/\d+|(?:\d+\.?\d*|\.\d+)(?:[eE]([+-]?\d+))?))(.*)", re.ASCII | re.DOTALL)
_FORMULA = re.compile(r"[-+*/^](?:.*[^a-zA-Z])?x(?:[^a-zA-Z].*)?", re.ASCII | re.DOTALL)  # what follows the number in 1/x or 2*sin(x)
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf|infinity)", re.IGNORECASE)
_LARGEST_POWER = 400  # beyond a double; an exact fraction with more digits would only cost memory
LARGEST_NUMBER = 1e50
"""Largest magnitude of parameters and given values; its fifth power is still a finite double."""
MOST_POINTS = 100_000_000
"""Most values of a range; as doubles they fill 0.8 GB."""
_LONGEST = 1000
_DIGITS_OF_COUNT = len(str(MOST_POINTS))


@explained
class Quantity(float):
    """A float in SI that remembers its SI unit, such as `m` or `rad/s`, and how it was written."""

    unit: str
    written: str

    def __new__(cls, value: float, unit: str, written: str = "") -> Quantity:
        """`value` is in `unit`, which is an SI unit."""
        self = super().__new__(cls, value)
        self.unit = unit
        self.written = written or f"{value:g} {unit}"
        return self

    def __getnewargs__(self) -> tuple[float, str, str]:  # type: ignore[override]
        return float(self), self.unit, self.written


@explained
@dataclass(frozen=True)
class Range:
    """`low:high` (count is None: the receiver chooses) or `low:high:count`, both ends included."""

    low: float
    high: float
    count: int | None = None

    def points(self, default_count: int = 11) -> tuple[float, ...]:
        """The values, evenly spaced, both ends exact; `default_count` of them where no count was written."""
        count = default_count if self.count is None else self.count
        step = (self.high - self.low) / (count - 1)
        return (*(self.low + i * step for i in range(count - 1)), self.high)

    def __str__(self) -> str:
        count = "" if self.count is None else f":{self.count}"
        return f"{float(self.low)!r}:{float(self.high)!r}{count}"


class Numbers(Protocol):
    """An array of numpy, or what behaves like one."""

    def __len__(self) -> int: ...

    def tolist(self) -> object:
        """The same numbers as a list."""
        ...


Scalar = float | Fraction | str
Written = Scalar | tuple[Scalar, ...] | Range
"""What a text stands for."""
Value = SupportsFloat | str | Range | Sequence[SupportsFloat | str] | Numbers | None
"""What may be given for a key in Python: a number, a text as on the command line, a range, a list, an array (n,)."""


def parse_value(key: str, text: str) -> Written:
    """The value written as `text`: a number, a list, a range, or the text itself where it begins like none.

    `1,` is a list of one. Raises MechlabError, naming `key`, for an empty value, an unknown unit, a number
    that is not finite, and a list or range in which only some numbers have a unit (0 needs none).
    """
    text = text.strip()
    if "," in text:
        items = tuple(_scalar(key, item) for item in text.removesuffix(",").split(","))
        _refuse_mixed_units(key, text, items)
        return items
    if ":" in text and (_NUMBER.match(text) or _NOT_FINITE.fullmatch(text.split(":")[0].strip())):
        return _range(key, text)
    return _scalar(key, text)


def one_number(key: str, value: object) -> float:
    """`value` as one float, with its unit where it has one; text is read as on the command line.

    Raises MechlabError, naming `key`, for anything else and for what is not finite.
    """
    number = parse_value(key, value) if isinstance(value, str) else value
    try:
        plain = float(number)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise MechlabError(f"{key}: expected a number, got {short(value)}.") from None
    if not math.isfinite(plain):
        raise MechlabError(f"{key}: expected a finite number, got {short(value)}.")
    if abs(plain) > LARGEST_NUMBER:
        raise MechlabError(
            f"{key}: a number beyond {LARGEST_NUMBER:g}, got {plain:g}: its powers leave the range of doubles."
        )
    return number if isinstance(number, Quantity) else plain


def in_unit(key: str, value: Any, *units: str) -> Any:
    """`value` (a number, list, range, or text of one), which is in one of the SI `units` where it says a unit at all.

    Raises MechlabError such as "crank_angle: expected an angle (rad, mrad, deg, ...), got 5mm".
    """
    value = parse_value(key, value) if isinstance(value, str) else value
    for item in _items(value):
        if isinstance(item, Quantity) and item.unit not in units:
            raise MechlabError(f"{key}: expected {' or '.join(map(described, units))}, got {item.written}.")
    return value


def has_unit(value: Any) -> bool:
    """True when a number, or any number of a list or a range, carries a unit."""
    return any(isinstance(item, Quantity) for item in _items(value))


def _items(value: Any) -> tuple[Any, ...]:
    if isinstance(value, Range):
        return value.low, value.high
    return tuple(value) if isinstance(value, tuple | list) else (value,)


def short(value: object) -> str:
    """A value for a message, at most 60 characters."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def parse_number(key: str, text: str, *units: str) -> float:
    """One number in the first of the SI `units`, or in another of them. Raises MechlabError, naming `key`, for anything else."""
    value = _scalar(key, text)
    if isinstance(value, str) or getattr(value, "unit", units[0]) not in units:
        wanted = " or ".join(u for u in units if u)
        raise MechlabError(f"{key}: expected a number{f' [{wanted}]' if wanted else ''}, got {text!r}.")
    return float(value)


def _range(key: str, text: str) -> Range:
    low, high, *count = text.split(":")
    if len(count) > 1:
        raise MechlabError(f"{key}: expected low:high or low:high:count, got {text!r}.")
    ends = _scalar(key, low), _scalar(key, high)
    if isinstance(ends[0], str) or isinstance(ends[1], str):
        raise MechlabError(f"{key}: expected numbers in low:high or low:high:count, got {text!r}.")
    _refuse_mixed_units(key, text, ends)
    if not count:
        return Range(_float(ends[0]), _float(ends[1]))
    if not re.fullmatch(r"\d+", count[0], re.ASCII) or not count[0].strip("01") and len(count[0].lstrip("0")) < 2:
        raise MechlabError(f"{key}: the count in low:high:count must be a whole number >= 2, got {count[0]!r}.")
    if len(count[0].lstrip("0")) > _DIGITS_OF_COUNT or int(count[0]) > MOST_POINTS:
        raise MechlabError(f"{key}: a range has at most {MOST_POINTS} points, got {count[0][:40]}.")
    return Range(_float(ends[0]), _float(ends[1]), int(count[0]))


def _float(value: float | Fraction) -> float:
    return float(value) if isinstance(value, Fraction) else value


def _scalar(key: str, text: str) -> Scalar:
    text = text.strip()
    if not text:
        raise MechlabError(f"{key}: a value is missing. Write for example {key}=0.5, {key}=5mm or {key}=1,2,3.")
    match = _NUMBER.fullmatch(text)
    if match is None:
        if _NOT_FINITE.fullmatch(text):
            raise MechlabError(f"{key}: expected a finite number, got {text!r}.")
        return text
    digits, power, unit = match[1], match[2] or "0", compact(match[3])
    if unit not in UNITS and _FORMULA.fullmatch(match[3].strip()):
        return text
    if unit and unit not in UNITS:
        raise unknown(f"{key}: in {text!r}, the unit", unit, UNITS)
    try:
        if len(digits) > _LONGEST:
            raise MechlabError(
                f"{key}: a number has at most {_LONGEST} characters, got {len(digits)}, beginning with {digits[:20]}."
            )
        if len(power) > 5 or abs(int(power)) > _LARGEST_POWER:
            raise OverflowError
        exact = Fraction(digits)
        if unit:
            return Quantity(UNITS[unit].to_si(exact), UNITS[unit].si, text)
        float(exact)  # an exact ratio beyond a double is refused here, not where it is used
        return exact if "/" in digits else float(exact)
    except ZeroDivisionError:
        raise MechlabError(f"{key}: division by zero in {text!r}.") from None
    except OverflowError:
        raise MechlabError(f"{key}: {text[:40]!r} is outside the range of a double.") from None


def _refuse_mixed_units(key: str, text: str, items: Iterable[Scalar]) -> None:
    numbers = [item for item in items if not isinstance(item, str) and item != 0]
    units = {getattr(number, "unit", None) for number in numbers}
    if len(units) > 1:
        raise MechlabError(f"{key}: {text!r} mixes units. Give every number its unit, or none of them.")
