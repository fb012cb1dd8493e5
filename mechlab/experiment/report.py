"""Prints answers and recordings: as one line, as text for the command line, and as HTML for a notebook.

In a notebook a Recording shows its page, by the function that was registered with `mechlab.results.offer_page`. Without
one, or where the page cannot be shown, a table with the reason takes its place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.question import Answers
from mechlab.experiment.recording import Cost, Health, Recording
from mechlab.results import html_of, line_of, text_of
from mechlab.results import offered_pages as _offered
from mechlab.tables import counted, html_sheet, number, table

NEGLIGIBLE = 1e-9
"""A value below this share of the largest value of its channel, and below the channel's error, is printed as 0."""

# -- answers ---------------------------------------------------------------------------------------------------------------


@line_of.register
def _(answers: Answers) -> str:
    difference = answers.max_difference
    apart = "" if difference is None else f", largest difference {difference:.3g}"
    return f"Answers of {', '.join(answers.answers)} to the question {answers.question}: {answers.status.value}{apart}"


@text_of.register
def _(answers: Answers) -> str:
    """A table with a column for each witness, the largest difference, the status and the notes."""
    parts = [table(*_values(answers))] if _values(answers)[1] else []
    for name, answer in answers.answers.items():
        if answer.cannot:
            parts.append(f"{name}: {answer.cannot}")
        if answer.modes:
            parts.append(f"{name}: {len(answer.modes)} modes\n{table(*_modes(answer.modes))}")
        parts += [f"{k}\n{table(*_details(v))}" for k, v in answer.details.items() if _is_table(v)]
        parts += [f"{name}: {note}" for note in answer.notes]
    parts += answers.remarks
    if (difference := answers.max_difference) is not None:
        parts.append(f"largest difference between witnesses: {difference:.3g}")
    parts.append(f"status: {answers.status.value}")
    return "\n".join([*parts, *(f"warning: {w}" for w in answers.warnings)])


@html_of.register
def _(answers: Answers) -> str:
    """A table with a column for each witness; modes in tables of their own; difference, status, notes, warnings."""
    tables = {"": _values(answers)} if _values(answers)[1] else {}
    sentences = [f"status: {answers.status.value}"]
    if (difference := answers.max_difference) is not None:
        sentences.append(f"largest difference between witnesses: {difference:.3g}")
    for name, answer in answers.answers.items():
        sentences += [f"{name}: {text}" for text in ([answer.cannot] if answer.cannot else answer.notes)]
        if answer.modes:
            tables[f"{name}: {len(answer.modes)} modes"] = _modes(answer.modes)
    return html_sheet("", [*sentences, *answers.remarks, *(f"warning: {w}" for w in answers.warnings)], tables)


Rows = tuple[list[str], list[list[str]]]


def _values(answers: Answers) -> Rows:
    """Quantity, unit, and the value of each witness."""
    each = answers.answers.values()
    keys = dict.fromkeys(k for a in each for k in a.values)
    rows = [[k, answers.units.get(k, ""), *(number(a.values.get(k), 10) for a in each)] for k in keys]
    return ["quantity", "unit", *answers.answers], rows


def _modes(modes: tuple[dict[str, Any], ...]) -> Rows:
    labels = list(dict.fromkeys(k for mode in modes for k in mode))
    return labels, [[number(mode.get(k), 8) for k in labels] for mode in modes]


def _is_table(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(row, Mapping) for row in value)


def _details(rows: list[Mapping[str, Any]]) -> Rows:
    """Heads and rows of a list of details of a witness, without columns that hold mappings."""
    heads = [k for k, x in rows[0].items() if not isinstance(x, Mapping)]
    return heads, [[x if isinstance(x := r[k], str) else number(x, 8) for k in heads] for r in rows]


# -- recordings ------------------------------------------------------------------------------------------------------------


@line_of.register
def _(recording: Recording) -> str:
    r = recording
    scene = f", scene {r.scene}" if r.scene else ""
    trust = "trusted" if r.health.trusted else "not to be trusted"
    return f"Recording of {r.name or r.mechanism.name}{scene}, {r.t[-1]:g} s, {len(r.t)} samples, {trust}"


