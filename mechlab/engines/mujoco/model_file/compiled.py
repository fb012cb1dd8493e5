"""A model file as MuJoCo compiles it, and the names of its elements."""

from __future__ import annotations

from dataclasses import field
from pathlib import Path

import mujoco

from mechlab.engines.mujoco.model_file.guarded import ModelRefused, load_file
from mechlab.errors import MechlabError
from mechlab.experiment.model_file import LeftOut, unnamed
from mechlab.lazy_dataclass import dataclass

OBJECT = mujoco.mjtObj


def compiled(path: Path) -> mujoco.MjModel:
    """The model of an MJCF file with its includes, meshes and defaults. Raises MechlabError where MuJoCo refuses the file, and for
    what `guarded.guard` refuses before."""
    try:
        return load_file(path)
    except ModelRefused as refused:
        raise MechlabError(f"MuJoCo refuses {path.name}: {refused}") from None


def given_name(model: mujoco.MjModel, kind: mujoco.mjtObj, number: int) -> str | None:
    """Name of an element, None where the file gives none."""
    return mujoco.mj_id2name(model, kind, number) or None


def key(model: mujoco.MjModel, kind: mujoco.mjtObj, number: int) -> str:
    """Name of an element, or `unnamed(number)`."""
    return given_name(model, kind, number) or unnamed(number)


@dataclass
class Remarks:
    """What a reader leaves out and decides, collected in the order of the file."""

    notes: list[str] = field(default_factory=list)
    _left_out: dict[tuple[str, str, bool], list[str]] = field(default_factory=dict)

    def lose(self, what: str, name: str, why: str) -> None:
        """An element that acts on the motion and is not in the mechanism."""
        self._left_out.setdefault((what, why, False), []).append(name)

    def keep(self, what: str, name: str, why: str = "") -> None:
        """An element that is not in the mechanism and acts, or is seen, in a run of the file as it is."""
        self._left_out.setdefault((what, why, True), []).append(name)

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        """What is left out: first what is lost, then what is kept for a run of the file."""
        items = [LeftOut(what, tuple(names), why, kept) for (what, why, kept), names in self._left_out.items()]
        return tuple(sorted(items, key=lambda x: x.kept))
