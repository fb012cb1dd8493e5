"""JSON text, the same bytes for the same value; reading refuses repeated keys and NaN. Exact fractions of floats."""

from __future__ import annotations

import json
import re
from fractions import Fraction
from typing import Any

from mechlab.errors import MechlabError


def exact(value: float) -> Fraction:
    """The simplest fraction whose float is exactly `value`: 0.35714285714285715 gives 5/14."""
    whole = Fraction(value)
    bound = 1
    while bound < 10**9:
        bound *= 10
        found = whole.limit_denominator(bound)
        if float(found) == value:
            return found
    return Fraction(str(value))


WIDTH = 120
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]|[\ud800-\udfff]")


def dump(value: Any, indent: int = 0) -> str:
    """JSON of dicts, lists and scalars; dicts and lists without an inner dict stay on one line if they fit. Floats have
    up to 17 digits."""
    flat = json.dumps(value, ensure_ascii=False, allow_nan=False)
    if not isinstance(value, dict | list) or not value or (indent and len(flat) + indent <= WIDTH and _plain(value)):
        return flat
    pad = " " * (indent + 1)
    if isinstance(value, dict):
        items = [f"{json.dumps(k, ensure_ascii=False)}: {dump(v, indent + 1)}" for k, v in value.items()]
        return "{\n" + pad + f",\n{pad}".join(items) + "\n" + " " * indent + "}"
    return "[\n" + pad + f",\n{pad}".join(dump(v, indent + 1) for v in value) + "\n" + " " * indent + "]"


def _plain(value: Any) -> bool:
    """True for a dict or list without a dict inside."""
    items = value.values() if isinstance(value, dict) else value
    return not any(isinstance(v, dict) or (isinstance(v, list) and not _plain(v)) for v in items)


def parse(text: str, what: str, finite: bool = True) -> dict[str, Any]:
    """The JSON object in `text`; raises MechlabError where it is not JSON, repeats a key, holds half of a surrogate pair, or
    with `finite` a NaN or an infinity."""

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        out: dict[str, Any] = {}
        for key, value in pairs:
            if key in out:
                raise MechlabError(f"{what}: the key {key!r} is written twice in one object.")
            out[key] = value
        return out

    def refuse(constant: str) -> float:
        raise MechlabError(f"{what}: {constant} is no number that a mechanism can have.")

    try:
        value = json.loads(text, object_pairs_hook=once, parse_constant=refuse if finite else None)
        if _SURROGATE.search(text):
            json.dumps(value, ensure_ascii=False).encode("utf-8")
    except UnicodeEncodeError as error:
        raise MechlabError(f"{what} holds {error.object[error.start]!r}, which is no character.") from None
    except ValueError as error:
        raise MechlabError(f"{what} is not JSON: {error}.") from None
    except RecursionError:
        raise MechlabError(f"{what} is nested too deeply.") from None
    if not isinstance(value, dict):
        raise MechlabError(f"{what}: expected a JSON object, got {type(value).__name__}.")
    return value
