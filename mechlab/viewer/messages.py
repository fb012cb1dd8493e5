"""Messages of a browser to the live page: what may be in them, and what is not believed."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

LARGEST_MESSAGE = 1_000_000  # bytes that a browser may send at once: the JSON of a large model
_DEEPEST_MESSAGE = 8  # lists and objects in each other in a message
_MOST_TEXT = 2000  # characters of one value


def read_message(message: str | bytes) -> dict[str, Any]:
    """The object in a message of a browser; {} for everything else, and for what is too large or too deep to be parsed."""
    if not isinstance(message, str) or len(message) > LARGEST_MESSAGE or _depth(message) > _DEEPEST_MESSAGE:
        return {}
    try:
        sent = json.loads(message)
    except ValueError:
        return {}
    return sent if isinstance(sent, dict) else {}


def wanted_values(sent: Mapping[str, Any]) -> dict[str, str] | None:
    """The parameters in a message of a browser; None where it has none, or others than texts of a sensible length."""
    values = sent.get("values") if sent.get("type") == "values" else None
    if not isinstance(values, dict) or not values:
        return None
    return values if all(isinstance(x, str) and len(x) <= _MOST_TEXT for x in values.values()) else None


def _depth(message: str) -> int:
    """How many lists and objects stand in each other in a JSON text."""
    deepest = depth = 0
    for bracket in re.findall(r"[\[\]{}]", re.sub(r'"(?:[^"\\]|\\.)*"', "", message)):
        depth += 1 if bracket in "[{" else -1
        deepest = max(deepest, depth)
    return deepest
