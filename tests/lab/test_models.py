"""models/ is what the catalog makes today: every text is made again and compared (see tests/same_files.py)."""

import re
from pathlib import Path

import numpy as np
import pytest

from mechlab import api, catalog
from mechlab.studies.outside import catalog_table
from tests.same_files import difference

MODELS = Path(__file__).parents[2] / "models"
SAMPLE = 16
"""Plain `pytest` makes every so many of the mechanisms again, `pytest -m printed` all others."""
PICTURES = {Path("picture.png"), Path("motion.svg")}


def pictures_of(name: str) -> set[Path]:
    """The pictures of a mechanism, which are not compared: those of all, and the figures of its sources."""
    return PICTURES | {Path(f"{f.stem}.png") for f in catalog.entry(name).figures}


def test_every_mechanism_has_its_folder() -> None:
    assert sorted(p.name for p in MODELS.iterdir() if p.is_dir()) == sorted(catalog.NAMES)


@pytest.mark.slow
@pytest.mark.machine
@pytest.mark.parametrize(
    "name", [n if k % SAMPLE == 0 else pytest.param(n, marks=pytest.mark.printed) for k, n in enumerate(catalog.NAMES)]
)
def test_models_are_current(name: str, tmp_path: Path) -> None:
    api.generate_catalog(tmp_path, [name], pictures=False)
    made = {p.relative_to(tmp_path / name): p for p in (tmp_path / name).rglob("*") if p.is_file()}
    kept = {p.relative_to(MODELS / name): p for p in (MODELS / name).rglob("*") if p.is_file()}
    how = f"run: mechlab generate {name} --catalog -o models"
    assert set(kept) == set(made) | pictures_of(name), how
    stale = {str(f): found for f, path in made.items() if (found := difference(kept[f], path))}
    assert not stale, f"{stale}; {how}"


@pytest.mark.slow
@pytest.mark.printed
def test_the_table_of_numbers_from_outside_is_current(tmp_path: Path) -> None:
    made = tmp_path / "README.md"
    made.write_text(catalog_table([catalog.entry(n) for n in catalog.NAMES]))
    assert not difference(MODELS / "README.md", made), "run: mechlab generate --catalog -o models"


def test_a_row_of_the_table_is_made_again_alone() -> None:
    kept = (MODELS / "README.md").read_text("utf-8")
    without = "\n".join(x for x in kept.splitlines() if not x.startswith("| [hoeken](")) + "\n"
    changed = kept.replace("| [hoeken](hoeken/README.md) | straight-line |", "| [hoeken](hoeken/README.md) | press |")
    assert without != kept != changed
    for before in (kept, without, changed):
        assert catalog_table([catalog.entry("hoeken")], before, catalog.NAMES) == kept


def test_the_models_stay_below_forty_megabytes() -> None:
    assert sum(p.stat().st_size for p in MODELS.rglob("*") if p.is_file()) < 40e6


def test_pictures_show_something() -> None:
    from PIL import Image

    for name in catalog.NAMES:
        with Image.open(MODELS / name / "picture.png") as picture:
            pixels = np.asarray(picture.convert("RGB"), dtype=np.uint32)[::3, ::3]
        assert len(np.unique(pixels @ np.array([1, 256, 65536], dtype=np.uint32))) > 200, name


# -- the comparison itself --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kept", "made", "same"),
    [
        ('<a quat="0.6 0 0.8 0"/>', '<a quat="-0.6 0 -0.8000000000000002 -1e-17"/>', True),
        ('<a pos="0.6 0 0.8"/>', '<a pos="-0.6 0 -0.8"/>', False),
        ('<a pos="1 0 0"/>', '<a pos="1 0 1e-11"/>', False),
        ('<a pos="1 0 0"/>', '<a pos="1 0"/>', False),
        ('<a mesh="link_1"/>', '<a mesh="link_2"/>', False),
        ('<a x="1" y="2"/>', '<a y="2" x="1"/>', False),
        ("<a><b/><c/></a>", "<a><b><c/></b></a>", False),
        ("<a><b/></a>", "<a><b/><b/></a>", False),
        ("<a><!-- one --></a>", "<a><!-- two --></a>", False),
    ],
)
def test_xml_is_compared_in_structure_and_numbers(kept: str, made: str, same: bool, tmp_path: Path) -> None:
    assert bool(_difference(kept, made, ".xml", tmp_path)) is not same


@pytest.mark.parametrize(
    ("kept", "made", "same"),
    [
        ('{"q": [1.0, 0.0], "n": 3}', '{"q": [1.0000000000000002, -1e-20], "n": 3}', True),
        ('{"q": [1.0, 0.0]}', '{"q": [1.0, 2e-12]}', False),
        ('{"q": [[1.0]]}', '{"q": [1.0]}', False),
        ('{"a": 1.0, "b": 2.0}', '{"b": 2.0, "a": 1.0}', False),
        ('{"n": 3}', '{"n": 4}', False),
        ('{"n": "x"}', '{"n": null}', False),
        ('{"n": []}', '{"n": {}}', False),
    ],
)
def test_json_is_compared_in_structure_and_numbers(kept: str, made: str, same: bool, tmp_path: Path) -> None:
    assert bool(_difference(kept, made, ".json", tmp_path)) is not same


@pytest.mark.parametrize(
    ("kept", "made", "same"),
    [
        ("| A11 | 2.2 % | pass |", "| A11 | 2.3 % | pass |", True),
        ("| A11 | 2.2 % | pass |", "| A12 | 2.2 % | pass |", False),
        ("| 9 = 6 + 3 | pass |", "| 9 = 6 + 3 | fail |", False),
        ("| 9 = 6 + 3 | pass |", "| 8 = 6 + 2 | pass |", False),
        ("one\ntwo\n", "one\n", False),
    ],
)
def test_printed_numbers_are_compared_to_their_digits(kept: str, made: str, same: bool, tmp_path: Path) -> None:
    assert bool(_difference(kept, made, ".md", tmp_path)) is not same


@pytest.mark.parametrize(
    ("kept", "made", "same"),
    [
        ("v 0.12345 0 2\nvn 0 0 1\nf 1//1 2//2", "v 0.12346 -3e-18 2\nvn 0.001 0 1\nf 1//1 2//2", True),
        ("v 0.12345 1 2", "v 0.12355 1 2", False),
        ("v 1e-5 2e-5 0", "v 1e-5 2.0009e-5 0", False),
        ("vn 0 0 1", "vn 0.002 0 1", False),
        ("f 1//1 2//2", "f 1//1 3//3", False),
    ],
)
def test_obj_is_compared_in_faces_and_numbers(kept: str, made: str, same: bool, tmp_path: Path) -> None:
    assert bool(_difference(kept, made, ".obj", tmp_path)) is not same


def _difference(kept: str, made: str, suffix: str, folder: Path) -> str:
    paths = [folder / f"{k}{suffix}" for k in (1, 2)]
    for path, text in zip(paths, (kept, made), strict=True):
        path.write_text(text)
    return difference(*paths)


def test_no_name_of_a_file_is_a_hash() -> None:
    """A hash of computed sizes is another one on another processor."""
    assert not [p for p in MODELS.rglob("*") if re.search(r"_(?=[0-9a-f]*\d)[0-9a-f]{8}\.", p.name)]
