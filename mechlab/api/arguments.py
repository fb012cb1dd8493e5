"""What the signatures of all verbs share: the types of their options, and the key=value pairs that come beside them.

A verb takes a source, then keys (parameters, given quantities, initial values, loads) and options. In Python a key is a keyword:
`ml.solve("fourbar", crank_angle=1.0)`. A mapping as the second argument does the same, and is the way to give a key that is
called like an option: as a keyword the option wins, `ml.simulate("pendulum", {"duration": 2.0}, duration=0.1)` gives both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from mechlab.errors import MechlabError
from mechlab.progress import silent as silent
from mechlab.values import Range, Value, parse_value

Seconds = Annotated[float, "s"]
"""A time [s]. The command line reads the units named in such a type from it."""
Error = Annotated[float, "m", "rad"]
"""A distance [m] or an angle [rad]."""
AnyError = str | float
"""A number [m or rad], or one with its unit: "0.1mm", "1W"."""
Plain = Annotated[float, "1"]
"""A number without a unit."""
Travel = Annotated[float, "rad", "m"]
"""The value of a drive."""
Whole = Annotated[int, 0]
"""A whole number of at least 0."""
Count = Annotated[int, 1]
"""A whole number of at least 1."""
Engine = Literal["mujoco", "file", "pinocchio", "hybrid", "one_freedom", "analytic"]
Task = Literal["motion", "path", "function", "straight_line", "dwell", "planetary", "gear_linkage", "closed_differential"]
Compared = Literal["straight-line", "quick-return", "walking"]
File = str | Path
Progress = Callable[[int, int], None]
"""Called with (done, total) while a verb works."""
Stages = Callable[[str], None]
"""Called with a line before each stage of the work."""
Values = Mapping[str, Value]


def key_values(values: Values | None, keywords: Values) -> dict[str, Any]:
    """Keys of the mapping and of the keywords together; text is read as on the command line, a list or range is a tuple.

    Raises MechlabError for a key in both, for text that is no value, and where `values` is no mapping.
    """
    if not isinstance(values, Mapping | None):
        raise MechlabError(
            f"the second argument: expected a mapping of keys to values, got {values!r}; name any other argument."
        )
    given = dict(values or {})
    if isinstance(keywords.get("values"), Mapping):
        raise MechlabError("values: give the mapping as the second argument, without a name.")
    if twice := sorted(given.keys() & keywords.keys()):
        raise MechlabError(f"{', '.join(twice)}: given in the mapping and as a keyword; keep one of them.")
    return {key: _read(key, value) for key, value in (given | dict(keywords)).items()}


def _read(key: str, value: Value) -> Any:
    if isinstance(value, str):
        return parse_value(key, value)
    return tuple(value) if isinstance(value, list | range) else value


def as_range(key: str, value: Value) -> Range | None:
    """The range that a value stands for: a Range, its two ends, or evenly spaced values; None for a single value.

    Raises MechlabError for a list that is no range.
    """
    if isinstance(value, Range):
        return value
    if isinstance(value, str) or not isinstance(value, Iterable):
        return None
    items: list[Any] = list(value)
    try:
        numbers = [float(x) for x in items]
    except (TypeError, ValueError):
        raise MechlabError(f"{key}: expected numbers, got {value!r}.") from None
    if len(items) == 2:
        return Range(items[0], items[1])
    if len(items) > 2:
        even = Range(items[0], items[-1], len(items))
        span = abs(numbers[-1] - numbers[0])
        if all(abs(a - b) <= 1e-9 * span for a, b in zip(even.points(), numbers, strict=True)):
            return even
    raise MechlabError(f"{key}: expected low:high, low:high:count or evenly spaced values, got {value!r}.")