@text_of.register
def _(recording: Recording) -> str:
    """Values at the sample times and at the end, health, cost."""
    r = recording
    samples, negligible = [*r.samples(), r.final()], _negligible(r)
    heads = ["channel", "unit", *(f"t = {s['t']:g} s" for s in samples[:-1]), f"t = {r.t[-1]:g} s (end)"]
    rows = [
        [n, r.units.get(n, ""), *(number(s[n] if abs(s[n]) > negligible[n] else 0.0, 7) for s in samples)]
        for n in r.channels
    ]
    if r.errors:
        heads.append("error, at most")
        rows = [[*row, number(r.errors.get(row[0]), 2)] for row in rows]
    lines = [
        f"{r.name}, scene {r.scene}, fidelity {r.fidelity}, "
        f"engine {r.settings.engine} ({r.settings.integrator}, {r.settings.timestep:g} s)"
    ]
    if r.acts:
        lines.append(f"what acts: {r.acts}")
    lines += [table(heads, rows), "", "health", *_sentences(r.health)]
    lines += [f"  note    {n}" for n in r.notes]
    lines.append(_cost_line(r.cost))
    return "\n".join(lines)


@text_of.register
def _(health: Health) -> str:
    return "\n".join(_sentences(health)) or "nothing was looked at"


@line_of.register
def _(health: Health) -> str:
    worst = [f.name for f in health.findings if f.severity == "error"]
    trust = f"not to be trusted: {', '.join(worst)}" if worst else "trusted"
    return f"Health, {counted(len(health.findings), 'finding')}, {trust}"


def _sentences(health: Health) -> list[str]:
    return [f"  {f.severity:8s}{f.sentence}" for f in health.findings]


def _cost_line(cost: Cost) -> str:
    """Steps, evaluations and CPU seconds with their parts."""
    count = f"cost: {cost.steps} steps, {cost.evaluations} evaluations, "
    if not cost.total_s:
        return f"{count}{cost.cpu_s:.3g} s of CPU for the steps" if cost.cpu_s else count.removesuffix(", ")
    parts = ", ".join(f"{name} {seconds:.2g}" for name, seconds in asdict(cost.parts).items() if seconds >= 0.005 * cost.total_s)
    return f"{count}{cost.total_s:.3g} s of CPU ({parts})"


def _negligible(recording: Recording) -> dict[str, float]:
    """Channel -> largest absolute value that the table prints as 0."""
    out = {}
    for name, values in recording.channels.items():
        largest = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
        out[name] = min(NEGLIGIBLE * largest, recording.errors.get(name, 0.0))
    return out


@html_of.register
def _(recording: Recording) -> str:
    """The page of a recording, or its table with the reason."""
    if not _offered:
        return recording_table(recording)
    try:
        return _offered[0](recording)
    except MechlabError as why:
        return recording_table(recording, f"The page of this run is not shown: {why}")


def recording_table(recording: Recording, *sentences: str) -> str:
    """HTML table of a recording: engine, health, and unit, least, largest and last value of every channel."""
    r = recording
    lines = [
        *sentences,
        f"scene {r.scene or '-'}, fidelity {r.fidelity or '-'}, {r.t[-1]:g} s, {len(r.t)} times recorded",
        f"engine {r.settings.engine}, {r.settings.integrator}, step {r.settings.timestep:g} s",
    ]
    if r.acts:
        lines.append(f"what acts: {r.acts}")
    rows = [
        [n, r.units.get(n, ""), number(x.min(), 6), number(x.max(), 6), number(x[-1], 9)] for n, x in r.channels.items()
    ]
    tables: dict[str, Rows] = {}
    if r.health.findings:
        tables["Health"] = ["", "what was found"], [[f.severity, f.sentence] for f in r.health.findings]
    tables["Channels"] = ["channel", "unit", "least", "largest", "at the end"], rows
    return html_sheet(r.name or r.mechanism.name, lines, tables)
