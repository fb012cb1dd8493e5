"""Verbs that show: pages, pictures, films, the gallery."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechlab import catalog
from mechlab.api.finding import Source, load
from mechlab.api.runs import simulate_values
from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording
from mechlab.files import whole_folder
from mechlab.lab.design import Design, design
from mechlab.lab.fidelity.choose import chosen_scene
from mechlab.lab.results import FilesResult
from mechlab.lab.sheet import describe_design
from mechlab.values import Range

if TYPE_CHECKING:
    from mechlab.viewer.explore import BorderSurface
    from mechlab.viewer.story import Story


LOCAL = "127.0.0.1"
"""The address of a live page: this machine only."""


def story(
    source: Source | Recording, values: Mapping[str, Any] | None = None, against: Source | Recording | None = None
) -> Story:
    """The Story of a Recording (or of its .npz), or the still one of a mechanism. `against`: a second run, drawn as ghost."""
    from mechlab.viewer.comparison import against as compare
    from mechlab.viewer.comparison import differences

    recording = _recording(source)
    if recording is None:
        if against is not None:
            raise MechlabError(
                f"only a run can be compared with another: {source} is a mechanism, expected a .npz of a run."
            )
        d = load(source, **dict(values or {}))  # type: ignore[arg-type]
        return _still(d)
    _refuse_values(values)
    told = _recorded(recording)
    if against is None:
        return told
    other = _recording(against)
    if other is None:
        raise MechlabError(f"against: expected a Recording or the .npz of a run, got {against!r}.")
    name = f"the run {Path(against).name}" if isinstance(against, str | Path) else f"the run of scene {other.scene}"
    there = _recorded(other)
    return compare(told, there, name, differences(recording, other, (dict(told.facts), dict(there.facts))))


def _refuse_values(values: Mapping[str, Any] | None) -> None:
    if values:
        raise MechlabError(f"{', '.join(values)}: a run that is recorded keeps its values; give them to a mechanism.")


def _still(d: Design) -> Story:
    from mechlab.viewer.from_recording import mechanism_story

    return mechanism_story(d.mechanism(list(d.entry.fidelities)[-1]), d.entry.title, _facts(d))


def explore(
    source: Source, values: Mapping[str, Any] | None = None, vary: Mapping[str, Range | Sequence[float]] | None = None
) -> Story:
    """A Story whose drives can be moved by sliders in the page: the richest fidelity, closed poses solved beforehand.

    vary: up to two parameters that can be changed in the page too, key -> range or values; by default those that the entry
    names, by 20 % either way.
    """
    from mechlab.viewer.html_page import variations

    d = load(source, **dict(values or {}))
    told = _explored(d)
    asked: Mapping[str, Any] = dict.fromkeys(d.entry.sliders) if vary is None else vary
    return replace(told, variants=variations(d, asked, told, _explored))


def _explored(d: Design) -> Story:
    from mechlab.viewer.from_recording import exploration_story

    rates = chosen_scene(d).initial_rates
    return exploration_story(d.mechanism(list(d.entry.fidelities)[-1]), d.entry.title, _facts(d), rates, _reach(d))


def _reach(d: Design) -> BorderSurface | None:
    """The border of the region that an entry states in x, y, z."""
    from mechlab.viewer.explore import border

    recipe = d.entry.workspace
    if recipe is None or set(recipe.grid) != set("xyz"):
        return None
    region, box = recipe.make(d.parameters, {}), [recipe.grid[a] for a in "xyz"]
    low, high = np.array([r.low for r in box]), np.array([r.high for r in box])
    return border(recipe.text, lambda x, y, z: region.margin({"x": x, "y": y, "z": z}), low, high)


def view(
    source: Source | Recording,
    values: Mapping[str, Any] | None = None,
    html: str | Path | None = None,
    png: str | Path | None = None,
    host: str = LOCAL,
    port: int = 0,
    wait: bool = True,
    glb: str | Path | None = None,
    mp4: str | Path | None = None,
    csv: str | Path | None = None,
    against: Source | Recording | None = None,
    explorable: bool = False,
    vary: Mapping[str, Range | Sequence[float]] | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> FilesResult:
    """Files of a run or a mechanism: page, picture, animated GLB, film, table; without a file a live page on 127.0.0.1.

    A mechanism that has a default scene is simulated first, so that it moves (not for a picture alone). against: a second
    run to compare with. explorable: the page has sliders for the drives instead of a run; vary: see `explore`.
    The exit code is 3 where one of the runs that are shown must not be trusted.
    """
    wanted = {"page": html, "picture": png, "GLB": glb, "film": mp4, "table": csv}
    if explorable and (html is None or glb or mp4 or csv or against):
        raise MechlabError(
            "to explore, the drives are moved in the page: ask for a page (html), and nothing else that needs a run."
        )
    if vary is not None and not explorable:
        raise MechlabError("vary: it adds a slider to the page of the drives: say explorable (--explore) too.")
    if (port or host != LOCAL) and any(x is not None for x in wanted.values()):
        raise MechlabError("host, port: they are for a live page, and a file is asked for: leave out one of them.")
    recording = _recording(source)
    if recording is not None:
        _refuse_values(values)
        if explorable:
            raise MechlabError("to explore takes a mechanism: a run that is recorded has no drives to move.")
    if recording is None and not explorable and any(x is not None for x in (html, glb, mp4, csv, against)):
        recording = simulate_values(source, values)  # type: ignore[arg-type]
    if recording is not None:
        told = story(recording, against=against)
    else:
        told = explore(source, values, vary) if explorable else story(source, values)  # type: ignore[arg-type]
    if not any(x is not None for x in wanted.values()):
        return _live(source, told, values, host, port, wait)
    bad = [sentence for severity, sentence in told.health if severity == "error"]
    notes = ["; ".join(bad)] if bad else []
    files: dict[str, Path] = {}
    if html is not None:
        from mechlab.viewer import write_page

        files["page"] = write_page(told, Path(html))
    if png is not None:
        from mechlab.viewer.picture import write_png

        files["picture"] = write_png(told, Path(png))
    if glb is not None:
        from mechlab.viewer.glb import write_glb

        files["GLB"] = write_glb(told, Path(glb))
    if csv is not None and recording is not None:
        from mechlab.viewer.from_recording import write_csv

        files["table"] = write_csv(recording, Path(csv))
    if mp4 is not None:
        from mechlab.viewer.film import film_sentence, write_mp4

        files["film"] = write_mp4(told, Path(mp4), progress=progress)
        notes.append(film_sentence(told))
    sentence = " ".join(n for n in notes if n)
    return FilesResult(next(iter(files.values())).parent, files, sentence, exit_code=3 if bad else 0)


def studio(source: Source, values: Mapping[str, Any] | None = None) -> FilesResult:
    """MuJoCo's own web viewer with a mechanism, until it is interrupted. Warns on stderr: its port is open to the network."""
    import tempfile

    from mechlab.viewer.live import open_studio

    d = load(source, **dict(values or {}))
    with tempfile.TemporaryDirectory() as folder:
        d.save(folder)
        open_studio(Path(folder) / "scene.xml", d.entry.title)
    return FilesResult(Path("."), {}, "the web viewer was closed")


