"""Diagnoses of whole folders of model files: a row a file, each examined in a process of its own with a limit of time."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, field
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.results import Result
from mechlab.studies.doctor.licences import licence_of

VERDICTS = ("do not trust", "refused", "not examined", "to be known", "healthy")
"""The gravest first."""
HEAD = 4096
"""Characters of a file in which its root element is looked for."""
_ROOT = re.compile(r"<(mujoco|robot)[\s>]")
_INCLUDE = re.compile(r"""<include\s[^>]*file\s*=\s*["']([^"']+)["']""")
_CHILD = """
import json, os, sys
import mechlab as ml
try:
    found = ml.doctor(sys.argv[1]).to_dict()
except ml.MechlabError as error:
    found = {"error": str(error)}
t = os.times()
found["cpu_s"] = t.user + t.system + t.children_user + t.children_system
json.dump(found, sys.stdout)
"""


@dataclass(frozen=True)
class AuditRow:
    """A file: its name from its folder on, the folder, kind, sizes (None where not known), how mechlab reads it ("whole", "in part",
    "not"), what is lost of it, verdict, findings as (severity, name, sentence), CPU time [s], licence."""

    name: str
    collection: str
    kind: str
    bodies: int | None = None
    freedoms: int | None = None
    loops: int | None = None
    read: str = "not"
    lost: tuple[str, ...] = ()
    verdict: str = "not examined"
    findings: tuple[tuple[str, str, str], ...] = ()
    not_examined: tuple[str, ...] = ()
    seconds: float = 0.0
    licence: str = ""

    @property
    def worst(self) -> tuple[str, str, str]:
        """The gravest finding that is more than a note; three empty texts for none."""
        return next((f for f in self.findings if f[0] != "note"), ("", "", ""))


@dataclass(frozen=True, repr=False)
class Audit(Result[dict[str, Path]]):
    """Rows of model files, the gravest first."""

    rows: tuple[AuditRow, ...]
    skipped: int = 0
    versions: Mapping[str, str] = field(default_factory=dict)
    paths: tuple[str, ...] = ()

    exit_code = 0

    @property
    def counts(self) -> dict[str, int]:
        """Verdict -> number of files."""
        found = Counter(r.verdict for r in self.rows)
        return {v: found[v] for v in VERDICTS if found[v]}

    @property
    def message(self) -> str:
        """One sentence."""
        return f"{len(self.rows)} model files: " + ", ".join(f"{n} {v}" for v, n in self.counts.items())

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        rows = [asdict(r) | {"worst": dict(zip(("severity", "name", "sentence"), r.worst, strict=True))} for r in self.rows]
        for row in rows:
            row["findings"] = [dict(zip(("severity", "name", "sentence"), f, strict=True)) for f in row["findings"]]
        return {
            "models": rows, "counts": self.counts, "included_files_skipped": self.skipped, "versions": dict(self.versions),
            "message": self.message, "files": list(self.paths),
        }  # fmt: skip


@dataclass(frozen=True)
class ModelPath:
    """A model file to examine, the folder it was found under, its name from there on."""

    path: Path
    top: Path
    name: str


def models_under(sources: Sequence[str | Path]) -> tuple[list[ModelPath], int]:
    """The MJCF and URDF files of folders and single files, without those that others include; and how many were included.

    Raises MechlabError for a source that is not there.
    """
    found: dict[Path, ModelPath] = {}
    for source in map(Path, sources):
        if not source.exists():
            raise MechlabError(f"there is no file or folder {source}.")
        top = source if source.is_dir() else source.parent
        for path in sorted(_files(source)):
            if path.suffix.lower() == ".urdf" or _ROOT.search(_head(path)):
                found.setdefault(path.resolve(), ModelPath(path, top, f"{top.resolve().name}/{path.relative_to(top).as_posix()}"))
    named = {Path(s).resolve() for s in sources if Path(s).is_file()}
    included = {target for path in found for target in _includes(path)} - named
    return [m for path, m in found.items() if path not in included], len(included & found.keys())


def _files(source: Path) -> Iterator[Path]:
    if source.is_file():
        yield source
        return
    for folder, below, names in os.walk(source):
        below[:] = sorted(b for b in below if not b.startswith("."))
        yield from (Path(folder) / n for n in names if Path(n).suffix.lower() in (".xml", ".urdf"))


def _head(path: Path) -> str:
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            return file.read(HEAD)
    except OSError:
        return ""


def _includes(path: Path) -> Iterator[Path]:
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return
    for name in _INCLUDE.findall(text):
        target = (path.parent / name).resolve()
        if target != path:
            yield target


def run_audit(
    models: Iterable[ModelPath], licences: Mapping[str, str], time_limit: float, jobs: int, progress: Callable[[int, int], None]
) -> tuple[AuditRow, ...]:
    """The rows, `jobs` files at a time; a file that takes more than time_limit [s] is not examined."""
    waiting = list(models)
    rows: list[AuditRow] = []
    with ThreadPoolExecutor(jobs) as pool:
        for row in pool.map(lambda m: examine(m, licences, time_limit), waiting):
            rows.append(row)
            progress(len(rows), len(waiting))
    return tuple(sorted(rows, key=lambda r: (VERDICTS.index(r.verdict), r.name)))


def examine(model: ModelPath, licences: Mapping[str, str], time_limit: float) -> AuditRow:
    """The row of one file, from a process of its own."""
    kind = "URDF" if model.path.suffix.lower() == ".urdf" else "MJCF"
    licence = licence_of(model.path.resolve(), model.top.resolve(), model.name, licences)
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            [sys.executable, "-c", _CHILD, str(model.path)], capture_output=True, timeout=time_limit, env=environment, check=False
        )
    except subprocess.TimeoutExpired:
        return _failed(model, kind, licence, f"it takes more than {time_limit:g} s", time_limit)
    try:
        found = json.loads(done.stdout)
    except ValueError:
        return _failed(model, kind, licence, f"the process that examined it ended with {done.returncode}", 0.0)
    if "error" in found:
        finding = ("error", "refused", _anonymous(found["error"], model))
        return AuditRow(
            model.name, model.top.resolve().name, kind, verdict="refused", findings=(finding,), seconds=round(found["cpu_s"], 2),
            licence=licence,
        )  # fmt: skip
    lost = tuple(x.partition(" (")[0] for x in found["lost"])
    return AuditRow(
        model.name, model.top.resolve().name, kind, found["bodies"], found["freedoms"], found["loops"],
        {"whole": "whole", "lost": "in part"}.get(found["mechanism"], "not"), lost, found["verdict"],
        tuple((f["severity"], f["name"], _anonymous(f["sentence"], model)) for f in found["findings"]),
        tuple(_anonymous(x, model) for x in found["not_examined"]), round(found["cpu_s"], 2), licence,
    )  # fmt: skip


def _failed(model: ModelPath, kind: str, licence: str, why: str, seconds: float) -> AuditRow:
    finding = ("error", "not_examined", f"{why}.")
    return AuditRow(model.name, model.top.resolve().name, kind, findings=(finding,), seconds=seconds, licence=licence)


_FOLDERS = re.compile(r"(?<![\w<./])(?:/[\w.+@-]+)+/")


def _anonymous(text: str, model: ModelPath) -> str:
    """A text without the paths of this machine: names of files remain."""
    for folder in (model.path.parent, model.top):
        text = text.replace(f"{folder}/", "")
    return _FOLDERS.sub("", text)


def picked(models: Iterable[ModelPath], patterns: Sequence[str]) -> list[ModelPath]:
    """The models whose name fits one of the patterns, in the order of the patterns."""
    known = list(models)
    return [m for p in patterns for m in known if fnmatch(m.name, p)]


def read_mapping(path: Path) -> dict[str, str]:
    """Patterns of names -> licence, from a JSON object; raises MechlabError for anything else."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise MechlabError(f"cannot read the licences {path}: {getattr(error, 'strerror', None) or error}.") from None
    if not isinstance(found, dict) or not all(isinstance(v, str) for v in found.values()):
        raise MechlabError(f'{path}: expected an object of texts, such as {{"folder/*": "MIT"}}.')
    return found
