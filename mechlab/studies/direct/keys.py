"""Keys and numbers of a direct question."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from mechlab.errors import MechlabError, unknown
from mechlab.lab.ask import numeric


def known_keys(name: str, values: Mapping[str, Any], keys: Iterable[str]) -> None:
    """Raises MechlabError for a key that the question `name` does not take."""
    exist = tuple(keys)
    for key in values:
        if key not in exist:
            raise unknown(f"{name}: quantity", key, exist)


def number_of(name: str, key: str, value: Any, unit: str, many: bool) -> Any:
    """A number without or with its right unit; where `many`, also an array. Raises MechlabError for anything else."""
    number = numeric(key, value)
    items = value if isinstance(value, tuple | list) else (value,)
    strange = [x for x in items if getattr(x, "unit", unit) != unit]
    if strange or (not many and not isinstance(number, float)):
        wanted = f"a number [{unit}]" if unit else "a number without a unit"
        got = f"one in {strange[0].unit}" if strange else repr(value)
        raise MechlabError(f"{name}: {key}: expected {wanted}, got {got}.")
    return number
