"""What can be asked of a sweep, learnt at a few of its points before it begins.

One block of a sweep, computed: the same function for every scheduler, so that all give the same bits.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.question import Answer, Open, Question
from mechlab.experiment.recording import Recording
from mechlab.lab.design import Design, design, initial_keys
from mechlab.lab.fidelity.choose import chosen_scene, run_chosen
from mechlab.mechanism import Mechanism
from mechlab.studies.sweep.by_run import question_of
from mechlab.studies.sweep.request import ANSWERS, CLOSED_FORM, ROLLOUT, Axis, Block, Request

PROBES = 8
"""So many points are tried, to learn what can be asked of a run."""
PROBE_STEPS = 4


def corners(chosen: Design, axes: Sequence[Axis]) -> list[Design]:
    """Designs at a few points of the parameter axes: the middle first, then ends, then as the design is."""
    outer = [a for a in axes if a.role == "parameter"]
    if not outer:
        return [chosen]
    picks: list[tuple[Any, ...]] = [tuple(a.values[len(a.values) // 2] for a in outer)]
    picks += itertools.islice(itertools.product(*((a.values[0], a.values[-1]) for a in outer)), PROBES)
    out, cause = [], None
    for pick in picks:
        changes = {a.key: x for a, x in zip(outer, pick, strict=True)}
        try:
            out.append(design(chosen.entry, dict(chosen.given) | changes))
        except MechlabError as error:
            cause = cause or error
    if not out and cause is not None:
        raise cause
    return out


def a_mechanism(chosen: Design, axes: Sequence[Axis]) -> Mechanism | None:
    """A mechanism of the sweep, for its names."""
    for one in [*corners(chosen, axes), chosen]:
        try:
            return one.mechanism(
                None
                if one.entry.default_fidelity != "kinematic"
                else one.entry.scenes[one.entry.default_scene].fidelity
            )
        except MechlabError:
            continue
    return None


def known_initial_keys(chosen: Design, axes: Sequence[Axis]) -> set[str]:
    """X_0, X_rate_0, X_force of what the mechanism has."""
    found = a_mechanism(chosen, axes)
    return set() if found is None else set(initial_keys(found))


def answers_of(
    draft: Request, chosen: Design, question: Question, witness: str
) -> tuple[dict[str, str], tuple[Open, ...]]:
    """Answers that are single numbers -> unit, from a few points, and those that are open; where none has an answer, those
    that the question names."""
    inner = [a for a in draft.axes if a.role == "given"]
    optional = {k: v for k, v in question.optional.items() if v is not None}
    picks = [tuple(a.values[len(a.values) // 2] for a in inner)]
    picks += itertools.islice(itertools.product(*((a.values[0], a.values[-1]) for a in inner)), PROBES)
    for one in corners(chosen, draft.axes):
        for pick in picks:
            nodes = {a.key: float(x) for a, x in zip(inner, pick, strict=True)}
            try:
                given = dict(draft.given) | nodes
                here = question if question.name != "generic" else question_of(one, set(given), given)
                answer: Answer = here.witnesses[witness](one.parameters, optional | given)
            except (MechlabError, ArithmeticError, ValueError):
                continue
            if answer.cannot:
                raise MechlabError(f"{chosen.name}: {witness} cannot answer: {answer.cannot}")
            numbers = [k for k, v in answer.values.items() if np.ndim(v) == 0 and not isinstance(v, str)]
            if (numbers or answer.open) and not answer.status.exit_code:
                return {k: question.units.get(k, "") for k in numbers}, answer.open
    return {k: question.units.get(k, "") for k in question.answers}, ()


def short_run(draft: Request, chosen: Design, step_error: bool) -> Recording | None:
    """A few steps of one of the runs, to learn its channels and findings; None where none of a few points runs."""
    inner = [a for a in draft.axes if a.role == "initial"]
    extra = {k: float(v) for k, v in draft.given.items()} | {a.key: float(a.values[len(a.values) // 2]) for a in inner}
    cause: MechlabError | None = None
    for one in corners(chosen, draft.axes):
        try:
            step = draft.timestep or chosen_scene(one.for_scene(draft.scene), draft.scene, None).settings.timestep
            return run_chosen(
                one, draft.scene, engine=draft.engine, fidelity=draft.fidelity, duration=PROBE_STEPS * step,
                timestep=draft.timestep, extra=extra, estimate=step_error,
            )  # fmt: skip
        except MechlabError as error:
            cause = cause or error
    if cause is not None and cause.exit_code == 1:
        raise cause
    return None


def names_of(chosen: Design, probe: Recording | None) -> tuple[dict[str, str], dict[str, str]]:
    """Channels and findings with their units."""
    channels = {n: unit for n, (unit, _) in chosen.entry.channels.items()}
    if probe is None:
        return channels, {}
    return channels | {n: probe.units.get(n, "") for n in probe.channels}, {
        f.name: f.unit for f in probe.health.findings
    }


def scene_channels(chosen: Design, draft: Request, recipe: Any) -> list[str]:
    """Channels that the scene names."""
    for one in [*corners(chosen, draft.axes), chosen]:
        try:
            return list(chosen_scene(one, draft.scene, draft.fidelity).channels)
        except MechlabError:
            continue
    return []


_bases: dict[str, Design] = {}


def evaluate(request: Request, block: int, threads: int = 1) -> Block:
    """The numbers of a block. threads: of engines that have their own; they do not change a bit.

    What goes wrong at a point is told there; raises MechlabError only for what concerns all points.
    """
    from mechlab.studies.sweep import by_rollout, by_run
    from mechlab.studies.sweep import by_run as by_answer

    out = Block.empty(request.span(block)[1] - request.span(block)[0], len(request.quantities))
    for where, changes, rest in groups(request, block):
        try:
            made = with_parameters(base(request), tuple(sorted(changes.items())))
        except MechlabError as cause:
            out.failed(where, cause)
            continue
        if request.method == CLOSED_FORM:
            by_answer.closed_form(request, made, where, rest, out)
        elif request.method == ANSWERS:
            by_answer.answers_one_by_one(request, made, where, rest, out)
        elif request.method == ROLLOUT:
            by_rollout.roll_block(request, made, where, rest, out, threads)
        else:
            by_run.runs_one_by_one(request, made, where, rest, out)
    return out


def base(request: Request) -> Design:
    """The design with the fixed parameters; loaded once in a process."""
    if request.fingerprint not in _bases:
        _bases.clear()
        _bases[request.fingerprint] = request.load(request.source, **request.parameters)
    return _bases[request.fingerprint]


def with_parameters(chosen: Design, changes: tuple[tuple[str, Any], ...]) -> Design:
    """The design with changed parameters."""
    return design(chosen.entry, dict(chosen.given) | dict(changes)) if changes else chosen


def groups(request: Request, block: int) -> Iterator[tuple[np.ndarray, dict[str, Any], dict[str, Any]]]:
    """The points of a block that share a design: where they stand in the block (m,), the parameters that change, and
    what else is given: numbers, or arrays (m,) of the axes."""
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
