"""A diagnosis as data, and the examined file: its XML, the model that MuJoCo compiles from it, the Mechanism read from
it."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mechlab.engines.mujoco.model import Model, to_mujoco
from mechlab.engines.mujoco.model_file.trace import compile_file, compile_text
from mechlab.errors import MechlabError
from mechlab.experiment.recording import Symptom
from mechlab.formats import from_mjcf, from_urdf
from mechlab.formats.mjcf.write import to_mjcf
from mechlab.formats.model_text import read_text
from mechlab.formats.soundness import sound
from mechlab.mechanism import Mechanism
from mechlab.mechanism.parts import MAX_BODIES
from mechlab.mechanism.structure import Redundancy
from mechlab.results import Shown

ORDER = {"error": 0, "warning": 1, "note": 2}
"""Severities. "error": results of the file as it is cannot be trusted; "warning": may matter; "note": concerns other
tools."""


@dataclass(frozen=True, repr=False)
class Diagnosis(Shown):
    """The diagnosis of a file. `freedoms` is None where no rank could be computed; `idle`: names of local freedoms;
    `gap` [m, rad]: largest residual of a loop or coupling in the reference pose, None without any; `paste`: all
    recommended settings."""

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
            "versions": dict(self.versions), "message": self.message,
        }  # fmt: skip


MOST_COORDINATES = MAX_BODIES
ROOTS = {".xml": ("mujoco", "MJCF"), ".urdf": ("robot", "URDF")}


@dataclass(frozen=True)
class ExaminedFile:
    """An examined file: the root of its XML (None for other sources), the compiled model or MuJoCo's error (`refused`),
    the Mechanism or the reason why mechlab cannot read it as one (`unread`)."""

    name: str
    kind: str
    root: ET.Element | None = None
    model: Model | None = None
    refused: str = ""
    mechanism: Mechanism | None = None
    unread: str = ""


def read_case(path: Path) -> ExaminedFile:
    """Read and compile an .xml (MJCF) or .urdf file; raises MechlabError for a file that cannot be read or is not such
    XML."""
    content = read_text(path)
    tag, kind = ROOTS[path.suffix.lower()]
    try:
        root = sound(content, tag, f"{kind} file")
        mechanism, unread = _as_mechanism(content, kind)
        whole = kind == "MJCF"
        _refuse_many(0 if whole else len(root.findall("joint")))
        model, refused = compile_file(path) if whole else compile_text(ET.tostring(bare(root), encoding="unicode"))
        _refuse_many(0 if model is None else model.nv)
    except MechlabError as error:
        raise MechlabError(f"{path}: {error}") from None
    return ExaminedFile(path.name, kind, root, model, refused, mechanism, unread)


def _refuse_many(coordinates: int) -> None:
    """Raise MechlabError for a file whose dense matrices would take minutes and gigabytes."""
    if coordinates > MOST_COORDINATES:
        raise MechlabError(
            f"it has {coordinates} joints or coordinates; a diagnosis computes with dense matrices, of at most {MOST_COORDINATES}. "
            "Weld parts that do not move against each other into one body, or diagnose a part of the model."
        )


def case_of(mechanism: Mechanism, kind: str) -> ExaminedFile:
    """The examined file of a Mechanism: the MJCF that mechlab writes for it."""

    root = ET.fromstring(to_mjcf(mechanism))
    return ExaminedFile(mechanism.name, kind, root, to_mujoco(mechanism)[0], "", mechanism)


def _as_mechanism(content: str, kind: str) -> tuple[Mechanism | None, str]:

    try:
        return (from_mjcf if kind == "MJCF" else from_urdf)(content), ""
    except MechlabError as error:
        return None, str(error)
    except (ValueError, KeyError, IndexError) as error:
        return None, f"{type(error).__name__}: {error}"


def bare(root: ET.Element) -> ET.Element:
    """A copy of a URDF without visual and collision elements, so that it compiles when its mesh files are missing."""
    root = copy.deepcopy(root)
    for link in root.findall("link"):
        for tag in ("visual", "collision"):
            for element in link.findall(tag):
                link.remove(element)
    return root
