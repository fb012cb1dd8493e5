"""The list of the catalog as a result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mechlab.results import Shown


@dataclass(frozen=True, repr=False)
class TableResult(Shown):
    """A table, and `data`, which a program reads in its place."""

    headers: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    data: Mapping[str, Any] = field(default_factory=dict)
    exit_code: int = 0

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return dict(self.data)
