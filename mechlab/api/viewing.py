"""Verbs that show: pages, pictures, films, the gallery."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mechlab.api.arguments import File, Progress, Stages, Values, key_values, silent
from mechlab.api.finding import Source, load_design
from mechlab.api.runs import simulate
from mechlab.api.suggestions import suggesting
from mechlab.errors import MechlabError, UsageError, explained
from mechlab.files import whole_folder
from mechlab.values import Range, Value

if TYPE_CHECKING:
    from mechlab.experiment.recording import Recording
    from mechlab.lab.design import Design
    from mechlab.lab.results import FilesResult
    from mechlab.viewer.gallery import Exhibit
    from mechlab.viewer.story import Story

LOCAL = "127.0.0.1"
"""The address of a live page: this machine only."""
Axis = Range | Sequence[float]


@explained
def load_recording(path: File, /, most_bytes: float | None = None) -> Recording:
    """The Recording of a .npz file that `save_recording` wrote; see `mechlab.formats.load_recording`. most_bytes: the largest
    size of all its numbers. Raises MechlabError, which names the file and what is wrong with it.
    """
    from mechlab.formats import load_recording as read

    return read(path) if most_bytes is None else read(path, most_bytes)


def page_of_recording(recording: Recording) -> str:
    """What a notebook shows of a run: its offline page."""
    from mechlab.api.pages import recording_page

    return recording_page(recording)


@explained
@suggesting
def story(
    source: Source | Recording,
    values: Values | None = None,
    /,
    *,
    against: Source | Recording | None = None,
    rebuild: bool = True,
    **parameters: Value,
) -> Story:
    """The Story of a Recording (or of its .npz), or the still one of a mechanism. against: a second run, drawn as ghost.
    rebuild: with all parts, also those that the run did not have."""
    from mechlab.api.pages import recording_of, run_story, still_story
    from mechlab.viewer.comparison import against as compared
    from mechlab.viewer.comparison import differences

    given = key_values(values, parameters)
    recording = recording_of(source)
    if recording is None:
        if against is not None:
            raise MechlabError(
                f"only a run can be compared with another: {source} is a mechanism, expected a .npz of a run."
            )
        return still_story(load_design(source, given))  # type: ignore[arg-type]
    _refuse_keys(given)
    first = run_story(recording, rebuild)
    if against is None:
        return first
    other = recording_of(against)
    if other is None:
        raise MechlabError(f"against: expected a Recording or the .npz of a run, got {against!r}.")
    name = f"the run {Path(against).name}" if isinstance(against, str | Path) else f"the run of scene {other.scene}"
    second = run_story(other, rebuild)
    return compared(first, second, name, differences(recording, other, (dict(first.facts), dict(second.facts))))


def _refuse_keys(given: Values) -> None:
    if given:
        raise MechlabError(f"{', '.join(given)}: a run that is recorded keeps its values; give them to a mechanism.")


def _sliders(design: Design) -> list[str]:
    """The parameters that an entry names for its page, without those that are 0, of which a share is nothing; two at most."""
    from mechlab.viewer.html_page import MOST_KEYS

    return [name for name in design.entry.sliders if getattr(design.parameters, name)][:MOST_KEYS]


@explained
@suggesting
def explore(
    source: Source, values: Values | None = None, /, *, vary: Mapping[str, Axis] | None = None, **parameters: Value
) -> Story:
    """A Story whose drives can be moved by sliders and parts grabbed in the page, which solves the loops: the richest fidelity.

    vary: up to two parameters that can be changed in the page too, key -> range or values; by default those that the entry
    names (the first two that are not 0), by 20 % either way.
    """
    from mechlab.api.pages import explored_story
    from mechlab.viewer.html_page import variations
    from mechlab.viewer.named_numbers import named_numbers

    design = load_design(source, key_values(values, parameters))
    named = named_numbers(design)
    if named is not None and isinstance(source, str):
        named = replace(named, name=source)
    first = replace(explored_story(design), named=named)
    asked: Mapping[str, Axis | None] = dict.fromkeys(_sliders(design)) if vary is None else vary
    return replace(first, variants=variations(design, asked, first, explored_story))


@explained
@suggesting
def view(
    source: Source | Recording,
    values: Values | None = None,
    /,
    *,
    html: File | None = None,
    png: File | None = None,
    glb: File | None = None,
    mp4: File | None = None,
    csv: File | None = None,
    against: Source | Recording | None = None,
    explorable: bool = False,
    vary: Mapping[str, Axis] | None = None,
    fidelity: str | None = None,
    host: str = LOCAL,
    port: int = 0,
    wait: bool = True,
    progress: Progress = silent,
    **parameters: Value,
) -> FilesResult:
    """Files of a run or a mechanism: page, picture, animated GLB, film, table; without a file a live page on 127.0.0.1.

    A mechanism that has a default scene is simulated first, so that it moves (not for a picture alone). vary: see `explore`.
    wait: a live page is served until it is interrupted. The exit code is 3 where a run that is shown must not be trusted.

    Options:
        html=F: write one page that works offline, instead of a live page
        png=F: write a picture
        glb=F: write an animated model (glTF) that any 3-D viewer plays
        mp4=F: write a film (needs ffmpeg or the package imageio-ffmpeg)
        csv=F: write all channels as a table
        against=run.npz: compare with a second run: its ghost, its curves
        explorable: with `html`: sliders for the drives instead of a run
        vary=KEY=LO:HI:N: with `explorable`: a slider for this parameter too (twice for two); none: --vary none
        fidelity=F: simulate and draw this level alone: minimal, parts, full (default: the scene's own, drawn with all parts)
        host=H: address of the live page (default: this machine only)
    """
    wanted = {"page": html, "picture": png, "GLB": glb, "film": mp4, "table": csv}
    if vary is not None and not explorable:
        raise UsageError("`vary` needs `explorable`: it adds a slider to the page of the drives.")
    if explorable and (html is None or glb or mp4 or csv or against):
        raise UsageError("`explorable` needs `html`, the page to write, and goes with nothing that needs a run.")
    if (port or host != LOCAL) and any(x is not None for x in wanted.values()):
        raise UsageError("`host`, port: they are for a live page, and a file is asked for: leave out one of them.")
    from mechlab.api.pages import at_fidelity, recording_of

    given = key_values(values, parameters)
    recording = recording_of(source)
    if recording is not None:
        _refuse_keys(given)
        if fidelity is not None:
            raise MechlabError(f"fidelity {fidelity}: a run that is recorded keeps its own, {recording.fidelity or 'none'}.")
        if explorable:
            raise MechlabError("to explore takes a mechanism: a run that is recorded has no drives to move.")
    elif fidelity is not None:
        source, given = at_fidelity(load_design(source, given), fidelity), {}  # type: ignore[arg-type]
    if recording is None and not explorable and any(x is not None for x in (html, glb, mp4, csv, against)):
        recording = simulate(source, given)  # type: ignore[arg-type]
    if recording is not None:
        shown = story(recording, against=against, rebuild=fidelity is None)
    else:
        shown = explore(source, given, vary=vary) if explorable else story(source, given)  # type: ignore[arg-type]
    if not any(x is not None for x in wanted.values()):
        return _live(source, shown, given, host, port, wait, fidelity is None)
    from mechlab.lab.results import FilesResult

    bad = [sentence for severity, sentence in shown.health if severity == "error"]
    notes = ["; ".join(bad)] if bad else []
    files: dict[str, Path] = {}
    if html is not None:
        from mechlab.viewer import write_page

        files["page"] = write_page(shown, Path(html))
    if png is not None:
        from mechlab.viewer.picture import write_png

        files["picture"] = write_png(shown, Path(png))
    if glb is not None:
        from mechlab.viewer.glb import write_glb

        files["GLB"] = write_glb(shown, Path(glb))
    if csv is not None and recording is not None:
        from mechlab.viewer.from_recording import write_csv

        files["table"] = write_csv(recording, Path(csv))
    if mp4 is not None:
        from mechlab.viewer.film import film_sentence, write_mp4

        files["film"] = write_mp4(shown, Path(mp4), progress=progress)
        notes.append(film_sentence(shown))
    sentence = " ".join(n for n in notes if n)
    return FilesResult(next(iter(files.values())).parent, files, sentence, exit_code=3 if bad else 0)


def _live(
    source: Source | Recording, shown: Story, given: Values, host: str, port: int, wait: bool, rebuild: bool
) -> FilesResult:
    """A live page; a mechanism is simulated while one looks, and the page of the run follows. Its parameters can be
    changed there."""
    from mechlab.api.pages import LivePages, recording_of
    from mechlab.lab.results import FilesResult
    from mechlab.viewer.live import serve

    design = load_design(source, given) if wait and recording_of(source) is None else None  # type: ignore[arg-type]
    pages = None if design is None else LivePages(design, rebuild)
    with serve(shown if pages is None else pages.shown(shown), host=host, port=port) as server:
        rebuilder = None
        if design is not None and pages is not None:
            from mechlab.viewer.streaming import Rebuilder

            rebuilder = Rebuilder(server, design, pages.still, pages.final)
        try:
            if wait:
                server.wait()
        finally:
            if rebuilder is not None:
                rebuilder.end()
        return FilesResult(Path("."), {}, f"served on {server.url}")


@explained
@suggesting
def studio(source: Source, values: Values | None = None, /, **parameters: Value) -> FilesResult:
    """MuJoCo's own web viewer with a mechanism, until it is interrupted. Warns on stderr: its port is open to the network."""
    import tempfile

    from mechlab.lab.results import FilesResult
    from mechlab.viewer.studio import open_studio

    design = load_design(source, key_values(values, parameters))
    with tempfile.TemporaryDirectory() as folder:
        design.save(folder)
        open_studio(Path(folder) / "scene.xml", design.entry.title)
    return FilesResult(Path("."), {}, "the web viewer was closed")


@explained
def draw(*, html: File | None = None, port: int = 0, wait: bool = True) -> FilesResult:
    """An empty plane in which a planar linkage is drawn: pivots, bars, sliders, gears, a motor; saved there as the JSON that
    every verb takes. Without a file the page is served on 127.0.0.1 until it is interrupted.

    Options:
        html=F: write the page, which works offline, instead
    """
    from mechlab.lab.results import FilesResult
    from mechlab.viewer.drawing_page import DrawingServer, write_drawing_page

    if html is not None:
        if port:
            raise MechlabError(f"port {port}: a page that is written to a file has no server.")
        page = write_drawing_page(Path(html))
        return FilesResult(page.parent, {"page": page})
    with DrawingServer(port) as server:
        print(server.url, flush=True)
        if wait:
            server.wait()
        return FilesResult(Path("."), {}, f"served on {server.url}")


@explained
def gallery(out: File, names: Sequence[str] = (), *, models: File = "models", progress: Stages = silent) -> FilesResult:
    """All mechanisms of the catalog as pages in one folder that any static host can serve; index.html first.

    Each has a picture (from MODELS/NAME/picture.png where that exists) that moves under the pointer, one sentence, the page of its
    default run, the page to explore where it has drives, and its sheet. With the whole catalog come the pages of `compare`. Made in
    as many processes as there are cores.
    """
    from functools import partial

    from mechlab import catalog
    from mechlab.lab.results import FilesResult
    from mechlab.processes import cores, in_processes
    from mechlab.viewer.gallery import write_gallery

    asked = tuple(names or catalog.NAMES)
    for name in asked:
        load_design(name, {})
    many = min(cores(), len(asked))
    made: dict[str, Exhibit] = {}
    with whole_folder(out) as folder:
        work = partial(exhibit, folder=folder, models=Path(models).absolute())
        for name, shown in ((n, work(n)) for n in asked) if many == 1 else in_processes(work, asked, many):
            made[name] = shown
            moved = "" if shown.explorable else "; no page to move it: no drive, or no loop that one could close"
            progress(f"{len(made):2d} of {len(asked)}: {name}{moved}")
        studies = {} if names else _study_pages(folder, progress)
        index = write_gallery([made[name] for name in asked], folder, studies)
    return FilesResult(Path(out), {"gallery": Path(out) / index.name}, f"{len(made)} mechanisms")


def _study_pages(folder: Path, progress: Stages) -> dict[str, str]:
    """Writes the comparisons into the folder of the gallery, whose pages they link; file -> question."""
    from typing import get_args

    from mechlab.api.arguments import Compared
    from mechlab.api.designs import compare

    pages = {}
    for kind in get_args(Compared):
        pages[f"{kind}.html"] = compare(kind, out=folder / f"{kind}.html").question
        progress(f"compared: {kind}")
    return pages


def exhibit(name: str, folder: Path, models: Path) -> Exhibit:
    """One mechanism of the gallery: writes its pages into FOLDER/NAME; its picture is MODELS/NAME/picture.png, or made."""
    from mechlab.api.pages import run_story
    from mechlab.lab.sheet import describe_design
    from mechlab.viewer import write_page
    from mechlab.viewer.film import motion_svg
    from mechlab.viewer.gallery import THUMBNAIL, Exhibit
    from mechlab.viewer.picture import write_png
    from mechlab.viewer.thumbnail import thumbnail

    design = load_design(name, {})
    run = run_story(simulate(name))
    write_page(run, folder / name / "run.html")
    kept = models / name / "picture.png"
    picture = kept if kept.is_file() else write_png(run, folder / name / "picture.png", size=THUMBNAIL, samples=4)
    moved = True
    try:
        write_page(explore(name, vary={}), folder / name / "explore.html")
    except MechlabError:
        moved = False
    return Exhibit(
        name, design.entry.title, design.entry.summary, picture.read_bytes(), describe_design(design)._repr_html_(),
        moved, motion_svg(run), design.entry.family, thumbnail(run),
    )  # fmt: skip
