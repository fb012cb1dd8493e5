"""Plain tables and numbers for people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


def number(value: Any, digits: int = 3) -> str:
    """A number for a table; lists are shortened."""
    if value is None:
        return "-"
    if isinstance(value, str):
        return value
    if isinstance(value, Mapping):
        return "; ".join(f"{k} {number(v, digits)}" for k, v in value.items())
    array = np.asarray(value)
    if array.ndim:
        flat = array.ravel()
        inner = ", ".join(number(x, digits) for x in flat[:4])
        return f"[{inner}{', ...' if flat.size > 4 else ''}]"
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, int | np.integer):
        return str(value)
    return f"{float(value):.{digits}g}"


def table(headers: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Left-aligned columns, a rule under the headers."""
    cells = [[str(c) for c in row] for row in rows]
    widths = [
        max(len(headers[k]), *(len(row[k]) for row in cells)) if cells else len(headers[k]) for k in range(len(headers))
    ]
    lines = [
        "  ".join(h.ljust(w) for h, w in zip(headers, widths, strict=True)).rstrip(),
        "  ".join("-" * w for w in widths),
    ]
    lines += ["  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in cells]
    return "\n".join(lines)


def markdown(headers: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A markdown table."""
    lines = ["| " + " | ".join(headers) + " |", "|" + "---|" * len(headers)]
    lines += ["| " + " | ".join(str(c).replace("|", "\\|") for c in row) + " |" for row in rows]
    return "\n".join(lines)
