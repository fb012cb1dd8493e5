"""The whole diagnosis of a file: structure, gap, softness, traps of the engines, a trial run, the order, settings to paste."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from mechlab.engines.mujoco.model import Model
from mechlab.engines.mujoco.model_file import options, parts, softness
from mechlab.engines.mujoco.model_file.options import IN_URDF, settings_to_paste
from mechlab.engines.mujoco.model_file.rows import EngineStructure, engine_structure
from mechlab.engines.mujoco.model_file.trial import TrialRun, run_trial
from mechlab.experiment.recording import Symptom
from mechlab.lab.single_run import versions
from mechlab.mechanism import Mechanism
from mechlab.mechanism.structure import Structure, structure
from mechlab.studies.doctor.case import ORDER, Diagnosis, ExaminedFile
from mechlab.studies.doctor.file_text import compiler_settings, other_readers, urdf

OPEN, TORN = 1e-9, 1e-4
"""Gap in the reference pose relative to the size of the model: above OPEN a warning, above TORN an error."""
LOCKING = 1e-6
"""A nearly redundant row whose independent part is larger than this is inconsistent; a smaller part is too few
digits."""


def diagnose(case: ExaminedFile) -> Diagnosis:
    """The diagnosis of an examined file."""
    model = case.model
    own = structure(case.mechanism) if case.mechanism is not None else None
    seen, trial = None, None
    findings: list[Symptom] = []
    notes: list[str] = []
    if case.root is not None and case.kind == "URDF":
        findings += urdf(case.root)
    if model is None:
        known = {"massless", "triangle", "tree"} & {f.name for f in findings}
        findings += [] if known else [Symptom("refused", "error", f"MuJoCo refuses the file: {case.refused}.")]
    else:
        findings += _text(case)
        start = np.array(model.qpos0)
        seen = engine_structure(model, start, float(model.stat.extent))
        findings += _structure(seen, case.mechanism, own, model)
        findings += parts.masses(model)
        findings += parts.limits(model, start)
        if case.kind != "URDF":  # a URDF has no integrator and no softness
            trial = run_trial(model) if model.nv else None
            findings += _engine(model, start, trial)
    if case.unread:
        notes.append(f"mechlab cannot hold this file as a Mechanism ({case.unread}); it is diagnosed as MuJoCo sees it")
    counted = own if case.kind == "URDF" or seen is None else seen
    gap = float(np.max(np.abs(seen.gaps), initial=0.0)) if seen is not None and len(seen.gaps) else None
    findings.sort(key=lambda f: ORDER[f.severity])
    return Diagnosis(
        case.name, case.kind, counted.nv if counted else None, _rows(counted), counted.freedoms if counted else None,
        own.idle if own else (), counted.redundant if counted else (), gap, tuple(findings),
        "" if model is None or not model.nv else IN_URDF if case.kind == "URDF" else settings_to_paste(model, trial, findings),
        tuple(notes), versions(),
    )  # fmt: skip


def _rows(counted: Structure | EngineStructure | None) -> int | None:
    if counted is None:
        return None
    return counted.rows if isinstance(counted, Structure) else len(counted.rows)


def _text(case: ExaminedFile) -> Iterator[Symptom]:
    if case.root is not None and case.kind != "URDF":
        yield from compiler_settings(case.root)
        yield from other_readers(case.root)


def _engine(model: Model, start: Any, trial: TrialRun | None) -> Iterator[Symptom]:
    yield from softness.softness(model)
    yield from softness.sag(model, start)
    yield from options.options(model, start)
    yield from parts.tendons(model, start)
    yield from parts.friction(model)
    yield from options.growing_step(model, start)
    yield from parts.contacts(model, start)
    if trial is not None:
        yield from trial.symptoms()
        yield from trial.order()


def _structure(
    seen: EngineStructure, mechanism: Mechanism | None, own: Structure | None, model: Model
) -> Iterator[Symptom]:
    """Findings "gap", "nearly_redundant", "locked", "singular_reference", "freedoms_differ"."""
    size = max(float(model.stat.extent), 1e-9)
    wide = {n: abs(float(g)) for n, g in zip(seen.rows, seen.gaps, strict=True) if abs(g) > OPEN * size}
    if wide:
        worst = max(wide, key=lambda n: wide[n])
        text = (
            f"the reference pose is not assembled: {worst} is open by {wide[worst]:.3g}"
            f"{f', {len(wide) - 1} more rows, too' if len(wide) > 1 else ''}. The first steps pull it shut."
        )
        yield Symptom("gap", "error" if wide[worst] > TORN * size else "warning", text)
    if seen.nearly:
        worst_row, left = max(seen.nearly, key=lambda pair: pair[1])
        count = len(seen.nearly)
        text = (
            f"{worst_row} repeats other rows but for {left:.2g} of its size{f' ({count} rows do so)' if count > 1 else ''}: "
            f"without the difference there are {seen.freedoms + count} freedoms, with it {seen.freedoms}. "
        )
        text += (
            "A ratio or an axis slightly off locks the mechanism: write tooth counts, one shared axis."
            if left > LOCKING
            else "Numbers with too few digits do that (MuJoCo's own writer keeps 6)."
        )
        yield Symptom("nearly_redundant", "error" if left > LOCKING else "warning", text)
    if seen.rows and seen.freedoms == 0 and not seen.nearly:
        yield Symptom(
            "locked", "error", "no freedom is left: every motion breaks a row; nothing here can move but by softness."
        )
    if seen.reference_rank < seen.rank:
        text = (
            f"the reference pose is singular: rank {seen.reference_rank} there, {seen.rank} beside it (a change point or toggle "
            "position). A run that starts at rest here may take either branch."
        )
        yield Symptom("singular_reference", "warning", text)
    if (
        mechanism is not None
        and own is not None
        and mechanism.nv == seen.nv
        and own.freedoms != seen.freedoms
        and not seen.nearly
    ):
        text = f"mechlab counts {own.freedoms} freedoms, MuJoCo's rows leave {seen.freedoms}: look at both before trusting either."
        yield Symptom("freedoms_differ", "warning", text)
