"""From words to quantities: channels, checks and findings of runs, and what is made of them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from mechlab.errors import unknown
from mechlab.experiment.recording import Recording
from mechlab.lab.design import Design
from mechlab.studies.check.check import checks_of
from mechlab.studies.sweep.by_run import STEP_ERROR
from mechlab.studies.sweep.probe import names_of, scene_channels, short_run
from mechlab.studies.sweep.request import REDUCTIONS, SweepAxis, SweepQuantity, SweepRequest

CALL = re.compile(r"(\w+)\((.+)\)")
OF_CHECK = ("difference", "passed")


def split_words(text: str) -> list[str]:
    """Words between the commas that stand outside parentheses."""
    return re.split(r",(?![^()]*\))", text)


def quantities_of_runs(draft: SweepRequest, chosen: Design, words: Sequence[str]) -> tuple[SweepQuantity, ...]:
    """Channels, checks and findings by the words; by default the final channels of the scene."""
    checks = {c.id for c in checks_of(chosen.entry)}
    told = {w: m for w in words if (m := CALL.fullmatch(w))}
    only_checks = bool(words) and all(
        (told[w][1] in OF_CHECK and told[w][2] in checks) if w in told else w in checks for w in words
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
        if (call := told.get(word)) is not None:
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
    """Labels that no axis and no other variable of the dataset has."""
    taken = {a.key for a in axes} | {"reason", "outcome"}
    unique = {q.label: q for q in asked}
    return tuple(replace(q, label=f"{q.reduce}({q.name})") if q.label in taken else q for q in unique.values())
