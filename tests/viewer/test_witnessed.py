"""What all witnesses say of a design that a live page has asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

import mechlab as ml
from mechlab.api.finding import load_design
from mechlab.api.pages import LivePages, run_story, still_story
from mechlab.formats.mechanism_json import from_json, to_json
from mechlab.lab.design import Design
from mechlab.viewer import witnessed as module
from mechlab.viewer.live import serve
from mechlab.viewer.streaming import Rebuilder
from mechlab.viewer.witnessed import witnessed


@pytest.mark.parametrize("name", ["fourbar", "slider_crank", "gear_linkage"])
def test_three_witnesses_agree(name: str) -> None:
    found = witnessed(load_design(name, {}))
    assert found is not None
    severity, words = found
    assert severity == "ok" and words.startswith("checked by numpy, Pinocchio, MuJoCo: largest difference ")
    assert 0.0 <= float(words.split()[-1]) < 1e-9


def test_a_difference_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers of numpy that are falsified by a micrometre are found."""
    real = module._values

    def false(m: Any, q: Any) -> dict[str, float]:
        return {k: x + 1e-6 for k, x in real(m, q).items()}

    monkeypatch.setattr(module, "_values", false)
    found = witnessed(load_design("fourbar", {}))
    assert found is not None and found[0] == "error" and float(found[1].split()[-1]) == pytest.approx(1e-6, rel=0.1)


def test_pages_of_a_changed_design_carry_the_sentence_and_the_names() -> None:
    first = load_design("fourbar", {})
    pages = LivePages(first, False)
    story = pages.shown(still_story(first))
    assert story.named is not None and not any("checked by" in words for _, words in story.health)
    changed = pages.still(load_design("fourbar", {"crank": 0.12}))
    assert any("checked by numpy, Pinocchio, MuJoCo" in words for _, words in changed.health)
    assert changed.named is not None and next(p.value for p in changed.named.parameters if p.key == "crank") == 0.12


@contextmanager
def edited(
    first: Design, look: Callable[..., Any], until: Callable[..., None], length: str, part: str = ""
) -> Iterator[tuple[Design, Any]]:
    """Types a length in the live page of a design and sends it: the design that Python built of it, and the page."""
    pages = LivePages(first, False)
    with serve(pages.shown(still_story(first)), quiet=True) as server:
        rebuilder = Rebuilder(server, first, pages.still, pages.final)
        try:
            page = look(server.url, offline=False, width=1000, height=700)
            page.evaluate("lab.explorer.editor.switch(true)")
            if part:
                page.get_by_label("Part", exact=True).select_option(part)
            page.get_by_label("length", exact=True).fill(length)
            page.get_by_label("length", exact=True).press("Enter")
            page.evaluate("document.getElementById('edit-send').click()")
            until(page, "document.getElementById('panel').textContent.includes('checked by numpy, Pinocchio, MuJoCo')")
            yield rebuilder.design, page
        finally:
            rebuilder.end()


@pytest.mark.browser
def test_an_edit_in_the_live_page_comes_back_checked(look: Callable[..., Any], until: Callable[..., None]) -> None:
    """A typed length goes to Python as the parameter it is; the page of that design says what the witnesses found."""
    with edited(load_design("fourbar", {}), look, until, "120mm") as (built, page):
        assert built.parameters.crank == 0.12
        lengths = page.evaluate("lab.explorer.model.document.bodies.map(b => b.shapes[0].size.length)")
        assert lengths[0] == pytest.approx(0.12, abs=1e-15)


@pytest.mark.browser
def test_a_model_without_parameters_is_built_and_checked_too(look: Callable[..., Any], until: Callable[..., None]) -> None:
    """The edited model itself goes to Python: a coupler of 320 mm closes to the rocker angle of the law of cosines."""
    own = from_json(to_json(ml.load("fourbar").mechanism()))
    with edited(load_design(own, {}), look, until, "320mm", "coupler") as (built, _):
        m = built.mechanism()
    home = {n: float(m.value(n, m.reference())) for n in ("crank_angle", "rocker_angle")}
    pin = 0.1 * np.exp(1j * home["crank_angle"]) - 0.3
    inner = np.arccos((abs(pin) ** 2 + 0.25**2 - 0.32**2) / (2 * abs(pin) * 0.25))
    # the saved text has 17 digits, the closure 1e-12
    assert home["rocker_angle"] == pytest.approx(np.angle(pin) - inner, abs=1e-10)


def test_a_mechanism_that_only_has_the_name_of_an_entry_is_not_described_as_that_entry() -> None:
    """Another mass under the name fourbar: no parameter of the catalog's fourbar stands beside it."""
    editor = ml.edit(ml.load("fourbar"))
    editor.change_body("crank", mass=0.7)
    recording = ml.simulate(editor.build(), duration=0.01)
    assert recording.name == "fourbar"
    assert "mass_per_length" not in dict(run_story(recording).facts)
    assert "mass_per_length" in dict(run_story(ml.simulate("fourbar", duration=0.01)).facts)
