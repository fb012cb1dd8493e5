"""A model file of somebody's own, as it was read: its mechanism, what of it the mechanism does not hold, what was decided in
reading.

What is left out is said by name: every verb prints it, its JSON lists it (`left_out`, `reading`), and Python gets one
`mechlab.errors.LeftOutWarning` when the file is loaded.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

from mechlab.errors import explained
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.model import Mechanism
from mechlab.tables import listed


@explained
@dataclass(frozen=True)
class LeftOut:
    """Elements of a file that its Mechanism does not hold. what: their kind, as the file's format calls it ("contact", "mesh",
    "sensor"); names: of the elements, or where they stand; why: half a sentence; kept: they still act in a run of the file as
    it is, or are drawn."""

    what: str
    names: tuple[str, ...]
    why: str = ""
    kept: bool = False

    @property
    def sentence(self) -> str:
        """ "3 contacts (a, b, c): why"."""
        kept = "; kept in a run of the file as it is" if self.kept else ""
        return f"{len(self.names)} x {self.what} ({listed(self.names)})" + (f": {self.why}" if self.why else "") + kept

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {"what": self.what, "names": list(self.names), "why": self.why, "kept": self.kept}


@explained
@dataclass(frozen=True)
class ModelFile:
    """A model file: its path (None for a text), kind ("MJCF", "URDF"), mechanism, what is left out of it, and `notes`, sentences
    on what was decided in reading: a loop that was closed and by how much, the branch that was taken, a name that was changed.

    joints: the file's joint -> the joints of the mechanism that stand for it: one, or for a free joint its three slides along
    the axes of the world and its ball joint; bodies, drives, tendons and closures: the file's body, actuator, tendon or equality
    -> the body, drive, shaft or spring, loop or relation of the mechanism. Elements without a name have the key `unnamed(k)`, k
    their number in the file. A body of the file may have more bodies in the mechanism, NAME.1, NAME.2, where its joints act at
    different points, and the frame of a body stands at its joints.
    reference: the coordinates of the file (MuJoCo's qpos) in the reference pose of the mechanism; empty: those of the file's own
    (qpos0). `mechlab.engines.mujoco.model_file.coordinates` converts states with them. ours: mechlab wrote the file.
    unheld: why no Mechanism holds the file, a sentence; then `mechanism` is a `RecordedTree`, and only MuJoCo runs the file.
    """

    path: Path | None
    kind: str
    mechanism: Mechanism
    left_out: tuple[LeftOut, ...] = ()
    notes: tuple[str, ...] = ()
    joints: Mapping[str, tuple[str, ...]] = field(default_factory=dict, hash=False, compare=False)
    bodies: Mapping[str, str] = field(default_factory=dict, hash=False, compare=False)
    drives: Mapping[str, str] = field(default_factory=dict, hash=False, compare=False)
    closures: Mapping[str, str] = field(default_factory=dict, hash=False, compare=False)
    tendons: Mapping[str, str] = field(default_factory=dict, hash=False, compare=False)
    reference: tuple[float, ...] = ()
    ours: bool = False
    unheld: str = ""

    @property
    def name(self) -> str:
        """Name of the file, or of the mechanism of a text."""
        return self.path.name if self.path else self.mechanism.name

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is left out and what was decided, a sentence each; empty for a file that was read whole."""
        return (*(f"left out: {x.sentence}" for x in self.left_out), *self.notes)

    @property
    def lost(self) -> tuple[LeftOut, ...]:
        """What acts on the motion without contacts and is not in the mechanism; empty: nothing is lost. Contacts, floor, meshes,
        sensors, keyframes, lights and the like are left out but not lost: they are `kept` in a run of the file as it is."""
        return tuple(x for x in self.left_out if not x.kept)


def unnamed(number: int) -> str:
    """Key of an element of a file that has no name; number: from 0, in the order of the file."""
    return f"#{number}"
