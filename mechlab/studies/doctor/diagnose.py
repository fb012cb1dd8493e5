"""The whole diagnosis of a file: structure, gap, softness, traps of the engines, a trial run, the order, settings to paste."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from mechlab.engines.mujoco.model import Model
from mechlab.engines.mujoco.model_file import joints, options, parts, softness
from mechlab.engines.mujoco.model_file.file_run import tried
from mechlab.engines.mujoco.model_file.options import IN_URDF, settings_to_paste
from mechlab.engines.mujoco.model_file.rows import EngineStructure, engine_structure, loops
from mechlab.engines.mujoco.model_file.start import start_pose
from mechlab.engines.mujoco.model_file.trial import TrialRun, run_trial
from mechlab.experiment.recording import Symptom
from mechlab.lab.single_run import versions
from mechlab.mechanism import Mechanism
from mechlab.mechanism.structure import Structure, structure
from mechlab.studies.doctor.case import Diagnosis, ExaminedFile
from mechlab.studies.doctor.file_text import compiler, compiler_settings, other_readers, urdf
from mechlab.studies.doctor.ranking import ranked
from mechlab.tables import listed

OPEN, TORN = 1e-9, 1e-3
"""Gap at the start relative to the size of the model: above OPEN a warning, above TORN an error."""
LOCKING = 1e-6
"""A nearly redundant row whose independent part is larger than this is inconsistent; a smaller part is too few
digits."""


def diagnose(case: ExaminedFile) -> Diagnosis:
    """The diagnosis of an examined file."""
    model = case.model
    own = structure(case.mechanism) if case.mechanism is not None else None
    seen, trial = None, None
    findings: list[Symptom] = []
    skipped: list[str] = []
    if case.root is not None and case.kind == "URDF":
        findings += urdf(case.root)
    if model is None:
        known = {"massless", "triangle", "tree"} & {f.name for f in findings}
        findings += [] if known else [Symptom("refused", "error", f"MuJoCo refuses the file: {case.refused}.")]
    else:
        findings += _text(case, model)
        start = start_pose(model)
        seen = tried(skipped, "freedoms and redundant rows", lambda: engine_structure(model, start, float(model.stat.extent)))
        if seen is not None:
            findings += _structure(seen, case.mechanism, own, model, _same_rows(case))
            skipped += [seen.skipped] if seen.skipped else []
        findings += parts.masses(model)
        if case.kind != "URDF":  # a URDF has no start pose, no integrator and no softness
            trial = tried(skipped, "a run", lambda: run_trial(model)) if model.nv else None
            findings += _engine(model, start, trial, skipped)
    notes = [f"mechlab cannot hold this file as a Mechanism ({case.unread}); it is diagnosed as MuJoCo sees it"] if case.unread else []
    notes += list(case.file.notes) if case.file is not None else []
    counted = own if case.kind == "URDF" and own is not None else seen or own
    gap = float(np.max(np.abs(seen.gaps), initial=0.0)) if seen is not None and len(seen.gaps) else None
    order = ranked(findings)
    paste = "" if model is None or not model.nv else IN_URDF if case.kind == "URDF" else settings_to_paste(model, trial, order)
    spinning = tuple(name for name, _ in seen.spins) if seen is not None else ()
    return Diagnosis(
        case.name, case.kind, counted.nv if counted else None, _rows(counted), counted.freedoms if counted else None,
        own.idle if own and own.idle else spinning, counted.redundant if counted else (), gap, order, paste, tuple(notes), versions(),
        None if model is None else model.nbody - 1, _loops(case), case.file, tuple(skipped), trial,
    )  # fmt: skip


def _same_rows(case: ExaminedFile) -> bool:
    """Whether MuJoCo's model and the mechanism have the same constraints: MuJoCo reads the tree of a URDF alone."""
    m = case.mechanism
    if m is None or case.file is None or case.file.lost:
        return False
    return case.kind != "URDF" or not m.is_closed


def _loops(case: ExaminedFile) -> int | None:
    """Closures and couplings: of the mechanism for a URDF, whose loops MuJoCo does not see, else those that act in MuJoCo."""
    m = case.mechanism
    if case.kind == "URDF" and m is not None:
        return len(m.loops) + len(m.couplings)
    return None if case.model is None else len(loops(case.model))


