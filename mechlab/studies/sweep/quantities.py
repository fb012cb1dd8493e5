"""The quantities of a sweep: finds out at a few points which exist, and which of them the user's words mean."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence, Set
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.question import Open, Question
from mechlab.experiment.recording import Recording
from mechlab.lab.ask import asked_mechanism
from mechlab.lab.design import Design, initial_keys
from mechlab.lab.fidelity.choose import chosen_scene
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.studies.check.check import checks_of
from mechlab.studies.named.answers import question_taking, witness_answer
from mechlab.studies.named.number import OF_CHECK, OF_TIME, NamedNumber, varied
from mechlab.studies.named.runs import short_run
from mechlab.studies.sweep.evaluate import STEP_ERROR
from mechlab.studies.sweep.request import SweepAxis, SweepRequest

PROBES = 8
"""Number of end points that are tried to learn which answers, channels and findings exist."""


def corners(chosen: Design, axes: Sequence[SweepAxis]) -> list[Design]:
    """Designs at a few points of the parameter axes: the middle first, then combinations of ends.

    The given design alone where no parameter varies. Raises MechlabError when none of the points gives a design.
    """
    outer = [a for a in axes if a.role == "parameter"]
    if not outer:
        return [chosen]
    picks: list[tuple[Any, ...]] = [tuple(a.values[len(a.values) // 2] for a in outer)]
    picks += itertools.islice(itertools.product(*((a.values[0], a.values[-1]) for a in outer)), PROBES)
    out, cause = [], None
    for pick in picks:
        changes = {a.key: x for a, x in zip(outer, pick, strict=True)}
        try:
            out.append(varied(chosen, changes))
        except MechlabError as error:
            cause = cause or error
    if not out and cause is not None:
        raise cause
    return out


def a_mechanism(chosen: Design, axes: Sequence[SweepAxis]) -> Mechanism | None:
    """The mechanism of the first design that can be built, for the names in it; None where none can."""
    for one in [*corners(chosen, axes), chosen]:
        try:
            return asked_mechanism(one)
        except MechlabError:
            continue
    return None


def known_initial_keys(chosen: Design, axes: Sequence[SweepAxis]) -> set[str]:
    """The keys X_0, X_rate_0, X_force of the joints and shafts of the mechanism."""
    found = a_mechanism(chosen, axes)
    return set() if found is None else set(initial_keys(found))


def answers_of(
    draft: SweepRequest, chosen: Design, question: Question, witness: str
) -> tuple[dict[str, str], tuple[Open, ...]]:
    """Answers that are single numbers -> unit, and the open answers, at the first of a few points that has any.

    Where none has, the answers that the question declares.
    """
    inner = [a for a in draft.axes if a.role == "given"]
    picks = [tuple(a.values[len(a.values) // 2] for a in inner)]
    picks += itertools.islice(itertools.product(*((a.values[0], a.values[-1]) for a in inner)), PROBES)
    for one in corners(chosen, draft.axes):
        for pick in picks:
            nodes = {a.key: float(x) for a, x in zip(inner, pick, strict=True)}
            try:
                given = dict(draft.given) | nodes
                here = question if question.name != "generic" else question_taking(one, set(given), given)
                answer = witness_answer(here, one, given, witness)
            except (MechlabError, ArithmeticError, ValueError):
                continue
            if answer.cannot:
                raise MechlabError(f"{chosen.name}: {witness} cannot answer: {answer.cannot}")
            numbers = [k for k, v in answer.values.items() if np.ndim(v) == 0 and not isinstance(v, str)]
            if (numbers or answer.open) and not answer.status.exit_code:
                return {k: question.units.get(k, "") for k in numbers}, answer.open
    return {k: question.units.get(k, "") for k in question.answers}, ()


def probed_run(draft: SweepRequest, chosen: Design, step_error: bool) -> Recording | None:
    """A few steps of one run, which show its channels and findings; None where no point tried can run."""
    inner = [a for a in draft.axes if a.role == "initial"]
    extra = {k: float(v) for k, v in draft.given.items()} | {a.key: float(a.values[len(a.values) // 2]) for a in inner}
    cause: MechlabError | None = None
    for one in corners(chosen, draft.axes):
        try:
            return short_run(
                one, draft.scene, extra, draft.timestep, engine=draft.engine, fidelity=draft.fidelity, estimate=step_error
            )  # fmt: skip
        except MechlabError as error:
            cause = cause or error
    if cause is not None and cause.exit_code == 1:
        raise cause
    return None


def names_of(chosen: Design, probe: Recording | None) -> tuple[dict[str, str], dict[str, str]]:
    """Channel -> unit, and finding -> unit."""
    channels = {n: unit for n, (unit, _) in chosen.entry.channels.items()}
    if probe is None:
        return channels, {}
    return channels | {n: probe.units.get(n, "") for n in probe.channels}, {
        f.name: f.unit for f in probe.health.findings
    }


def scene_channels(chosen: Design, draft: SweepRequest) -> list[str]:
    """The channels that the scene declares."""
    for one in [*corners(chosen, draft.axes), chosen]:
        try:
            return list(chosen_scene(one, draft.scene, draft.fidelity).channels)
        except MechlabError:
            continue
    return []


CALL = re.compile(r"(\w+)\((.+)\)")


def split_words(text: str) -> list[str]:
    """The text split at commas outside parentheses."""
    return re.split(r",(?![^()]*\))", text)


def quantities_of_runs(draft: SweepRequest, chosen: Design, words: Sequence[str]) -> tuple[NamedNumber, ...]:
    """The channels, checks and findings that the words name; without words, the final values of the scene's channels.

    Raises MechlabError for an unknown word, listing what exists.
    """
    checks = {c.id for c in checks_of(chosen.entry)}
    calls = [(w, *_called(w)) for w in words]
    only_checks = bool(calls) and all(name in checks and how in ("", *OF_CHECK) for _, how, name in calls)
    probe = None if only_checks else probed_run(draft, chosen, step_error=STEP_ERROR in " ".join(words))
    known = _NamesOfRuns(chosen.name, checks, *names_of(chosen, probe), probe is not None)
    if words:
        return tuple(known.called(*x) if x[1] else known.plain(x[2]) for x in calls)
    wanted = scene_channels(chosen, draft) or [n for n in known.channels if probe and n in probe.mechanism.scalar_names]
    return tuple(NamedNumber(n, "channel", n, unit=known.channels.get(n, "")) for n in wanted)


def _called(word: str) -> tuple[str, str]:
    """HOW and NAME of the word HOW(NAME); no HOW for a plain word."""
    call = CALL.fullmatch(word)
    return (call[1], call[2].strip()) if call else ("", word)


@dataclass(frozen=True)
class _NamesOfRuns:
    """Names of the checks, channels and findings of a mechanism. probed: a run has shown them; else channels and
    findings that are not known may exist."""

    owner: str
    checks: Set[str]
    channels: Mapping[str, str]
    findings: Mapping[str, str]
    probed: bool

    def called(self, word: str, how: str, name: str) -> NamedNumber:
        """HOW(NAME): a reduced channel, difference or passed of a check, or health of a finding."""
        if how in OF_CHECK:
            if name not in self.checks:
                raise unknown(f"{self.owner}: check", name, self.checks)
            return NamedNumber(word, how, name)
        if how == "health":
            return self._finding(word, name)
        if how not in OF_TIME:
            raise unknown(f"quantity {word!r}: function", how, (*OF_TIME, *OF_CHECK, "health"))
        if self.probed and name not in self.channels:
            raise unknown(f"{self.owner}: quantity", name, self.channels)
        return NamedNumber(word, "channel", name, how, self.channels.get(name, ""))

    def plain(self, name: str) -> NamedNumber:
        """A name alone: the final value of a channel, the difference of a check, a finding, or trusted."""
        if name in self.channels:
            return NamedNumber(name, "channel", name, unit=self.channels[name])
        if name == "trusted":
            return NamedNumber(name, "trusted", name)
        if name in self.checks:
            return NamedNumber(name, "difference", name)
        if not self.probed:
            return NamedNumber(name, "channel", name)
        if name in self.findings:
            return NamedNumber(name, "finding", name, unit=self.findings[name])
        raise unknown(f"{self.owner}: quantity", name, {*self.channels, *self.checks, *self.findings, "trusted"})

    def _finding(self, word: str, name: str) -> NamedNumber:
        if name == "trusted":
            return NamedNumber(word, "trusted", name)
        if self.probed and name not in self.findings:
            raise unknown(f"{self.owner}: finding", name, {*self.findings, "trusted"})
        return NamedNumber(word, "finding", name, unit=self.findings.get(name, ""))


def distinct(asked: Sequence[NamedNumber], axes: Sequence[SweepAxis]) -> tuple[NamedNumber, ...]:
    """The quantities, each once, with labels that differ from the axes and other variables of the dataset."""
    taken = {a.key for a in axes} | {"reason", "outcome"}
    unique = {q.label: q for q in asked}
    return tuple(replace(q, label=f"{q.reduce}({q.name})") if q.label in taken else q for q in unique.values())
