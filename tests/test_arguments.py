"""Calls with wrong arguments: the message names what is wrong, what is needed and what exists; and an angle that looks like degrees."""

from __future__ import annotations

import enum
import inspect
import pickle
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
        (lambda: ml.FrameTask(), ("FrameTask", "missing: frame, target", "Needed: frame, target")),  # type: ignore[call-arg]
        (lambda: ml.Range(0, hgh=1), ("Range", "Did you mean 'high'?")),  # type: ignore[call-arg]
        (lambda: ml.Quantity(1.0), ("Quantity", "missing: unit")),  # type: ignore[call-arg]
        (lambda: ml.Builder(), ("Builder", "missing: name")),  # type: ignore[call-arg]
        (lambda: ml.simulate(scene="x", lenght=2), ("simulate", "missing: source")),  # type: ignore[call-arg]
        (lambda: ml.gallery("a", nmaes=1), ("gallery", "Did you mean 'names'?")),  # type: ignore[call-arg]
        (lambda: ml.environment("fivebar", rewrd=1), ("missing: reward", "Did you mean 'reward' by 'rewrd'?")),  # type: ignore[call-arg, arg-type]
        (lambda: ml.to_json(), ("to_json", "missing: mechanism")),  # type: ignore[call-arg]
    ],
)
def test_what_is_wrong_is_named(call: Callable[[], object], words: tuple[str, ...]) -> None:
    with pytest.raises(ml.MechlabError) as error:
        call()
    assert isinstance(error.value, TypeError)  # as Python itself would say
    assert all(word in str(error.value) for word in words)


def takes_arguments(name: str) -> bool:
    """Classes and functions; of the classes not errors, enumerations and protocols, which nobody makes."""
    found = getattr(ml, name)
    is_class = isinstance(found, type)
    return callable(found) and not (is_class and (issubclass(found, BaseException | enum.Enum) or getattr(found, "_is_protocol", False)))


@pytest.mark.parametrize("name", [n for n in dir(ml) if takes_arguments(n)])
def test_every_public_name_says_what_it_needs(name: str) -> None:
    """Against Python's own signature: what has no default is named as missing, and a strange argument is one."""
    called = getattr(ml, name)
    own = inspect.signature(called).parameters.values()
    needed = [p for p in own if p.default is p.empty and p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
    if needed:
        with pytest.raises(ml.MechlabError, match="missing: " + ", ".join(p.name for p in needed)):
            called()
    if not any(p.kind is p.VAR_KEYWORD for p in own):
        with pytest.raises(ml.MechlabError, match="argument 'nonsense' does not exist"):
            called(*(None for p in needed if p.kind is not p.KEYWORD_ONLY), nonsense=1)


@pytest.mark.parametrize(
    ("call", "option"),
    [
        (lambda: ml.view("fourbar", htlm="x.html"), "html"),
        (lambda: ml.optimize("fourbar", minimise="crank"), "minimize"),
        (lambda: ml.modes("fourbar", fidelty="full"), "fidelity"),
    ],
)
def test_an_option_that_is_spelled_wrong_is_asked_for(call: Callable[[], object], option: str) -> None:
    with pytest.raises(ml.MechlabError, match=f"Did you mean the option '{option}'"):
        call()


def test_an_option_with_a_value_that_does_not_fit_is_not_asked_for() -> None:
    with pytest.raises(ml.MechlabError, match="expected 40 or more, got 20") as found:
        ml.optimize("pendulum", {"length": (0.5, 1.0)}, maximize="length", evaluations=20)
    assert "Did you mean" not in str(found.value)


def test_a_public_name_that_is_spelled_wrong_is_asked_for() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'laod'. Did you mean 'load'\?"):
        ml.laod  # noqa: B018


def test_what_is_explained_can_be_sent_to_another_process() -> None:
    assert pickle.loads(pickle.dumps(ml.solve)) is ml.solve
    sent = pickle.loads(pickle.dumps((ml.Quantity(0.1, "m"), ml.Range(0.0, 1.0, 3))))
    assert sent == (0.1, ml.Range(0.0, 1.0, 3)) and sent[0].unit == "m"


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
