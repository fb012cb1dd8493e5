"""Computes one block of a sweep: closed forms for many points at once; answers, runs and checks point by point.

Every scheduler calls the same function, `evaluate`, so that all give bitwise equal numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mechlab.errors import EngineMissing, MechlabError, Untrustworthy, unknown
from mechlab.experiment.question import Answer, Question
from mechlab.experiment.recording import Recording
from mechlab.lab.ask import ask, generic_question
from mechlab.lab.design import Design, design
from mechlab.lab.run import run_scene
from mechlab.mechanism import Status
from mechlab.mechanism.geometry import Array
from mechlab.studies.check.check import checks_of
from mechlab.studies.named import witness_answer
from mechlab.studies.sweep.request import (
    ANSWERS,
    CLOSED_FORM,
    NO_SOLUTION,
    ROLLOUT,
    UNTRUSTED,
    SweepBlock,
    SweepQuantity,
    SweepRequest,
    reduced,
)
from mechlab.studies.sweep.rollout import roll_block

PARTS = 4
"""When some points have no answer and the closed form does not say which, they are divided into this many parts,
recursively, down to single points."""
DIFFERENCE = "max_difference"
"""Name of the quantity that is the largest difference between any two witnesses."""


def question_of(design: Design, keys: set[str], given: Mapping[str, Any]) -> Question:
    """The question that takes these keys: one of the entry's, or the generic one. Raises MechlabError for other
    keys."""
    fits = [q for q in design.entry.questions if set(q.given) <= keys <= set(q.given) | set(q.optional)]
    return max(fits, key=lambda q: len(q.given)) if fits else generic_question(design, given)


def closed_form(
    request: SweepRequest, design: Design, where: np.ndarray, rest: Mapping[str, Any], out: SweepBlock
) -> None:
    """Compute all points of a group at once; where some have no answer, in parts."""
    question = question_of(design, set(rest), rest)
    arrays = {k: v for k, v in rest.items() if np.ndim(v)}
    fixed = {k: v for k, v in rest.items() if not np.ndim(v)}

    def part(points: np.ndarray) -> None:
        single = len(points) == 1
        nodes = {k: float(v[points[0]]) if single else v[points] for k, v in arrays.items()}
        try:
            answer = witness_answer(question, design, fixed | nodes, request.witness)
            whole = all(q.name in answer.values for q in request.quantities)
            if answer.status.exit_code == 0 and not answer.cannot and (whole or single):
                _take(request, answer, where[points], out)
                return
        except (MechlabError, ArithmeticError, TypeError, ValueError, np.linalg.LinAlgError) as cause:
            if single or isinstance(cause, EngineMissing):
                out.failed(where[points], cause)
                return
        else:
            if single:
                _refused(answer, where[points], out)
                return
            if answer.status.exit_code and answer.solved is not None and not np.all(answer.solved):
                solved = np.broadcast_to(answer.solved, points.shape)
                _refused(answer, where[points[~solved]], out)
                if np.any(solved):
                    part(points[solved])
                return
        for some in np.array_split(points, min(PARTS, len(points))):
            part(some)

    part(np.arange(len(where)))


def answers_one_by_one(
    request: SweepRequest, design: Design, where: np.ndarray, rest: Mapping[str, Any], out: SweepBlock
) -> None:
    """Ask the question at each point: one witness, or all where their difference is a quantity."""
    for i, at in enumerate(where):
        given = {k: float(v[i]) if np.ndim(v) else v for k, v in rest.items()}
        spot = np.array([at])
        try:
            if any(q.name == DIFFERENCE for q in request.quantities):
                answers = ask(design, given)
                answer = answers.answers[request.witness]
                difference = answers.max_difference
                if answers.status.exit_code and not answer.status.exit_code:
                    answer = next(a for a in answers.answers.values() if a.status is answers.status and not a.cannot)
                if difference is not None and answer.values:
                    answer = Answer(
                        answer.values | {DIFFERENCE: difference}, answer.status, answer.notes, cannot=answer.cannot
                    )
            else:
                question = question_of(design, set(given), given)
                answer = witness_answer(question, design, given, request.witness)
        except (Exception, SystemExit) as cause:  # one point must not end the others
            out.failed(spot, cause)
            continue
        if answer.cannot or answer.status.exit_code or not answer.values:
            _refused(answer, spot, out)
        else:
            _take(request, answer, spot, out)


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
    bad = ""
    if any(q.of_run for q in request.quantities):
        estimate = any(q.name == STEP_ERROR for q in request.quantities)
        recording = run_scene(
            design, request.scene, engine=request.engine, fidelity=request.fidelity, duration=request.duration,
            timestep=request.timestep, extra=extra, estimate=estimate,
        )  # fmt: skip
        bad = next((f.sentence for f in recording.health.findings if f.severity == "error"), "")
        for k, quantity in enumerate(request.quantities):
            if quantity.of_run and not (bad and quantity.kind == "channel"):
                values[k] = of_recording(quantity, design, recording)
    measured: dict[str, Any] = {}
    for k, quantity in enumerate(request.quantities):
        if quantity.of_check:
            if quantity.name not in measured:
                measured[quantity.name] = check(design, quantity.name).run(design.parameters)
            found = measured[quantity.name]
            values[k] = found.difference if quantity.kind == "difference" else float(found.passed)
    out.values[at] = values
    if bad:
        out.gap(at, UNTRUSTED, bad)


def check(design: Design, id: str) -> Any:
    """The check `id`, of the entry or generic; raises MechlabError, listing the checks, for an unknown one."""
    checks = {c.id: c for c in checks_of(design.entry)}
    if id not in checks:
        raise unknown(f"{design.name}: check", id, checks)
    return checks[id]


def of_recording(quantity: SweepQuantity, design: Design, recording: Recording) -> float:
    """The value of a quantity in a run. Raises Untrustworthy where the run lacks the finding."""
    if quantity.kind == "trusted":
        return float(recording.health.trusted)
    if quantity.kind == "finding":
        found = {f.name: f.value for f in recording.health.findings}
        if quantity.name not in found:
            raise Untrustworthy(f"this run has no finding {quantity.name!r}; it has {', '.join(sorted(found))}.")
        return float(found[quantity.name])
    return reduced(quantity.reduce, recording.t, channel(design, recording, quantity.name))


def channel(design: Design, recording: Recording, name: str) -> Array:
    """A channel (n,) of the run, or one of the entry that the scene does not record."""
    if name not in recording.channels and name in design.entry.channels:
        return np.asarray(design.entry.channels[name][1](design.parameters, recording))
    return recording.channel(name)


_bases: dict[str, Design] = {}


def evaluate(request: SweepRequest, block: int, threads: int = 1) -> SweepBlock:
    """The numbers of a block. threads: number of the engine's own threads; the numbers do not depend on it.

    An error at a point is recorded in the block; raises MechlabError only for an error that concerns all points.
    """

    out = SweepBlock.empty(request.span(block)[1] - request.span(block)[0], len(request.quantities))
    for where, changes, rest in groups(request, block):
        try:
            made = with_parameters(base(request), tuple(sorted(changes.items())))
        except MechlabError as cause:
            out.failed(where, cause)
            continue
        if request.method == CLOSED_FORM:
            closed_form(request, made, where, rest, out)
        elif request.method == ANSWERS:
            answers_one_by_one(request, made, where, rest, out)
        elif request.method == ROLLOUT:
            roll_block(request, made, where, rest, out, threads)
        else:
            runs_one_by_one(request, made, where, rest, out)
    return out


def base(request: SweepRequest) -> Design:
    """The design with the fixed parameters; loaded once in a process."""
    if request.fingerprint not in _bases:
        _bases.clear()
        _bases[request.fingerprint] = request.load(request.source, **request.parameters)
    return _bases[request.fingerprint]


def with_parameters(chosen: Design, changes: tuple[tuple[str, Any], ...]) -> Design:
    """The design with changed parameters."""
    return design(chosen.entry, dict(chosen.given) | dict(changes)) if changes else chosen


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
