"""The site builds without a warning: every link leads somewhere, every page is in the menu, every public name is described."""

from __future__ import annotations

import importlib
import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import mechlab
from mechlab.cli.verbs import VERBS
from tests.docs.pages import DOCS

pytest.importorskip("sphinx")
pytestmark = pytest.mark.printed


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site without the catalog's pages, built with warnings as errors, from a copy: nothing is written into docs/."""
    import shutil
    import subprocess

    folder = tmp_path_factory.mktemp("site")
    root = shutil.copytree(DOCS, folder / "docs", ignore=shutil.ignore_patterns("generated", "_build"))
    for name in ("CHANGELOG.md", "assets", "examples", "models"):
        (folder / name).symlink_to(DOCS.parent / name)
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-D", "with_gallery=0", str(root), str(folder / "html")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=DOCS.parent)
    assert done.returncode == 0, done.stderr
    return folder / "html"


class _Targets(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {k: v for k, v in attrs if v}
        self.anchors |= {given[k] for k in ("id", "name") if k in given}
        self.links += [given[k] for k in ("href", "src") if k in given]


def _read(page: Path) -> _Targets:
    found = _Targets()
    found.feed(page.read_text(encoding="utf-8"))
    return found


def test_every_link_inside_the_site_leads_somewhere(site: Path) -> None:
    pages = {p: _read(p) for p in site.rglob("*.html")}
    assert len(pages) > 10
    wrong = []
    for page, found in pages.items():
        for link in found.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc or "gallery/" in link:
                continue
            target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            if not target.exists() or (parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors):
                wrong.append(f"{page.relative_to(site)}: {link}")
    assert not wrong


def test_the_site_asks_nothing_of_the_network(site: Path) -> None:
    for page in site.rglob("*.html"):
        for tag in re.findall(r"<(?:script|link|img)\b[^>]*>", page.read_text(encoding="utf-8")):
            assert not re.search(r"(?:src|href)=\"(?:https?:)?//", tag), f"{page.name}: {tag}"


def test_every_public_name_and_verb_has_its_place(site: Path) -> None:
    anchors = {a for p in (site / "reference").rglob("*.html") for a in _read(p).anchors}
    assert {f"mechlab.{n}" for n in dir(mechlab) if n != "__version__"} <= anchors
    assert {*VERBS} <= anchors


def test_the_gallery_is_linked_where_it_is_built() -> None:
    """A link to the page of each mechanism and to the whole; without the gallery none, as it would lead nowhere."""
    sys.path.insert(0, str(DOCS / "_ext"))
    try:
        reference = importlib.import_module("reference")
    finally:
        sys.path.remove(str(DOCS / "_ext"))
    linked, bare = ("\n".join(reference._catalog_page(with_gallery)) for with_gallery in (True, False))
    names = {row["name"] for row in mechlab.list_entries().to_dict()["mechanisms"]}
    assert set(re.findall(r'href="\.\./\.\./gallery/(\w+)/run\.html"', linked)) == names and "gallery/index.html" in linked
    assert "gallery" not in bare and all(f"`{name}`" in bare for name in names)
