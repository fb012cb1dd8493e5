"""Points that are questions: the closed form takes many at once, engines one after the other.

Points that are simulations or checks: one after the other, each with its own health record.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.errors import EngineMissing, MechlabError, Untrustworthy, unknown
from mechlab.experiment.question import Answer, Question
from mechlab.experiment.recording import Recording
from mechlab.lab.ask import ask, generic_question
from mechlab.lab.design import Design
from mechlab.lab.fidelity.choose import run_chosen
from mechlab.mechanism import Status
from mechlab.mechanism.geometry import Array
from mechlab.studies.check.check import checks_of
from mechlab.studies.sweep.request import NO_SOLUTION, UNTRUSTED, Block, Quantity, Request

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


def answers_one_by_one(
    request: Request, design: Design, where: np.ndarray, rest: Mapping[str, Any], out: Block
) -> None:
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


STEP_ERROR = "step_error"
"""The finding that takes more runs; it is made only where it is asked for."""


def runs_one_by_one(request: Request, design: Design, where: np.ndarray, rest: Mapping[str, Any], out: Block) -> None:
    """The run of each point, and the checks of its design."""
    for i, at in enumerate(where):
        extra = {k: float(v[i]) if np.ndim(v) else float(v) for k, v in rest.items()}
        try:
            _point(request, design, extra, int(at), out)
        except (Exception, SystemExit) as cause:  # one point must not end the others
            out.values[at] = np.nan
            out.failed(at, cause)


def _point(request: Request, design: Design, extra: Mapping[str, float], at: int, out: Block) -> None:
    values = np.full(len(request.quantities), np.nan)
    bad = ""
    if any(q.of_run for q in request.quantities):
        estimate = any(q.name == STEP_ERROR for q in request.quantities)
        recording = run_chosen(
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
    """A check of the entry, or a generic one where it has none of its own; raises MechlabError that lists them."""
    checks = {c.id: c for c in checks_of(design.entry)}
    if id not in checks:
        raise unknown(f"{design.name}: check", id, checks)
    return checks[id]


def of_recording(quantity: Quantity, design: Design, recording: Recording) -> float:
    """A quantity of a run."""
    if quantity.kind == "trusted":
        return float(recording.health.trusted)
    if quantity.kind == "finding":
        found = {f.name: f.value for f in recording.health.findings}
        if quantity.name not in found:
            raise Untrustworthy(f"this run has no finding {quantity.name!r}; it has {', '.join(sorted(found))}.")
        return float(found[quantity.name])
    return reduced(quantity.reduce, recording.t, channel(design, recording, quantity.name))


def channel(design: Design, recording: Recording, name: str) -> Array:
    """(n,) a channel of the run, or one of the entry that the scene does not ask for."""
    if name not in recording.channels and name in design.entry.channels:
        return np.asarray(design.entry.channels[name][1](design.parameters, recording))
    return recording.channel(name)


def reduced(how: str, t: Array, values: Array) -> float:
    """final, max, min, mean or rms (over time, by the trapezoidal rule) of a channel (n,) at times t (n,)."""
    x = np.asarray(values, dtype=float)
    if how == "final":
        return float(x[-1])
    if how in ("max", "min"):
        return float(np.max(x) if how == "max" else np.min(x))
    span = float(t[-1] - t[0])
    if not span > 0.0:
        raise MechlabError(f"a {how} over time needs a run that lasts.")
    if how == "mean":
        return float(np.trapezoid(x, t)) / span
    return float(np.sqrt(np.trapezoid(x * x, t) / span))


REDUCTIONS = ("final", "max", "min", "mean", "rms")
