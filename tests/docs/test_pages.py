"""Every block of code in the documentation runs, and prints what the page says."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs.pages import DOCS, blocks_of, difference, run_page, written

PAGES = sorted(p for p in DOCS.rglob("*.md") if "_build" not in p.parts)
SAMPLE = 9
"""Plain `pytest` runs every so many of the pages, `pytest -m printed` all others."""
WITH_CODE = [p for p in PAGES if any(not b.reason for b in blocks_of(p.read_text(encoding="utf-8")))]


@pytest.mark.parametrize(
    "path", [p if k % SAMPLE == 4 else pytest.param(p, marks=pytest.mark.printed) for k, p in enumerate(WITH_CODE)],
    ids=lambda p: str(p.relative_to(DOCS).with_suffix("")),
)
def test_the_code_of_a_page_runs_and_prints_what_is_shown(path: Path) -> None:
    for ran in run_page(path):
        if ran.block.shown is not None:
            how = difference(ran.block.shown, ran.printed)
            assert not how, f"{how}\nrun: python -m tests.docs.pages --write {path.relative_to(DOCS.parent)}"


def test_little_is_left_alone() -> None:
    """What cannot run here (an installation, a robot, a GPU) says why; it is one block in ten at most."""
    blocks = [b for p in PAGES for b in blocks_of(p.read_text(encoding="utf-8"))]
    assert sum(bool(b.reason) for b in blocks) <= 0.1 * len(blocks)


def test_the_comparison_can_fail(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    code, shell = "```python\nprint('x is', 2 * 1.5)\n```", "```sh\nmechlab solve nothing  # exit 1\n```"
    page.write_text(f"# A\n\n{code}\n\n```text\nx is 3.0\n```\n\n{shell}\n")
    (first, second) = run_page(page)
    assert first.printed == "x is 3.0\n" and "does not exist" in second.printed
    assert not difference("x is 3.01", first.printed) and not difference("x ... 3", first.printed)
    assert "3.2 on the page" in difference("x is 3.2", first.printed)
    assert "the page shows" in difference("y is 3.0", first.printed)
    page.write_text(page.read_text().replace("x is 3.0\n", "x is 9\n"))
    assert "x is 3.0\n```" in written(page)
    page.write_text("```sh\nmechlab solve nothing\n```\n")
    with pytest.raises(AssertionError, match="exit 1, the page says 0"):
        run_page(page)
