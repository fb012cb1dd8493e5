"""Which fidelity a page shows, and that it says so."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from mechlab import api
from mechlab.errors import MechlabError


def document(path: Path) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="story">(.*?)</script>', path.read_text("utf-8"), re.S)
    assert found is not None
    return dict(json.loads(found[1]))


@pytest.mark.parametrize("fidelity", ["minimal", "full"])
def test_a_page_of_one_fidelity_has_its_bodies(fidelity: str, tmp_path: Path) -> None:
    api.view("planetary_stage", html=tmp_path / "page.html", fidelity=fidelity)
    page = document(tmp_path / "page.html")
    mechanism = api.load("planetary_stage").mechanism(fidelity)
    drawn = [b.name for b in mechanism.bodies] + [s.name for s in mechanism.shafts if s.shapes]
    assert {name.removesuffix(" (shaft)") for name in page["bodies"]} == {*drawn, "ground"}
    assert page["reconstructed"] == []
    assert dict(page["facts"])["fidelity"] == fidelity


def test_a_page_says_what_is_rebuilt() -> None:
    story = api.story(api.simulate("delta6", duration=0.05))
    assert len(story.reconstructed) == 24
    assert dict(story.facts)["fidelity"] == "minimal; drawn with all parts, 24 of them rebuilt from the run"


def test_pictures_and_sliders_of_one_fidelity(tmp_path: Path) -> None:
    api.view("planetary_stage", html=tmp_path / "page.html", explorable=True, vary={}, fidelity="minimal")
    mechanism = api.load("planetary_stage").mechanism("minimal")
    assert len(document(tmp_path / "page.html")["bodies"]) < 1 + len(mechanism.bodies) + len(mechanism.shafts) + 1


def test_fidelities_that_cannot_be_shown(tmp_path: Path) -> None:
    with pytest.raises(MechlabError, match="'huge' does not exist. Existing: full"):
        api.view("delta6", html=tmp_path / "x.html", fidelity="huge")
    with pytest.raises(MechlabError, match="a run that is recorded keeps its own, minimal"):
        api.view(api.simulate("fourbar", duration=0.05), html=tmp_path / "x.html", fidelity="minimal")
    assert not (tmp_path / "x.html").exists()


def test_the_pipeline_names_both_fidelities(tmp_path: Path) -> None:
    made = api.run("planetary_stage", out=tmp_path / "out")
    text = made.text()
    assert "run of scene constant-torques, fidelity minimal" in text
    assert "model files are of fidelity full; to run and see that: mechlab view planetary_stage --fidelity full" in text
