"""All fidelities of a scene side by side: answers, error against the richest, cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import NEEDS
from mechlab.lab.design import Design
from mechlab.lab.fidelity.choose import (
    CLOSED_FORM,
    checked_needs,
    exact_words,
    levels,
    missing_answers,
    sentence,
    too_far,
)
from mechlab.lab.fidelity.measure import agreement, closed, error_against, thinned
from mechlab.lab.single_run import single_run, versions
from mechlab.mechanism.structure import structure
from mechlab.studies.fidelity.result import Fidelities, Level

MOST_STEPS = 10_000
"""Steps of the richest fidelity; a longer scene is cut unless its duration is asked for."""


def compare(
    design: Design,
    scene: str | None = None,
    duration: float | None = None,
    extra: Mapping[str, float] | None = None,
    needs: Sequence[str] | None = None,
) -> Fidelities:
    """The fidelities of a design on a scene, each run with the settings that the scene recommends.

    Without a duration a scene is cut after MOST_STEPS timesteps. Raises MechlabError for
    unknown names; a fidelity whose run fails is shown with the reason.
    """
    of_scene, names, more = design.for_scene(scene), levels(design), dict(extra or {})
    top = names[-1]
    scene_top = of_scene.scene(scene, top, duration, more)
    span = (
        scene_top.duration
        if duration is not None
        else min(scene_top.duration, MOST_STEPS * scene_top.settings.timestep)
    )
    wanted = checked_needs(scene_top.needs if needs is None else needs)
    runs: dict[str, Recording] = {}
    failed: dict[str, str] = {}
    for level in names:
        try:
            runs[level] = single_run(design, scene, level, span, more)
            bad = [f.sentence for f in runs[level].health.findings if f.severity == "error"]
            failed |= {level: bad[0]} if bad else {}
        except MechlabError as error:
            failed[level] = str(error)
    rows = [_row(of_scene, scene, level, top, runs, failed, span, more) for level in names]
    chosen, why = _chosen(rows, wanted, scene_top.tolerance)
    rows = [_with_status(r, wanted, scene_top.tolerance, chosen) for r in rows]
    if CLOSED_FORM in design.entry.fidelities:
        rows = [_closed_form(design), *rows]
    return Fidelities(
        design.name, design.entry.title, scene_top.name, span, scene_top.duration, wanted, scene_top.tolerance,
        tuple(rows), chosen, why, versions(),
    )  # fmt: skip


def _row(
    design: Design, scene: str | None, level: str, top: str, runs: Mapping[str, Recording], failed: Mapping[str, str],
    span: float, extra: Mapping[str, float],
) -> Level:  # fmt: skip
    m = design.mechanism(level)
    best = structure(m)
    missing = missing_answers(m, design.mechanism(top))
    answers = tuple(n for n in NEEDS if n not in missing)
    row = Level(level, best.freedoms, best.nv, best.rows, answers, missing, reason=failed.get(level, ""))
    if level not in runs:
        return row
    run = runs[level]
    ran = float(run.t[-1])
    cost = {
        "cpu_s_per_s": run.cost.cpu_s / ran if ran else None, "steps_per_s": run.cost.steps / max(run.cost.cpu_s, 1e-9),
        "cpu_s": run.cost.cpu_s, "steps": run.cost.steps,
    }  # fmt: skip
    if level == top:
        slip = closed(thinned(run))[1]
        return replace(
            row,
            cost=cost,
            error=0.0,
            force_error=0.0,
            slip=slip,
            resolution=0.0,
            exact="the richest: all others are held against it",
        )
    if top in runs:
        found = error_against(run, runs[top])
        row = replace(
            row,
            error=found.poses,
            worst=found.worst,
            force_error=found.forces,
            load_error=found.loads,
            slip=found.slip,
            resolution=found.resolution,
        )
    scenes = [design.scene(scene, f, span, extra) for f in (level, top)]
    same = agreement(m, design.mechanism(top), *scenes)
    return replace(row, cost=cost, exact=exact_words(same, top) if same.exact else "")


def _chosen(rows: Sequence[Level], needs: Sequence[str], tolerance: float) -> tuple[str | None, str]:
    passed: list[str] = []
    for row in rows:
        why = _refused(row, needs, tolerance)
        if why:
            passed.append(f"{row.fidelity}: {why}")
            continue
        text = row.exact or f"within {row.error:.2g} m or rad of {rows[-1].fidelity} (tolerance {tolerance:g})"
        if len(rows) == 1:
            text = "the only one"
        return row.fidelity, sentence(row.fidelity, needs, passed, text)
    return None, f"no fidelity answers what is needed: {'; '.join(passed)}"


def _refused(row: Level, needs: Sequence[str], tolerance: float) -> str:
    cannot = [n for n in needs if n in row.missing]
    if cannot:
        return f"no {cannot[0].replace('_', ' ')}, {row.missing[cannot[0]]}"
    if row.reason:
        return f"its run is not to be trusted, {row.reason}"
    return "" if row.exact else too_far(row.as_error(), needs, tolerance)


def _with_status(row: Level, needs: Sequence[str], tolerance: float, chosen: str | None) -> Level:
    return replace(row, status="chosen" if row.fidelity == chosen else _refused(row, needs, tolerance) or "answers too")


def _closed_form(design: Design) -> Level:
    gone = dict.fromkeys(NEEDS[1:], "closed form of positions and rates")
    text = "closed form only: no run; `mechlab solve` answers poses"
    return Level(CLOSED_FORM, None, None, None, ("poses",), gone, status=text)
