"""The lessons of assets/lessons as pages of the site: text, code and the outputs that their files keep."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

from reference import write_if_new
from sphinx.application import Sphinx


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx looks for its sources."""
    app.connect("config-inited", lambda app, config: write_pages(Path(app.srcdir)))
    return {"parallel_read_safe": True}


def write_pages(docs: Path) -> None:
    """A page for each notebook, its pictures beside it."""
    folder = docs / "tutorials" / "generated"
    folder.mkdir(parents=True, exist_ok=True)
    for lesson in sorted((docs.parent / "assets" / "lessons").glob("*.ipynb")):
        cells = json.loads(lesson.read_text(encoding="utf-8"))["cells"]
        parts = [_page_part(cell, f"{lesson.stem}_{k}", folder) for k, cell in enumerate(cells)]
        text = "\n\n".join(parts).replace(".ipynb)", ".md)").replace("](../", "](../../../assets/")
        write_if_new(folder / f"{lesson.stem}.md", text + "\n")


def _page_part(cell: dict[str, Any], name: str, folder: Path) -> str:
    source = "".join(cell["source"])
    if cell["cell_type"] == "markdown":
        return source
    return "\n\n".join([f"```python\n{source}\n```", *(_output(o, name, folder) for o in cell["outputs"])])


def _output(output: dict[str, Any], name: str, folder: Path) -> str:
    data = output.get("data", {})
    if "image/png" in data:
        (folder / f"{name}.png").write_bytes(base64.b64decode(data["image/png"]))
        return f"![What this prints]({name}.png)"
    if "text/html" in data:
        return "```{raw} html\n<div class=\"output\">" + "".join(data["text/html"]) + "</div>\n```"
    return "```text\n" + "".join(output["text"]).rstrip() + "\n```"