def _rows(counted: Structure | EngineStructure | None) -> int | None:
    if counted is None:
        return None
    return counted.rows if isinstance(counted, Structure) else len(counted.rows)


def _text(case: ExaminedFile, model: Model) -> Iterator[Symptom]:
    if case.stripped:
        text = f"MuJoCo refuses the file ({case.stripped}); it is examined without meshes, height fields and textures."
        yield Symptom("not_meshes", "warning", text)
    if case.root is None:
        return
    settings = compiler(case.root)
    radian = settings.get("angle", "degree") == "radian" or case.kind == "URDF"
    yield from joints.angles(model, radian, "angle" in settings)
    if case.kind != "URDF":
        yield from compiler_settings(case.root)
        yield from other_readers(case.root)


def _engine(model: Model, start: Any, trial: TrialRun | None, skipped: list[str]) -> list[Symptom]:
    harmless = trial is not None and trial.convinced_small
    gaps = None if trial is None or trial.reason else trial.gaps
    rules: dict[str, Callable[[], Iterator[Symptom]]] = {
        "limits of joints": lambda: joints.limits(model, start),
        "actuators": lambda: joints.commands(model),
        "softness": lambda: softness.softness(model, harmless),
        "sag": lambda: softness.sag(model, start, gaps),
        "options": lambda: options.options(model, start, trial),
        "tendons": lambda: parts.tendons(model, start),
        "dry friction": lambda: parts.friction(model),
        "stability of a step": lambda: options.growing_step(model, start),
        "contacts at the start": lambda: parts.contacts(model, start),
    }
    if trial is not None:
        rules |= {"a run": trial.symptoms, "memory of a run": trial.memory_full, "order of RK4": trial.order}
        skipped += [t.skipped for t in (trial, trial.follow) if t is not None and t.skipped]
    if options.too_large(model):
        skipped.append(f"the stability of a step: {model.nv} coordinates, above {options.MOST_COORDINATES}")
    found: list[Symptom] = []
    for what, rule in rules.items():
        found += tried(skipped, what, lambda rule=rule: list(rule())) or []  # type: ignore[misc]
    return found


def _structure(
    seen: EngineStructure, mechanism: Mechanism | None, own: Structure | None, model: Model, same: bool
) -> Iterator[Symptom]:
    """Findings "gap", "nearly_redundant", "locked", "spins", "singular_reference", "freedoms_differ"."""
    size = max(float(model.stat.extent), 1e-9)
    wide = {n: abs(float(g)) for n, g in zip(seen.rows, seen.gaps, strict=True) if abs(g) > OPEN * size}
    if wide:
        worst = max(wide, key=lambda n: wide[n])
        text = (
            f"the start is not assembled: {worst} is open by {wide[worst]:.3g}"
            f"{f', {len(wide) - 1} more rows, too' if len(wide) > 1 else ''}. The first steps pull it shut."
        )
        yield Symptom("gap", "error" if wide[worst] > TORN * size else "warning", text, number=wide[worst])
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
        yield Symptom("nearly_redundant", "error" if left > LOCKING else "warning", text, number=left)
    if seen.rows and seen.freedoms == 0 and not seen.nearly:
        yield Symptom(
            "locked", "error", "no freedom is left: every motion breaks a row; nothing here can move but by softness."
        )
    if seen.spins:
        count = sum(k for _, k in seen.spins)
        text = (
            f"{count} of the {seen.freedoms} freedoms {'is' if count == 1 else 'are'} local: {listed([n for n, _ in seen.spins])} can move "
            f"alone, as a rod spins between two balls. The mechanism has {seen.freedoms - count}."
        )
        cure = "damping on the joints of these bodies, or one of the two balls as a universal joint"
        yield Symptom("spins", "note", text, cure, count)
    if seen.reference_rank < seen.rank and loops(model):
        text = (
            f"the start is singular: rank {seen.reference_rank} there, {seen.rank} beside it (a change point or toggle "
            "position). A run that starts at rest here may take either branch."
        )
        yield Symptom("singular_reference", "warning", text)
    if (
        same
        and mechanism is not None
        and own is not None
        and mechanism.nv == seen.nv
        and own.freedoms != seen.freedoms
        and not seen.nearly
    ):
        text = f"mechlab counts {own.freedoms} freedoms, MuJoCo's rows leave {seen.freedoms}: look at both before trusting either."
        yield Symptom("freedoms_differ", "warning", text)
