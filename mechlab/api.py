"""The public API: finds a mechanism in the catalog, a user's file or an object, and hands it on.

Every verb of the command line is one function here; `Design` (what `load` gives) carries the parameters.
"""

from __future__ import annotations

import importlib.util
import inspect
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechlab import catalog
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.entry import Entry
from mechlab.experiment.question import Answers
from mechlab.experiment.recording import Recording
from mechlab.mechanism import Mechanism
from mechlab.study.ask import ask, parameters_and_rest
from mechlab.study.check import CheckReport, run_checks
from mechlab.study.claims import ClaimReport, judge
from mechlab.study.design import Design, design, entry_of, entry_of_function
from mechlab.study.figure import write_figure
from mechlab.study.results import FilesResult, RunResult, SimulateResult, SolveResult, TableResult
from mechlab.study.sheet import Description, describe_design

if TYPE_CHECKING:
    from mechlab.study.chart import Chart
    from mechlab.study.cycle import CycleResult
    from mechlab.study.portrait import PortraitResult
    from mechlab.study.synthesis import SynthesisResult
    from mechlab.view.story import Story

Source = str | Path | Mechanism | Design | Entry | Callable[..., Mechanism]


# -- finding a mechanism ---------------------------------------------------------------------------------------------------


def load(source: Source, **parameters: Any) -> Design:
    """A Design from a catalog name, "file.py:function", a .json, .xml (MJCF) or .urdf file, a function or a Mechanism.

    Keyword arguments are parameters. Raises MechlabError for an unknown name, listing the catalog.
    """
    if isinstance(source, Design):
        return design(source.entry, dict(source.given) | parameters)
    return design(find(source), parameters)


def find(source: Source) -> Entry:
    """The entry behind a source; see `load`."""
    if isinstance(source, Entry):
        return source
    if isinstance(source, Design):
        return source.entry
    if isinstance(source, Mechanism):
        return entry_of(source)
    if callable(source):
        return entry_of_function(source)
    text = str(source)
    if text in catalog.NAMES:
        return catalog.entry(text)
    path, _, name = text.rpartition(":") if ".py:" in text else (text, "", "")
    if text.endswith(".py") or path.endswith(".py"):
        return _from_python(Path(path or text), name)
    suffix = Path(text).suffix.lower()
    if suffix in (".json", ".xml", ".urdf"):
        return entry_of(_from_file(Path(text), suffix))
    raise unknown("mechanism", text, [*catalog.NAMES, "FILE.py:FUNCTION", "FILE.json", "FILE.xml", "FILE.urdf"])


def _read(path: Path) -> str:
    try:
        return path.read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise MechlabError(f"cannot read {path}: {getattr(error, 'strerror', None) or error}.") from None


def _from_file(path: Path, suffix: str) -> Mechanism:
    from mechlab.formats import from_json, from_mjcf, from_urdf

    reader = {".json": from_json, ".xml": from_mjcf, ".urdf": from_urdf}[suffix]
    try:
        return reader(_read(path))
    except MechlabError as error:
        raise MechlabError(f"{path}: {error}") from None


def _from_python(path: Path, name: str) -> Entry:
    """The entry of a user's function. Errors of the file are told with its own line."""
    if not path.is_file():
        raise MechlabError(f"there is no file {path}.")
    spec = importlib.util.spec_from_file_location(f"mechlab_user_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise MechlabError(f"{path} is not a Python file.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    _guarded(path, lambda: spec.loader.exec_module(module))  # type: ignore[union-attr]
    own = {
        n: f
        for n, f in vars(module).items()
        if callable(f) and getattr(f, "__module__", "") == spec.name and not isinstance(f, type)
    }
    if not name:
        if len(own) != 1:
            raise MechlabError(f"{path} defines {', '.join(own) or 'no function'}: say which one, as {path}:FUNCTION.")
        name = next(iter(own))
    if isinstance(getattr(module, name, None), Entry):
        return getattr(module, name)
    if name not in own:
        raise unknown(f"{path}: function", name, own)
    function = own[name]

    def guarded(**values: Any) -> Mechanism:
        return _guarded(path, lambda: function(**values))

    guarded.__name__, guarded.__doc__ = function.__name__, function.__doc__
    guarded.__signature__ = inspect.signature(function)  # type: ignore[attr-defined]
    return entry_of_function(guarded, name)


def _guarded(path: Path, work: Callable[[], Any]) -> Any:
    try:
        return work()
    except MechlabError as error:
        raise type(error)(f"{path}{_line(error, path)}: {error}") from None
    except SyntaxError as error:
        raise MechlabError(f"{path}, line {error.lineno}: {error.msg}.") from None
    except Exception as error:
        raise MechlabError(f"{path}{_line(error, path)}: {type(error).__name__}: {error}") from None


def _line(error: BaseException, path: Path) -> str:
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if Path(f.filename) == path]
    return f", line {lines[-1]}" if lines else ""


