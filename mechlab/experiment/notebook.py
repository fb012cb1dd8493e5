"""How answers and recordings show themselves in a notebook.

A Recording shows its page. This room knows no pages: whoever can draw one offers it with `offer_page`, and without an
offer, or where the page cannot be shown, a table stands in and says why.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from mechlab.errors import MechlabError
from mechlab.tables import html_sheet, number

if TYPE_CHECKING:
    from mechlab.experiment.question import Answers
    from mechlab.experiment.recording import Recording

Page = Callable[["Recording"], str]
_offered: list[Page] = []


def offer_page(write: Page) -> None:
    """From now on recordings show `write(recording)`, HTML that is safe to stand in a notebook. The last offer counts.

    A MechlabError that `write` raises becomes the sentence above the table.
    """
    _offered[:] = [write]


def recording_html(recording: Recording) -> str:
    """The page of a recording, or its table with the reason."""
    if not _offered:
        return recording_table(recording)
    try:
        return _offered[0](recording)
    except MechlabError as why:
        return recording_table(recording, f"The page of this run is not shown: {why}")


def recording_table(recording: Recording, *sentences: str) -> str:
    """Engine, health in words, and of every channel the unit, least, largest and last value."""
    r = recording
    said = [
        *sentences,
        f"scene {r.scene or '-'}, fidelity {r.fidelity or '-'}, {r.t[-1]:g} s, {len(r.t)} times recorded",
    ]
    said.append(f"engine {r.settings.engine}, {r.settings.integrator}, step {r.settings.timestep:g} s")
    if r.acts:
        said.append(f"what acts: {r.acts}")
    rows = [
        (n, r.units.get(n, ""), number(x.min(), 6), number(x.max(), 6), number(x[-1], 9)) for n, x in r.channels.items()
    ]
    health = [(f.severity, f.sentence) for f in r.health.findings]
    tables: dict[str, tuple[tuple[str, ...], list[tuple[str, ...]]]] = {}
    if health:
        tables["Health"] = (("", "what was found"), list(health))
    tables["Channels"] = (("channel", "unit", "least", "largest", "at the end"), list(rows))
    return html_sheet(r.name or r.mechanism.name, said, tables)


def answers_html(answers: Answers) -> str:
    """A table with a column for each witness; modes in tables of their own; difference, status, notes, warnings."""
    names = list(answers.answers)
    keys = list(dict.fromkeys(k for a in answers.answers.values() for k in a.values))
    rows = [
        (k, answers.units.get(k, ""), *(number(a.values.get(k), 10) for a in answers.answers.values())) for k in keys
    ]
    tables: dict[str, tuple[tuple[str, ...], list[tuple[str, ...]]]] = {}
    if rows:
        tables[""] = (("quantity", "unit", *names), rows)
    said = [f"status: {answers.status.value}"]
    if (difference := answers.max_difference) is not None:
        said.append(f"largest difference between witnesses: {difference:.3g}")
    for name, answer in answers.answers.items():
        said += [f"{name}: {text}" for text in ([answer.cannot] if answer.cannot else answer.notes)]
        if answer.modes:
            labels = tuple(dict.fromkeys(k for mode in answer.modes for k in mode))
            modes = [tuple(number(mode.get(k), 8) for k in labels) for mode in answer.modes]
            tables[f"{name}: {len(modes)} modes"] = (labels, modes)
    return html_sheet("", [*said, *answers.remarks, *(f"warning: {w}" for w in answers.warnings)], tables)
