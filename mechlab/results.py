"""What every result of a verb has: one line for a shell, the table of the command line, HTML for a notebook, and files.

A result is data. How it looks is written in the module `report` of its package, as functions registered by type
(`functools.singledispatch`), and imported when it is first asked for: data never imports what draws it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import singledispatch
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar


@singledispatch
def text_of(result: Any) -> str:
    """What a person reads; a package registers its own. Raises TypeError for a type that has none."""
    raise TypeError(f"no text is registered for {type(result).__name__}")


@singledispatch
def line_of(result: Any) -> str:
    """One line that says what a result is; without a registration the name of its type."""
    return f"<{type(result).__name__}>"


@singledispatch
def html_of(result: Any) -> str:
    """What a notebook shows; without a registration the text."""
    from html import escape

    return f"<pre>{escape(text_of(result))}</pre>"


@singledispatch
def save_result(result: Any, path: Path) -> Any:
    """Writes a result; returns what its `save` does. Raises TypeError for a type that has no files."""
    raise TypeError(f"no file is registered for {type(result).__name__}")


offered_pages: list[Callable[[Any], str]] = []


def offer_page(write: Callable[[Any], str]) -> None:
    """From now on recordings show `write(recording)` in a notebook, HTML that is safe there. The last offer counts.

    A MechlabError that `write` raises becomes the sentence above a table.
    """
    offered_pages[:] = [write]


class Shown:
    """Base of what is printed: dataclasses with `repr=False`, whose line, text and HTML stand in the `report` of their package."""

    def text(self) -> str:
        """What a person reads, as the command line prints it."""
        load_reports(type(self))
        return text_of(self)

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        load_reports(type(self))
        return line_of(self)

    def _repr_html_(self) -> str:
        load_reports(type(self))
        return html_of(self)


Saved = TypeVar("Saved")


class Result(Shown, Generic[Saved]):
    """Base of what is printed and can be written: to one file, `Result[Path]`, or to several, `Result[dict[str, Path]]`."""

    written_by: ClassVar[str] = ""
    """The module that registers the writer with `save_result`, where that is not the `report` of the package."""

    def save(self, path: str | Path) -> Saved:
        """Write to a file or folder, the kind by the ending; returns the path, or kind -> path where there are several.

        Raises MechlabError for a kind that does not exist, and for a path that cannot take it.
        """
        load_reports(type(self))
        if self.written_by:
            import_module(self.written_by)
        saved: Saved = save_result(self, Path(path))
        return saved


_loaded: set[type] = set()


def load_reports(kind: type) -> None:
    """Import the module `report` beside each class that `kind` is derived from, where there is one."""
    if kind in _loaded:
        return
    _loaded.add(kind)
    for base in kind.__mro__:
        package = base.__module__.rpartition(".")[0]
        if package.startswith("mechlab.") and find_spec(f"{package}.report"):
            import_module(f"{package}.report")
