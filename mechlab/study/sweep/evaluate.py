"""One block of a sweep, computed: the same function for every scheduler, so that all give the same bits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.study.design import Design, design
from mechlab.study.sweep.block import Block
from mechlab.study.sweep.request import ANSWERS, CLOSED_FORM, ROLLOUT, Request

_bases: dict[str, Design] = {}


def evaluate(request: Request, block: int, threads: int = 1) -> Block:
    """The numbers of a block. threads: of engines that have their own; they do not change a bit.

    What goes wrong at a point is told there; raises MechlabError only for what concerns all points.
    """
    from mechlab.study.sweep import by_answer, by_rollout, by_run

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
            by_answer.one_by_one(request, made, where, rest, out)
        elif request.method == ROLLOUT:
            by_rollout.roll_block(request, made, where, rest, out, threads)
        else:
            by_run.one_by_one(request, made, where, rest, out)
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
