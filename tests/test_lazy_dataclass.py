"""Classes whose methods are compiled late are those of the standard library in everything that can be seen of them."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
import subprocess
import sys
from dataclasses import InitVar, field
from typing import Any, ClassVar

import pytest

from mechlab.lazy_dataclass import _lazy

DECORATORS = (dataclasses.dataclass, _lazy)


def family(dataclass: Any) -> dict[str, type]:
    """Classes of every kind that the decorator treats differently."""

    @dataclass(frozen=True)
    class Point:
        """A point."""

        x: float
        y: float = 1.0
        kind: ClassVar[str] = "point"

    @dataclass(frozen=True)
    class Named(Point):
        """A point with a name, a list and a derived number."""

        names: list[str] = field(default_factory=list)
        scale: InitVar[float] = 2.0
        far: float = field(init=False, default=0.0, compare=False)

        def __post_init__(self, scale: float) -> None:
            object.__setattr__(self, "far", scale * self.x)

    @dataclass(frozen=True)
    class Quiet(Point):
        """With a list of its own, a text of its own and equality of its own."""

        more: list[int] = field(default_factory=lambda: [1])

        def __repr__(self) -> str:
            return "quiet"

        def __eq__(self, other: object) -> bool:
            return isinstance(other, Quiet) and self.x == other.x

    @dataclass(frozen=True, eq=False, repr=False)
    class Bare:
        """Compared by identity."""

        x: float

    @dataclass
    class Open:
        """Can be changed, cannot be hashed."""

        x: float
        tags: dict[str, int] = field(default_factory=dict)

    return {c.__name__: c for c in (Point, Named, Quiet, Bare, Open)}


def outcome(do: Any) -> object:
    """What a call gives, or the kind and the words of its error, without the name of the enclosing function."""
    try:
        got = do()
    except Exception as error:
        return type(error), str(error).replace("family.<locals>.", "")
    return str(got).replace("family.<locals>.", "") if not isinstance(got, (bool, int, float)) else got


SEEN = {
    "fields": lambda c: [(f.name, f.type, f.default, f.init, f.compare) for n in c for f in dataclasses.fields(c[n])],
    "signatures": lambda c: [inspect.signature(c[n]) for n in c],
    "match": lambda c: [c[n].__match_args__ for n in c],
    "is": lambda c: [dataclasses.is_dataclass(c[n]) for n in c],
    "made": lambda c: [c["Point"](1), c["Named"](2.0, names=["a"], scale=3.0), c["Quiet"](3), c["Open"](4)],
    "derived": lambda c: c["Named"](2.0, scale=5.0).far,
    "wrong": lambda c: c["Point"](),
    "unknown": lambda c: c["Point"](1, z=2),
    "equal": lambda c: [c["Point"](1) == x for x in (c["Point"](1), c["Point"](2), c["Quiet"](1))],
    "identity": lambda c: c["Bare"](1) == c["Bare"](1),
    "hash": lambda c: [hash(c["Point"](1)) == hash((1, 1.0)), hash(c["Quiet"](1)) == hash((1, 1.0, [1]))],
    "unhashable": lambda c: hash(c["Open"](1)),
    "quiet": lambda c: c["Quiet"](7) == c["Quiet"](7),
    "assign": lambda c: setattr(c["Point"](1), "x", 2),
    "assign other": lambda c: setattr(c["Point"](1), "z", 2),
    "assign added": lambda c: setattr(c["Named"](1), "names", []),
    "delete": lambda c: delattr(c["Named"](1), "x"),
    "open": lambda c: [setattr(o := c["Open"](1), "x", 5), o],
    "defaults": lambda c: [c["Point"].y, c["Named"].far, hasattr(c["Quiet"], "more") or hasattr(c["Quiet"](1), "more")],
    "replace": lambda c: dataclasses.replace(c["Point"](1), y=9),
    "dict": lambda c: dataclasses.asdict(c["Open"](1, {"a": 1})),
    "copy": lambda c: copy.deepcopy(c["Quiet"](1)).more,
    "heir": lambda c: dataclasses.make_dataclass("Heir", [("z", int, 3)], bases=(c["Point"],), frozen=True)(1),
    "open heir": lambda c: dataclasses.make_dataclass("Heir", [("z", int, 3)], bases=(c["Point"],)),
    "plain heir": lambda c: setattr(type("Plain", (c["Point"],), {})(1), "w", 1),
    "plain heir, field": lambda c: setattr(type("Plain", (c["Point"],), {})(1), "x", 1),
}  # fmt: skip


@pytest.mark.parametrize("what", SEEN)
def test_all_that_is_seen_of_a_class_is_as_the_standard_library_makes_it(what: str) -> None:
    """Each question is the first one that a class is asked."""
    theirs, ours = (outcome(lambda d=d: SEEN[what](family(d))) for d in DECORATORS)
    assert ours == theirs


def test_a_wrapper_around_a_class_not_yet_complete_stays_and_shows_the_signature() -> None:
    point = family(_lazy)["Point"]
    call, calls = point.__init__, list[float]()  # type: ignore[misc]

    def wrapper(self: Any, *args: Any, **keywords: Any) -> None:
        calls.append(args[0])
        call(self, *args, **keywords)

    point.__init__ = wrapper  # type: ignore[misc]
    assert [point(1), point(2)] == [point(1), point(2)]
    assert calls == [1, 2, 1, 2]
    assert list(inspect.signature(call).parameters) == ["self", "x", "y"]


def test_an_object_that_another_process_made_is_compared_without_being_made() -> None:
    """Unpickling calls no __init__: equality is the first that a class is asked."""
    code = (
        "import sys, pickle; a, b = (pickle.loads(bytes.fromhex(x)) for x in sys.argv[1:]); "
        "assert a == b and repr(a) == repr(b) and hash(a) == hash(b)"
    )
    from mechlab.experiment.recording import Finding

    finding = pickle.dumps(Finding("gap", 1.0, 2.0, "m", "ok", "small")).hex()
    subprocess.run([sys.executable, "-c", code, finding, finding], check=True)
