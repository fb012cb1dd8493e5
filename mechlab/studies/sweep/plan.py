"""Makes the request of a sweep from keys and words: its axes, its question or runs, and its quantities."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.parameters import checked, entry_units
from mechlab.experiment.question import Question
from mechlab.lab.ask import parameters_and_rest
from mechlab.lab.design import Design
from mechlab.lab.single_run import versions
from mechlab.studies.named.answers import chosen_witness, question_taking
from mechlab.studies.named.number import NamedNumber, parameter_infos, varied
from mechlab.studies.sweep.evaluate import DIFFERENCE
from mechlab.studies.sweep.quantities import (
    a_mechanism,
    answers_of,
    corners,
    distinct,
    known_initial_keys,
    quantities_of_runs,
    split_words,
)
from mechlab.studies.sweep.request import (
    ANSWERS,
    BACKENDS,
    CLOSED_FORM,
    ROLLOUT,
    RUNS,
    SweepAxis,
    SweepRequest,
    block_size,
)
from mechlab.studies.sweep.rollout import scene_of, why_not
from mechlab.values import Quantity as Written
from mechlab.values import Range, has_unit

MOST_NUMBERS = 200_000_000
"""Largest number of values of a sweep (1.6 GB)."""


def plan(
    base: Design,
    values: Mapping[str, Any],
    quantities: Sequence[str] = (),
    *,
    load: Callable[..., Design],
    source: Any,
    identity: str,
    witness: str | None = None,
    **run: Any,
) -> SweepRequest:
    """The request for these keys and quantities. run: scene, engine, fidelity, duration, timestep, backend.

    A range or a list is an axis; for a parameter that is itself a list, it is a fixed value. Raises MechlabError for
    unknown keys and quantities, listing what exists, and where there is no axis.
    """
    _refuse_too_many(base.name, values)
    if run.get("backend") not in (None, *BACKENDS):
        raise unknown(f"{base.name}: backend", run["backend"], BACKENDS)
    parameters, rest = parameters_and_rest(base.entry.parameters, values)
    infos = parameter_infos(base)
    axes: list[SweepAxis] = []
    fixed: dict[str, Any] = {}
    for key, value in parameters.items():
        points = None if infos[key].kind in ("numbers", "integers") else _points(key, value)
        if points is None:
            fixed[key] = value
        else:
            axes.append(SweepAxis(key, points, "parameter", infos[key].unit, infos[key].text))
    chosen = varied(base, fixed)
    mechanism_keys = known_initial_keys(chosen, axes) if rest else set()
    role = "initial" if set(rest) & mechanism_keys else "given"
    given: dict[str, Any] = {}
    for key, value in _checked(chosen, axes, rest).items():
        points = _points(key, value)
        if points is None:
            given[key] = _number(key, value)
        else:
            if any(isinstance(x, str) for x in points):
                raise MechlabError(f"{key}: expected numbers, got {', '.join(map(str, points))}.")
            axes.append(SweepAxis(key, tuple(float(x) for x in points), role, _unit(points)))
    order = [k for k in values if any(a.key == k for a in axes)]
    axes.sort(key=lambda a: order.index(a.key))
    if not axes:
        raise MechlabError(
            f"{base.name}: there is nothing to sweep: give at least one range, key=low:high:count, or list, key=a,b,c; "
            "or say --portrait KIND for a phase portrait."
        )
    count = math.prod(len(a.values) for a in axes)
    draft = SweepRequest(
        load, source, identity, base.name, tuple(axes), (), RUNS, 1, dict(base.given) | {k: chosen.given[k] for k in fixed}, given,
        versions=versions(), **run,
    )  # fmt: skip
    if role == "initial" and set(rest) - mechanism_keys:
        raise unknown(f"{base.name}: quantity", min(set(rest) - mechanism_keys), mechanism_keys | set(infos))
    question = None if role == "initial" else _question(chosen, axes, rest, given)
    draft = replace(draft, axes=tuple(_with_unit(a, question, chosen, axes) for a in axes))
    starts = [f"{k}_0 instead of {k}" for k in sorted(rest) if f"{k}_0" in mechanism_keys]
    request = _with_quantities(draft, chosen, question, quantities, witness, bool(rest) and role == "given", starts)
    _refuse_idle(request, sorted(rest), starts)
    if count * len(request.quantities) > MOST_NUMBERS:
        raise _too_many(base.name, count, len(request.quantities))
    return replace(request, block=block_size(request.method, count, _steps(request, chosen), request.backend))


def _steps(request: SweepRequest, chosen: Design) -> float:
    """Steps of a motion of a rollout, at the first of a few points that gives a design; 1 for other methods."""
    for one in corners(chosen, request.axes) if request.method == ROLLOUT else ():
        try:
            _, _, scene, settings = scene_of(request, one)
        except MechlabError:
            continue
        return max(1.0, scene.duration / settings.timestep)
    return 1.0


def _too_many(name: str, points: int, quantities: int) -> MechlabError:
    return MechlabError(
        f"{name}: {points} points of {quantities} quantities are more than fit into memory; take fewer."
    )


def _refuse_too_many(name: str, values: Mapping[str, Any]) -> None:
    """Raises MechlabError for more than MOST_NUMBERS points, before the values of the axes are made."""
    count = math.prod(x.count for x in values.values() if isinstance(x, Range) and x.count is not None)
    if count > MOST_NUMBERS:
        raise _too_many(name, count, 1)


def _points(key: str, value: Any) -> tuple[Any, ...] | None:
    """The values of an axis; None for a single value."""
    if isinstance(value, Range):
        points: tuple[Any, ...] = value.points()
        unit = getattr(value.low, "unit", None) or getattr(value.high, "unit", None)
        return tuple(Written(float(x), unit) for x in points) if unit else tuple(float(x) for x in points)
    if isinstance(value, np.ndarray) and value.ndim == 1:
        value = tuple(value.tolist())
    if isinstance(value, tuple | list | range):
        if not value:
            raise MechlabError(f"{key}: the list is empty.")
        return tuple(value)
    return None


def _number(key: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise MechlabError(f"{key}: expected a number, a range or a list, got {value!r}.") from None
    if not math.isfinite(number):
        raise MechlabError(f"{key}: expected a finite number, got {value!r}.")
    return number


def _checked(chosen: Design, axes: Sequence[SweepAxis], rest: Mapping[str, Any]) -> dict[str, Any]:
    """The keys that are no parameters; raises MechlabError for a unit that does not fit its key."""
    if not any(has_unit(v) or isinstance(v, str) for v in rest.values()):
        return dict(rest)
    found = a_mechanism(chosen, axes)
    return checked(rest, entry_units(chosen.entry, [] if found is None else [found]))


def _unit(points: Sequence[Any]) -> str:
    return next((u for x in points if (u := getattr(x, "unit", ""))), "")


def _with_unit(axis: SweepAxis, question: Question | None, chosen: Design, axes: Sequence[SweepAxis]) -> SweepAxis:
    """An axis of given quantities or initial values with the unit of the question or of the joint."""
    if axis.unit or axis.role == "parameter":
        return axis
    if question is not None and axis.key in question.units:
        return replace(axis, unit=question.units[axis.key])
    m = a_mechanism(chosen, axes)
    if m is None:
        return axis
    for suffix, turning, sliding in (
        ("_rate_0", "rad/s", "m/s"), ("_0", "rad", "m"), ("_force", "N m", "N"),
        ("_rate", "rad/s", "m/s"), ("_accel", "rad/s2", "m/s2"), ("", "rad", "m"),
    ):  # fmt: skip
        if axis.key.endswith(suffix) and axis.key.removesuffix(suffix) in m.scalar_names:
            name = axis.key.removesuffix(suffix)
            return replace(axis, unit=sliding if name in m.slides else turning)
    return axis


def _question(
    chosen: Design, axes: Sequence[SweepAxis], rest: Mapping[str, Any], given: Mapping[str, Any]
) -> Question | None:
    """The question that takes the given keys; without keys, the first that needs none, or None.

    Raises MechlabError for keys that fit no question.
    """
    first = dict(given) | {a.key: float(a.values[0]) for a in axes if a.role == "given"}
    if rest:
        cause: MechlabError | None = None
        for one in corners(chosen, axes):
            try:
                return question_taking(one, set(rest), first)
            except MechlabError as error:
                cause = cause or error
        assert cause is not None
        raise cause
    return next((q for q in chosen.entry.questions if not q.given), None)


def _with_quantities(
    draft: SweepRequest,
    chosen: Design,
    question: Question | None,
    quantities: Sequence[str],
    witness: str | None,
    answers_only: bool,
    starts: Sequence[str],
) -> SweepRequest:
    """The request with its quantities and its method of computation."""
    words = [w.strip() for q in quantities for w in split_words(str(q)) if w.strip()]
    by_witness = chosen_witness(question, witness, chosen.name) if question is not None else ""
    answers, left_open = answers_of(draft, chosen, question, by_witness) if question is not None else ({}, ())
    if answers_only or (words and question is not None and all(w in answers or w == DIFFERENCE for w in words)):
        assert question is not None
        if DIFFERENCE in words:
            answers[DIFFERENCE] = ""
        for word in words:
            for loose in (x for x in left_open if word in x.quantities):
                raise MechlabError(f"{chosen.name}: {word} is open: {loose.sentence}.")
            if word not in answers:
                strange = unknown(
                    f"{chosen.name}: {question.name}: answer of {by_witness}", word, {*answers, DIFFERENCE}
                )
                runs = f" Channels, findings and trusted are of runs: give {', '.join(starts)}." if starts else ""
                raise MechlabError(f"{strange}{runs}")
        chosen_quantities = tuple(NamedNumber(w, "answer", w, unit=answers[w]) for w in dict.fromkeys(words or answers))
        if not chosen_quantities:
            raise MechlabError(
                f"{chosen.name}: where {_words(draft)} is given nothing is left that {by_witness} answers with a number."
            )
        method = CLOSED_FORM if by_witness == "analytic" and DIFFERENCE not in words else ANSWERS
        return replace(draft, quantities=distinct(chosen_quantities, draft.axes), method=method, witness=by_witness)
    if witness is not None:
        raise MechlabError(f"{chosen.name}: --witness is for answers to a question; a simulation has --engine.")
    request = replace(draft, quantities=distinct(quantities_of_runs(draft, chosen, words), draft.axes))
    reason = "no point gives a design"
    for one in corners(chosen, draft.axes):
        try:
            reason = why_not(request, one)
        except MechlabError:
            continue
        if not reason:
            return replace(request, method=ROLLOUT)
        break
    if request.backend is not None and not all(q.of_check for q in request.quantities):
        raise MechlabError(f"{chosen.name}: --backend {request.backend} steps runs together, and these go one by one: {reason}.")
    return request


OF_RUNS = ("scene", "engine", "fidelity", "duration", "timestep", "backend")
"""Options that only simulations use."""


def _refuse_idle(request: SweepRequest, rest: Sequence[str], starts: Sequence[str]) -> None:
    """Raises MechlabError for options of runs in a sweep without runs, naming them. starts: keys that would make it one
    of runs."""
    asks = request.method in (ANSWERS, CLOSED_FORM)
    if not asks and not all(q.of_check for q in request.quantities):
        return
    idle = [f"--{k}" for k in OF_RUNS if getattr(request, k) is not None] + ([] if asks else [*rest])
    if not idle:
        return
    kind = "answers to a question" if asks else "checks"
    how = f"give {', '.join(starts)}" if asks and starts else "ask for a channel, or give X_0, X_rate_0"
    raise MechlabError(
        f"{request.name}: {', '.join(idle)}: this is a sweep of {kind}, and only runs look at {'it' if len(idle) == 1 else 'them'}. "
        f"For runs {how}; else leave {', '.join(idle)} out."
    )


def _words(draft: SweepRequest) -> str:
    return ", ".join([*draft.given, *(a.key for a in draft.axes)])
