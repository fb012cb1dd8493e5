"""Results of the verbs are data: each has one line for a shell, the text of the command line, and HTML for a notebook."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

import pytest

import mechlab as ml
from mechlab.values import Range

RESULTS: dict[str, tuple[Callable[[], Any], str]] = {
    "cycle": (lambda: ml.cycle("fourbar", points=6), "Cycle of fourbar: 7 positions of crank_angle"),
    "claims": (lambda: ml.claims("gear_linkage"), "10 claims: 6 holds, 1 holds only if"),
    "modes": (lambda: ml.modes("pendulum"), "Modes of pendulum, the reference pose: 1 mode: 1 oscillating"),
    "stability": (
        lambda: ml.stability("pendulum", methods="RK4", budget=1, gravity=Range(1.0, 9.0, 2)),
        "Stability of pendulum",
    ),
    "sweep": (lambda: ml.sweep("fourbar", crank_angle=Range(0.0, 1.0, 3)), "Sweep of fourbar: 3 of 3 points are good"),
    "sensitivity": (lambda: ml.sensitivity("fourbar", crank_angle=1.0), "Sensitivity: "),
    "workspace": (
        lambda: ml.workspace("fivebar", P_x=Range(-0.3, 0.3, 3), P_y=Range(0.0, 0.4, 3)),
        "Workspace of fivebar",
    ),
    "synthesize": (lambda: ml.synthesize("planetary", ratio=6), "Synthesis of planetary: "),
    "doctor": (lambda: ml.doctor("pendulum"), "Diagnosis of pendulum"),
}


@pytest.mark.parametrize("verb", RESULTS)
def test_a_result_has_a_line_a_text_and_html(verb: str) -> None:
    make, start = RESULTS[verb]
    result = make()
    assert repr(result).startswith(start) and "\n" not in repr(result)
    assert str(result) == result.text() and "\n" in result.text()
    html = result._repr_html_()
    assert html.startswith("<pre>") and escape(result.text()) in html
