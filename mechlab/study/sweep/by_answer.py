"""Points that are questions: the closed form takes many at once, engines one after the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.errors import EngineMissing, MechlabError
from mechlab.experiment.question import Answer, Question
from mechlab.mechanism import Status
from mechlab.study.ask import ask, generic_question
from mechlab.study.design import Design
from mechlab.study.sweep.block import NO_SOLUTION, Block
from mechlab.study.sweep.request import Request

PARTS = 4
"""Where one of many points has no answer, and the closed form does not say which, they are asked again in so many parts, down
to single points."""
DIFFERENCE = "max_difference"
"""As a quantity: the largest difference between any two witnesses."""


def question_of(design: Design, keys: set[str], given: Mapping[str, Any]) -> Question:
    """The question that the keys ask: one of the entry's, or the generic one. Raises MechlabError for other keys."""
    fits = [q for q in design.entry.questions if set(q.given) <= keys <= set(q.given) | set(q.optional)]
    return max(fits, key=lambda q: len(q.given)) if fits else generic_question(design, given)


def closed_form(request: Request, design: Design, where: np.ndarray, rest: Mapping[str, Any], out: Block) -> None:
    """All points of a group at once, in parts where some have no answer."""
    question = question_of(design, set(rest), rest)
    witness = question.witnesses[request.witness]
    fixed = {k: v for k, v in question.optional.items() if v is not None and k not in rest}
    arrays = {k: v for k, v in rest.items() if np.ndim(v)}
    fixed |= {k: v for k, v in rest.items() if not np.ndim(v)}

    def part(points: np.ndarray) -> None:
        single = len(points) == 1
        nodes = {k: float(v[points[0]]) if single else v[points] for k, v in arrays.items()}
        try:
            said = witness(design.parameters, fixed | nodes)
            whole = all(q.name in said.values for q in request.quantities)
            if said.status.exit_code == 0 and not said.cannot and (whole or single):
                _take(request, said, where[points], out)
                return
        except (MechlabError, ArithmeticError, TypeError, ValueError, np.linalg.LinAlgError) as cause:
            if single or isinstance(cause, EngineMissing):
                out.failed(where[points], cause)
                return
        else:
            if single:
                _refused(said, where[points], out)
                return
            if said.status.exit_code and said.solved is not None and not np.all(said.solved):
                solved = np.broadcast_to(said.solved, points.shape)
                _refused(said, where[points[~solved]], out)
                if np.any(solved):
                    part(points[solved])
                return
        for some in np.array_split(points, min(PARTS, len(points))):
            part(some)

    part(np.arange(len(where)))


def one_by_one(request: Request, design: Design, where: np.ndarray, rest: Mapping[str, Any], out: Block) -> None:
    """Each point is asked by itself: one witness, or all of them where their difference is wanted."""
    for i, at in enumerate(where):
        given = {k: float(v[i]) if np.ndim(v) else v for k, v in rest.items()}
        spot = np.array([at])
        try:
            if any(q.name == DIFFERENCE for q in request.quantities):
                answers = ask(design, given)
                said = answers.answers[request.witness]
                difference = answers.max_difference
                if answers.status.exit_code and not said.status.exit_code:
                    said = next(a for a in answers.answers.values() if a.status is answers.status and not a.cannot)
                if difference is not None and said.values:
                    said = Answer(said.values | {DIFFERENCE: difference}, said.status, said.notes, cannot=said.cannot)
            else:
                question = question_of(design, set(given), given)
                optional = {k: v for k, v in question.optional.items() if v is not None}
                said = question.witnesses[request.witness](design.parameters, optional | given)
        except (Exception, SystemExit) as cause:  # one point must not end the others
            out.failed(spot, cause)
            continue
        if said.cannot or said.status.exit_code or not said.values:
            _refused(said, spot, out)
        else:
            _take(request, said, spot, out)


def _refused(said: Answer, where: np.ndarray, out: Block) -> None:
    if said.cannot:
        raise EngineMissing(f"the witness cannot answer: {said.cannot}")
    if not said.status.exit_code:
        labels = ", ".join(str(m.get("label", k)) for k, m in enumerate(said.modes))
        text = f"there are several modes ({labels}) and no single value" if said.modes else "no value was answered"
        out.gap(where, NO_SOLUTION, text)
        return
    out.gap(where, said.status.exit_code, "; ".join([said.status.value, *said.notes]))


def _take(request: Request, said: Answer, where: np.ndarray, out: Block) -> None:
    missing = []
    for k, quantity in enumerate(request.quantities):
        value = said.values.get(quantity.name)
        if value is None:
            missing.append(quantity.name)
            continue
        numbers = np.asarray(value, dtype=float)
        if numbers.shape not in ((), where.shape):
            raise MechlabError(f"{quantity.name} is no single number (its shape is {numbers.shape}); ask for others.")
        out.values[where, k] = numbers
    values = out.values[where]
    empty = ~np.isfinite(values)
    if not empty.any():
        return
    out.values[where] = np.where(empty, np.nan, values)
    names = np.array([q.label for q in request.quantities])
    for i in np.flatnonzero(empty.any(axis=1)):
        text = f"{', '.join(names[empty[i]])}: no finite value here ({said.status.value})"
        note = f"; {'; '.join(said.notes)}" if said.notes and len(where) == 1 else ""
        if empty[i].all():
            out.gap(where[i], NO_SOLUTION, text + note)
        else:
            out.gap(where[i], Status.SOLVED.exit_code, text + note)
