"""How the list of the catalog is printed."""

from __future__ import annotations

from mechlab.catalog.listing import TableResult
from mechlab.results import html_of, line_of, text_of
from mechlab.tables import counted, html_table, table

NOTHING = "The catalog has no mechanism of this kind; `mechlab list` shows them all."


@line_of.register
def _(result: TableResult) -> str:
    return f"Table of {counted(len(result.rows), 'row')}: {', '.join(result.headers)}"


@text_of.register
def _(result: TableResult) -> str:
    return table(result.headers, result.rows) if result.rows else NOTHING


@html_of.register
def _(result: TableResult) -> str:
    return html_table(result.headers, result.rows)
