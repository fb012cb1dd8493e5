"""The quantities of a sweep: finds out at a few points which exist, and which of them the user's words mean."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.question import Open, Question
from mechlab.experiment.recording import Recording
from mechlab.lab.design import Design, design, initial_keys
from mechlab.lab.fidelity.choose import chosen_scene
from mechlab.lab.run import run_scene
from mechlab.mechanism import Mechanism
from mechlab.studies.check.check import checks_of
from mechlab.studies.named import witness_answer
from mechlab.studies.sweep.evaluate import STEP_ERROR, question_of
from mechlab.studies.sweep.request import REDUCTIONS, SweepAxis, SweepQuantity, SweepRequest

PROBES = 8
"""Number of end points that are tried to learn which answers, channels and findings exist."""
PROBE_STEPS = 4


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
            out.append(design(chosen.entry, dict(chosen.given) | changes))
        except MechlabError as error:
            cause = cause or error
    if not out and cause is not None:
        raise cause
    return out


def a_mechanism(chosen: Design, axes: Sequence[SweepAxis]) -> Mechanism | None:
    """The mechanism of the first design that can be built, for the names in it; None where none can."""
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
                here = question if question.name != "generic" else question_of(one, set(given), given)
                answer = witness_answer(here, one, given, witness)
            except (MechlabError, ArithmeticError, ValueError):
                continue
            if answer.cannot:
                raise MechlabError(f"{chosen.name}: {witness} cannot answer: {answer.cannot}")
            numbers = [k for k, v in answer.values.items() if np.ndim(v) == 0 and not isinstance(v, str)]
            if (numbers or answer.open) and not answer.status.exit_code:
                return {k: question.units.get(k, "") for k in numbers}, answer.open
    return {k: question.units.get(k, "") for k in question.answers}, ()


def short_run(draft: SweepRequest, chosen: Design, step_error: bool) -> Recording | None:
    """A few steps of one run, which show its channels and findings; None where no point tried can run."""
    inner = [a for a in draft.axes if a.role == "initial"]
    extra = {k: float(v) for k, v in draft.given.items()} | {a.key: float(a.values[len(a.values) // 2]) for a in inner}
    cause: MechlabError | None = None
    for one in corners(chosen, draft.axes):
        try:
            step = draft.timestep or chosen_scene(one.for_scene(draft.scene), draft.scene, None).settings.timestep
            return run_scene(
                one, draft.scene, engine=draft.engine, fidelity=draft.fidelity, duration=PROBE_STEPS * step,
                timestep=draft.timestep, extra=extra, estimate=step_error,
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


def scene_channels(chosen: Design, draft: SweepRequest, recipe: Any) -> list[str]:
    """The channels that the scene declares."""
    for one in [*corners(chosen, draft.axes), chosen]:
        try:
            return list(chosen_scene(one, draft.scene, draft.fidelity).channels)
        except MechlabError:
            continue
    return []


CALL = re.compile(r"(\w+)\((.+)\)")
OF_CHECK = ("difference", "passed")


def split_words(text: str) -> list[str]:
    """The text split at commas outside parentheses."""
    return re.split(r",(?![^()]*\))", text)


def quantities_of_runs(draft: SweepRequest, chosen: Design, words: Sequence[str]) -> tuple[SweepQuantity, ...]:
    """The channels, checks and findings that the words name; without words, the final values of the scene's channels.

    Raises MechlabError for an unknown word, listing what exists.
    """
    checks = {c.id for c in checks_of(chosen.entry)}
    calls = {w: m for w in words if (m := CALL.fullmatch(w))}
    only_checks = bool(words) and all(
        (calls[w][1] in OF_CHECK and calls[w][2] in checks) if w in calls else w in checks for w in words
    )
    probe = None if only_checks else short_run(draft, chosen, step_error=STEP_ERROR in " ".join(words))
    channels, findings = names_of(chosen, probe)
    if not words:
        scene = chosen.recipe(draft.scene)
        wanted = scene_channels(chosen, draft, scene) or [
            n for n in channels if probe and n in probe.mechanism.scalar_names
        ]
        return tuple(SweepQuantity(n, "channel", n, unit=channels.get(n, "")) for n in wanted)
    out = []
    for word in words:
        if (call := calls.get(word)) is not None:
            how, name = call[1], call[2].strip()
            if how in OF_CHECK:
                if name not in checks:
                    raise unknown(f"{chosen.name}: check", name, checks)
                out.append(SweepQuantity(word, how, name))
                continue
            if how == "health":
                out.append(_finding(word, name, findings, probe, chosen))
                continue
            if how not in REDUCTIONS:
                raise unknown(f"quantity {word!r}: function", how, (*REDUCTIONS, *OF_CHECK, "health"))
        else:
            how, name = "final", word
        if call is None and name == "trusted" and name not in channels:
            out.append(SweepQuantity(word, "trusted", name))
        elif probe is None or name in channels:
            if name in checks and call is None and name not in channels:
                out.append(SweepQuantity(word, "difference", name))
            else:
                out.append(SweepQuantity(word, "channel", name, how, channels.get(name, "")))
        elif call is None and name in checks:
            out.append(SweepQuantity(word, "difference", name))
        elif call is None and name in findings:
            out.append(SweepQuantity(word, "finding", name, unit=findings[name]))
        else:
            known = {*channels, *checks, *findings, "trusted"} if call is None else set(channels)
            raise unknown(f"{chosen.name}: quantity", name, known)
    return tuple(out)


def _finding(
    word: str, name: str, findings: Mapping[str, str], probe: Recording | None, chosen: Design
) -> SweepQuantity:
    if name == "trusted":
        return SweepQuantity(word, "trusted", name)
    if probe is not None and name not in findings:
        raise unknown(f"{chosen.name}: finding", name, {*findings, "trusted"})
    return SweepQuantity(word, "finding", name, unit=findings.get(name, ""))


def distinct(asked: Sequence[SweepQuantity], axes: Sequence[SweepAxis]) -> tuple[SweepQuantity, ...]:
    """The quantities, each once, with labels that differ from the axes and other variables of the dataset."""
    taken = {a.key for a in axes} | {"reason", "outcome"}
    unique = {q.label: q for q in asked}
    return tuple(replace(q, label=f"{q.reduce}({q.name})") if q.label in taken else q for q in unique.values())
