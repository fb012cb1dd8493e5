"""Questions: given some quantities, get others, from each witness on its own. And the answers, compared."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.assembly import Status

Witness = Callable[[Any, Mapping[str, Any]], "Answer"]


@dataclass(frozen=True)
class Answer:
    """What one witness says: values by name, or modes (a list, each with a "label"), or `cannot` with a sentence."""

    values: dict[str, Any] = field(default_factory=dict)
    status: Status = Status.SOLVED
    notes: tuple[str, ...] = ()
    modes: tuple[dict[str, Any], ...] = ()
    cannot: str = ""
    details: dict[str, Any] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form: the values flat, then status, notes and what else there is."""
        if self.cannot:
            return {"cannot": self.cannot}
        out: dict[str, Any] = dict(self.values)
        if self.modes:
            out["modes"] = list(self.modes)
        if self.notes:
            out["notes"] = list(self.notes)
        return out | self.details


@dataclass(frozen=True)
class Question:
    """Chosen by the keys that are given: all of `given`, any of `optional` (with
    defaults; None: absent unless given). Answers `answers`.

    witnesses: name -> function(parameters, values) -> Answer. `angles` are answers that compare modulo 2 pi.
    """

    name: str
    given: tuple[str, ...]
    answers: tuple[str, ...]
    witnesses: Mapping[str, Witness]
    optional: Mapping[str, float | None] = field(default_factory=dict)
    angles: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    text: str = ""


@dataclass(frozen=True)
class Answers:
    """The answers of all witnesses to one question, and their largest difference over the values they share."""

    question: str
    answers: dict[str, Answer]
    angles: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    given: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    def __getitem__(self, witness: str) -> dict[str, Any]:
        return self.answers[witness].values

    @property
    def max_difference(self) -> float | None:
        """Largest difference of any value between any two witnesses; None when fewer than two share a value."""
        said = [a.values for a in self.answers.values() if not a.cannot and a.values]
        worst: float | None = None
        for i, a in enumerate(said):
            for b in said[i + 1 :]:
                for key in a.keys() & b.keys():
                    difference = np.asarray(a[key], dtype=float) - np.asarray(b[key], dtype=float)
                    if key in self.angles:
                        difference = (difference + np.pi) % (2 * np.pi) - np.pi
                    worst = max(worst or 0.0, float(np.max(np.abs(difference), initial=0.0)))
        return worst

    @property
    def status(self) -> Status:
        """The worst status of any witness that could answer."""
        said = [a.status for a in self.answers.values() if not a.cannot] or [Status.NOT_CONVERGED]
        return max(said, key=lambda s: (s.exit_code, s is not Status.SOLVED))

    @property
    def exit_code(self) -> int:
        """0 answered, 3 not to be trusted, 4 no solution exists."""
        return self.status.exit_code

    def _repr_html_(self) -> str:
        from mechlab.experiment.notebook import answers_html

        return answers_html(self)


def choose(questions: Sequence[Question], keys: set[str], owner: str) -> Question:
    """The question that these keys ask; raises MechlabError that lists what can be asked."""
    fits = [q for q in questions if set(q.given) <= keys <= set(q.given) | set(q.optional)]
    if fits:
        return max(fits, key=lambda q: len(q.given))
    known = {k for q in questions for k in (*q.given, *q.optional)}
    strange = sorted(keys - known)
    listing = "; ".join(
        f"{' '.join(q.given)}" + (f" [{' '.join(q.optional)}]" if q.optional else "") for q in questions
    )
    if strange:
        from mechlab.errors import unknown

        raise unknown(f"{owner}: quantity", strange[0], known)
    raise MechlabError(
        f"{owner}: these quantities make no question: {', '.join(sorted(keys)) or 'none given'}. One can give: {listing}."
    )


def one_spelling(questions: Sequence[Question], values: Mapping[str, Any], owner: str) -> dict[str, Any]:
    """The values under the names of the questions: X_angle_rate is X_rate (X_accel likewise) where a question about X_angle takes
    that. Raises MechlabError where both are given."""
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
