"""The catalog of mechanisms: NAMES lists the modules and packages that hold one Entry each."""

from __future__ import annotations

from importlib import import_module

from mechlab.errors import unknown
from mechlab.experiment.entry import Entry

NAMES: tuple[str, ...] = (
    "fourbar", "class4_linkage", "platform_3rrr", "quick_return", "stephenson", "fivebar", "planetary_stage",
    "wolfrom", "closed_differential", "delta6", "impulse_transmission", "gear_linkage", "planetary",
    "prosthetic_leg", "pendulum", "n_fourbar", "andrews", "bricard", "flyball", "slider_crank",
)  # fmt: skip
"""Catalog names; each is a module of this package that exports ENTRY."""


def entry(name: str) -> Entry:
    """The entry of a catalog name; raises MechlabError that lists the catalog."""
    if name not in NAMES:
        raise unknown("mechanism", name, NAMES)
    found = import_module(f"mechlab.catalog.{name}").ENTRY
    assert isinstance(found, Entry)
    return found
