"""What a design predicts for the measured channels: a run of a scene sampled at the times, or the answers of a question."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from mechlab.engines.protocol import available
from mechlab.errors import MechlabError, NoSolution, Untrustworthy, unknown
from mechlab.experiment.parameters import entry_units
from mechlab.experiment.question import Question
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Settings
from mechlab.lab.ask import asked_mechanism, generic_question
from mechlab.lab.design import Design
from mechlab.lab.problem_settings import with_static_motors
from mechlab.lab.single_run import analytic_run, chosen_settings, compared_run, complete
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import structure
from mechlab.studies.fit.table import TIME, MeasuredTable
from mechlab.studies.named.answers import PREFERRED, witness_answers
from mechlab.studies.named.runs import channel, short_run


class Predictions(Protocol):
    """Series that a design predicts at the rows of the measurements."""

    @property
    def units(self) -> Mapping[str, str]:
        """Channel -> unit."""
        ...

    @property
    def angles(self) -> tuple[str, ...]:
        """Channels that count modulo 2 pi."""
        ...

    @property
    def ways(self) -> tuple[str, ...]:
        """Engines or witnesses: the first ones fit, the next one confirms."""
        ...

    @property
    def trial(self) -> int:
        """How many of `ways`, from the first, may fit."""
        ...

    def at(self, way: str, design: Design, extra: Mapping[str, float]) -> dict[str, Array]:
        """Channel -> (n,) in SI. Raises MechlabError where the design has no motion."""
        ...


@dataclass(frozen=True)
class RunPredictions:
    """A scene run by an engine, sampled at times (n,) [s]; settings are those of the first design, for all designs."""

    base: Design
    scene: str | None
    fidelity: str | None
    times: Array
    channels: tuple[str, ...]
    loads: Mapping[str, float]
    engine: str | None
    states: bool

    @property
    def angles(self) -> tuple[str, ...]:
        """None: measured angles are continuous."""
        return ()

    @cached_property
    def sample(self) -> Recording:
        """A short run, for its channels and units."""
        return short_run(self.base, self.scene, dict(self.loads), estimate=False, fidelity=self.fidelity, engine=self.engine)

    @cached_property
    def units(self) -> dict[str, str]:
        """Channel -> unit. Raises MechlabError, listing the channels, for one that a run does not have."""
        known = dict(self.sample.units) | {n: u for n, (u, _) in self.base.entry.channels.items()}
        for name in self.channels:
            if name not in known:
                raise unknown(f"{self.base.name}: channel", name, known)
        return {n: known[n] for n in self.channels}

    @cached_property
    def own(self) -> Settings:
        """The settings that the scene recommends for the first design."""
        made = self.base.for_scene(self.scene)
        return chosen_settings(made, made.scene(self.scene, self.fidelity, self.duration), self.engine)

    @property
    def duration(self) -> float:
        """Time of the last row [s]."""
        return float(self.times[-1])

    @cached_property
    def ways(self) -> tuple[str, ...]:
        """MuJoCo, which is cheapest, and the scene's own engine; then those that only confirm."""
        own = self.own.engine
        fits = (self.engine,) if self.engine else (own,) if own in ("file", "analytic") else ("mujoco", own)
        closed = self.base.entry.reference is not None and not self.states and not self.loads
        others = (*(("analytic",) if closed else ()), "pinocchio")
        ways = dict.fromkeys((*fits, *(() if own == "file" else (own, *others))))
        return tuple(w for w in ways if w == "analytic" or not available(w))

    @property
    def trial(self) -> int:
        """Engines that may fit: the cheapest, and where it does not do the scene's own."""
        own = self.own.engine
        return 1 if self.engine or own in (self.ways[0], "file", "analytic") else 2

    def at(self, way: str, design: Design, extra: Mapping[str, float]) -> dict[str, Array]:
        """See `Predictions.at`."""
        made = design.for_scene(self.scene)
        scene = made.scene(self.scene, self.fidelity, self.duration, dict(self.loads) | dict(extra))
        if way == "analytic":
            run = complete(made, analytic_run(made, scene, dict(self.loads) | dict(extra)), scene)
        else:
            settings = self._settings(way)
            run = compared_run(made, with_static_motors(scene, settings), settings, self.times)
        if run.t[-1] < self.duration - 1e-9 * max(1.0, self.duration):
            raise Untrustworthy(f"{design.name}: the run ended at {run.t[-1]:g} s of {self.duration:g} s.")
        found = {name: interpolated(run.t, channel(made, run, name), self.times) for name in self.channels}
        if not all(np.all(np.isfinite(x)) for x in found.values()):
            raise Untrustworthy(f"{design.name}: the run has values that are not finite.")
        return found

    def _settings(self, way: str) -> Settings:
        if way not in self._chosen:
            made = self.base.for_scene(self.scene)
            scene = made.scene(self.scene, self.fidelity, self.duration)
            self._chosen[way] = self.own if way == self.own.engine else chosen_settings(made, scene, way)
        return self._chosen[way]

    @cached_property
    def _chosen(self) -> dict[str, Settings]:
        return {}


