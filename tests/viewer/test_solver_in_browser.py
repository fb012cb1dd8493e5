"""The page's solver in a browser: the same checks as in Node on a few events for each mechanism, and its speed there."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mechlab.formats.mechanism_json import to_json
from tests.viewer.solver_witness import MECHANISMS, Witness, mechanism_of

EVENTS = 4

READ = """document => {
  window.model = new lab.PageModel(document);
  window.solver = new lab.PoseSolver(model);
  return model.drives;
}"""
SOLVE = "wish => ({ ...solver.solve(wish), q: Array.from(solver.q) })"
MEDIAN = """([name, span, count]) => {
  const home = model.value(name, model.home), times = [];
  const others = Object.fromEntries(model.drives.map((drive) => [drive, model.value(drive, model.home)]));
  for (let k = 0; k < count; k++) {
    const began = performance.now();
    for (let n = 0; n < 5; n++) solver.solve({ drives: { ...others, [name]: home + span * Math.sin(0.37 * (5 * k + n)) } });
    times.push((performance.now() - began) / 5); // the browser's clock ticks in 0.1 ms
  }
  return times.sort((a, b) => a - b)[count >> 1];
}"""
"""Median time [ms] of a solve while a drive goes to and fro about home by `span`."""


@pytest.fixture(scope="module")
def page(look: Callable[..., Any], page_file: Path) -> Any:
    """A page, whose solver reads one model after another."""
    return look(page_file.as_uri())


@pytest.mark.parametrize(("name", "fidelity"), MECHANISMS)
def test_sliders_and_drags(page: Any, name: str, fidelity: str | None) -> None:
    m = mechanism_of(name, fidelity)
    rng = np.random.default_rng(29)
    witness = Witness(m, tuple(page.evaluate(READ, json.loads(to_json(m)))))
    q = m.reference()
    for _ in range(EVENTS):
        wish = witness.wish(rng, q)
        report = page.evaluate(SOLVE, wish)
        witness.check(q, wish, report)
        q = np.array(report["q"])


@pytest.mark.parametrize(
    ("name", "fidelity", "drive", "span", "most"),
    [("delta6", "full", "q1", 0.02, 4.0), ("delta6", "full", "phi1", 0.5, 4.0), ("fivebar", None, "left_angle", 0.3, 0.1)],
)
def test_a_solve_takes_a_fraction_of_a_picture(
    page: Any, name: str, fidelity: str | None, drive: str, span: float, most: float
) -> None:
    """Milliseconds: 45 coordinates and 36 rows in less than 4, 4 coordinates in less than 0.1."""
    page.evaluate(READ, json.loads(to_json(mechanism_of(name, fidelity))))
    page.evaluate(MEDIAN, [drive, span, 60])  # the browser compiles
    assert page.evaluate(MEDIAN, [drive, span, 101]) < most
