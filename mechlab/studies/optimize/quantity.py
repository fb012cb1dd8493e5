"""The quantities of an optimisation: reads their names once, finds the source that computes each, and its unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.question import Question
from mechlab.kit.quantities import quantities
from mechlab.lab.ask import asked_mechanism
from mechlab.lab.design import Design
from mechlab.lazy_dataclass import dataclass
from mechlab.studies.cycle.cycle import run_cycle
from mechlab.studies.named.answers import witness_answer
from mechlab.studies.named.number import OF_COURSE, SINGLE_NUMBERS, NamedNumber, keys_to_give, parameter_infos
from mechlab.studies.named.runs import short_run
from mechlab.studies.optimize import sources
from mechlab.studies.optimize.sources import COUNTED, DEXTERITY, STATISTICS, QuantitySource
from mechlab.studies.workspace.grid import product
from mechlab.values import Range

FEW = 4
"""Number of positions of the short cycle that lists the columns of a design."""


@dataclass(frozen=True)
class QuantitySet:
    """All quantities of a problem: the sources that compute them, and their units."""

    sources: tuple[QuantitySource, ...]
    units: Mapping[str, str]

    def numbers(self, design: Design) -> dict[str, float]:
        """Quantity -> value in SI. Raises MechlabError where the design has no value."""
        out: dict[str, float] = {}
        for source in self.sources:
            out |= source.numbers(design)
        return out

    def checked(self, design: Design) -> dict[str, dict[str, float]]:
        """Quantity -> other way of computing it -> value."""
        out: dict[str, dict[str, float]] = {}
        for source in self.sources:
            out |= source.checked(design)
        return {k: v for k, v in out.items() if v}


def quantity_set(design: Design, names: Sequence[str], given: Mapping[str, Any]) -> QuantitySet:
    """The sources that compute `names`, cheapest first. given: keys that are no parameters: keys of questions, axes and
    limits of the workspace, X_rate, X_force of a cycle, X_0 of a run.

    Names: a parameter; an answer of the question that fits the given keys; voxels, volume, columns (xy_nodes), margin,
    MAP_smallest, MAP_median, MAP_largest, reach, dexterity of a workspace; cycle.REDUCE.COLUMN; run.REDUCE.CHANNEL,
    run.health.FINDING. Raises MechlabError for any other, listing what exists, and for given keys that nothing takes.
    """
    groups: dict[str, list[NamedNumber]] = {"parameter": [], "answer": [], "workspace": [], "cycle": [], "run": []}
    for name in dict.fromkeys(names):
        read = named_number(design, name)
        groups["run" if read.of_run else read.kind].append(read)
    made: list[QuantitySource] = []
    taken: set[str] = set()
    if groups["parameter"]:
        made.append(sources.ParameterSource(tuple(groups["parameter"])))
    asked: dict[tuple[str | None, tuple[str, ...]], list[NamedNumber]] = {}
    for k, number in enumerate(groups["answer"]):
        question, keys, unit = _question_for(design, number.name, given)
        groups["answer"][k] = replace(number, unit=unit)
        asked.setdefault((None if question is None else question.name, keys), []).append(groups["answer"][k])
        taken |= set(keys)
    made += [sources.AnswerSource(tuple(n), q, {k: given[k] for k in keys}) for (q, keys), n in asked.items()]
    recipe = design.entry.workspace
    if groups["workspace"] and recipe is not None:
        own = {k: v for k, v in given.items() if k in {*recipe.grid, *recipe.limits}}
        made.append(sources.WorkspaceSource(tuple(groups["workspace"]), own))
        taken |= set(own)
    for kind, source in (("cycle", sources.CycleSource), ("run", sources.RunSource)):
        if groups[kind]:
            own = {k: _plain(k, v) for k, v in given.items() if k not in taken}
            taken |= set(own)
            made.append(source(tuple(groups[kind]), own))
            _exist(design, kind, groups[kind], own)
    strange = [k for k in given if k not in taken]
    if strange:
        raise unknown(f"{design.name}: quantity", strange[0], keys_to_give(design) | taken)
    return QuantitySet(tuple(made), {n.label: n.unit for group in groups.values() for n in group})


def named_number(design: Design, text: str) -> NamedNumber:
    """The number that a text names; the unit of an answer is left open until its question is known.

    Raises MechlabError for a cycle or run without a reduction that exists.
    """
    first, _, rest = text.partition(".")
    if rest and first in ("cycle", "run"):
        how, dot, what = rest.partition(".")
        allowed = OF_COURSE if first == "cycle" else (*OF_COURSE, "health")
        if how not in allowed or not dot:
            raise MechlabError(f"{text}: expected {first}.HOW.COLUMN, HOW one of {', '.join(allowed)}.")
        unit = "rad" if what.endswith("_angle") else ""
        if how == "health":
            return NamedNumber(text, "finding", what, unit=unit)
        return NamedNumber(text, "cycle" if first == "cycle" else "channel", what, how, unit)
    info = parameter_infos(design).get(text)
    if info is not None and info.kind in SINGLE_NUMBERS:
        return NamedNumber(text, "parameter", text, unit=info.unit)
    if text in workspace_names(design):
        return NamedNumber(text, "workspace", text, unit=_workspace_unit(design, text))
    return NamedNumber(text, "answer", text)


def _exist(design: Design, kind: str, numbers: Sequence[NamedNumber], own: Mapping[str, float]) -> None:
    """Raises MechlabError, listing what exists, for a column, channel, finding or key that this design does not have.

    A design whose cycle or run has no solution passes: other designs may have one.
    """
    try:
        if kind == "cycle":
            found = run_cycle(design.mechanism(None), design.name, own, points=FEW)
            columns, findings = {*found.columns, *found.zero}, set[str]()
        else:
            recording = short_run(design, None, own)
            columns, findings = set(recording.channels), {f.name for f in recording.health.findings}
    except MechlabError as cause:
        if cause.exit_code > 2:
            return
        raise
    for number in numbers:
        what, known = ("finding", findings) if number.kind == "finding" else ("column", columns)
        if number.name not in known:
            raise unknown(f"{design.name}: {kind}: {what}", number.name, known)


def workspace_names(design: Design) -> tuple[str, ...]:
    """Quantities of the design's own workspace; empty where the entry defines no workspace."""
    recipe = design.entry.workspace
    if recipe is None:
        return ()
    maps = recipe.maps(design.parameters)
    per_map = [f"{m}_{s}" for m in maps for s in STATISTICS]
    return (*COUNTED, "reach", *(["dexterity"] if DEXTERITY in maps else []), *per_map)


