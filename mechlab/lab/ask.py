"""Asking a design: the given keys select a question, which every witness answers; generic question of a Mechanism."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.errors import EngineMissing, MechlabError, unknown
from mechlab.experiment.parameters import checked, describe, entry_units, mechanism_units
from mechlab.experiment.question import Answer, Answers, Open, Question, WitnessInBulk, answers_at, choose, one_spelling
from mechlab.kit.quantities import quantities, split
from mechlab.kit.witness import engine_answers
from mechlab.lab.design import Design
from mechlab.lab.gear_trains import asks_lag, asks_power_flow
from mechlab.mechanism import Mechanism, Status
from mechlab.mechanism.given import many_turns
from mechlab.mechanism.length_unit import is_length
from mechlab.values import LARGEST_NUMBER, has_unit, parse_value

NUMBERS_ALONE = (TypeError, ValueError, IndexError)
"""What a closed form for one pose raises when it gets arrays."""


def parameters_and_rest(
    entry_parameters: type[Any], values: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """The keys that are parameters, and the others."""
    names = {i.name for i in describe(entry_parameters)}
    return {k: v for k, v in values.items() if k in names}, {k: v for k, v in values.items() if k not in names}


def ask(design: Design, given: Mapping[str, Any]) -> Answers:
    """The answers of all witnesses to the question that the given keys make.

    Numbers or arrays of one shape (they broadcast). Raises MechlabError when the keys make no question.
    """
    values, question = _asked(design, given)
    assumed = {k: d for k, d in question.optional.items() if d is not None and k not in values}
    found = {n: _ask_one(n, w, design, assumed | values) for n, w in question.witnesses.items()}
    done = _compared(design, question, values, assumed, found)
    return replace(done, warnings=(*done.warnings, *_many_turns(design, given)))


def ask_at_points(design: Design, given: Mapping[str, Any], count: int) -> list[Answers]:
    """`ask` at each of `count` points, given as numbers or arrays (count,): witnesses answer together where they can."""
    values, question = _asked(design, given)
    assumed = {k: d for k, d in question.optional.items() if d is not None and k not in values}
    found = {}
    for name, witness in question.witnesses.items():
        try:
            found[name] = answers_at(witness, design.parameters, assumed | values, count)
        except EngineMissing as missing:
            found[name] = [Answer(cannot=str(missing))] * count
    points = ({k: float(v[i]) if np.ndim(v) else v for k, v in values.items()} for i in range(count))
    return [
        _compared(design, question, at, assumed, {n: _plain(found[n][i]) for n in found}) for i, at in enumerate(points)
    ]


def _asked(design: Design, given: Mapping[str, Any]) -> tuple[dict[str, Any], Question]:
    """The given values by the names of the question, and the question."""
    values = {k: numeric(k, v) for k, v in in_si(design, given).items()}
    entry = design.entry
    values = one_spelling(entry.questions, values, design.name)
    keys = set(values)
    special = [q for q in entry.questions if set(q.given) <= keys <= set(q.given) | set(q.optional)]
    if special:
        return values, choose(entry.questions, keys, design.name)
    if asks_lag(keys):  # few questions are asked of gear trains: these modules wait
        from mechlab.lab.gear_trains.row_lag import lag_question

        return values, lag_question(design, values)
    if asks_power_flow(keys):
        from mechlab.lab.gear_trains.power_flow import power_flow_question

        return values, power_flow_question(design, values)
    return values, generic_question(design, values)


def _compared(
    design: Design, question: Question, values: Mapping[str, Any], assumed: Mapping[str, float], found: Mapping[str, Answer]
) -> Answers:
    """The answers of all witnesses side by side. Raises MechlabError where nothing is determined."""
    answers = {name: replace(a, assumed=dict(assumed) | dict(a.assumed)) for name, a in found.items()}
    done = Answers(
        question.name, answers, question.angles, question.units, _parameters(design), values, design.warnings,
        question.tolerance, _length(design),
    )  # fmt: skip
    if done.open and not any(a.modes or a.values.keys() - a.assumed.keys() for a in answers.values()):
        raise MechlabError(
            f"{design.name}: what is given ({', '.join(values)}) determines nothing else: "
            + "; ".join(x.sentence for x in _gathered(done.open))
        )  # fmt: skip
    return done


def _many_turns(design: Design, given: Mapping[str, Any]) -> list[str]:
    """A sentence on each angle that looks like degrees (`mechlab.mechanism.given.many_turns`)."""
    large = {k: text for k, v in given.items() if (text := many_turns(k, v))}
    units = entry_units(design.entry, [asked_mechanism(design)]) if large else {}
    return [text for k, text in large.items() if "rad" in units.get(k, ())]


def _gathered(found: Sequence[Open]) -> list[Open]:
    """The open quantities with those that each move on their own as one."""
    alone = [x for x in found if x.quantities == x.freedoms]
    names = tuple(n for x in alone for n in x.quantities)
    joined = [Open(names, names, tuple(k for x in alone for k in x.give))] if alone else []
    return [x for x in found if x.quantities != x.freedoms] + joined


def in_si(design: Design, values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of keys that are no parameters: text is read; raises MechlabError for a unit that does not fit its key."""
    if not any(has_unit(v) or isinstance(v, str) for v in values.values()):
        return dict(values)
    return checked(values, entry_units(design.entry, [asked_mechanism(design)]))


