"""Verbs about a mechanism itself: catalog, sheets, files, checks, claims, the whole pipeline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mechlab.api.arguments import File, Progress, Stages, Values, key_values, silent
from mechlab.api.finding import Source, find_all, load_design
from mechlab.api.suggestions import suggesting
from mechlab.catalog.table import TABLE, Motion
from mechlab.errors import explained
from mechlab.studies.direct import NAMES as DIRECT_QUESTIONS
from mechlab.values import Value

if TYPE_CHECKING:
    from mechlab.catalog.listing import TableResult
    from mechlab.lab.results import FilesResult
    from mechlab.lab.sheet import Description
    from mechlab.mechanism import Builder
    from mechlab.studies.check.check import CheckReport
    from mechlab.studies.check.claims import ClaimReport
    from mechlab.studies.pipeline import RunResult


@explained
def list_entries(
    *, family: str | None = None, freedoms: int | None = None, motion: Motion | None = None, search: str | None = None
) -> TableResult:
    """The catalog: name, family, freedoms, title, one sentence; fidelities and scenes stand in the data.

    Options:
        family=F: one family, such as straight-line, gear-train, parallel-robot
        freedoms=N: mechanisms with this many degrees of freedom
        motion=M: in parallel planes, about one point, or in space
        search=WORDS: entries that have all these words in name, title, family, motion or sentence
    """
    from mechlab.catalog.listing import TableResult, found_in, moving, one_family

    chosen = found_in(moving(one_family(TABLE, family), freedoms, motion), search)
    rows = tuple((e.name, e.family, f"{e.freedoms} {e.motion}", e.title, e.summary) for e in chosen)
    data = {
        "mechanisms": [
            {
                "name": e.name, "title": e.title, "family": e.family, "summary": e.summary, "fidelities": list(e.fidelities),
                "scenes": list(e.scenes), "freedoms": e.freedoms, "motion": e.motion,
            }
            for e in chosen
        ]
    }  # fmt: skip
    return TableResult(("name", "family", "freedoms", "title", "summary"), rows, data)


@explained
@suggesting
def show(
    source: Source, values: Values | None = None, /, *, fidelity: str | None = None, **parameters: Value
) -> Description:
    """Parameters, structure, bodies, fidelities, scenes, questions. The sources "toolpath", "bspline"
    and "regions" are no mechanisms but questions.

    Options:
        fidelity=F: level of fidelity: kinematic, minimal, parts, full
    """
    given = key_values(values, parameters)
    if isinstance(source, str) and source in DIRECT_QUESTIONS and not given and fidelity is None:
        from mechlab.lab.sheet import describe_question
        from mechlab.studies.direct.table import DIRECT

        return describe_question(source, DIRECT[source].question)
    from mechlab.lab.sheet import describe_design

    return describe_design(load_design(source, given), fidelity)


@explained
@suggesting
def edit(
    source: Source, values: Values | None = None, /, *, fidelity: str | None = None, **parameters: Value
) -> Builder:
    """A Builder of a mechanism, a design, a file or a name of the catalog, at a fidelity: add parts, change, rename or remove
    them, attach another mechanism; then `assemble()` closes it, or `build()` where it closes as it is.

    Without a change `edit(m).build() == m`. What the reader of a file left out stays left out; it is a warning.
    """
    from mechlab.mechanism import Builder

    return Builder.of(load_design(source, key_values(values, parameters)).mechanism(fidelity))


@explained
@suggesting
def generate(
    source: Source,
    values: Values | None = None,
    /,
    out: File = "out",
    fidelity: str | None = None,
    also: Sequence[str] = (),
    **parameters: Value,
) -> FilesResult:
    """Model files, each reloaded by its consumer; the MJCF is run for a moment in plain MuJoCo, and says a smaller timestep or
    another integrator where it needs one. Exit code 3 where none was found: the warning says what to do.

    Options:
        out=DIR: folder for the files
        fidelity=F: level of fidelity: minimal, parts, full
        also=A,...: more files for other tools: ros2 (a package), sdf (loops included), extended-urdf (loops in a YAML file), stl, 3mf
            (parts, in mm), usd
    """
    from mechlab.files import whole_folder
    from mechlab.formats.exports import EXPORTS, chosen
    from mechlab.lab.generate import write_verified
    from mechlab.lab.results import FilesResult

    exports = chosen(also)
    d = load_design(source, key_values(values, parameters))
    m = d.mechanism(fidelity)
    if not exports:
        made = write_verified(m, out, d.file_settings)
        return FilesResult(Path(out), made.files, made.sentence, (*d.warnings, *made.trial.warnings), made.trial.exit_code)
    with whole_folder(out) as stage:
        made = write_verified(m, stage, d.file_settings)
        files = {kind: Path(out) / path.relative_to(stage) for kind, path in made.files.items()}
        lost: list[str] = []
        for name in exports:
            written = EXPORTS[name](m, stage)
            files |= {kind: Path(out) / path for kind, path in written.files.items()}
            lost += [f"not in {name}: {x.sentence}" for x in written.left_out]
    return FilesResult(Path(out), files, made.sentence, (*d.warnings, *made.trial.warnings, *lost), made.trial.exit_code)


@explained
def generate_catalog(out: File = "models", names: Sequence[str] = (), *, pictures: bool = True) -> FilesResult:
    """A folder for each mechanism of the catalog: model files of its richest fidelity and the sheet (README.md); `out`/README.md: a
    table of all of them (with names: where there is one, their rows).

    pictures: also picture.png, the plots of the default scene (motion.svg), the figures of the sources, and gallery.png, which shows every
    picture in `out`.
    """
    from mechlab import catalog
    from mechlab.files import whole_folder, write
    from mechlab.lab.generate import write_verified
    from mechlab.lab.results import FilesResult
    from mechlab.studies.check.check import run_checks
    from mechlab.studies.check.claims import run_claims
    from mechlab.studies.check.figures import make_figures, write_picture
    from mechlab.studies.picture_style import fewer_colors
    from mechlab.studies.sheet import model_sheet

    files: dict[str, Path] = {}
    warnings: list[str] = []
    code = 0
    for name in names or catalog.NAMES:
        d = load_design(name, {})
        folder = Path(out) / name
        with whole_folder(folder) as stage:
            made = write_verified(d.mechanism(list(d.entry.fidelities)[-1]), stage, d.file_settings)
            code = max(code, made.trial.exit_code)
            warnings += [f"{name}: {w}" for w in made.trial.warnings]
            drawn = make_figures([d.entry], "all") if d.entry.figures else []
            sheet = model_sheet(d, run_checks([d]), run_claims([d.entry]), drawn, "picture.png", "motion.svg")
            write(stage / "README.md", sheet)
            if pictures:
                from mechlab.api.runs import simulate
                from mechlab.api.viewing import story, view
                from mechlab.viewer.film import write_motion_svg

                view(name, png=stage / "picture.png")
                fewer_colors(stage / "picture.png")
                write_motion_svg(story(simulate(name)), stage / "motion.svg")
                for x in drawn:
                    write_picture(x.figure, x.drawing, stage / f"{x.figure.stem}.png")
        _remove_unnamed_meshes(folder)
        files[name] = folder
    table = Path(out) / "README.md"
    if not names or table.is_file():
        from mechlab.studies.outside import catalog_table

        before = table.read_text("utf-8") if names else ""
        made_of = [catalog.entry(n) for n in names or catalog.NAMES]
        files["table"] = write(table, catalog_table(made_of, before, catalog.NAMES))
    if pictures:
        files["gallery"] = _gallery_picture(Path(out))
    return FilesResult(Path(out), files, made.sentence, tuple(warnings), code)


def _remove_unnamed_meshes(folder: Path) -> None:
    """Meshes that an earlier run wrote there and the model does not name any more."""
    from mechlab.shapes.obj import HEADER

    text = (folder / f"{folder.name}.xml").read_text("utf-8")
    for mesh in (folder / "meshes").glob("*.obj"):
        if f'"meshes/{mesh.name}"' not in text and mesh.read_text("utf-8").startswith(HEADER):
            mesh.unlink()


def _gallery_picture(folder: Path) -> Path:
    """gallery.png: the pictures of all mechanisms that have a folder there, in the order of the catalog."""
    from mechlab import catalog
    from mechlab.files import write
    from mechlab.viewer.gallery import contact_sheet

    kept = [(catalog.entry(n).title, folder / n / "picture.png") for n in catalog.NAMES]
    made = contact_sheet([(title, p.read_bytes()) for title, p in kept if p.is_file()], columns=7)
    return write(folder / "gallery.png", made)


@explained
@suggesting
def check(
    sources: Source | Sequence[Source] = (), values: Values | None = None, /, *, progress: Progress = silent, **parameters: Value
) -> CheckReport:
    """Every check of the mechanisms (default: the whole catalog)."""
    from mechlab.studies.check.check import run_checks

    given = key_values(values, parameters)
    return run_checks([load_design(entry, given) for entry in find_all(sources)], progress)


@explained
def claims(
    sources: Source | Sequence[Source] = (), /, *, figure: File | None = None, out: File | None = None, progress: Progress = silent
) -> ClaimReport:
    """The ledger of printed claims (default: the whole catalog), and the figures of the sources, ours against what is printed.

    Options:
        figure=[N]: compute a figure of the source: its number or name as printed, or all; the ledger lists them
        out=FILE: picture of the figure (.png, .svg, .pdf; .gif: in motion, where something moves), or a folder for several
    """
    from mechlab.studies.check.claims import run_claims
    from mechlab.studies.check.figures import ALL, SUFFIXES, make_figures

    if isinstance(sources, Sequence) and not isinstance(sources, str):  # the others need not be loaded for the whole ledger
        sources = sources or [row.name for row in TABLE if row.claims]
    entries, warnings = find_all(sources), tuple[str, ...]()
    if figure is not None and out is None and Path(figure).suffix.lower() in SUFFIXES:
        with_figures = [e for e in entries if e.figures]
        if len(with_figures) == 1:  # as before figures had names: the first one, into this file
            name = with_figures[0].figures[0].name
            warnings = (f"`figure` takes the name of a figure; {name} is written to {figure}, which is given by `out` now",)
            figure, out = name, figure
    if figure is None and out is not None:
        figure = ALL
    drawn = () if figure is None else tuple(make_figures(entries, str(figure), out))
    return replace(run_claims(entries, progress), figures=drawn, warnings=warnings)


@explained
@suggesting
def run(
    source: Source,
    values: Values | None = None,
    /,
    out: File = "out",
    *,
    progress: Stages = silent,
    **parameters: Value,
) -> RunResult:
    """The whole pipeline: files, checks, a run of the default scene, the page.

    Options:
        out=DIR: folder for the results
    """
    progress(f"{source}: the whole pipeline, into {out}")  # before the engines load, which takes a second
    from mechlab.api.pages import write_run_page
    from mechlab.studies.pipeline import pipeline

    return pipeline(load_design(source, key_values(values, parameters)), Path(out), write_run_page, progress)