def _workspace_unit(design: Design, name: str) -> str:
    recipe = design.entry.workspace
    assert recipe is not None
    if name in ("margin", "reach"):
        return "m"
    if name == "volume":
        return product([recipe.units[a] for a in recipe.grid])
    maps = recipe.maps(design.parameters)
    stem = DEXTERITY if name == "dexterity" else name.rpartition("_")[0]
    return maps[stem].unit if stem in maps else ""


def _question_for(design: Design, name: str, given: Mapping[str, Any]) -> tuple[Question | None, tuple[str, ...], str]:
    """The question that gives the answer `name` (None: the generic question), the given keys it takes, and the unit.

    Of several fitting questions it takes the one that uses most of the given keys. Raises MechlabError where none fits.
    """
    fits = []
    for q in design.entry.questions:
        if set(q.given) <= set(given) and (name in q.answers or name in _further_answers(design, q, given)):
            fits.append(q)
    if fits:
        best = max(fits, key=lambda q: len(q.given))
        keys = tuple(k for k in given if k in {*best.given, *best.optional})
        return best, keys, best.units.get(name, "rad" if name in best.angles or name.endswith("_angle") else "")
    generic = quantities(asked_mechanism(design))
    if given and name in generic:
        return None, tuple(k for k in given if k in generic), ""
    needs = [f"{', '.join(q.given)} for {name}" for q in design.entry.questions if name in q.answers]
    if needs:
        raise MechlabError(f"{design.name}: {name} is an answer; also give {' or '.join(needs)}.")
    exists = {a for q in design.entry.questions for a in q.answers} | {*workspace_names(design)}
    exists |= {*parameter_infos(design)} | {"cycle.peak.COLUMN", "run.final.CHANNEL"}
    raise unknown(f"{design.name}: quantity", name, exists)


def _further_answers(design: Design, q: Question, given: Mapping[str, Any]) -> tuple[str, ...]:
    """The answers that a question gives beyond those it declares."""
    known = {k: v for k, v in given.items() if k in {*q.given, *q.optional} and np.ndim(v) == 0}
    if not set(q.given) <= set(known):
        return ()
    try:
        return tuple(witness_answer(q, design, known).values)
    except MechlabError:
        return ()


def _plain(key: str, value: Any) -> float:
    if isinstance(value, Range) or not hasattr(value, "__float__"):
        raise MechlabError(f"{key}: expected a number, got {value}.")
    return float(value)
