"""The verb sweep: many designs, initial states or questions at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechlab.api.finding import Source, find, load
from mechlab.formats import to_json
from mechlab.lab.design import Design
from mechlab.mechanism import Mechanism
from mechlab.values import Range

if TYPE_CHECKING:
    from mechlab.studies.sweep.result import SweepResult


@dataclass(frozen=True)
class UserFile:
    """A user's Python file as it travels to other processes and machines: where it is here, and what it says."""

    path: str
    function: str
    content: str


def open_source(source: Any, **parameters: Any) -> Design:
    """The design of a source that may come from another machine: where the file is not there, or says something else, its
    content is taken."""
    if not isinstance(source, UserFile):
        return load(source, **parameters)
    path = Path(source.path)
    suffix = f":{source.function}" if source.function else ""
    if path.is_file() and path.read_text() == source.content:
        return load(f"{path}{suffix}", **parameters)
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        copy.write_text(source.content)
        return load(f"{copy}{suffix}", **parameters)


def sweep(
    source: Source,
    values: Mapping[str, Any] | None = None,
    quantities: Sequence[str] | str = (),
    *,
    witness: str | None = None,
    scene: str | None = None,
    engine: str | None = None,
    fidelity: str | None = None,
    duration: float | None = None,
    timestep: float | None = None,
    out: str | Path | None = None,
    plot: str | Path | None = None,
    resume: bool = False,
    scheduler: str | None = None,
    workers: int | None = None,
    command: str = "",
    progress: Callable[[int, int], None] = lambda done, total: None,
    **more: Any,
) -> SweepResult:
    """A quantity, or many, over ranges of parameters, given quantities, initial values X_0, X_rate_0 or constant loads X_force.

    values (and keyword arguments): numbers, or axes: `mechlab.values.Range`, lists, arrays (n,). quantities: answers of the
    question that the given keys make; channels of the run (the final value; max(ch), min(ch), mean(ch), rms(ch)); checks by
    id (their difference; passed(id)); findings of the health record and `trusted`. By default all answers, or the final
    channels of the scene. out: a netCDF file; plot: a picture; resume: go on where an interrupted sweep into the same file was;
    scheduler: address of a Dask cluster; workers: processes here, by default one for each core.

    A point without a number is a gap, with its reason. Raises MechlabError for unknown keys and quantities.
    """
    from mechlab.studies.sweep.plan import plan
    from mechlab.studies.sweep.study import sweep as work

    given = dict(values or {}) | more
    asked = [quantities] if isinstance(quantities, str) else list(quantities)
    travelling, identity = _travelling(source)
    request = plan(
        open_source(travelling), given, asked, load=open_source, source=travelling, identity=identity, witness=witness,
        scene=scene, engine=engine, fidelity=fidelity, duration=duration, timestep=timestep,
    )  # fmt: skip
    return work(
        request, out=None if out is None else Path(out), plot=None if plot is None else Path(plot), resume=resume,
        scheduler=scheduler, workers=workers, command=command or _command(source, given, asked), progress=progress,
    )  # fmt: skip


def _travelling(source: Source) -> tuple[Any, str]:
    """The source in a form that other processes can open, and what it is, as text that tells two sources apart."""
    if isinstance(source, str | Path):
        text = str(source)
        path, _, function = text.rpartition(":") if ".py:" in text else (text, "", "")
        if path.endswith(".py"):
            find(text)  # says what is wrong with the file
            content = Path(path).read_text()
            return UserFile(str(Path(path).resolve()), function, content), f"{function}\n{content}"
        if Path(text).suffix.lower() in (".json", ".xml", ".urdf"):
            mechanism = load(text).mechanism()
            return mechanism, to_json(mechanism)
        return text, text
    if isinstance(source, Mechanism):
        return source, to_json(source)
    if isinstance(source, Design):
        return source, f"{source.name} {dict(source.given)!r}"
    return source, find(source).name


def _command(source: Source, given: Mapping[str, Any], quantities: Sequence[str]) -> str:
    """The command that asks the same."""
    name = str(source) if isinstance(source, str | Path) else load(source).name

    def said(value: Any) -> str:
        if isinstance(value, Range | str):
            return str(value)
        return ",".join(str(x) for x in value) if hasattr(value, "__iter__") else str(value)

    words = ["mechlab", "sweep", name, *(f"{k}={said(v)}" for k, v in given.items())]
    return " ".join(words + (["--quantity", ",".join(quantities)] if quantities else []))
