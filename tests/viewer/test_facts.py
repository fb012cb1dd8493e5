"""Parameters in words."""

from __future__ import annotations

import math
from typing import Any

import pytest

from mechlab import api
from mechlab.viewer.facts import unit_words, value_words


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (0.1, "m", "0.1 m"),
        (None, "rad", "none"),
        (math.pi / 6, "rad", "0.523599 rad (30\u00b0)"),
        ((-math.pi / 6, 0.0, math.pi / 2), "rad", "\u22120.523599, 0, 1.5708 rad (\u221230, 0, 90\u00b0)"),
        (0.0, "rad", "0 rad"),
        (True, "", "yes"),
        (18, "", "18"),
        ("open", "m", "open"),
        (2e-6, "kg m2", "2\u00b710\u207b\u2076 kg\u00b7m\u00b2"),
        ((), "m", "none"),
        (9.81, "m/s2", "9.81 m/s\u00b2"),
    ],
)
def test_values_in_words(value: Any, unit: str, words: str) -> None:
    assert value_words(value, unit) == words


def test_units_in_words() -> None:
    assert [unit_words(u) for u in ("m3", "N m", "rad/s2", "kg/m", "")] == [
        "m\u00b3",
        "N\u00b7m",
        "rad/s\u00b2",
        "kg/m",
        "",
    ]


def test_no_page_has_raw_numbers() -> None:
    for name in ("platform_3rrr", "delta6"):
        for label, text in api.story(name).facts:
            assert "none " not in text and not any(
                len(word.strip("-,")) > 12 for word in text.split() if word[-1].isdigit()
            ), (label, text)
