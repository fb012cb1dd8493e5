"""The catalog of mechanisms: NAMES lists the modules and packages that hold one Entry each (`mechlab.catalog.table`)."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from mechlab.catalog.table import TABLE
from mechlab.clock import spent_on
from mechlab.errors import unknown

if TYPE_CHECKING:
    from mechlab.experiment.entry import Entry

NAMES: tuple[str, ...] = tuple(row.name for row in TABLE)
"""Catalog names; each is a module of this package that exports ENTRY."""


def entry(name: str) -> Entry:
    """The entry of a catalog name; raises MechlabError that lists the catalog."""
    if name not in NAMES:
        raise unknown("mechanism", name, NAMES)
    with spent_on("imports"):
        found: Entry = import_module(f"mechlab.catalog.{name}").ENTRY
    return found
