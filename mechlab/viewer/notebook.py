"""A page inside a notebook: the offline page in a frame of its own, cut off from the notebook around it."""

from __future__ import annotations

from html import escape

from mechlab.errors import MechlabError

HEIGHT = 640
"""Height of the frame [px]."""
LIMIT = 6_000_000
"""Largest page [bytes]: a notebook keeps every page it shows in its file."""


def framed(page: str, title: str, height: int = HEIGHT, limit: int = LIMIT) -> str:
    """An iframe with the page as its source document.

    Sandboxed: the page may run its scripts and offer downloads; it reaches neither the notebook nor
    its origin. Raises MechlabError for a page larger than `limit` bytes.
    """
    size = len(page.encode("utf-8"))
    if size > limit:
        raise MechlabError(
            f"it has {size / 1e6:.1f} MB, more than the {limit / 1e6:.1f} MB that a notebook should keep; "
            'try mechlab.view(recording, html="run.html") and open that file.'
        )
    return (
        f'<iframe title="{escape(title)}" srcdoc="{escape(page)}" sandbox="allow-scripts allow-downloads" '
        f'style="width:100%;height:{height:d}px;border:1px solid #d5dae0;border-radius:6px"></iframe>'
    )
