"""The gallery: one page that shows every mechanism, and links to its run, its sliders and its sheet. Static files only."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mechlab.view.html_page import asset, write_atomically

THUMBNAIL = (720, 540)


@dataclass(frozen=True, eq=False)
class Exhibit:
    """One mechanism: name (of its folder), title, one sentence, picture (PNG bytes), sheet (HTML that is already escaped),
    and whether there is a page to explore."""

    name: str
    title: str
    sentence: str
    picture: bytes
    sheet: str
    explorable: bool


def write_gallery(exhibits: Sequence[Exhibit], folder: Path) -> Path:
    """Writes index.html, and for each exhibit FOLDER/NAME/sheet.html and picture.png; the pages are there already.

    Returns the path of index.html. Raises OSError.
    """
    for exhibit in exhibits:
        write_atomically(folder / exhibit.name / "picture.png", exhibit.picture)
        write_atomically(folder / exhibit.name / "sheet.html", sheet_page(exhibit).encode("utf-8"))
    cards = "\n".join(_card(e) for e in exhibits)
    text = _fill("gallery.html", {"style": asset("gallery.css"), "count": str(len(exhibits)), "cards": cards})
    return write_atomically(folder / "index.html", text.encode("utf-8"))


def sheet_page(exhibit: Exhibit) -> str:
    """The sheet of a mechanism as a page of its own, with the picture in it."""
    return _fill(
        "sheet.html",
        {
            "style": asset("gallery.css"),
            "title": html.escape(exhibit.title),
            "picture": data_address(exhibit.picture),
            "sheet": exhibit.sheet,
            "links": _links(exhibit, "", sheet=False),
        },
    )


def data_address(png: bytes) -> str:
    """A picture as a data: address of a smaller JPEG, so that the page stays one file."""
    from PIL import Image

    with Image.open(io.BytesIO(png)) as image:
        small = image.convert("RGB")
        small.thumbnail(THUMBNAIL)
        buffer = io.BytesIO()
        small.save(buffer, format="jpeg", quality=88, optimize=True)
    return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def _card(exhibit: Exhibit) -> str:
    title, folder = html.escape(exhibit.title), html.escape(exhibit.name, quote=True)
    return (
        f'<article><a class="picture" href="{folder}/run.html" tabindex="-1" aria-hidden="true">'
        f'<img src="{data_address(exhibit.picture)}" alt="" loading="lazy"></a>'
        f"<h2>{title}</h2><p>{html.escape(exhibit.sentence)}</p>"
        f'<p class="links">{_links(exhibit, folder + "/")}</p></article>'
    )


def _links(exhibit: Exhibit, folder: str, sheet: bool = True) -> str:
    title = html.escape(exhibit.title, quote=True)
    items = [("run.html", "Watch it run")]
    items += [("explore.html", "Move it")] if exhibit.explorable else []
    items += [("sheet.html", "Sheet")] if sheet else [("../index.html", "All mechanisms")]
    return "".join(f'<a href="{folder}{page}" aria-label="{words}: {title}">{words}</a>' for page, words in items)


def _fill(template: str, parts: dict[str, str]) -> str:
    pieces = asset(template).split("@@")
    return "".join(parts[piece] if i % 2 else piece for i, piece in enumerate(pieces))
