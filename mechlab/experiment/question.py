"""Questions, which each witness answers independently: given some quantities, find others. And the compared answers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import MechlabError, explained, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.newton import Status
from mechlab.results import Shown
from mechlab.tables import listed

TOLERANCE = 1e-6
"""Default relative tolerance between witnesses: rounding is 1e-12, and near a singular position it grows to its square
root."""
ORDERS = ("_accel", "_rate")

Witness = Callable[[Any, Mapping[str, Any]], "Answer"]
"""witness(parameters, values) -> its answer."""


@dataclass(frozen=True)
class WitnessInBulk:
    """A witness that answers at many poses at once: many(parameters, values, count) -> an answer for each pose, where values are
    numbers or arrays (count,)."""

    many: Callable[[Any, Mapping[str, Any], int], Sequence[Answer]]

    def __call__(self, parameters: Any, values: Mapping[str, Any]) -> Answer:
        """The answer at one pose."""
        return self.many(parameters, values, 1)[0]


def answers_at(witness: Witness, parameters: Any, values: Mapping[str, Any], count: int) -> Sequence[Answer]:
    """An answer for each of `count` poses, given as numbers or arrays (count,): together where the witness can."""
    if isinstance(witness, WitnessInBulk):
        return witness.many(parameters, values, count)
    each = ({k: float(v[i]) if np.ndim(v) else v for k, v in values.items()} for i in range(count))
    return [witness(parameters, one) for one in each]


MOST_NAMES = 12
"""Quantities that a sentence names."""


@dataclass(frozen=True)
class Open:
    """Quantities that the given ones do not determine because of the same freedoms; `give`: a smallest set of keys that
    would."""

    quantities: tuple[str, ...]
    freedoms: tuple[str, ...]
    give: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """In words: which quantities are open, on which freedoms they depend, which keys to give."""
        names = listed(self.quantities, MOST_NAMES)
        one = len(self.quantities) == 1
        if self.quantities == self.freedoms:
            hangs = f"{names} {'moves on its' if one else 'move on their'} own"
        else:
            hangs = f"{names} {'hangs' if one else 'hang'} on {', '.join(self.freedoms)}"
        return f"{hangs}; give {' '.join(f'{k}=...' for k in self.give)}" if self.give else hangs

    def to_dict(self) -> dict[str, list[str]]:
        """JSON-able form."""
        return {"quantities": list(self.quantities), "freedoms": list(self.freedoms), "give": list(self.give)}


@explained
@dataclass(frozen=True)
class Answer:
    """The answer of one witness: values by name, or modes (a list, each with a "label"), or `cannot` with a sentence.

    open: quantities that what is given does not determine; idle: those that hang on local freedoms alone (the spin of a rod
    between two ball joints); neither has a value. assumed: what was taken for a key that was not given. solved (points,): of
    a question about many points, the ones that have an answer, where the status is not that of all.
    """

    values: dict[str, Any] = field(default_factory=dict)
    status: Status = Status.SOLVED
    notes: tuple[str, ...] = ()
    modes: tuple[dict[str, Any], ...] = ()
    cannot: str = ""
    details: dict[str, Any] = field(default_factory=dict)
    open: tuple[Open, ...] = ()
    idle: tuple[str, ...] = ()
    assumed: Mapping[str, float] = field(default_factory=dict)
    solved: NDArray[np.bool_] | None = None

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form: the values, then modes, notes and details."""
        if self.cannot:
            return {"cannot": self.cannot}
        out: dict[str, Any] = dict(self.values)
        if self.modes:
            out["modes"] = list(self.modes)
        if self.notes:
            out["notes"] = list(self.notes)
        return out | self.details


LENGTHS = ("m", "m/s", "m/s2")
"""Units of a length, its rate and its acceleration."""


@explained
@dataclass(frozen=True)
class Question:
    """A question with the answers `answers`. It is chosen by the given keys: all of `given`, any of `optional` (key ->
    default; None: no default).

    witnesses: name -> function(parameters, values) -> Answer. `angles`: answers that are compared modulo 2 pi. units:
    SI unit of every given or answered key ("" for a pure number). tolerance: largest difference between witnesses,
    relative to the largest value of the same unit; see `Answers.apart`.
    """

    name: str
    given: tuple[str, ...]
    answers: tuple[str, ...]
    witnesses: Mapping[str, Witness]
    optional: Mapping[str, float | None] = field(default_factory=dict)
    angles: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    text: str = ""
    tolerance: float = TOLERANCE