def gallery(
    out: str | Path,
    names: Sequence[str] = (),
    models: str | Path = "models",
    progress: Callable[[str], None] = lambda line: None,
) -> FilesResult:
    """All mechanisms of the catalog as pages in one folder that any static host can serve; index.html first.

    Each has a picture (from MODELS/NAME/picture.png where that exists), one sentence, the page of its default run, the
    page to explore where it has drives, and its sheet.
    """
    from mechlab.viewer import write_page
    from mechlab.viewer.film import motion_svg
    from mechlab.viewer.gallery import Exhibit, write_gallery
    from mechlab.viewer.picture import write_png

    exhibits = []
    with whole_folder(out) as folder:
        for name in names or catalog.NAMES:
            progress(f"{name}: run, page, picture, sheet")
            d = load(name)
            told = _recorded(simulate_values(name))
            write_page(told, folder / name / "run.html")
            kept = Path(models) / name / "picture.png"
            made = kept if kept.is_file() else write_png(told, folder / name / "picture.png")
            moved: Story | None = None
            try:
                moved = explore(name)
            except MechlabError as error:
                progress(f"{name}: no page to explore: {error}")
            if moved is not None:
                write_page(moved, folder / name / "explore.html")
            exhibits.append(
                Exhibit(
                    name, d.entry.title, d.entry.summary, made.read_bytes(), describe_design(d)._repr_html_(),
                    moved is not None, motion_svg(told),
                )
            )  # fmt: skip
        index = write_gallery(exhibits, folder)
    return FilesResult(Path(out), {"gallery": Path(out) / index.name}, f"{len(exhibits)} mechanisms")


def _recording(source: Source | Recording) -> Recording | None:
    if isinstance(source, Recording):
        return source
    if isinstance(source, str | Path) and str(source).endswith(".npz"):
        from mechlab.formats import load_recording

        return load_recording(source)
    return None


def _live(
    source: Source | Recording, told: Story, values: Mapping[str, Any] | None, host: str, port: int, wait: bool
) -> FilesResult:
    """A live page; a mechanism is simulated while one looks, and the page of the run follows. Its parameters can be
    changed there."""
    from mechlab.viewer.live import serve

    with serve(told, host=host, port=port) as server:
        if wait and _recording(source) is None:
            from mechlab.viewer.streaming import Rebuilder

            d = load(source, **dict(values or {}))  # type: ignore[arg-type]
            Rebuilder(server, d, _still, _recorded)
        if wait:
            server.wait()
        return FilesResult(Path("."), {}, f"served on {server.url}")


def _facts(d: Design) -> dict[str, str]:
    from mechlab.lab.sheet import parameter_rows

    return {row[0]: f"{row[1]} {row[2]}".strip() for row in parameter_rows(d)[1]}


def _recorded(recording: Recording) -> Story:
    from mechlab.viewer.from_recording import recording_story

    drawn, title, facts = None, "", {"scene": recording.scene, "fidelity": recording.fidelity}
    s = recording.settings
    facts |= {"engine": f"{s.engine}, {s.integrator}, step {s.timestep:g} s"}
    if recording.acts:
        facts["what acts"] = recording.acts
    if recording.name in catalog.NAMES:
        entry = catalog.entry(recording.name)
        d = design(entry, {k: v for k, v in recording.parameters.items() if v is not None})
        title = entry.title
        facts |= _facts(d)
        if entry.expand is not None:
            drawn = entry.expand(d.parameters, recording)
    return recording_story(
        recording,
        drawn,
        title=title,
        facts=facts,
        channels=tuple(n for n in recording.channels if n.startswith("error_")),
    )


def write_run_page(d: Design, recording: Recording, path: Path) -> Path:
    """Write the page of a run: the last step of the pipeline."""
    from mechlab.viewer import write_page

    return write_page(_recorded(recording), path)