def interpolated(t: Array, values: Array, at: Array) -> Array:
    """Values (m,) at times (m,) from samples (n,): a cubic through the four neighbours, exact at a sample."""
    if len(t) < 4:
        return np.interp(at, t, values)
    i = np.clip(np.searchsorted(t, at) - 2, 0, len(t) - 4)
    x, y = (np.stack([a[i + j] for j in range(4)]) for a in (t, np.asarray(values, dtype=float)))
    out = np.zeros(len(at))
    for j in range(4):
        others = [m for m in range(4) if m != j]
        out += y[j] * np.prod([(at - x[m]) / (x[j] - x[m]) for m in others], axis=0)
    return out


@dataclass(frozen=True)
class QuestionPredictions:
    """The answers of a question at given values (n,) or numbers; each witness is a way."""

    base: Design
    question: Question
    given: Mapping[str, Any]
    channels: tuple[str, ...]
    count: int
    witness: str | None = None

    @property
    def trial(self) -> int:
        """One: all witnesses answer exactly."""
        return 1

    @property
    def angles(self) -> tuple[str, ...]:
        """Answers that count modulo 2 pi."""
        return self.question.angles

    @cached_property
    def units(self) -> dict[str, str]:
        """Channel -> unit. Raises MechlabError, listing the answers, for one that the question does not have."""
        for name in self.channels:
            if name not in self.question.answers:
                raise unknown(f"{self.base.name}: answer", name, self.question.answers)
        known = _units(self.base)
        return {n: known.get(n, "") for n in self.channels}

    @cached_property
    def ways(self) -> tuple[str, ...]:
        """The witnesses, the fastest first; the one that was asked for before all."""
        order = [w for w in (*PREFERRED, *self.question.witnesses) if w in self.question.witnesses]
        if self.witness is not None and self.witness not in order:
            raise unknown(f"{self.base.name}: witness", self.witness, order)
        return tuple(dict.fromkeys(([self.witness] if self.witness else []) + order))

    def at(self, way: str, design: Design, extra: Mapping[str, float]) -> dict[str, Array]:
        """See `Predictions.at`."""
        own = self.question in self.base.entry.questions
        question = self.question if own else generic_question(design, self.given)  # the latter knows one mechanism
        if way == "analytic":
            defaults = {k: v for k, v in question.optional.items() if v is not None}
            answers = [question.witnesses[way](design.parameters, defaults | dict(self.given))]
        else:
            answers = list(witness_answers(question, design, self.given, way, self.count))
        for answer in answers:
            if answer.cannot or answer.status.exit_code:
                raise NoSolution(f"{design.name}: {answer.cannot or answer.status.value}")
        out = {}
        for name in self.channels:
            if not all(name in a.values for a in answers):
                raise unknown(f"{design.name}: answer", name, set.intersection(*(set(a.values) for a in answers)))
            if len(answers) == 1:
                out[name] = np.broadcast_to(np.asarray(answers[0].values[name], dtype=float), (self.count,))
            else:
                out[name] = np.array([float(a.values[name]) for a in answers])
            if not np.all(np.isfinite(out[name])):
                raise NoSolution(f"{design.name}: {name} has no value at some of the rows.")
        return out


def question_predictions(base: Design, table: MeasuredTable, values: Mapping[str, float], witness: str | None) -> QuestionPredictions:
    """Predictions for a table without time: its first column is given, and so are the other columns that a question of the entry
    takes; for the generic question of joints and frames, the first columns, one a freedom. values: given constants.

    Raises MechlabError where no question takes them.
    """
    names = list(table.columns)
    for question in base.entry.questions:
        keys = {*question.given, *question.optional}
        have = [n for n in names if n in keys]
        left = [n for n in names if n not in keys]
        answered = bool(left) and set(left) <= set(question.answers)
        if names[0] in keys and answered and set(question.given) <= {*have, *values} and set(values) <= keys:
            return _asked(base, question, have, left, table, values, witness)
    count = max(1, structure(asked_mechanism(base)).freedoms - len(values))
    have, left = names[:count], names[count:]
    try:
        question = generic_question(base, dict.fromkeys(have, 0.0) | dict(values))
    except MechlabError as error:
        raise MechlabError(
            f"{table.where}: the first column is {names[0]}, so it is a drive or a given quantity, not the time ({TIME} [s]); {error}"
        ) from None
    if not left:
        raise MechlabError(f"{table.where}: {', '.join(have)} are given by {base.name}'s {count} freedoms; no measured column is left.")
    return _asked(base, question, have, left, table, values, witness)


def _asked(
    base: Design, question: Question, have: Sequence[str], left: Sequence[str], table: MeasuredTable,
    values: Mapping[str, float], witness: str | None,
) -> QuestionPredictions:  # fmt: skip
    known = _units(base)
    given = table.in_units({n: known.get(n, "") for n in have})
    for name, column in given.items():
        if not np.all(np.isfinite(column)):
            raise MechlabError(f"{table.where}: column {name} is given and has gaps; only measured columns may have them.")
    rows = len(table.columns[table.first])
    return QuestionPredictions(base, question, dict(values) | given, tuple(left), rows, witness)


def _units(base: Design) -> Mapping[str, str]:
    """Key or answer of a question -> unit."""
    return {k: units[0] for k, units in entry_units(base.entry, [asked_mechanism(base)]).items()}
