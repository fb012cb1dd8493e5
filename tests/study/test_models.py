"""models/ is what the catalog makes today: every text is regenerated and compared, numbers to rounding of the machine."""

import re
from pathlib import Path

import pytest

from mechlab import api, catalog

MODELS = Path(__file__).parents[2] / "models"
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")


def same(one: str, two: str) -> bool:
    """Equal texts; numbers may differ in their last digits, as they do between processors."""
    if one == two:
        return True
    if NUMBER.sub("#", one) != NUMBER.sub("#", two):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(two), strict=True)
    return all(abs(float(a) - float(b)) <= 1e-12 * max(1.0, abs(float(a))) for a, b in pairs)


def test_every_mechanism_has_its_folder() -> None:
    assert sorted(p.name for p in MODELS.iterdir() if p.is_dir()) == sorted(catalog.NAMES)


@pytest.mark.slow
@pytest.mark.parametrize("name", catalog.NAMES)
def test_models_are_current(name: str, tmp_path: Path) -> None:
    api.generate_catalog(tmp_path, [name], pictures=False)
    made = {p.relative_to(tmp_path / name): p for p in (tmp_path / name).rglob("*") if p.is_file()}
    kept = {p.relative_to(MODELS / name): p for p in (MODELS / name).rglob("*") if p.is_file()}
    assert set(kept) == set(made) | {Path("picture.png"), Path("motion.svg")}, (
        f"run: mechlab generate {name} --catalog -o models"
    )
    stale = [str(f) for f, path in made.items() if not same(path.read_text(), kept[f].read_text())]
    assert not stale, f"{stale} are not current; run: mechlab generate {name} --catalog -o models"


def test_pictures_show_something() -> None:
    from PIL import Image

    for name in catalog.NAMES:
        with Image.open(MODELS / name / "picture.png") as picture:
            colours = picture.convert("RGB").getcolors(maxcolors=1 << 24)
        assert colours is not None and len(colours) > 200, name
