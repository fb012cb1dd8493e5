"""Computes one block of a sweep: closed forms and answers of the engines for many points at once; runs and checks point by point.

Every scheduler calls the same function, `evaluate`, so that all give bitwise equal numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mechlab.errors import EngineMissing, MechlabError
from mechlab.experiment.question import Answer, Answers
from mechlab.lab.ask import ask, ask_at_points
from mechlab.lab.design import Design
from mechlab.lab.run import run_scene
from mechlab.mechanism import Status
from mechlab.studies.named.answers import (
    answer_in_parts,
    in_bulk,
    nodes_at,
    question_taking,
    witness_answer,
    witness_answers,
)
from mechlab.studies.named.number import varied
from mechlab.studies.named.runs import distrust, measured_check, number_of_run
from mechlab.studies.sweep.request import (
    ANSWERS,
    CLOSED_FORM,
    NO_SOLUTION,
    ROLLOUT,
    UNTRUSTED,
    SweepBlock,
    SweepRequest,
)
from mechlab.studies.sweep.rollout import Group, roll_block

DIFFERENCE = "max_difference"
"""Name of the quantity that is the largest difference between any two witnesses."""


def closed_form(
    request: SweepRequest, design: Design, where: np.ndarray, rest: Mapping[str, Any], out: SweepBlock
) -> None:
    """Compute all points of a group at once; where some have no answer, in parts."""
    question = question_taking(design, set(rest), rest)
    arrays = {k: v for k, v in rest.items() if np.ndim(v)}
    fixed = {k: v for k, v in rest.items() if not np.ndim(v)}
    answer_in_parts(
        np.arange(len(where)),
        lambda points: witness_answer(question, design, fixed | nodes_at(arrays, points), request.witness),
        lambda answer: all(q.name in answer.values for q in request.quantities),
        lambda points, answer: _take(request, answer, where[points], out),
        lambda points, answer: _refused(answer, where[points], out),
        lambda points, cause: out.failed(where[points], cause),
    )


def answers_at_points(
    request: SweepRequest, design: Design, where: np.ndarray, rest: Mapping[str, Any], out: SweepBlock
) -> None:
    """Ask the question at each point, together where the witness can: one witness, or all where their difference is a quantity."""
    together = _together(request, design, rest, len(where))
    for i, at in enumerate(where):
        spot = np.array([at])
        try:
            answer = together[i] if together is not None else _answer(request, design, _at_point(rest, i))
        except (Exception, SystemExit) as cause:  # one point must not end the others
            out.failed(spot, cause)
            continue
        if answer.cannot or answer.status.exit_code or not answer.values:
            _refused(answer, spot, out)
        else:
            _take(request, answer, spot, out)


def _at_point(rest: Mapping[str, Any], i: int) -> dict[str, Any]:
    return {k: float(v[i]) if np.ndim(v) else v for k, v in rest.items()}


def _together(request: SweepRequest, design: Design, rest: Mapping[str, Any], count: int) -> Sequence[Answer] | None:
    """An answer for each point; None where the witness takes one point after the other, or a point raises."""
    try:
        question = question_taking(design, set(rest), rest)
        if any(q.name == DIFFERENCE for q in request.quantities):
            if not any(in_bulk(question, w) for w in question.witnesses):
                return None
            return [_compared(request, x) for x in ask_at_points(design, rest, count)]
        witness = request.witness or next(iter(question.witnesses))
        return witness_answers(question, design, rest, witness, count) if in_bulk(question, witness) else None
    except (MechlabError, ArithmeticError, TypeError, ValueError, np.linalg.LinAlgError):
        return None


def _answer(request: SweepRequest, design: Design, given: Mapping[str, Any]) -> Answer:
    """The answer at one point."""
    if any(q.name == DIFFERENCE for q in request.quantities):
        return _compared(request, ask(design, given))
    return witness_answer(question_taking(design, set(given), given), design, given, request.witness)


def _compared(request: SweepRequest, answers: Answers) -> Answer:
    """The answer of the witness, with the difference of all; that of the worst where it does not answer."""
    answer, difference = answers.answers[request.witness], answers.max_difference
    if answers.status.exit_code and not answer.status.exit_code:
        answer = next(a for a in answers.answers.values() if a.status is answers.status and not a.cannot)
    if difference is not None and answer.values:
        answer = Answer(answer.values | {DIFFERENCE: difference}, answer.status, answer.notes, cannot=answer.cannot)
    return answer


def _refused(answer: Answer, where: np.ndarray, out: SweepBlock) -> None:
    if answer.cannot:
        raise EngineMissing(f"the witness cannot answer: {answer.cannot}")
    if not answer.status.exit_code:
        labels = ", ".join(str(m.get("label", k)) for k, m in enumerate(answer.modes))
        text = f"there are several modes ({labels}) and no single value" if answer.modes else "no value was answered"
        out.gap(where, NO_SOLUTION, text)
        return
    out.gap(where, answer.status.exit_code, "; ".join([answer.status.value, *answer.notes]))


def _take(request: SweepRequest, answer: Answer, where: np.ndarray, out: SweepBlock) -> None:
    missing = []
    for k, quantity in enumerate(request.quantities):
        value = answer.values.get(quantity.name)
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
        text = f"{', '.join(names[empty[i]])}: no finite value here ({answer.status.value})"
        note = f"; {'; '.join(answer.notes)}" if answer.notes and len(where) == 1 else ""
        if empty[i].all():
            out.gap(where[i], NO_SOLUTION, text + note)
        else:
            out.gap(where[i], Status.SOLVED.exit_code, text + note)


STEP_ERROR = "step_error"
"""The finding that needs extra runs; it is computed only where it is a quantity of the sweep."""


def runs_one_by_one(
    request: SweepRequest, design: Design, where: np.ndarray, rest: Mapping[str, Any], out: SweepBlock
) -> None:
    """Run each point, and the checks of its design."""
    for i, at in enumerate(where):
        extra = {k: float(v[i]) if np.ndim(v) else float(v) for k, v in rest.items()}
        try:
            _point(request, design, extra, int(at), out)
        except (Exception, SystemExit) as cause:  # one point must not end the others
            out.values[at] = np.nan
            out.failed(at, cause)


def _point(request: SweepRequest, design: Design, extra: Mapping[str, float], at: int, out: SweepBlock) -> None:
    values = np.full(len(request.quantities), np.nan)
    wrong: tuple[str, ...] = ()
    if any(q.of_run for q in request.quantities):
        estimate = any(q.name == STEP_ERROR for q in request.quantities)
        recording = run_scene(
            design, request.scene, engine=request.engine, fidelity=request.fidelity, duration=request.duration,
            timestep=request.timestep, extra=extra, estimate=estimate,
        )  # fmt: skip
        wrong = distrust(recording)
        for k, quantity in enumerate(request.quantities):
            if quantity.of_run and not (wrong and quantity.kind == "channel"):
                values[k] = number_of_run(quantity, design, recording)
    measured: dict[str, Any] = {}
    for k, quantity in enumerate(request.quantities):
        if quantity.of_check:
            if quantity.name not in measured:
                measured[quantity.name] = measured_check(design, quantity.name)
            found = measured[quantity.name]
            values[k] = found.difference if quantity.kind == "difference" else float(found.passed)
    out.values[at] = values
    if wrong:
        out.gap(at, UNTRUSTED, wrong[0])


_bases: dict[str, Design] = {}


def evaluate(request: SweepRequest, block: int, threads: int = 1) -> SweepBlock:
    """The numbers of a block. threads: number of the engine's own threads; the numbers do not depend on it.

    An error at a point is recorded in the block; raises MechlabError only for an error that concerns all points.
    """

    out = SweepBlock.empty(request.span(block)[1] - request.span(block)[0], len(request.quantities))
    together: list[Group] = []
    for where, changes, rest in groups(request, block):
        try:
            made = varied(base(request), dict(sorted(changes.items())))
        except MechlabError as cause:
            out.failed(where, cause)
            continue
        if request.method == CLOSED_FORM:
            closed_form(request, made, where, rest, out)
        elif request.method == ANSWERS:
            answers_at_points(request, made, where, rest, out)
        elif request.method == ROLLOUT:
            together.append((where, made, rest))
        else:
            runs_one_by_one(request, made, where, rest, out)
    for where, made, given in roll_block(request, together, out, threads):
        runs_one_by_one(request, made, where, given, out)
    return out


def base(request: SweepRequest) -> Design:
    """The design with the fixed parameters; loaded once in a process."""
    if request.fingerprint not in _bases:
        _bases.clear()
        _bases[request.fingerprint] = request.load(request.source, **request.parameters)
    return _bases[request.fingerprint]


def groups(request: SweepRequest, block: int) -> Iterator[tuple[np.ndarray, dict[str, Any], dict[str, Any]]]:
    """Groups of points of a block that share a design: indices in the block (m,), changed parameters, and the other
    given values, each a number or an array (m,) of an axis."""
    places = request.places(block)
    outer = [a for a in request.work if a.role == "parameter"]
    inner = [a for a in request.work if a.role != "parameter"]
    tables = {a.key: np.array([float(x) for x in a.values]) for a in inner}
    start, stop = request.span(block)
    steps = np.zeros(stop - start, dtype=bool)
    for axis in outer:
        steps[1:] |= np.diff(places[axis.key]) != 0
    for where in np.split(np.arange(stop - start), np.flatnonzero(steps)):
        changes = {a.key: a.values[int(places[a.key][where[0]])] for a in outer}
        varied: Mapping[str, Any] = {k: table[places[k][where]] for k, table in tables.items()}
        yield where, changes, dict(request.given) | dict(varied)