# -- the verbs -------------------------------------------------------------------------------------------------------------


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
    """Parameters, structure, bodies, fidelities, scenes, questions."""
    return describe_design(load(source, **dict(values or {})), fidelity)


def generate(
    source: Source, values: Mapping[str, Any] | None = None, out: str | Path = "out", fidelity: str | None = None
) -> FilesResult:
    """Model files, each reloaded by its consumer."""
    d = load(source, **dict(values or {}))
    m = d.mechanism(fidelity)
    from mechlab.study.files import write_verified

    files = write_verified(m, out)
    return FilesResult(
        Path(out), files, "every file was reloaded by its consumer (MuJoCo, Pinocchio, yourdfpy)", d.warnings
    )


def generate_catalog(out: str | Path = "models", names: Sequence[str] = (), pictures: bool = True) -> FilesResult:
    """A folder for each mechanism of the catalog: model files of its richest fidelity, sheet (README.md), picture.png."""
    from mechlab.study.files import write_verified
    from mechlab.study.sheet import model_sheet

    files: dict[str, Path] = {}
    for name in names or catalog.NAMES:
        d = load(name)
        folder = Path(out) / name
        write_verified(d.mechanism(list(d.entry.fidelities)[-1]), folder)
        sheet = model_sheet(d, run_checks([d]), judge([d.entry]), "picture.png")
        (folder / "README.md").write_text(sheet)
        if pictures:
            view(name, png=folder / "picture.png")
        files[name] = folder
    return FilesResult(Path(out), files, "every file was reloaded by its consumer (MuJoCo, Pinocchio, yourdfpy)")


def solve(source: Source, **values: Any) -> Answers:
    """Answers of all witnesses; keyword arguments are parameters and given quantities, numbers or arrays."""
    return solve_values(source, values).answers


def solve_values(source: Source, values: Mapping[str, Any]) -> SolveResult:
    """As `solve`, from a mapping."""
    base = load(source)
    parameters, given = parameters_and_rest(base.entry.parameters, values)
    return SolveResult(ask(load(base, **parameters), given))


def simulate(source: Source, scene: str | None = None, at: Sequence[float] = (), **options: Any) -> Recording:
    """Run a scene and return its Recording.

    options: parameters, X_0, X_rate_0 (initial values), X_force (constant loads), and duration [s], timestep [s],
    max_error, engine, fidelity, settings as of `simulate_values`. Nothing is raised for a run that cannot be trusted:
    look at `recording.health.trusted`.
    """
    names = ("duration", "timestep", "max_error", "engine", "fidelity", "settings")
    how = {k: options.pop(k) for k in names if k in options}
    return simulate_values(source, options, scene=scene, at=at, **how).recording


def simulate_values(
    source: Source,
    values: Mapping[str, Any] | None = None,
    scene: str | None = None,
    duration: float | None = None,
    timestep: float | None = None,
    max_error: float | None = None,
    engine: str | None = None,
    fidelity: str | None = None,
    at: Sequence[float] | None = None,
    settings: Any = None,
) -> SimulateResult:
    """Run a scene; the result carries the samples at the times `at` [s] and an exit code.

    values: parameters, X_0, X_rate_0 (initial), X_force (constant loads). settings: a Settings or the name of a preset.
    """
    from mechlab.study.run import run_scene

    base = load(source)
    parameters, extra = parameters_and_rest(base.entry.parameters, dict(values or {}))
    chosen = load(base, **parameters)
    numbers = {k: _number(k, v) for k, v in extra.items()}
    recording = run_scene(
        chosen, scene, engine=engine, fidelity=fidelity, duration=duration, timestep=timestep, max_error=max_error,
        settings=settings, at=tuple(at or ()), extra=numbers,
    )  # fmt: skip
    return SimulateResult(recording, tuple(at or ()), chosen.warnings)


