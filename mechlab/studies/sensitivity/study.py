"""Derivatives of the answers of every witness by every input, and the tolerances of the answers that follow."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.question import Answers
from mechlab.lab.ask import ask, in_si, numeric
from mechlab.lab.design import Design
from mechlab.mechanism.geometry import Array
from mechlab.studies.sensitivity.derivatives import Slope, ToleranceCorners, corners, slope
from mechlab.studies.sensitivity.inputs import AnswerInput, Tolerances, check_names, inputs_of
from mechlab.studies.sensitivity.result import AnswerDerivative, AnswerTolerance, Sensitivity

ROUNDING = 1e-6
"""Added to the change by all inputs together when witnesses are compared, so that rounding of zero changes does not
count."""


def sensitivity(
    base: Design,
    asked: Mapping[str, Any],
    tolerance: Tolerances | None = None,
    only: Sequence[str] = (),
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Sensitivity:
    """First-order sensitivity of every answer of every witness to every parameter that is a number.

    asked: as for `mechlab.lab.ask.ask`. A given quantity with a tolerance is an input too. Angles are compared modulo 2
    pi. only: inputs by name, default all. progress(done, total) counts inputs. Raises what `ask` raises. Where no
    answer exists on one side of an input its derivative is one-sided; on both sides, it is left out with a note. With
    tolerances, the ends and corners of their box are solved too (`mechlab.studies.sensitivity.derivatives`).
    """
    chosen = tolerance or Tolerances()
    given = {k: numeric(k, v) for k, v in in_si(base, asked).items()}
    answers = ask(base, given)
    if answers.exit_code:
        return Sensitivity(answers, {})
    also = [k for k in chosen.named if k in given and np.ndim(given[k]) == 0]
    inputs, skipped = inputs_of(base, given, answers.units, also)
    layout = _Layout(answers)
    if not layout.slots:
        raise MechlabError(
            f"{base.name}: the question {answers.question!r} has no answers that are numbers; a list of modes has no derivative."
        )
    check_names(only, inputs, skipped, base.name, "derivative")
    inputs = tuple(i for i in inputs if not only or i.name in only or i.key in only)
    widths = chosen.half_widths(inputs, skipped, base.name)
    slopes = {}
    for k, item in enumerate(inputs):
        slopes[item.name] = _slope(base, given, item, layout)
        progress(k + 1, len(inputs))
    notes = _notes(slopes)
    cells = {a: _row(a, layout, answers, inputs, slopes) for a in layout.names}
    box = _box(base, given, inputs, layout, cells, widths) if widths else None
    spreads = {a: _spread(row, widths, box.worst[a]) for a, row in cells.items()} if box is not None else {}
    apart = _apart(cells, {i.name: i.size for i in inputs})
    return Sensitivity(answers, cells, spreads, widths, {i.name: i.unit for i in inputs}, skipped, apart, notes, box)


class _Layout:
    """Places of the answers of all witnesses in one flat array."""

    def __init__(self, answers: Answers) -> None:
        self.angles = answers.angles
        self.slots: dict[tuple[str, str], tuple[slice, tuple[int, ...]]] = {}
        parts: list[Array] = []
        at = 0
        for witness, answer in answers.answers.items():
            for key, value in answer.values.items():
                array = np.asarray(value, dtype=float)
                self.slots[witness, key] = (slice(at, at + array.size), array.shape)
                parts.append(array.ravel())
                at += array.size
        self.reference = np.concatenate(parts) if parts else np.zeros(0)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the answers, each once."""
        return tuple(dict.fromkeys(key for _, key in self.slots))

    def change(self, answers: Answers) -> Array:
        """Differences from the reference as a flat array; angles modulo 2 pi; NaN where a witness has no answer."""
        out = np.full(len(self.reference), np.nan)
        for (witness, key), (where, shape) in self.slots.items():
            answer = answers.answers.get(witness)
            value = None if answer is None or answer.status.exit_code else answer.values.get(key)
            if value is not None and np.shape(value) == shape:
                out[where] = np.ravel(np.asarray(value, dtype=float)) - self.reference[where]
                if key in self.angles:
                    out[where] = (out[where] + np.pi) % (2.0 * np.pi) - np.pi
        return out


