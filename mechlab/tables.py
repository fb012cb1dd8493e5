"""Plain tables and numbers for people: for a terminal, as markdown, and as HTML for a notebook or a sheet."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

MOST_ROWS = 200
"""Rows of an HTML table; what is left out is counted below it."""


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
    return f"{float(value) + 0.0:.{digits}g}"  # a zero has no sign


def up_to(values: Any) -> str:
    """The words before the largest of several values; none before a single one."""
    return "up to " if np.ndim(values) else ""


def counted(count: int, one: str, many: str = "") -> str:
    """ "1 body", "2 bodies"; `many` is `one` with an s where it is not given."""
    return f"{count} {one if count == 1 else many or one + 's'}"


def listed(names: Iterable[str], most: int = 4) -> str:
    """ "a, b, c, d and 3 more"."""
    names = list(names)
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


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


def csv_text(rows: Iterable[Sequence[Any]], line_end: str = "\n") -> str:
    """Rows as comma-separated values, one a line; cells with commas or quotes are quoted."""
    out = io.StringIO(newline="")
    csv.writer(out, lineterminator=line_end).writerows(rows)
    return out.getvalue()


def markdown(headers: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A markdown table."""
    lines = ["| " + " | ".join(headers) + " |", "|" + "---|" * len(headers)]
    lines += ["| " + " | ".join(str(c).replace("|", "\\|") for c in row) + " |" for row in rows]
    return "\n".join(lines)


def html_table(headers: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """An HTML table of escaped cells; beyond MOST_ROWS rows only the number of those left out."""
    head = "".join(f"<th>{escape(h)}</th>" for h in headers)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(str(c))}</td>" for c in row) + "</tr>" for row in list(rows)[:MOST_ROWS]
    )
    more = f"<p>and {len(rows) - MOST_ROWS} more rows</p>" if len(rows) > MOST_ROWS else ""
    return f"<table><tr>{head}</tr>{body}</table>{more}"


def html_sheet(
    title: str, sentences: Iterable[str], tables: Mapping[str, tuple[Sequence[str], Sequence[Sequence[Any]]]]
) -> str:
    """A title, a paragraph for each sentence, and named tables, all escaped. A table named "" has no heading."""
    parts = [f"<h3>{escape(title)}</h3>"] if title else []
    parts += [f"<p>{escape(s)}</p>" for s in sentences]
    for name, (headers, rows) in tables.items():
        parts.append((f"<h4>{escape(name)}</h4>" if name else "") + html_table(headers, rows))
    return "".join(parts)
