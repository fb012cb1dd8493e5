"""The gallery: one page that shows every mechanism by family, with a search, and moves it under the pointer; links to the page that
solves it, its run and its sheet. Static files only."""

from __future__ import annotations

import base64
import hashlib
import html
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

from mechlab.errors import MechlabError
from mechlab.files import write
from mechlab.lazy_dataclass import dataclass
from mechlab.viewer.html_page import asset

THUMBNAIL = (560, 420)


@dataclass(frozen=True, eq=False)
class Exhibit:
    """One mechanism: name (of its folder), title, one sentence, picture (PNG bytes), sheet (HTML that is already escaped),
    whether there is a page to explore, the plots of its run (SVG, or none), its family ("" for none), and what moves on its card
    (`mechlab.viewer.thumbnail`; empty for a picture that stands still)."""

    name: str
    title: str
    sentence: str
    picture: bytes
    sheet: str
    explorable: bool
    motion: str = ""
    family: str = ""
    moving: Mapping[str, Any] = field(default_factory=dict)


def write_gallery(exhibits: Sequence[Exhibit], folder: Path, studies: Mapping[str, str] | None = None) -> Path:
    """Writes index.html, gallery.png (all pictures in one), and for each exhibit FOLDER/NAME/sheet.html and
    picture.png. The pages run.html and explore.html that it links to are made elsewhere, as are the pages of studies (file -> title).

    Returns the path of index.html. Raises CannotWrite.
    """
    for exhibit in exhibits:
        write(folder / exhibit.name / "picture.png", exhibit.picture)
        write(folder / exhibit.name / "sheet.html", sheet_page(exhibit))
    write(folder / "gallery.png", contact_sheet([(e.title, e.picture) for e in exhibits]))
    script = asset("gallery.js")
    compared = "".join(f'<li><a href="{html.escape(f, quote=True)}">{html.escape(t)}</a></li>' for f, t in (studies or {}).items())
    digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
    parts = {
        "style": asset("gallery.css"), "count": str(len(exhibits)), "cards": _sections(exhibits), "families": _families(exhibits),
        "studies": f"<ul>{compared}</ul>" if compared else "", "motions": _motions(exhibits), "script": script, "hash": digest,
    }  # fmt: skip
    return write(folder / "index.html", _fill("gallery.html", parts))


def _motions(exhibits: Sequence[Exhibit]) -> str:
    """What moves on the cards, as JSON that may stand in a page."""
    moving = {e.name: e.moving for e in exhibits if e.moving}
    return json.dumps(moving, separators=(",", ":")).replace("<", "\\u003c")


def _by_family(exhibits: Sequence[Exhibit]) -> dict[str, list[Exhibit]]:
    """The exhibits of each family, in the order in which they come."""
    out: dict[str, list[Exhibit]] = {}
    for exhibit in exhibits:
        out.setdefault(exhibit.family, []).append(exhibit)
    return out


def _heading(family: str) -> str:
    """ "straight-line" -> "Straight line"."""
    return html.escape(family.replace("-", " ").capitalize())


def _families(exhibits: Sequence[Exhibit]) -> str:
    """Links to the sections; none where there is one family only."""
    found = _by_family(exhibits)
    links = [f'<a href="#{html.escape(f, quote=True)}">{_heading(f)} <small>{len(e)}</small></a>' for f, e in found.items() if f]
    return "".join(links) if len(found) > 1 else ""


def _sections(exhibits: Sequence[Exhibit]) -> str:
    """A section of cards for each family."""
    out = []
    for family, group in _by_family(exhibits).items():
        title = f"<h2>{_heading(family)}</h2>" if family else ""
        cards = "\n".join(_card(e) for e in group)
        out.append(f'<section id="{html.escape(family, quote=True)}">{title}<div class="cards">\n{cards}\n</div></section>')
    return "\n".join(out)


def sheet_page(exhibit: Exhibit) -> str:
    """The sheet of a mechanism as a page of its own, with the picture in it."""
    return _fill(
        "sheet.html",
        {
            "style": asset("gallery.css"),
            "title": html.escape(exhibit.title),
            "picture": data_address(exhibit.picture),
            "motion": _drawing(exhibit),
            "sheet": exhibit.sheet,
            "links": _links(exhibit, "", sheet=False),
        },
    )


