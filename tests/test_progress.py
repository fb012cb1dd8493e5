"""Progress of long work: parts of it, and how far a synthesis says it is."""

import pytest

import mechlab as ml
from mechlab.progress import counted, part


def test_parts_make_up_the_whole() -> None:
    """Two parts of 30 % and 70 %, of two and of four steps: percent by hand."""
    heard: list[float] = []

    def hear(done: int, total: int) -> None:
        heard.append(100.0 * done / total)

    assert list(counted("ab", part(hear, 0, 30))) == ["a", "b"]
    assert list(counted([1, 2, 3, 4], part(hear, 30, 100))) == [1, 2, 3, 4]
    assert heard == pytest.approx([0.0, 15.0, 30.0, 30.0, 47.5, 65.0, 82.5, 100.0])
    assert [*counted([], part(hear, 30, 100))] == [] and heard[-1] == 30.0


@pytest.mark.parametrize(
    ("task", "given"),
    [
        ("straight_line", {"length": 0.1, "limit": 1}),
        ("dwell", {"angle": 2.0, "limit": 1}),
        ("path", {"x": [0.0, 0.1, 0.2, 0.25, 0.2], "y": [0.0, 0.03, 0.04, 0.1, 0.15], "limit": 1}),
        ("function", {"x": [1.0, 3.0, 9.0], "y": "log10(x)", "limit": 1}),
    ],
)  # fmt: skip
def test_a_search_for_dimensions_says_how_far_it_is(task: str, given: dict[str, object]) -> None:
    """Shares of the work from 0 upwards, never backwards, in steps from which the time left can be estimated."""
    heard: list[float] = []
    ml.synthesize(task, given, progress=lambda done, total: heard.append(done / total))  # type: ignore[arg-type]
    assert heard[0] == 0.0 and heard == sorted(heard) and 0.8 <= heard[-1] <= 1.0
    assert len(set(heard)) >= 10 and max(b - a for a, b in zip(heard, heard[1:], strict=False)) <= 0.5
