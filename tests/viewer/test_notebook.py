"""What a notebook shows: tables that are escaped, a page in a frame of its own, pictures of plots and of the gallery."""

from __future__ import annotations

import html
import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import mechlab as ml
from mechlab.errors import MechlabError
from mechlab.experiment import report
from mechlab.experiment.question import Answer, Answers
from mechlab.experiment.recording import Recording
from mechlab.mechanism import Mechanism
from mechlab.tables import MOST_ROWS, html_table
from mechlab.viewer import Story, story_to_html
from mechlab.viewer.film import _paths, motion_svg
from mechlab.viewer.gallery import Exhibit, contact_sheet, sheet_page
from mechlab.viewer.html_page import framed

EVIL = '<script>alert(1)</script> & "co"'


def cells(text: str) -> list[list[str]]:
    """The unescaped cells of all rows."""
    rows = re.findall(r"<tr>(.*?)</tr>", text, re.S)
    return [[html.unescape(c) for c in re.findall(r"<t[hd]>(.*?)</t[hd]>", row, re.S)] for row in rows]


@pytest.fixture(scope="module")
def mechanism() -> Mechanism:
    b = ml.Builder("m", summary=EVIL)
    b.bar("one", ml.revolute("first"), 1.0)
    b.bar("two", ml.revolute("second"), 0.5, parent="one", at=(1.0, 0.0, 0.0))
    return b.build()


@pytest.fixture(scope="module")
def run(mechanism: Mechanism) -> Recording:
    t = np.linspace(0.0, 1.0, 11)
    q = np.column_stack([t, -2.0 * t])
    return Recording(
        mechanism, t, q, np.gradient(q, t, axis=0), {"first<": t, "second": -2.0 * t}, {"second": "rad"}, name="r"
    )


def test_a_mechanism_is_a_table(mechanism: Mechanism) -> None:
    text = mechanism._repr_html_()
    assert "<script" not in text and html.escape(EVIL) in text
    rows = cells(text)
    assert rows[0] == ["body", "parent", "joints", "mass [kg]"]
    assert rows[1:3] == [["one", "ground", "first (revolute)", "1"], ["two", "one", "second (revolute)", "0.5"]]
    assert "2 degrees of freedom" in text


def test_loops_and_relations_are_named() -> None:
    rows = cells(ml.load("wolfrom").mechanism("parts")._repr_html_())
    m = ml.load("wolfrom").mechanism("parts")
    assert {x.name for x in (*m.loops, *m.relations, *m.shafts)} <= {row[0] for row in rows}


def test_answers_are_a_table_with_a_column_for_each_witness() -> None:
    said = {"a": Answer({"x": 1.0}), "b": Answer({"x": 1.25}, notes=(EVIL,)), "c": Answer(cannot="no <engine>")}
    text = Answers("q", said, units={"x": "m"})._repr_html_()
    assert cells(text) == [["quantity", "unit", "a", "b", "c"], ["x", "m", "1", "1.25", "-"]]
    assert "0.25" in text and "<script" not in text and "c: no &lt;engine&gt;" in text


def test_a_check_report_is_a_table() -> None:
    report = ml.check("pendulum")
    rows = cells(report._repr_html_())
    assert [row[1:3] for row in rows[1:]] == [[o.check.id, o.verdict] for o in report.outcomes]
    assert "checks passed" in report._repr_html_()


def test_a_long_table_says_what_it_leaves_out() -> None:
    text = html_table(["n"], [[str(k)] for k in range(MOST_ROWS + 7)])
    assert len(cells(text)) == MOST_ROWS + 1 and "and 7 more rows" in text


def test_a_recording_is_its_page(run: Recording) -> None:
    text = run._repr_html_()
    inner = html.unescape(re.fullmatch(r'<iframe .*? srcdoc="([^"]*)" .*</iframe>', text, re.S)[1])  # type: ignore[index]
    assert inner.startswith("<!DOCTYPE html>") and "default-src 'none'" in inner
    assert re.search(r'sandbox="([^"]*)"', text)[1].split() == ["allow-scripts", "allow-downloads"]  # type: ignore[index]


