"""The table of all benchmarks: goals are judged by the number they name, and a section that fails is shown with its error."""

from __future__ import annotations

import math

import pytest

from tests.benchmarks import __main__ as table
from tests.benchmarks.before import BEFORE
from tests.benchmarks.rows import Row


def test_a_goal_is_of_the_ratio_or_of_the_value() -> None:
    assert Row("a", 2.0, "s", "loop", 1.0, "ratio <= 3").met
    assert not Row("a", 4.0, "s", "loop", 1.0, "ratio <= 3").met
    assert Row("a", 12000.0, "steps/s", "loop", math.nan, "value >= 1e4").met
    assert Row("a", 4.0, "s", "loop", math.nan, "ratio <= 3").met is None
    assert Row("a", 4.0, "s").met is None and math.isnan(Row("a", 4.0, "s").ratio)
    with pytest.raises(ValueError, match="ratio <= NUMBER"):
        Row("a", 4.0, "s", asked="fast")


def test_a_section_that_fails_stands_in_the_table_with_its_error(monkeypatch: pytest.MonkeyPatch) -> None:
    found = {
        "one": [Row("a | b", 2.0, "s", "loop", 1.0, "ratio <= 3"), Row("c", 1234.5, "us")],
        "two": "ValueError: no",
    }
    monkeypatch.setattr(table, "rows_of", lambda section, limit: found[section])
    text = table.report(["one", "two"], 1.0)
    assert "| a / b | 2 | s | loop | 1 | 2 | ratio ≤ 3 | yes |  |" in text
    assert "| c | 1,234 | us |  |  |  |  |  |  |" in text
    assert "**failed**: ValueError: no" in text and "1 of 1 goals are met" in text
    widths = {row.count("|") for row in text.splitlines() if row.startswith("|")}
    assert len(widths) == 1


def test_a_section_that_does_not_exist_is_an_error_of_its_own_process() -> None:
    assert "bench_nowhere" in str(table.rows_of("nowhere", 60.0))


def test_older_numbers_belong_to_known_sections() -> None:
    assert {section for section, _ in BEFORE} <= set(table.known_sections())
