"""Verbs about a mechanism itself: catalog, sheets, files, checks, claims, synthesis, the whole pipeline."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechlab import catalog
from mechlab.api.finding import Source, find, load
from mechlab.api.runs import simulate
from mechlab.api.viewing import story, view, write_run_page
from mechlab.experiment.entry import Entry
from mechlab.files import whole_folder, write
from mechlab.lab.design import Design
from mechlab.lab.results import FilesResult, TableResult
from mechlab.lab.sheet import Description, describe_design
from mechlab.mechanism import Mechanism
from mechlab.studies.check.check import CheckReport, run_checks, write_figure
from mechlab.studies.check.claims import ClaimReport, judge
from mechlab.studies.pipeline import RunResult

if TYPE_CHECKING:
    from mechlab.studies.doctor import Diagnosis
    from mechlab.studies.synthesis import SynthesisResult


def list_entries() -> TableResult:
    """The catalog."""
    entries = [catalog.entry(n) for n in catalog.NAMES]
    rows = tuple((e.name, e.title, ", ".join(e.fidelities), ", ".join(e.scenes), e.summary) for e in entries)
    data = {
        "mechanisms": [
            {
                "name": e.name,
                "title": e.title,
                "summary": e.summary,
                "fidelities": list(e.fidelities),
                "scenes": list(e.scenes),
            }
            for e in entries
        ]
    }
    return TableResult(("name", "title", "fidelities", "scenes", "summary"), rows, data)


def show(source: Source, values: Mapping[str, Any] | None = None, fidelity: str | None = None) -> Description:
    """Parameters, structure, bodies, fidelities, scenes, questions. The source "toolpath" is no mechanism but a question."""
    if source == "toolpath" and not values and fidelity is None:
        from mechlab.lab.sheet import describe_question
        from mechlab.studies.toolpath import QUESTION

        return describe_question("toolpath", QUESTION)
    return describe_design(load(source, **dict(values or {})), fidelity)


def generate(
    source: Source, values: Mapping[str, Any] | None = None, out: str | Path = "out", fidelity: str | None = None
) -> FilesResult:
    """Model files, each reloaded by its consumer; the MJCF is run for a moment in plain MuJoCo, and says a smaller timestep or
    another integrator where it needs one. Exit code 3 where none was found: the warning says what to do."""
    d = load(source, **dict(values or {}))
    m = d.mechanism(fidelity)
    from mechlab.lab.generate import write_verified

    made = write_verified(m, out, d.file_settings)
    warnings = (*d.warnings, *made.trial.warnings)
    return FilesResult(Path(out), made.files, made.sentence, warnings, made.trial.exit_code)


def generate_catalog(out: str | Path = "models", names: Sequence[str] = (), pictures: bool = True) -> FilesResult:
    """A folder for each mechanism of the catalog: model files of its richest fidelity and the sheet (README.md).

    pictures: also picture.png, the plots of the default scene (motion.svg), and gallery.png, which shows every picture in `out`.
    """
    from mechlab.lab.generate import write_verified
    from mechlab.studies.sheet import model_sheet

    files: dict[str, Path] = {}
    warnings: list[str] = []
    code = 0
    for name in names or catalog.NAMES:
        d = load(name)
        folder = Path(out) / name
        with whole_folder(folder) as stage:
            made = write_verified(d.mechanism(list(d.entry.fidelities)[-1]), stage, d.file_settings)
            code = max(code, made.trial.exit_code)
            warnings += [f"{name}: {w}" for w in made.trial.warnings]
            sheet = model_sheet(d, run_checks([d]), judge([d.entry]), "picture.png", "motion.svg")
            write(stage / "README.md", sheet)
            if pictures:
                from mechlab.viewer.film import write_motion_svg

                view(name, png=stage / "picture.png")
                write_motion_svg(story(simulate(name)), stage / "motion.svg")
        _remove_unnamed_meshes(folder)
        files[name] = folder
    if pictures:
        files["gallery"] = _gallery_picture(Path(out))
    return FilesResult(Path(out), files, made.sentence, tuple(warnings), code)


def _remove_unnamed_meshes(folder: Path) -> None:
    """Meshes that an earlier run wrote there and the model does not name any more."""
    from mechlab.shapes.build import HEADER

    text = (folder / f"{folder.name}.xml").read_text("utf-8")
    for mesh in (folder / "meshes").glob("*.obj"):
        if f'"meshes/{mesh.name}"' not in text and mesh.read_text("utf-8").startswith(HEADER):
            mesh.unlink()


def _gallery_picture(folder: Path) -> Path:
    """gallery.png: the pictures of all mechanisms that have a folder there, in the order of the catalog."""
    from mechlab.viewer.gallery import contact_sheet

    kept = [(catalog.entry(n).title, folder / n / "picture.png") for n in catalog.NAMES]
    made = contact_sheet([(title, p.read_bytes()) for title, p in kept if p.is_file()])
    return write(folder / "gallery.png", made)


def check(sources: Source | Sequence[Source] = (), values: Mapping[str, Any] | None = None) -> CheckReport:
    """Every check of the mechanisms (default: the whole catalog)."""
    many = (
        [sources]
        if isinstance(sources, str | Path | Mechanism | Design | Entry) or callable(sources)
        else list(sources)
    )
    return run_checks([load(s, **dict(values or {})) for s in many or catalog.NAMES])


def claims(sources: Source | Sequence[Source] = (), figure: str | Path | None = None) -> ClaimReport:
    """The ledger of printed claims (default: the whole catalog). figure: a file to draw the verdict to, for the one
    mechanism that has a figure."""
    many = (
        [sources]
        if isinstance(sources, str | Path | Mechanism | Design | Entry) or callable(sources)
        else list(sources)
    )
    entries = [find(s) for s in many or catalog.NAMES]
    drawn = "" if figure is None else str(write_figure(entries, figure))
    return replace(judge(entries), figure=drawn)


def doctor(source: Source) -> Diagnosis:
    """What is wrong, or will go wrong, with an MJCF (.xml) or URDF file, or any other source: freedoms, redundant rows by
    name, gap of the reference pose, softness, traps of the engines, a short run of the file as it is, settings to paste.

    An .xml or .urdf is taken as MuJoCo takes it, whatever it holds. Raises MechlabError for a file that cannot be read.
    """
    from mechlab.engines.protocol import engine

    engine("mujoco")  # raises EngineMissing where it is not installed
    from mechlab.studies.doctor.case import ROOTS, case_of, read_case
    from mechlab.studies.doctor.diagnose import diagnose

    if isinstance(source, str | Path) and Path(source).suffix.lower() in ROOTS:
        return diagnose(read_case(Path(source)))
    kind = "JSON" if str(source).endswith(".json") else "mechanism"
    return diagnose(case_of(load(source).mechanism(), kind))


def synthesize(task: str, values: Mapping[str, Any] | None = None, **more: Any) -> SynthesisResult:
    """Dimensions from wanted properties; tasks: planetary, gear_linkage, closed_differential. See `mechlab.studies.synthesis`."""
    from mechlab.studies.synthesis import synthesize as work

    return work(task, dict(values or {}) | more)


def run(
    source: Source,
    values: Mapping[str, Any] | None = None,
    out: str | Path = "out",
    progress: Callable[[str], None] = lambda line: None,
) -> RunResult:
    """The whole pipeline: files, checks, a run of the default scene, the page."""
    from mechlab.studies.pipeline import pipeline

    return pipeline(load(source, **dict(values or {})), Path(out), write_run_page, progress)