def test_a_page_too_large_becomes_a_table_that_says_why(run: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(MechlabError, match=r"1\.0 MB.*run\.html"):
        framed("x" * 1_000_001, "t", limit=1_000_000)
    monkeypatch.setattr(report, "_offered", [lambda r: framed("x" * 2000, "t", limit=1000)])
    text = run._repr_html_()
    assert "<iframe" not in text and "is not shown" in text and "first&lt;" in text
    assert ["second", "rad", "-2", "0", "-2"] in [
        [c.replace("-0", "0") if c == "-0" else c for c in r] for r in cells(text)
    ]


def test_nobody_need_offer_a_page(run: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report, "_offered", [])
    assert "Channels" in run._repr_html_()


def test_a_loaded_recording_is_its_page_too(run: Recording, tmp_path: Path) -> None:
    ml.save_recording(ml.simulate("pendulum", duration=0.1), tmp_path / "r.npz")
    assert "<iframe" in ml.load_recording(tmp_path / "r.npz")._repr_html_()


@pytest.mark.browser
def test_the_page_lives_in_its_frame_and_cannot_leave_it(
    story: Story, browser: Any, until: Any, tmp_path: Path
) -> None:
    """In a notebook of another document: the lab runs, shows something, asks for nothing, and the notebook is out of reach."""
    path = tmp_path / "notebook.html"
    path.write_text(
        f"<!DOCTYPE html><title>secret</title><body>{framed(story_to_html(story), 'A run')}</body>", encoding="utf-8"
    )
    page = browser.new_context(offline=True, viewport={"width": 900, "height": 720}).new_page()
    errors: list[str] = []
    requests: list[str] = []
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    page.goto(path.as_uri())
    frame = page.frames[1]
    until(frame, "window.lab && window.lab.ready")
    frame.evaluate("lab.pause(), lab.seek(2)")
    assert frame.evaluate("lab.time") == 2.0
    assert (
        frame.evaluate("(() => { try { return parent.document.title } catch (e) { return e.name } })()")
        == "SecurityError"
    )
    assert page.evaluate("document.title") == "secret"
    assert [r for r in requests if not r.startswith(("file:", "about:", "data:", "blob:"))] == []
    assert errors == []
    page.context.close()


def test_plots_of_a_run_as_a_picture(story: Story) -> None:
    drawn = motion_svg(story)
    assert drawn == motion_svg(story)
    assert drawn.count('<g id="axes_') == len(story.plots) + 1  # and the paths
    assert not re.search(r"<script|https?://(?!www\.w3\.org|purl\.org|creativecommons\.org|matplotlib\.org)", drawn)
    still = ml.story("fourbar")
    with pytest.raises(MechlabError, match="no motion to plot"):
        motion_svg(still)


def test_flat_paths_that_lie_apart_are_all_in_the_picture() -> None:
    along = np.linspace(0.0, 2.0, 5)
    axes = Figure().add_subplot()
    _paths(axes, {name: np.column_stack([along, 0.0 * along, height + 0.1 * along]) for name, height in (("low", 0.0), ("high", 1.0))})
    low, high = axes.get_ylim()
    assert low <= 0.0 and high >= 1.2


def test_the_sheet_of_the_gallery_holds_the_plots(story: Story) -> None:
    text = sheet_page(Exhibit("a", "A", "One.", colour((0, 0, 0)), "<h3>sheet</h3>", False, motion_svg(story)))
    assert 'src="data:image/svg+xml;base64,' in text
    assert not re.findall(r"""src\s*=\s*["'](?!data:)|https?://|@@""", text)


def colour(rgb: tuple[int, int, int]) -> bytes:
    from PIL import Image

    buffer = io.BytesIO()
    Image.new("RGB", (64, 48), rgb).save(buffer, format="png")
    return buffer.getvalue()


def test_the_contact_sheet_shows_every_picture_in_its_place() -> None:
    from PIL import Image

    wanted = [(200, 30, 30), (30, 160, 30), (30, 30, 200)]
    made = contact_sheet([(f"a title that is far too long {k}" * 3, colour(c)) for k, c in enumerate(wanted)], 2, 600)
    with Image.open(io.BytesIO(made)) as image:
        sheet = image.convert("RGB")
    assert sheet.width == 600
    size = (600 - 3 * 12) // 2
    for k, c in enumerate(wanted):
        x = 12 + (k % 2) * (size + 12) + size // 2
        y = 12 + (k // 2) * (size * 3 // 4 + 42) + 80
        assert np.abs(np.subtract(sheet.getpixel((x, y)), c)).max() < 8
    with pytest.raises(MechlabError, match="at least one"):
        contact_sheet([])