@explained
@dataclass(frozen=True, repr=False)
class Answers(Shown):
    """The answers of all witnesses to one question, and their largest difference over the values they share."""

    question: str
    answers: dict[str, Answer]
    angles: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    given: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    tolerance: float = TOLERANCE
    length: float = 1.0
    """Size of the mechanism [m], the scale for differences of lengths."""

    def __getitem__(self, witness: str) -> dict[str, float | NDArray[np.float64]]:
        if witness not in self.answers:
            raise unknown("witness", witness, self.answers)
        return self.answers[witness].values

    def __iter__(self) -> Iterator[str]:
        return iter(self.answers)

    @property
    def differences(self) -> dict[str, float]:
        """Largest difference of each value between any two witnesses that share it."""
        values = [a.values for a in self.answers.values() if not a.cannot and a.values]
        out: dict[str, float] = {}
        for i, a in enumerate(values):
            for b in values[i + 1 :]:
                for key in (k for k in a if k in b):
                    difference = np.asarray(a[key], dtype=float) - np.asarray(b[key], dtype=float)
                    if key in self.angles:
                        difference = (difference + np.pi) % (2 * np.pi) - np.pi
                    out[key] = max(out.get(key, 0.0), float(np.max(np.abs(difference), initial=0.0)))
        return out

    @property
    def max_difference(self) -> float | None:
        """Largest difference of any value between any two witnesses; None when fewer than two share a value."""
        return max(self.differences.values(), default=None)

    @property
    def apart(self) -> dict[str, float]:
        """Value -> difference, for values in which witnesses differ by more than the tolerance.

        The tolerance is relative to the largest value of the same unit, taken as at least 1e-3 [SI]; for a length, its
        rate and its acceleration as at least 1e-3 of the size of the mechanism.
        """
        found = self.differences
        largest: dict[str, float] = {}
        for key in found:
            both = [a.values[key] for a in self.answers.values() if not a.cannot and key in a.values]
            value = max(float(np.max(np.abs(np.asarray(x, dtype=float)), initial=0.0)) for x in both)
            floor = 1e-3 * (self.length if self.units.get(key) in LENGTHS else 1.0)
            largest[self._kind(key)] = max(largest.get(self._kind(key), floor), value)
        return {k: x for k, x in found.items() if not x <= self.tolerance * largest[self._kind(k)]}

    def _kind(self, key: str) -> str:
        """What is compared in size: values of one unit, or of one order of derivative where the unit is not known."""
        order = next((x for x in ORDERS if key.endswith(x)), "")
        return self.units.get(key, f"{'angle' if key in self.angles else 'value'}{order}")

    @property
    def open(self) -> tuple[Open, ...]:
        """Quantities that the given ones do not determine."""
        return next((a.open for a in self.answers.values() if a.open), ())

    @property
    def idle(self) -> tuple[str, ...]:
        """Quantities that depend on local freedoms alone."""
        return next((a.idle for a in self.answers.values() if a.idle), ())

    @property
    def assumed(self) -> dict[str, float]:
        """Key -> value used for keys that were not given."""
        return {k: x for a in self.answers.values() for k, x in a.assumed.items()}

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on open and idle quantities, on values used for keys not given, and on differences between
        witnesses."""
        out = [f"open: {x.sentence}" for x in self.open]
        if self.idle:
            out.append(f"idle: {', '.join(self.idle)}: parts that turn freely, on which nothing else hangs")
        if self.assumed:
            out.append("not given, taken: " + ", ".join(f"{k} = {x:g}" for k, x in self.assumed.items()))
        if self.apart:
            out.append("witnesses differ in " + ", ".join(f"{k} by {x:.3g}" for k, x in self.apart.items()))
        return tuple(out)

    @property
    def status(self) -> Status:
        """The worst status of the witnesses that could answer; DISAGREE where all answered but differ beyond the
        tolerance."""
        each = [a.status for a in self.answers.values() if not a.cannot] or [Status.NOT_CONVERGED]
        worst = max(each, key=lambda s: (s.exit_code, s is not Status.SOLVED))
        return Status.DISAGREE if worst.exit_code == 0 and self.apart else worst

    @property
    def exit_code(self) -> int:
        """0 answered, 3 not to be trusted, 4 no solution exists."""
        return self.status.exit_code

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        notes = [*(f"{name}: {note}" for name, a in self.answers.items() for note in a.notes), *self.remarks]
        status = self.status.value
        return {
            "question": self.question, "answers": {name: a.to_dict() for name, a in self.answers.items()},
            "max_difference": self.max_difference, "status": status, "open": [x.to_dict() for x in self.open],
            "idle": list(self.idle), "assumed": self.assumed, "parameters": dict(self.parameters), "given": dict(self.given),
            "warnings": list(self.warnings), "message": status + (f" ({'; '.join(notes)})" if notes else ""),
        }  # fmt: skip


def with_rates(units: Mapping[str, str]) -> dict[str, str]:
    """The units of quantities and of their rates and accelerations: X, X_rate, X_accel."""
    orders = {"": "", "_rate": "/s", "_accel": "/s2"}
    return {f"{name}{order}": unit + per for name, unit in units.items() for order, per in orders.items()}


def choose(questions: Sequence[Question], keys: set[str], owner: str) -> Question:
    """The question that takes these keys; raises MechlabError, listing the questions, where none does."""
    fits = [q for q in questions if set(q.given) <= keys <= set(q.given) | set(q.optional)]
    if fits:
        return max(fits, key=lambda q: len(q.given))
    known = {k for q in questions for k in (*q.given, *q.optional)}
    strange = sorted(keys - known)
    listing = "; ".join(
        f"{' '.join(q.given)}" + (f" [{' '.join(q.optional)}]" if q.optional else "") for q in questions
    )
    if strange:
        raise unknown(f"{owner}: quantity", strange[0], known)
    raise MechlabError(
        f"{owner}: these quantities make no question: {', '.join(sorted(keys)) or 'none given'}. One can give: {listing}."
    )


def one_spelling(questions: Sequence[Question], values: Mapping[str, Any], owner: str) -> dict[str, Any]:
    """The values under the names that the questions use: X_angle_rate becomes X_rate where a question takes X_rate
    (X_accel likewise). Raises MechlabError where both are given."""
    known = {k for q in questions if set(q.given) <= set(values) for k in q.optional}
    out: dict[str, Any] = {}
    for key, value in values.items():
        stem, _, what = key.rpartition("_")
        short = f"{stem.removesuffix('_angle')}_{what}"
        name = (
            short
            if stem.endswith("_angle") and what in ("rate", "accel") and short in known and key not in known
            else key
        )
        if name in out or (name != key and name in values):
            raise MechlabError(f"{owner}: {name} and {key} are one quantity: give it once.")
        out[name] = value
    return out