def _number(key: str, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise MechlabError(f"{key}: expected a number, got {value!r}.") from None


def portrait(
    source: Source, kind: str, values: Mapping[str, Any] | None = None, out: str | Path | None = None, **more: Any
) -> PortraitResult:
    """A portrait of a mechanism (see its `portraits`); values: parameters (numbers), and what the portrait takes, numbers
    or ranges. Arrays and a figure go to the folder `out`. Raises MechlabError for an unknown kind, listing them."""
    from mechlab.study.ask import numeric
    from mechlab.study.portrait import write

    base = load(source)
    if kind not in base.entry.portraits:
        raise unknown(f"{base.name}: portrait", kind, base.entry.portraits)
    given = dict(values or {}) | more
    parameters, rest = parameters_and_rest(base.entry.parameters, given)
    many = {k: numeric(k, v) for k, v in rest.items()}
    for key in [k for k, v in parameters.items() if hasattr(v, "points") or isinstance(v, list | tuple)]:
        many[key] = numeric(key, parameters.pop(key))
    chosen = load(base, **parameters)
    many |= {k: numeric(k, v) for k, v in parameters.items() if k.endswith("_0")}
    made = base.entry.portraits[kind](chosen.parameters, many)
    return write(base.name, made, None if out is None else Path(out), chosen.warnings)


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


def run(
    source: Source,
    values: Mapping[str, Any] | None = None,
    out: str | Path = "out",
    progress: Callable[[str], None] = lambda line: None,
) -> RunResult:
    """The whole pipeline: files, checks, a run of the default scene, the page."""
    from mechlab.study.pipeline import pipeline

    return pipeline(load(source, **dict(values or {})), Path(out), _page, progress)


# -- looking ---------------------------------------------------------------------------------------------------------------


def story(
    source: Source | Recording, values: Mapping[str, Any] | None = None, against: Source | Recording | None = None
) -> Story:
    """The Story of a Recording (or of its .npz), or the still one of a mechanism. `against`: a second run, drawn as ghost."""
    from mechlab.view.from_recording import against as compare
    from mechlab.view.from_recording import mechanism_story

    recording = _recording(source)
    if recording is None:
        if against is not None:
            raise MechlabError(
                f"only a run can be compared with another: {source} is a mechanism, expected a .npz of a run."
            )
        d = load(source, **dict(values or {}))  # type: ignore[arg-type]
        return mechanism_story(d.mechanism(list(d.entry.fidelities)[-1]), d.entry.title, _facts(d))
    told = _recorded(recording)
    if against is None:
        return told
    other = _recording(against)
    if other is None:
        raise MechlabError(f"against: expected a Recording or the .npz of a run, got {against!r}.")
    name = f"the run {Path(against).name}" if isinstance(against, str | Path) else f"the run of scene {other.scene}"
    return compare(told, _recorded(other), name)


def explore(source: Source, values: Mapping[str, Any] | None = None) -> Story:
    """A Story whose drives can be moved by sliders in the page: the richest fidelity, closed poses solved beforehand."""
    from mechlab.view.from_recording import exploration_story

    d = load(source, **dict(values or {}))
    return exploration_story(d.mechanism(list(d.entry.fidelities)[-1]), d.entry.title, _facts(d))


def view(
    source: Source | Recording,
    values: Mapping[str, Any] | None = None,
    html: str | Path | None = None,
    png: str | Path | None = None,
    host: str = "127.0.0.1",
    port: int = 0,
    wait: bool = True,
    glb: str | Path | None = None,
    mp4: str | Path | None = None,
    csv: str | Path | None = None,
    against: Source | Recording | None = None,
    explorable: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> FilesResult:
    """Files of a run or a mechanism: page, picture, animated GLB, film, table; without a file a live page on 127.0.0.1.

    A mechanism that has a default scene is simulated first, so that it moves (not for a picture alone). against: a second
    run to compare with. explorable: the page has sliders for the drives instead of a run.
    """
    wanted = {"page": html, "picture": png, "GLB": glb, "film": mp4, "table": csv}
    if explorable and (html is None or glb or mp4 or csv or against):
        raise MechlabError(
            "to explore, the drives are moved in the page: ask for a page (html), and nothing else that needs a run."
        )
    recording = _recording(source)
    notes: list[str] = []
    if recording is None and not explorable and any(x is not None for x in (html, glb, mp4, csv, against)):
        recording = simulate_values(source, values).recording  # type: ignore[arg-type]
    if recording is not None:
        told = story(recording, against=against)
    else:
        told = explore(source, values) if explorable else story(source, values)  # type: ignore[arg-type]
    if not any(x is not None for x in wanted.values()):
        return _live(source, told, values, host, port, wait)
    files: dict[str, Path] = {}
    if html is not None:
        from mechlab.view import write_page

        files["page"] = write_page(told, Path(html))
    if png is not None:
        from mechlab.view.picture import write_png

        files["picture"] = write_png(told, Path(png))
    if glb is not None:
        from mechlab.view.glb import write_glb

        files["GLB"] = write_glb(told, Path(glb))
    if csv is not None and recording is not None:
        from mechlab.view.table import write_csv

        files["table"] = write_csv(recording, Path(csv))
    if mp4 is not None:
        from mechlab.view.film import film_sentence, write_mp4

        files["film"] = write_mp4(told, Path(mp4), progress=progress)
        notes.append(film_sentence(told))
    return FilesResult(next(iter(files.values())).parent, files, " ".join(n for n in notes if n))


def studio(source: Source, values: Mapping[str, Any] | None = None) -> FilesResult:
    """MuJoCo's own web viewer with a mechanism, until it is interrupted. Warns on stderr: its port is open to the network."""
    import tempfile

    from mechlab.view.studio import open_studio

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
    from mechlab.view import write_page
    from mechlab.view.gallery import Exhibit, write_gallery
    from mechlab.view.picture import write_png

    folder, exhibits = Path(out), []
    for name in names or catalog.NAMES:
        progress(f"{name}: run, page, picture, sheet")
        d = load(name)
        told = _recorded(simulate_values(name).recording)
        write_page(told, folder / name / "run.html")
        kept = Path(models) / name / "picture.png"
        picture = kept.read_bytes() if kept.is_file() else write_png(told, folder / name / "picture.png").read_bytes()
        moved = None
        try:
            moved = write_page(explore(name), folder / name / "explore.html")
        except MechlabError as error:
            progress(f"{name}: no page to explore: {error}")
        sheet = show(name).html()
        exhibits.append(Exhibit(name, d.entry.title, d.entry.summary, picture, sheet, moved is not None))
    return FilesResult(folder, {"gallery": write_gallery(exhibits, folder)}, f"{len(exhibits)} mechanisms")


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
    """A live page; a mechanism is simulated while one looks, and the page of the run follows."""
    from mechlab.view.live import serve

    with serve(told, host=host, port=port) as server:
        if wait and _recording(source) is None:
            from mechlab.view.streaming import stream

            d = load(source, **dict(values or {}))  # type: ignore[arg-type]
            stream(server, d, _recorded)
        if wait:
            server.wait()
        return FilesResult(Path("."), {}, f"served on {server.url}")


def _facts(d: Design) -> dict[str, str]:
    from mechlab.study.sheet import parameter_rows

    return {row[0]: f"{row[1]} {row[2]}".strip() for row in parameter_rows(d)[1]}


def _recorded(recording: Recording) -> Story:
    from mechlab.view.from_recording import recording_story

    drawn, title, facts = None, "", {"scene": recording.scene, "fidelity": recording.fidelity}
    s = recording.settings
    facts |= {"engine": f"{s.engine}, {s.integrator}, step {s.timestep:g} s"}
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


def _page(d: Design, simulation: SimulateResult, path: Path) -> Path:
    from mechlab.view import write_page

    return write_page(_recorded(simulation.recording), path)


def synthesize(task: str, values: Mapping[str, Any] | None = None, **more: Any) -> SynthesisResult:
    """Dimensions from wanted properties; tasks: planetary, gear_linkage, closed_differential. See `mechlab.study.synthesis`."""
    from mechlab.study.synthesis import synthesize as work

    return work(task, dict(values or {}) | more)


def cycle(
    source: Source, values: Mapping[str, Any] | None = None, fidelity: str | None = None, **more: Any
) -> CycleResult:
    """One turn of the drive of a mechanism with one freedom. Values (a mapping or keywords): parameters, X_rate and X_accel of
    the drive X, X_force (constant loads). Options: drive, output, points, span; see `mechlab.study.cycle.run_cycle`."""
    from mechlab.study.cycle import run_cycle

    options = {k: x for k in ("drive", "output", "points", "span") if (x := more.pop(k, None)) is not None}
    base = load(source)
    parameters, motion = parameters_and_rest(base.entry.parameters, dict(values or {}) | more)
    chosen = load(base, **parameters)
    return run_cycle(chosen.mechanism(fidelity), chosen.name, {k: _number(k, v) for k, v in motion.items()}, **options)


def chart(
    source: Source,
    values: Mapping[str, Any] | None = None,
    scene: str | None = None,
    duration: float | None = None,
    target: float | None = None,
    fidelity: str | None = None,
    **parameters: Any,
) -> Chart:
    """Speed against accuracy of every method on a scene: points, Pareto front, recommended setting.

    An .xml file is charted as MuJoCo loads it, whatever it holds; see `mechlab.study.chart_file`.
    target [m or rad]: the error to meet, by default that of the scene.
    """
    if isinstance(source, str | Path) and Path(source).suffix.lower() == ".xml":
        from mechlab.study.chart_file import chart_file

        for name, given in {"scene": scene, "fidelity": fidelity, **dict(values or {}), **parameters}.items():
            if given is not None:
                raise MechlabError(f"chart {source}: an MJCF file has no {name}; --duration and --target can be given.")
        return chart_file(Path(source), duration, target)
    from mechlab.study.chart import chart as work

    d = load(source, **(dict(values or {}) | parameters))
    return work(d, scene, fidelity=fidelity, duration=duration, target=target)
