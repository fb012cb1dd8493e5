"""The gallery of the catalog inside the site: a page to move, measure and change for each mechanism."""

from __future__ import annotations

from pathlib import Path

from sphinx.application import Sphinx

import mechlab


def _add(app: Sphinx, error: Exception | None) -> None:
    if error is None and app.config.with_gallery and app.builder.format == "html":
        mechlab.gallery(out=Path(app.outdir) / "gallery")


def setup(app: Sphinx) -> dict[str, bool]:
    """Make the gallery when everything else is built."""
    app.add_config_value("with_gallery", True, "")
    app.connect("build-finished", _add)
    return {"parallel_read_safe": True}
