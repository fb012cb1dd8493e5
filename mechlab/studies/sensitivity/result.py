"""The result of a sensitivity study: derivatives of answers by inputs, from each witness, and tolerances of answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

import numpy as np

from mechlab.experiment.question import Answers
from mechlab.lazy_dataclass import dataclass
from mechlab.results import Shown
from mechlab.studies.sensitivity.derivatives import NAMED, ToleranceCorners

APART = 1e-3
"""Largest difference of derivatives between witnesses that is trusted, relative to the change by all inputs
together."""


LINEAR = 0.1
"""Largest relative error of the worst case to first order, against the solutions at the corners, that is trusted."""
SMALLEST = 1e-9
"""Changes of an answer below this [unit of the answer] are rounding and are not compared."""


@dataclass(frozen=True)
class AnswerDerivative:
    """Derivative of an answer A by an input p: dA/dp, its estimated error, and p/A dA/dp (None where A is 0), from the
    first witness that has it; `witnesses`: dA/dp of each. Arrays for an answer that is an array."""

    derivative: Any
    error: Any
    relative: Any
    witnesses: Mapping[str, Any]
    one_sided: bool = False

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        out = {"derivative": self.derivative, "relative": self.relative, "error": self.error}
        return out | {"witnesses": dict(self.witnesses)} | ({"one_sided": True} if self.one_sided else {})


@dataclass(frozen=True)
class AnswerTolerance:
    """Tolerance of an answer to first order: worst_case = sum |dA/dp| t, root_sum_square = sqrt(sum (dA/dp t)^2);
    shares: what each input adds to the worst case. at_corners: the largest change among true solutions at the ends and corners."""

    worst_case: Any
    root_sum_square: Any
    shares: Mapping[str, Any]
    at_corners: Any

    @property
    def is_linear(self) -> bool:
        """True when the worst case to first order equals the one at the corners within `LINEAR`."""
        first, true = np.asarray(self.worst_case, dtype=float), np.asarray(self.at_corners, dtype=float)
        return bool(np.all(np.abs(first - true) <= LINEAR * true + SMALLEST))

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "worst_case": self.worst_case, "root_sum_square": self.root_sum_square, "contributions": dict(self.shares),
            "at_corners": self.at_corners, "linear": self.is_linear,
        }  # fmt: skip


@dataclass(frozen=True, repr=False)
class Sensitivity(Shown):
    """Sensitivities. cells: answer -> input -> derivative; spreads: answer -> tolerance; widths: input -> half width
    used; max_difference: largest difference of a derivative between witnesses, relative to sum_p |dA/dp| size(p)."""

    answers: Answers
    cells: Mapping[str, Mapping[str, AnswerDerivative]]
    spreads: Mapping[str, AnswerTolerance] = field(default_factory=dict)
    widths: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    skipped: Mapping[str, str] = field(default_factory=dict)
    max_difference: float | None = None
    notes: tuple[str, ...] = ()
    box: ToleranceCorners | None = None

    def __getitem__(self, answer: str) -> Mapping[str, AnswerDerivative]:
        return self.cells[answer]

    @property
    def exit_code(self) -> int:
        """That of the answers; at least 3 when witnesses disagree on a derivative or the linear tolerances fail."""
        return max(self.answers.exit_code, 3 if self._apart or self.bent else 0)

    @property
    def _apart(self) -> bool:
        return self.max_difference is not None and self.max_difference > APART

    @property
    def bent(self) -> str:
        """A sentence on where the tolerances to first order fail; empty where they hold."""
        if self.box is not None and self.box.missing:
            more = f" and {len(self.box.missing) - NAMED} more" if len(self.box.missing) > NAMED else ""
            return f"within the tolerances there is no answer at {'; '.join(self.box.missing[:NAMED])}{more}"
        off = {a: s for a, s in self.spreads.items() if not s.is_linear}
        if not off:
            return ""
        name = max(off, key=lambda a: size_of(off[a].at_corners))
        spread = off[name]
        return (
            f"tolerances to first order fail by more than {100 * LINEAR:g} % for {', '.join(off)}: {name} changes by up to "
            f"{size_of(spread.at_corners):.6g} at the corners, to first order by {size_of(spread.worst_case):.6g}"
        )

    @property
    def message(self) -> str:
        """What the answers depend on, in one sentence."""
        if self.answers.exit_code:
            return f"{self.answers.to_dict()['message']}; there is no answer to take a derivative of"
        if not self.units:
            return f"no parameter is a number that can vary ({reasons(self.skipped)}): the answers have no tolerance"
        used = [p for p in self.units if any(np.any(c[p].derivative != 0) for c in self.cells.values() if p in c)]
        if not used:
            return f"the answers depend on none of {', '.join(self.units)}"
        if self.bent:
            return f"{self.bent}: do not trust them"
        if self.exit_code:
            return f"the derivatives of the witnesses differ by {self.max_difference:.3g} of the whole change: do not trust them"
        return f"{len(self.cells)} answers depend on {len(used)} of {len(self.units)} inputs: {', '.join(used)}"

    def to_dict(self) -> dict[str, Any]:
        """The answers, then `sensitivity` and `tolerance`."""
        table_ = {a: {p: c.to_dict() for p, c in row.items()} for a, row in self.cells.items()}
        return self.answers.to_dict() | {
            "sensitivity": table_, "sensitivity_difference": self.max_difference,
            "tolerance": {a: s.to_dict() for a, s in self.spreads.items()}, "input_tolerances": dict(self.widths),
            "corners": None if self.box is None else {"solved": self.box.solved, "all": self.box.whole, "missing": list(self.box.missing)},
            "skipped": dict(self.skipped), "notes": list(self.notes), "message": self.message,
        }  # fmt: skip


def reasons(skipped: Mapping[str, str]) -> str:
    """The parameters that are no inputs, each with its reason."""
    return ", ".join(f"{k} ({why})" for k, why in skipped.items()) or "there is none"


def size_of(value: Any) -> float:
    """The largest size of a number or of the entries of an array; NaN counts as 0."""
    return float(np.nanmax(np.abs(np.nan_to_num(np.asarray(value, dtype=float))), initial=0.0))
