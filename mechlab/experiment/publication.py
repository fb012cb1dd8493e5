"""A publication that entries and claims cite: what can be read of its author, title and place."""

from __future__ import annotations

from typing import Any

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Publication:
    """A printed source. `label`: short name for tables, such as "Zinchenko 2009".

    title: in English; original: as printed; authors: as printed, transliterated; place: journal and number. What the text at
    hand does not show is empty (year: None), and `readable` says what is missing or damaged. Raises MechlabError without
    label or title.
    """

    label: str
    title: str
    original: str = ""
    authors: str = ""
    year: int | None = None
    place: str = ""
    readable: str = ""

    def __post_init__(self) -> None:
        if not self.label.strip() or not self.title.strip():
            raise MechlabError(f"publication {self.label!r}: a label and a title are needed to cite it.")

    @property
    def citation(self) -> str:
        """One line: authors, title, original title, place, year, and what cannot be read."""
        what = f"{self.title} ({self.original})" if self.original else self.title
        facts = (self.authors, what, self.place, str(self.year or ""))
        line = ", ".join(x for x in facts if x)
        return f"{line} [{self.readable}]" if self.readable else line

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form; year is null where it is not known."""
        return {
            "label": self.label, "authors": self.authors, "title": self.title, "original_title": self.original,
            "year": self.year, "place": self.place, "readable": self.readable,
        }  # fmt: skip
