"""A result that several verbs share: files that were written."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mechlab.lazy_dataclass import dataclass
from mechlab.results import Shown


@dataclass(frozen=True, repr=False)
class FilesResult(Shown):
    """Files that were written, by kind; `sentence` and `warnings` are printed below them."""

    folder: Path
    files: Mapping[str, Path]
    sentence: str = ""
    warnings: tuple[str, ...] = ()
    exit_code: int = 0

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "folder": str(self.folder),
            "files": {k: str(v) for k, v in self.files.items()},
            "message": self.sentence,
            "warnings": list(self.warnings),
        }
