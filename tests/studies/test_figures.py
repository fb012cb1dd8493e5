"""Figures of the sources: what is refused, what a picture shows, and that every figure of the catalog says what is printed."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from mechlab import catalog
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.experiment.figure import Curve, Drawing, Mark, Note, Panel, Reading, SourceFigure
from mechlab.experiment.publication import Publication
from mechlab.studies.check.figures import write_picture

SOURCE = Publication("Nobody 1900", "On lines")
X = np.linspace(0.0, 1.0, 11)


def picture(path: Path, *panels: Panel, **more: object) -> Path:
    drawing = Drawing(panels, **more)  # type: ignore[arg-type]
    return write_picture(SourceFigure("figure 3", "A line.", SOURCE, lambda: drawing), drawing, path)


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Curve(X, X, "a", "wavy"), "thick"),
        (lambda: Curve(X, X[1:], "a"), r"\(11,\) and \(10,\)"),
        (lambda: Curve(X, np.nan * X, "a"), "no finite point"),
        (lambda: Curve(X, X, "a", color=6), "0 to 5"),
        (lambda: Mark("nowhere"), "x, y or both"),
    ],
)
def test_bad_data_is_refused(make, word: str) -> None:
    with pytest.raises(MechlabError, match=word):
        make()


def test_a_picture_shows_curves_and_what_is_printed(tmp_path: Path) -> None:
    """The text of the SVG: labels, and the colours of curve and printed marks; a mark at (0.5, 0.5) lies on the line x = y."""
    panel = Panel(
        "one", "x [m]", "y [m]", (Curve(X, X, "ours"), Curve([X, X], [X, 0.5 * X], "two lines", "dashed")),
        (Mark("printed point", 0.5, 0.5), Mark("printed level", y=0.25)), (Note("remark", 0.1, 0.9, (0.5, 0.5)),),
        printed_x=(0.0, 1.0), printed_y=(0.0, 0.8),
    )  # fmt: skip
    text = picture(tmp_path / "a.svg", panel, text="A sentence.").read_text()
    for words in ("ours", "two lines", "printed in the source", "numbers on the printed axes", "printed level", "remark", "A sentence."):
        assert f"<!-- {words} -->" in text
    assert text.count("#0072b2") >= 2 and text.count("#d55e00") >= 3  # a line or two, and one in the legend
    assert text == picture(tmp_path / "b.svg", panel, text="A sentence.").read_text()
    line = re.search(r'<path d="M ([\d.]+) ([\d.]+)[^"]*L ([\d.]+) ([\d.]+)\s*" clip-path[^>]*#0072b2', text)
    diamond = re.search(r'<use xlink:href="#\w+" x="([\d.]+)" y="([\d.]+)" style="fill: #c1121f', text)
    assert line and diamond
    x0, y0, x1, y1 = map(float, line.groups())
    assert [float(v) for v in diamond.groups()] == pytest.approx([0.5 * (x0 + x1), 0.5 * (y0 + y1)], abs=0.01)


@pytest.mark.parametrize(("rises", "sides"), [(True, {(1, -1), (-1, 1)}), (False, {(1, 1)})])
def test_words_at_a_printed_point_take_a_side_without_a_curve(rises: bool, sides: set[tuple[int, int]], tmp_path: Path) -> None:
    """A straight line through the point leaves two of its four sides free; right above it wherever that is one of them."""
    panel = Panel("one", "x", "y", (Curve(X, X if rises else 1.0 - X),), (Mark("a printed point", 0.5, 0.5),))
    text = picture(tmp_path / "a.svg", panel).read_text()
    words = re.search(r'<!-- a printed point -->\s*<g style="fill: #c1121f" transform="translate\(([\d.]+) ([\d.]+)\)', text)
    diamond = re.search(r'<use xlink:href="#\w+" x="([\d.]+)" y="([\d.]+)" style="fill: #c1121f', text)
    assert words and diamond
    across, down = (float(a) - float(b) for a, b in zip(words.groups(), diamond.groups(), strict=True))
    assert (int(np.sign(across)), -int(np.sign(down))) in sides


def test_several_panels_and_formats(tmp_path: Path) -> None:
    panels = [Panel(str(k), "x", "y", (Curve(X, X**k),), printed_y=(0.1, 0.2), log="y" if k else "") for k in range(3)]
    for suffix in (".png", ".svg", ".pdf"):
        assert picture(tmp_path / f"a{suffix}", *panels).stat().st_size > 3000


def test_a_film_moves(tmp_path: Path) -> None:
    """Its frames differ, and its first one is the drawing at half a step; a figure in which nothing moves has no film."""
    from PIL import Image

    asked: list[float] = []

    def frame(phase: float) -> Drawing:
        asked.append(phase)
        return Drawing((Panel("p", "x", "y", (Curve(X, phase * X),), y_range=(0.0, 1.0)),))

    still = SourceFigure("figure 3", "A line.", SOURCE, lambda: frame(0.0))
    with pytest.raises(MechlabError, match=r"nothing moves in figure 3.*\.png"):
        write_picture(still, still.draw(), tmp_path / "a.gif")
    asked.clear()
    path = write_picture(SourceFigure("figure 3", "A line.", SOURCE, still.draw, film=frame), still.draw(), tmp_path / "a.gif")
    pictures = []
    with Image.open(path) as film:
        assert film.n_frames == len(asked) - 1 and asked[1:] == [(k + 0.5) / film.n_frames for k in range(film.n_frames)]
        for k in (0, film.n_frames - 1):
            film.seek(k)
            pictures.append(np.asarray(film.convert("RGB"), dtype=int))
    assert np.abs(pictures[0] - pictures[1]).max() > 100


def test_the_ledger_lists_figures_and_finds_them_by_number(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    figure = SourceFigure("Figure 12a", "x", SOURCE, lambda: Drawing(()))
    assert all(figure.is_called(name) for name in ("12a", "figure 12a", "Figure_12a"))
    assert not any(figure.is_called(name) for name in ("12", "figure 1", ""))
    assert main(["claims", "closed_differential", "--json"]) == 0
    known = json.loads(capsys.readouterr().out)["figures"]
    assert [f["name"] for f in known] == [f.name for f in catalog.entry("closed_differential").figures] and "file" not in known[0]


WITH_FIGURES = [n for n in catalog.NAMES if catalog.entry(n).figures]


@pytest.mark.parametrize("name", WITH_FIGURES)
def test_names_and_claims_of_figures(name: str) -> None:
    entry = catalog.entry(name)
    stems = [f.stem for f in entry.figures]
    assert len(set(stems)) == len(stems)
    assert {c for f in entry.figures for c in f.claims} <= {c.id for c in entry.claims}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "number"), [(n, k) for n in WITH_FIGURES for k in range(len(catalog.entry(n).figures))])
def test_every_figure_says_what_is_printed_in_a_small_picture(name: str, number: int, tmp_path: Path) -> None:
    figure = catalog.entry(name).figures[number]
    drawing = figure.draw()
    assert any(r.printed != "-" for r in drawing.readings)  # what the source prints, in numbers or words, beside ours
    for reading in drawing.readings:
        ours = list(reading.ours.values()) if isinstance(reading.ours, dict) else reading.ours
        assert isinstance(reading, Reading) and (isinstance(ours, str) or np.all(np.isfinite(ours))), reading.what
    # Beyond this a sheet loads slowly; fewer curves, or fewer panels, are also easier to read.
    assert write_picture(figure, drawing, tmp_path / "a.png").stat().st_size < 60_000
