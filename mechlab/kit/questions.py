"""Witnesses of the engines by a table of names, arrays of named quantities, and the answer of a closed form that does not
assemble."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.protocol import WITNESSES
from mechlab.errors import MechlabError
from mechlab.experiment.question import Answer, Witness, WitnessInBulk
from mechlab.mechanism import Mechanism, Status
from mechlab.mechanism.geometry import Array
from mechlab.tables import up_to

RATES = ("", "_rate", "_accel")
"""Suffixes of a quantity, its rate and its acceleration."""


def both_spellings(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values, with X_angle_rate also as X_rate, and X_angle_accel also as X_accel."""
    return {**values, **{k.replace("_angle_", "_"): v for k, v in values.items() if "_angle_" in k}}


def stacked(given: Mapping[str, Any], names: Sequence[str]) -> Array:
    """(..., names) the given values, 0 where there is none."""
    return np.stack(np.broadcast_arrays(*(np.asarray(given.get(n, 0.0), dtype=float) for n in names)), axis=-1)


def by_name(names: Sequence[str], values: Array) -> dict[str, Array]:
    """Name -> its values (...), from values (..., names)."""
    return {name: values[..., k] for k, name in enumerate(names)}


Start = Callable[[Any, Mechanism, Mapping[str, Any]], Array | None]


def with_orders(names: Mapping[str, str]) -> dict[str, str]:
    """The table of names, extended by the rate and the acceleration of each."""
    return {f"{ours}{s}": f"{theirs}{s}" for ours, theirs in names.items() for s in RATES}


def by_engines(
    build: Callable[[Any, str], Mechanism],
    given: Mapping[str, str],
    answers: Mapping[str, str],
    start: Start | None = None,
    output: str | None = None,
    fidelity: str = "minimal",
) -> dict[str, Witness]:
    """The witnesses "pinocchio" and "mujoco" of a question.

    given, answers: key of the question -> quantity of the engine (a joint, a shaft or a coordinate of a frame, with
    _rate or _accel); keys of `given` that a user leaves out are ignored. start(p, mechanism, given) -> (nq,) pose from
    which the engine assembles, None for the reference pose. output: as for `engine_answers`. Where the mechanism cannot
    be built with these parameters, the status of the answer is NO_ASSEMBLY.
    """
    wanted = tuple(dict.fromkeys(answers.values()))

    def ask(engine: str, p: Any, values: Mapping[str, Any], count: int) -> Sequence[Answer]:
        from mechlab.kit.witness import at_pose, engine_answers  # not before a question is asked

        try:
            m = build(p, fidelity)
        except MechlabError as never:
            return [Answer(status=Status.NO_ASSEMBLY, notes=(str(never),))] * count
        asked = {theirs: values[ours] for ours, theirs in given.items() if ours in values}
        starts = start and [start(p, m, at_pose(values, k, count)) for k in range(count)]
        found = engine_answers(engine, m, asked, wanted, count, starts, output=output)
        return [
            Answer(
                {ours: x.values[theirs] for ours, theirs in answers.items() if theirs in x.values}, x.status, x.notes, cannot=x.cannot
            )
            for x in found
        ]

    return together_for_engines(ask)


def together_for_engines(ask: Callable[[str, Any, Mapping[str, Any], int], Sequence[Answer]]) -> dict[str, Witness]:
    """The witnesses "pinocchio" and "mujoco" from ask(engine, p, given, count), which answers at `count` poses, given as numbers or
    arrays (count,)."""

    def witness(engine: str) -> Witness:
        return WitnessInBulk(lambda p, values, count: ask(engine, p, values, count))

    return {engine: witness(engine) for engine in WITNESSES}


def for_engines(ask: Callable[[str, Any, Mapping[str, Any]], Answer]) -> dict[str, Witness]:
    """The witnesses "pinocchio" and "mujoco" from ask(engine, p, given)."""

    def witness(engine: str) -> Witness:
        return lambda p, given: ask(engine, p, given)

    return {engine: witness(engine) for engine in WITNESSES}


def not_assembled(what: str, gap: ArrayLike, assembles: ArrayLike, modes: tuple[dict[str, Any], ...] = ()) -> Answer:
    """The answer of a closed form that does not close at all positions. what: subject and verb of the sentence, as "the
    bars are"; gap [m]: distance that each position lacks; assembles: mask of the positions that close."""
    largest = float(np.max(np.where(assembles, 0.0, gap)))
    text = f"{what} {up_to(gap)}{largest:.6g} m short of meeting"
    closed = np.asarray(assembles)
    return Answer(status=Status.NO_ASSEMBLY, notes=(text,), details={"gap": largest}, modes=modes, solved=closed)
