"""Runs a notebook in one namespace and keeps light outputs; `python tests/lessons/notebooks.py` refreshes assets/lessons.

No kernel: a kernel needs open ports, and all that a lesson needs is a display of the last expression of a cell.
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

LESSONS = Path(__file__).resolve().parents[2] / "assets" / "lessons"
LIGHT = 12_000
"""Longest HTML output [characters] that is kept in a file; of pages and charts a picture is kept, the whole appears when the notebook
runs."""
PICTURE = (520, 340)
"""Size of such a picture [px]."""


def read(path: Path) -> dict[str, Any]:
    """The notebook as JSON."""
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def run(notebook: dict[str, Any]) -> tuple[dict[str, Any], list[list[dict[str, Any]]]]:
    """The namespace after all code cells, and the outputs of each code cell."""
    import matplotlib

    matplotlib.use("Agg")
    names: dict[str, Any] = {"__name__": "__main__"}
    code = [c for c in notebook["cells"] if c["cell_type"] == "code"]
    return names, [_cell("".join(c["source"]), names, k) for k, c in enumerate(code, 1)]


def _cell(source: str, names: dict[str, Any], count: int) -> list[dict[str, Any]]:
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed, value = io.StringIO(), None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, f"<cell {count}>", "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), f"<cell {count}>", "eval"), names)
    outputs: list[dict[str, Any]] = []
    if printed.getvalue():
        outputs.append(
            {"output_type": "stream", "name": "stdout", "text": printed.getvalue().splitlines(keepends=True)}
        )
    if value is not None:
        outputs.append(
            {"output_type": "execute_result", "execution_count": count, "metadata": {}, "data": _shown(value)}
        )
    return outputs


def _shown(value: Any) -> dict[str, Any]:
    if type(value).__name__ == "Figure":
        out = io.BytesIO()
        value.savefig(out, format="png", dpi=72)
        return {"image/png": base64.b64encode(out.getvalue()).decode("ascii"), "text/plain": ["<Figure>"]}
    html = value._repr_html_()
    assert html
    kind = type(value).__name__
    if len(html) > LIGHT:
        return {"image/png": _picture(value), "text/plain": [f"<{kind}: the whole is shown when the notebook runs>"]}
    return {"text/html": html.splitlines(keepends=True), "text/plain": [f"<{kind}>"]}


def _picture(value: Any) -> str:
    """A run in the middle of its time, or a chart, as a small PNG in base64."""
    from PIL import Image

    out = io.BytesIO()
    if type(value).__name__ == "Recording":
        from mechlab import api
        from mechlab.viewer.picture import render

        picture = Image.fromarray(render(api.story(value), 0.5 * float(value.t[-1]), PICTURE))
    else:
        with tempfile.TemporaryDirectory() as folder:
            value.save(Path(folder) / "chart.png")
            picture = Image.open(Path(folder) / "chart.png").convert("RGB")
        picture.thumbnail((2 * PICTURE[0], 2 * PICTURE[1]))
    picture.quantize(48).save(out, format="png", optimize=True)
    return base64.b64encode(out.getvalue()).decode("ascii")


def refresh(path: Path) -> None:
    """Run a lesson and write its outputs into its file."""
    notebook = read(path)
    _, outputs = run(notebook)
    code = [c for c in notebook["cells"] if c["cell_type"] == "code"]
    for k, (cell, shown) in enumerate(zip(code, outputs, strict=True), 1):
        cell["outputs"], cell["execution_count"] = shown, k
    path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    for lesson in [Path(p) for p in sys.argv[1:]] or sorted(LESSONS.glob("*.ipynb")):
        refresh(lesson)
        print(lesson.name, lesson.stat().st_size, "bytes")
