"""Numbers that are answers: which question takes the given keys, the answer of one witness, and answers at many points at once."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np

from mechlab.errors import EngineMissing, MechlabError, unknown
from mechlab.experiment.question import Answer, Question, WitnessInBulk, answers_at
from mechlab.lab.ask import generic_question
from mechlab.lab.design import Design

PARTS = 4
"""Points of which some have no answer are divided into this many parts, recursively, down to single points."""
PREFERRED = ("analytic", "pinocchio", "mujoco")
"""The witness that answers where none is named: the first of these that the question has."""


def question_taking(design: Design, keys: Collection[str], given: Mapping[str, Any]) -> Question:
    """The question that takes exactly these keys: one of the entry's, or the generic one.

    Raises MechlabError, listing what exists, for other keys.
    """
    asked = set(keys)
    fits = [q for q in design.entry.questions if set(q.given) <= asked <= set(q.given) | set(q.optional)]
    return max(fits, key=lambda q: len(q.given)) if fits else generic_question(design, given)


def chosen_witness(question: Question, witness: str | None, owner: str) -> str:
    """The named witness of the question, default the first of PREFERRED, else its first. Raises MechlabError."""
    if witness is None:
        return next((w for w in PREFERRED if w in question.witnesses), next(iter(question.witnesses)))
    if witness not in question.witnesses:
        raise unknown(f"{owner}: witness", witness, question.witnesses)
    return witness


def witness_answer(question: Question, design: Design, given: Mapping[str, Any], witness: str = "") -> Answer:
    """The answer of one witness (default: the first); keys that are not given take the defaults of the question."""
    defaults = {k: v for k, v in question.optional.items() if v is not None}
    function = question.witnesses[witness] if witness else next(iter(question.witnesses.values()))
    return function(design.parameters, defaults | dict(given))


def in_bulk(question: Question, witness: str) -> bool:
    """Whether the witness answers many points together, with an answer for each."""
    return isinstance(question.witnesses[witness], WitnessInBulk)


def witness_answers(
    question: Question, design: Design, given: Mapping[str, Any], witness: str, count: int
) -> Sequence[Answer]:
    """An answer of one witness for each of `count` points, given as numbers or arrays (count,)."""
    defaults = {k: v for k, v in question.optional.items() if v is not None}
    return answers_at(question.witnesses[witness], design.parameters, defaults | dict(given), count)


def single_number(design: Design, name: str, answer: Answer) -> float:
    """One answer as a float. Raises MechlabError where it is missing, an array, or not finite."""
    if name not in answer.values:
        raise unknown(f"{design.name}: answer", name, answer.values)
    value = np.asarray(answer.values[name], dtype=float)
    if value.size != 1 or not np.all(np.isfinite(value)):
        raise MechlabError(f"{design.name}: {name} is not one finite number: {value!r}.")
    return float(value.ravel()[0])


def nodes_at(arrays: Mapping[str, np.ndarray], points: np.ndarray) -> dict[str, Any]:
    """Key -> its values at points (m,) of arrays (n,); a float each for a single point."""
    if len(points) == 1:
        return {k: float(v[points[0]]) for k, v in arrays.items()}
    return {k: v[points] for k, v in arrays.items()}


def answer_in_parts(
    points: np.ndarray,
    ask: Callable[[np.ndarray], Answer],
    complete: Callable[[Answer], bool],
    take: Callable[[np.ndarray, Answer], None],
    refuse: Callable[[np.ndarray, Answer], None],
    fail: Callable[[np.ndarray, Exception], None],
) -> None:
    """Ask at all points (m,) together, and in parts where some have no answer, so that every point is taken, refused or
    fails once.

    ask(points): the answer there; complete(answer): whether it has all that is needed. take: points with an answer;
    refuse: points without one, or whose witness cannot answer; fail: a point whose question raises, and EngineMissing.
    Where the answer says which points are solved, those are asked again together.
    """
    single = len(points) == 1
    try:
        answer = ask(points)
        if not (answer.status.exit_code or answer.cannot) and (single or complete(answer)):
            take(points, answer)
            return
    except (MechlabError, ArithmeticError, TypeError, ValueError, np.linalg.LinAlgError) as cause:
        if single or isinstance(cause, EngineMissing):
            fail(points, cause)
            return
    else:
        if single or answer.cannot:
            refuse(points, answer)
            return
        if answer.status.exit_code and answer.solved is not None and not np.all(answer.solved):
            solved = np.broadcast_to(answer.solved, points.shape)
            refuse(points[~solved], answer)
            if np.any(solved):
                answer_in_parts(points[solved], ask, complete, take, refuse, fail)
            return
    for part in np.array_split(points, min(PARTS, len(points))):
        answer_in_parts(part, ask, complete, take, refuse, fail)
