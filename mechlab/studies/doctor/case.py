"""A diagnosis as data, and the examined file: its XML, the model that MuJoCo compiles from it, the Mechanism read from
it."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

from mechlab.engines.mujoco.model import Model, to_mujoco
from mechlab.engines.mujoco.model_file.trace import compile_file
from mechlab.engines.mujoco.model_file.trial import TrialRun
from mechlab.errors import MechlabError
from mechlab.experiment.model_file import LeftOut, ModelFile
from mechlab.experiment.recording import Symptom
from mechlab.formats.mjcf.write import to_mjcf
from mechlab.formats.model_text import read_text, refuse_far_files
from mechlab.formats.soundness import sound
from mechlab.formats.xml_text import parse
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.redundancy import Redundancy
from mechlab.results import Shown

ORDER = {"error": 0, "warning": 1, "note": 2}
"""Severities. "error": results of the file as it is cannot be trusted; "warning": may matter; "note": a default,
or a matter of other tools."""


@dataclass(frozen=True, repr=False)
class Diagnosis(Shown):
    """The diagnosis of a file. `freedoms` is None where no rank could be computed; `idle`: names of local freedoms;
    `gap` [m, rad]: largest residual of a loop or coupling at the start, None without any; `findings`: the gravest first; `paste`: all
    recommended settings; `loops`: closures and couplings that act; `file`: what mechlab reads of it, None where it cannot;
    `not_examined`: what was left out because it costs too much, or the engine gave up; `run`: a short run of the file as it is."""

    name: str
    kind: str
    coordinates: int | None
    rows: int | None
    freedoms: int | None
    idle: tuple[str, ...]
    redundant: tuple[Redundancy, ...]
    gap: float | None
    findings: tuple[Symptom, ...]
    paste: str = ""
    notes: tuple[str, ...] = ()
    versions: Mapping[str, str] = field(default_factory=dict)
    bodies: int | None = None
    loops: int | None = None
    file: ModelFile | None = None
    not_examined: tuple[str, ...] = ()
    run: TrialRun | None = None

    @property
    def exit_code(self) -> int:
        """3 when a finding is an error, else 0."""
        return 3 if any(f.severity == "error" for f in self.findings) else 0

    @property
    def message(self) -> str:
        """One sentence: what must not be trusted, or that nothing serious was found."""
        bad = [f.sentence for f in self.findings if f.severity == "error"]
        if bad:
            return f"{self.name}: do not trust results of this file as it is: {' '.join(bad)}"
        warned = sum(f.severity == "warning" for f in self.findings)
        return f"{self.name}: nothing serious" + (f"; {warned} to be known" if warned else "")

    @property
    def verdict(self) -> str:
        """One word or two: "refused", "do not trust", "to be known", "healthy"."""
        grave = {f.name for f in self.findings if f.severity == "error"}
        if "refused" in grave or self.bodies is None and grave:
            return "refused"
        if grave:
            return "do not trust"
        return "to be known" if any(f.severity == "warning" for f in self.findings) else "healthy"

    @property
    def lost(self) -> tuple[LeftOut, ...]:
        """What acts on the motion without contacts and is not in the mechanism that mechlab reads of the file."""
        return () if self.file is None else tuple(x for x in self.file.lost if x.what not in LOOKS)

    def finding(self, name: str) -> Symptom:
        """The first finding of that name; raises KeyError."""
        for f in self.findings:
            if f.name == name:
                return f
        raise KeyError(name)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "file": self.name, "kind": self.kind, "coordinates": self.coordinates, "rows": self.rows, "freedoms": self.freedoms,
            "local_freedoms": list(self.idle), "redundant": [x.sentence for x in self.redundant], "gap": self.gap,
            "findings": [f.to_dict() for f in self.findings], "paste": self.paste, "notes": list(self.notes),
            "versions": dict(self.versions), "message": self.message, "verdict": self.verdict, "bodies": self.bodies,
            "loops": self.loops, "not_examined": list(self.not_examined), "run": None if self.run is None else self.run.to_dict(),
            "mechanism": None if self.file is None else "lost" if self.lost else "whole", "lost": [x.sentence for x in self.lost],
            "left_out": [] if self.file is None else [x.to_dict() for x in self.file.left_out],
        }  # fmt: skip


MOST_COORDINATES = 600
"""A flag of 513 coordinates takes 5 s; the work grows with the cube."""
LOOKS = ("mesh", "collision", "gazebo", "transmission", "material", "sensor", "limit of effort or velocity")
"""What is left out of a URDF that does not act on a motion without contacts: looks, and settings of programs and motors."""
ROOTS = {".xml": ("mujoco", "MJCF"), ".urdf": ("robot", "URDF")}


@dataclass(frozen=True)
class ExaminedFile:
    """An examined file: the root of its XML with what it includes (None for other sources), the compiled model or MuJoCo's error
    (`refused`), what mechlab reads of it or the reason why it cannot (`unread`); `stripped`: the model was compiled without its
    missing meshes and textures, for this reason."""

    name: str
    kind: str
    root: ET.Element | None = None
    model: Model | None = None
    refused: str = ""
    file: ModelFile | None = None
    unread: str = ""
    stripped: str = ""

    @property
    def mechanism(self) -> Mechanism | None:
        """The mechanism of the file, where there is one."""
        return None if self.file is None else self.file.mechanism


def read_case(path: Path, read: Callable[[Path], ModelFile]) -> ExaminedFile:
    """Read and compile an .xml (MJCF) or .urdf file; `read`: the reader of model files. Raises MechlabError for a file that cannot
    be read or is not such XML."""
    content = read_text(path)
    tag, kind = ROOTS[path.suffix.lower()]
    file, unread, stripped = None, "", ""
    try:
        root = sound(content, tag, f"{kind} file")
        if kind == "MJCF":
            refuse_far_files(path)
        else:
            _refuse_many(len(root.findall("joint")))
    except MechlabError as error:
        raise MechlabError(f"{path}: {error}") from None
    try:
        found = read(path)
        file, unread = (None, found.unheld) if found.unheld else (found, "")
    except MechlabError as error:
        unread = str(error).removeprefix(f"{path}: ")
    except (ValueError, KeyError, IndexError) as error:
        unread = f"{type(error).__name__}: {error}"
    if kind == "URDF":
        model, refused = compile_file(ET.tostring(bare(root), encoding="unicode"))
    else:
        root = with_includes(root, path.parent)
        model, refused = compile_file(path)
        if model is None and any(mark in refused for mark in UNSEEN):
            model, _ = compile_file(ET.tostring(bare_mjcf(root), encoding="unicode"))
            stripped = refused if model is not None else ""
    if model is not None:
        _refuse_many(model.nv, f"{path}: ")
    return ExaminedFile(path.name, kind, root, model, refused, file, unread, stripped)


def _refuse_many(coordinates: int, place: str = "") -> None:
    """Raise MechlabError for a file whose dense matrices would take minutes and gigabytes."""
    if coordinates > MOST_COORDINATES:
        raise MechlabError(
            f"{place}it has {coordinates} joints or coordinates; a diagnosis computes with dense matrices, of at most {MOST_COORDINATES}. "
            "Weld parts that do not move against each other into one body, or diagnose a part of the model."
        )


def case_of(mechanism: Mechanism, kind: str) -> ExaminedFile:
    """The examined file of a Mechanism: the MJCF that mechlab writes for it."""
    root = ET.fromstring(to_mjcf(mechanism))
    return ExaminedFile(mechanism.name, kind, root, to_mujoco(mechanism)[0], "", ModelFile(None, kind, mechanism))


UNSEEN = ("stl_decoder", "Error opening file", "resource not found", "obj_decoder", "mesh file", "PNG file", "lodepng", "decoder")
"""Words of MuJoCo where meshes or textures are missing or are not the files they should be (pointers to a large-file store)."""


def with_includes(root: ET.Element, folder: Path, seen: set[Path] | None = None) -> ET.Element:
    """A copy in which every <include> of a file that can be read is replaced by what stands in it. A file that is included again is
    left as it is: MuJoCo refuses it."""
    seen = set() if seen is None else seen
    out = copy.copy(root)
    out[:] = []
    for child in root:
        file = folder / child.get("file", "")
        inner = _included(file) if child.tag == "include" and file not in seen else None
        if inner is None:
            out.append(with_includes(child, folder, seen))
        else:
            seen.add(file)
            out.extend(with_includes(inner, folder, seen))
    return out


def _included(file: Path) -> ET.Element | None:
    try:
        content = read_text(file)
        return parse(content, "mujocoinclude" if "<mujocoinclude" in content else "mujoco", "MJCF file")
    except MechlabError:
        return None


def bare_mjcf(root: ET.Element) -> ET.Element:
    """A copy of an MJCF without meshes, height fields and textures; it compiles where every moving body has an <inertial>."""
    root = copy.deepcopy(root)
    for parent in list(root.iter()):
        for child in list(parent):
            seen = child.tag in ("mesh", "hfield", "texture", "material", "skin", "flexcomp") and parent.tag in ("asset", "worldbody")
            if seen or child.tag == "geom" and (child.get("mesh") or child.get("hfield")):
                parent.remove(child)
        parent.attrib.pop("material", None)
    return root


def bare(root: ET.Element) -> ET.Element:
    """A copy of a URDF without visual and collision elements, so that it compiles when its mesh files are missing."""
    root = copy.deepcopy(root)
    for link in root.findall("link"):
        for tag in ("visual", "collision"):
            for element in link.findall(tag):
                link.remove(element)
    return root