def data_address(png: bytes) -> str:
    """A picture as a data: address of a smaller WebP, so that the page stays one file."""
    from PIL import Image

    with Image.open(io.BytesIO(png)) as image:
        small = image.convert("RGB")
        small.thumbnail(THUMBNAIL)
        buffer = io.BytesIO()
        small.save(buffer, format="webp", quality=72, method=4)
    return "data:image/webp;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def contact_sheet(pictures: Sequence[tuple[str, bytes]], columns: int = 5, width: int = 1500) -> bytes:
    """All pictures with their titles as one PNG: (title, picture as PNG bytes) in rows of `columns`, `width` pixels wide.

    Raises MechlabError where there is no picture.
    """
    from PIL import Image, ImageDraw, ImageFont, ImageOps

    if not pictures:
        raise MechlabError("contact sheet: expected at least one picture.")
    gap, line = 12, 30
    size = (width - gap * (columns + 1)) // columns
    tall = size * 3 // 4
    rows = -(-len(pictures) // columns)
    sheet = Image.new("RGB", (width, gap + rows * (tall + line + gap)), "#f6f8fa")
    pen, large, small_type = ImageDraw.Draw(sheet), ImageFont.load_default(17), ImageFont.load_default(14)
    for k, (title, png) in enumerate(pictures):
        x, y = gap + (k % columns) * (size + gap), gap + (k // columns) * (tall + line + gap)
        with Image.open(io.BytesIO(png)) as image:
            small = ImageOps.fit(image.convert("RGB"), (size, tall), Image.Resampling.LANCZOS)
        pen.rounded_rectangle((x - 1, y - 1, x + size, y + tall + line), 6, "white", "#dde2e9")
        sheet.paste(small, (x, y))
        font = large if pen.textlength(title, large) <= size - 12 else small_type
        while pen.textlength(title, font) > size - 12:
            title = title[:-2].rstrip(" ,…") + "…"
        pen.text((x + size / 2, y + tall + line / 2), title, "#1c2430", font, "mm")
    out = io.BytesIO()
    sheet.quantize(256, dither=Image.Dither.NONE).save(out, format="png", optimize=True)
    return out.getvalue()


def _drawing(exhibit: Exhibit) -> str:
    """The plots of the run as an image: a drawing in an image element cannot run scripts."""
    if not exhibit.motion:
        return ""
    address = "data:image/svg+xml;base64," + base64.b64encode(exhibit.motion.encode("utf-8")).decode("ascii")
    words = f"Plots of the run of {html.escape(exhibit.title, quote=True)}"
    return f'<div class="drawing"><img src="{address}" alt="{words}"></div>'


def _card(exhibit: Exhibit) -> str:
    title, folder = html.escape(exhibit.title), html.escape(exhibit.name, quote=True)
    words = html.escape(f"{exhibit.name} {exhibit.title} {exhibit.family} {exhibit.sentence}".lower(), quote=True)
    page = "explore" if exhibit.explorable else "run"
    return (
        f'<article data-name="{folder}" data-words="{words}">'
        f'<a class="picture" href="{folder}/{page}.html" tabindex="-1" aria-hidden="true">'
        f'<img src="{data_address(exhibit.picture)}" alt="" loading="lazy"></a>'
        f"<h3>{title}</h3><p>{html.escape(exhibit.sentence)}</p>"
        f'<p class="links">{_links(exhibit, folder + "/")}</p></article>'
    )


def _links(exhibit: Exhibit, folder: str, sheet: bool = True) -> str:
    title = html.escape(exhibit.title, quote=True)
    items = [("explore.html", "Move it")] if exhibit.explorable else []
    items += [("run.html", "Watch it run")]
    items += [("sheet.html", "Sheet")] if sheet else [("../index.html", "All mechanisms")]
    return "".join(f'<a href="{folder}{page}" aria-label="{words}: {title}">{words}</a>' for page, words in items)


def _fill(template: str, parts: dict[str, str]) -> str:
    pieces = asset(template).split("@@")
    return "".join(parts[piece] if i % 2 else piece for i, piece in enumerate(pieces))
