"""The tables of `mechlab.tables`, under the name that the studies use."""

from mechlab.tables import Told, html_sheet, html_table, markdown, number, table

__all__ = ["Told", "html_sheet", "html_table", "markdown", "number", "table"]
