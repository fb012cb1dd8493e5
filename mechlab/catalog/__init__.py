"""Which mechanisms exist: one Entry a file (or a package of that name). This table is all that has to know them."""

from __future__ import annotations

from importlib import import_module

from mechlab.errors import unknown
from mechlab.experiment.entry import Entry

NAMES: tuple[str, ...] = ("fourbar", "planetary_stage", "delta6")
"""Catalog names; each is a module of this package that exports ENTRY."""


def entry(name: str) -> Entry:
    """The entry of a catalog name; raises MechlabError that lists the catalog."""
    if name not in NAMES:
        raise unknown("mechanism", name, NAMES)
    found = import_module(f"mechlab.catalog.{name}").ENTRY
    assert isinstance(found, Entry)
    return found
