"""Verbs about anybody's model files: a diagnosis, a cured copy, a table over folders."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mechlab.api.arguments import Count, File, Progress, Seconds, silent
from mechlab.api.finding import Source, load_design, read_file
from mechlab.errors import MechlabError, explained

if TYPE_CHECKING:
    from mechlab.studies.doctor.audit import Audit
    from mechlab.studies.doctor.case import Diagnosis
    from mechlab.studies.doctor.cure import Cure


@explained
def doctor(source: Source, /) -> Diagnosis:
    """What is wrong, or will go wrong, with an MJCF (.xml) or URDF file, or any other source: freedoms, redundant rows by
    name, gap of the reference pose, softness, traps of the engines, a short run of the file as it is, settings to paste.

    An .xml or .urdf is taken as MuJoCo takes it, whatever it holds. Raises MechlabError for a file that cannot be read.
    """
    from mechlab.engines.protocol import engine

    engine("mujoco")  # raises EngineMissing where it is not installed
    from mechlab.studies.doctor.case import ROOTS, case_of, read_case
    from mechlab.studies.doctor.diagnose import diagnose

    if isinstance(source, str | Path) and Path(source).suffix.lower() in ROOTS:
        return diagnose(read_case(Path(source), read_file))
    kind = "JSON" if str(source).endswith(".json") else "mechanism"
    return diagnose(case_of(load_design(source, {}).mechanism(), kind))


@explained
def cure(source: str | Path, /, out: File = "cured.xml", *, overwrite: bool = False) -> Cure:
    """Write a copy of an MJCF file with the settings that its diagnosis asks for, and compare runs of both.

    The text is kept, with comments; changed are options, the softness of loops, contacts between overlapping neighbours, control
    ranges and the unit of angles, each only for an error or a warning. Raises MechlabError for a URDF, which has no such settings,
    and where `out` is the file itself.

    Options:
        out=FILE: the cured file
        overwrite: write even over the file itself
    """
    from mechlab.engines.protocol import engine

    engine("mujoco")  # raises EngineMissing where it is not installed
    from mechlab.studies.doctor.cure import cure_file

    return cure_file(Path(source), Path(out), read_file, overwrite)


@explained
def audit(
    sources: Sequence[str | Path],
    /,
    *,
    out: File | None = None,
    licences: File | None = None,
    pick: File | None = None,
    time_limit: Seconds = 120.0,
    jobs: Count | None = None,
    progress: Progress = silent,
) -> Audit:
    """Diagnoses of all MJCF and URDF files of folders, without those that others include: what each is, how mechlab reads it, a verdict,
    the gravest finding. Each file has a process of its own. Raises MechlabError for a folder that is not there, or has no model.

    Options:
        out=FILE: .html, .json, or a folder for both
        licences=FILE: a JSON mapping of patterns of names to licences, for models without a licence file above them
        pick=FILE: patterns of names, one a line: only these models
        time_limit=S: longest time for one file
        jobs=N: files at a time (default: one a core)
    """
    from mechlab.engines.protocol import engine

    engine("mujoco")  # raises EngineMissing where it is not installed
    from mechlab.formats.model_text import read_text
    from mechlab.lab.single_run import versions
    from mechlab.studies.doctor.audit import Audit, models_under, picked, read_mapping, run_audit

    if jobs is not None and jobs < 1:
        raise MechlabError(f"jobs must be at least 1, got {jobs}.")
    models, skipped = models_under(sources)
    if pick is not None:
        models = picked(models, [line for line in read_text(Path(pick)).splitlines() if line and not line.startswith("#")])
    if not models:
        raise MechlabError(f"there is no MJCF (.xml) or URDF file to examine in {', '.join(map(str, sources))}.")
    known = {} if licences is None else read_mapping(Path(licences))
    rows = run_audit(models, known, time_limit, jobs or os.cpu_count() or 1, progress)
    found = Audit(rows, skipped, versions())
    if out is None:
        return found
    return replace(found, paths=tuple(str(p) for p in found.save(Path(out)).values()))