def asked_mechanism(design: Design) -> Mechanism:
    """The mechanism of the generic question."""
    return design.mechanism(None if design.entry.default_fidelity != "kinematic" else "minimal")


def _length(design: Design) -> float:
    """Size of the mechanism [m]; 1 m where these parameters make no mechanism, which the witnesses then report."""
    try:
        return asked_mechanism(design).length_scale
    except MechlabError:
        return 1.0


def _parameters(design: Design) -> dict[str, Any]:
    return {i.name: getattr(design.parameters, i.name) for i in describe(design.entry.parameters)}


def numeric(key: str, value: Any) -> Any:
    """A float, or an array of a list or range; raises MechlabError that names the key."""
    if isinstance(value, str):
        value = parse_value(key, value)
    if hasattr(value, "points"):
        value = value.points()
    try:
        array = np.asarray([float(x) for x in value] if isinstance(value, tuple | list) else value, dtype=float)
    except (TypeError, ValueError):
        raise MechlabError(f"{key}: expected a number, got {value!r}.") from None
    if not np.all(np.isfinite(array)):
        raise MechlabError(f"{key}: expected a finite number, got {value!r}.")
    if np.any(np.abs(array) > LARGEST_NUMBER):
        raise MechlabError(
            f"{key}: a number beyond {LARGEST_NUMBER:g}, got {value!r}: its powers leave the range of doubles."
        )
    return float(array) if array.ndim == 0 else array


def _ask_one(name: str, witness: Any, design: Design, values: Mapping[str, Any]) -> Answer:
    """One witness; the closed form takes arrays at once, an engine a list of poses."""
    try:
        shape = np.broadcast_shapes(*(np.shape(v) for v in values.values()))
    except ValueError as error:
        raise MechlabError(f"{design.name}: the given arrays do not broadcast: {error}.") from None
    try:
        if not shape:
            return _plain(witness(design.parameters, values))
        if name == "analytic":
            try:
                return _plain(witness(design.parameters, values))
            except NUMBERS_ALONE:
                pass  # it takes numbers: it is asked at each pose, and an error of the formula itself is raised there
        flat = {k: np.broadcast_to(v, shape).ravel() for k, v in values.items()}
        answers = answers_at(witness, design.parameters, flat, math.prod(shape))
    except EngineMissing as missing:
        return Answer(cannot=str(missing))
    if any(a.cannot for a in answers):
        return next(a for a in answers if a.cannot)
    worst = max(answers, key=lambda a: (a.status.exit_code, a.status is not Status.SOLVED))
    keys = [k for k in answers[0].values if all(k in a.values for a in answers)]
    arrays = {k: np.array([a.values[k] for a in answers]).reshape(shape) for k in keys}
    loosest = max(answers, key=lambda a: sum(len(x.quantities) for x in a.open))
    return Answer(
        arrays, worst.status, worst.notes, open=loosest.open, idle=answers[0].idle, assumed=answers[0].assumed
    )


def _plain(answer: Answer) -> Answer:
    """Zero-dimensional arrays as floats."""
    return replace(answer, values={k: float(v) if np.ndim(v) == 0 else v for k, v in answer.values.items()})


def generic_question(design: Design, values: Mapping[str, Any]) -> Question:
    """The question every Mechanism answers: joint, shaft and frame names, with rates and accelerations."""
    m = asked_mechanism(design)
    known = set(quantities(m))
    strange = sorted(set(values) - known)
    if strange:
        asked = {k for q in design.entry.questions for k in (*q.given, *q.optional)}
        raise unknown(
            f"{design.name}: quantity", strange[0], known | asked | {i.name for i in describe(design.entry.parameters)}
        )
    if not values:
        listing = "; ".join(" ".join(q.given) for q in design.entry.questions)
        raise MechlabError(
            f"{design.name}: nothing is given. Give joints, shafts or points (with _rate, _accel): {', '.join(m.scalar_names)}"
            + (f"; or one of: {listing}." if listing else ".")
        )
    wanted = _wanted(m, values)

    def witness(engine: str) -> Any:
        return WitnessInBulk(lambda p, given, count: engine_answers(engine, m, given, wanted, count))

    angles = tuple(k for k in m.scalar_names if not is_length(m, k))
    units = {k: u[0] for k, u in mechanism_units(m).items() if len(u) == 1 and (k in wanted or k in values)}
    return Question(
        "generic",
        tuple(values),
        wanted,
        {"pinocchio": witness("pinocchio"), "mujoco": witness("mujoco")},
        angles=angles,
        units=units,
    )


def _wanted(m: Mechanism, values: Mapping[str, Any]) -> tuple[str, ...]:
    position, rate, accel = split(m, dict.fromkeys(values, 0.0))
    points = [f"{f.name}_{a}" for f in m.frames for a in "xyz"]
    names = [*m.scalar_names, *points]
    wanted = [n for n in names if n not in values] if position else []
    if rate or accel:
        wanted += [f"{n}_rate" for n in names if f"{n}_rate" not in values]
        wanted += [f"{n}_accel" for n in names if f"{n}_accel" not in values]
    return tuple(wanted)
