"""Calls with wrong arguments: the message names what is wrong, what is needed and what exists; and an angle that looks like degrees."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import mechlab as ml
from mechlab.experiment.laws.protocol import LAWS


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: ml.Motor(), ("Motor", "missing: on, stall, no_load_rate")),  # type: ignore[call-arg]
        (lambda: ml.Motor("a", stal=1, no_load_rate=2), ("Motor", "'stal'", "Did you mean 'stall'?")),  # type: ignore[call-arg]
        (lambda: ml.Motor("a", 1, 2, 3), ("Motor", "too many", "on, stall, no_load_rate")),  # type: ignore[call-arg]
        (lambda: ml.Sine(), ("Sine", "missing: amplitude, frequency", "optional: phase, offset")),  # type: ignore[call-arg]
        (lambda: ml.Spring("a", "b"), ("Spring", "missing: body_b")),  # type: ignore[call-arg]
        (lambda: ml.Inertia(mas=1), ("Inertia", "Did you mean 'mass'?")),  # type: ignore[call-arg]
        (lambda: ml.Settings(timstep=1), ("Settings", "Did you mean 'timestep'?")),  # type: ignore[call-arg]
        (lambda: ml.belt("a"), ("belt", "radius_b")),  # type: ignore[call-arg]
        (lambda: ml.Builder("x").bar("a", ml.revolute("b"), 1, lenth=2), ("Builder.bar", "'length'")),  # type: ignore[call-arg]
    ],
)
def test_what_is_wrong_is_named(call: Callable[[], object], words: tuple[str, ...]) -> None:
    with pytest.raises(ml.MechlabError) as error:
        call()
    assert isinstance(error.value, TypeError)  # as Python itself would say
    assert all(word in str(error.value) for word in words)


@pytest.mark.parametrize("kind", LAWS)
def test_no_law_answers_with_a_bare_type_error(kind: str) -> None:
    with pytest.raises(ml.MechlabError, match="nonsense"):
        LAWS[kind](nonsense=1)


def test_an_error_inside_a_call_passes_unchanged() -> None:
    from mechlab.errors import explained

    @explained
    def fails(x: float) -> float:
        return x + "1"  # type: ignore[operator]

    with pytest.raises(TypeError, match="unsupported operand") as error:
        fails(1.0)
    assert not isinstance(error.value, ml.MechlabError)


@pytest.mark.parametrize(("given", "doubtful"), [(60, True), (-90.0, True), (12, False), (60.5, False), ("60deg", False)])
def test_an_angle_of_many_turns_is_asked_about(given: float | str, doubtful: bool) -> None:
    found = ml.solve("fourbar", crank_angle=given, crank_angle_rate=300)
    assert [w for w in found.warnings if "crank_angle" in w] == ([w for w in found.warnings if f"={given:g}deg" in w] if doubtful else [])
    assert bool(found.warnings) == doubtful and found.status.exit_code == 0  # a rate may be 300 rad/s


def test_arrays_and_lengths_are_left_alone() -> None:
    assert not ml.solve("fourbar", crank_angle=(20.0, 40.0)).warnings
    assert not ml.solve("slider_crank", crank_angle=1, crank_angle_rate=60).warnings
