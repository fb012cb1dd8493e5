"""The gallery of the catalog inside the site: a page to move, measure and change for each mechanism."""

from __future__ import annotations

from pathlib import Path

from sphinx.application import Sphinx

import mechlab

BACK = '<p><a href="../index.html">Documentation</a></p>'
"""The way from the gallery back to the site."""


def _add(app: Sphinx, error: Exception | None) -> None:
    if error is None and app.config.with_gallery and app.builder.format == "html":
        folder = Path(app.outdir) / "gallery"
        mechlab.gallery(out=folder, models=Path(app.srcdir).parent / "models")
        index = folder / "index.html"
        page = index.read_text(encoding="utf-8")
        index.write_text(page.replace("<header>\n", f"<header>\n{BACK}\n", 1), encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Make the gallery when everything else is built."""
    app.add_config_value("with_gallery", True, "")
    app.connect("build-finished", _add)
    return {"parallel_read_safe": True}