def _slope(base: Design, given: Mapping[str, Any], item: AnswerInput, layout: _Layout) -> Slope:
    def change(by: float) -> Array:
        try:
            moved, asked = item.moved(base, given, by)
            return layout.change(ask(moved, asked))
        except MechlabError:
            return np.full(len(layout.reference), np.nan)

    return slope(change, item.size, layout.reference)


def _row(
    answer: str, layout: _Layout, answers: Answers, inputs: tuple[AnswerInput, ...], slopes: Mapping[str, Slope]
) -> dict[str, AnswerDerivative]:
    """The derivatives of one answer; inputs without a derivative are left out."""
    out = {}
    for item in inputs:
        found = slopes[item.name]
        by: dict[str, tuple[Any, Any]] = {}
        for (witness, key), (where, shape) in layout.slots.items():
            if key == answer and np.all(np.isfinite(found.value[where])):
                value, error = found.value[where].reshape(shape), found.error[where].reshape(shape)
                by[witness] = (value, error) if shape else (float(value), float(error))
        if by:
            first = next(iter(by))
            value, error = by[first]
            size = np.asarray(answers[first][answer], dtype=float)
            with np.errstate(divide="ignore", invalid="ignore"):
                relative = np.where(size != 0.0, item.value * np.asarray(value) / size, np.nan)
            plain: Any = relative if relative.ndim else (None if np.isnan(relative) else float(relative))
            out[item.name] = AnswerDerivative(value, error, plain, {w: v for w, (v, _) in by.items()}, found.sides == 1)
    return out


def _box(
    base: Design,
    given: Mapping[str, Any],
    inputs: Sequence[AnswerInput],
    layout: _Layout,
    cells: Mapping[str, Mapping[str, AnswerDerivative]],
    widths: Mapping[str, float],
) -> ToleranceCorners:
    """Solutions at the corners of the tolerances, each answer from the first witness that has it."""
    by_name = {i.name: i for i in inputs}
    first = {key: place for (_, key), place in reversed(layout.slots.items())}

    def change(steps: Mapping[str, float]) -> dict[str, Array]:
        moved, asked = base, dict(given)
        try:
            for name, step in steps.items():
                moved, asked = by_name[name].moved(moved, asked, step)
            flat = layout.change(ask(moved, asked))
        except MechlabError:
            flat = np.full(len(layout.reference), np.nan)
        return {key: flat[where].reshape(shape) for key, (where, shape) in first.items()}

    return corners(widths, {a: {p: c.derivative for p, c in row.items()} for a, row in cells.items()}, change)


def _spread(row: Mapping[str, AnswerDerivative], widths: Mapping[str, float], corner: Array) -> AnswerTolerance:
    shares = {p: np.abs(row[p].derivative) * t for p, t in widths.items() if p in row}
    values = list(shares.values())
    worst = sum(values, np.float64(0.0))
    square = np.sqrt(sum((v**2 for v in values), np.float64(0.0)))
    if np.ndim(worst) == 0:
        return AnswerTolerance(float(worst), float(square), {p: float(v) for p, v in shares.items()}, float(corner))
    return AnswerTolerance(worst, square, shares, corner)


def _apart(cells: Mapping[str, Mapping[str, AnswerDerivative]], sizes: Mapping[str, float]) -> float | None:
    """Largest difference of dA/dp size(p) between witnesses, relative to the sum of |dA/dp| size(p) over all inputs."""
    worst: float | None = None
    for row in cells.values():
        changes = [sizes[p] * np.max(np.abs(list(c.witnesses.values())), axis=0) for p, c in row.items()]
        whole = sum(changes, np.float64(ROUNDING))
        for p, cell in row.items():
            values = [np.asarray(v) for v in cell.witnesses.values()]
            if len(values) > 1:
                gap = np.max([np.abs(v - values[0]) for v in values[1:]], axis=0) * sizes[p]
                worst = max(worst or 0.0, float(np.max(gap / whole, initial=0.0)))
    return worst


def _notes(slopes: Mapping[str, Slope]) -> tuple[str, ...]:
    one = [p for p, s in slopes.items() if s.sides == 1]
    none = [p for p, s in slopes.items() if s.sides == 0]
    return tuple(
        f"{text}: {', '.join(names)}"
        for names, text in (
            (one, "one-sided, because no answer exists on the other side"),
            (none, "no derivative, because no answer exists beside the value"),
        )
        if names
    )
