"""The table of fidelities: in words, as JSON, as a picture."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from mechlab.errors import MechlabError
from mechlab.files import whole_folder, write
from mechlab.study.fidelity.measure import Error
from mechlab.tables import Told, number, table

FORMATS = (".svg", ".png", ".json")


@dataclass(frozen=True)
class Level:
    """One fidelity: size, what it answers and why not the rest, error against the richest [m or rad], of drive forces and tooth
    loads (shares), what the engine's rows gave way (slip) and below
    which the error cannot be told from it (resolution) [m or rad], cost, whether it is exact (in words), status in words."""

    fidelity: str
    freedoms: int | None
    coordinates: int | None
    rows: int | None
    answers: tuple[str, ...]
    missing: Mapping[str, str] = field(default_factory=dict)
    error: float | None = None
    worst: str = ""
    force_error: float | None = None
    load_error: float | None = None
    slip: float | None = None
    resolution: float | None = None
    cost: Mapping[str, float | None] = field(default_factory=dict)
    exact: str = ""
    status: str = ""
    reason: str = ""

    def but(self, **changes: Any) -> Level:
        """The same with changes."""
        return replace(self, **changes)

    def as_error(self) -> Error:
        """Its error; infinite where it is not known."""
        poses = float("inf") if self.error is None else self.error
        return Error(poses, self.worst, self.force_error, self.load_error, self.slip or 0.0)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "fidelity": self.fidelity, "freedoms": self.freedoms, "coordinates": self.coordinates, "rows": self.rows,
            "answers": list(self.answers), "cannot": dict(self.missing), "error": self.error, "worst": self.worst,
            "slip": self.slip, "resolution": self.resolution, "force_error": self.force_error, "load_error": self.load_error,
            "exact": self.exact, "cost": dict(self.cost),
            "status": self.status,
        }  # fmt: skip


@dataclass(frozen=True)
class Fidelities(Told):
    """All fidelities on one scene over `duration` [s] of its `full_duration`, and the one to take."""

    name: str
    title: str
    scene: str
    duration: float
    full_duration: float
    needs: tuple[str, ...]
    tolerance: float
    levels: tuple[Level, ...]
    chosen: str | None
    sentence: str
    versions: Mapping[str, str] = field(default_factory=dict)

    @property
    def exit_code(self) -> int:
        """0, or 3 when no fidelity answers what is needed."""
        return 0 if self.chosen else 3

    def level(self, fidelity: str) -> Level:
        """The row of a fidelity; raises KeyError."""
        return {x.fidelity: x for x in self.levels}[fidelity]

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "name": self.name, "scene": self.scene, "duration": self.duration, "scene_duration": self.full_duration,
            "needs": list(self.needs), "tolerance": self.tolerance, "fidelities": [x.to_dict() for x in self.levels],
            "chosen": self.chosen, "sentence": self.sentence, "versions": dict(self.versions),
            "status": "answered" if self.chosen else "no fidelity answers what is needed", "message": self.sentence,
        }  # fmt: skip

    def text(self) -> str:
        """The table for a person."""
        cut = "" if self.duration >= self.full_duration else f" of {self.full_duration:g} s"
        heads = [
            "fidelity",
            "freedoms",
            "coordinates",
            "rows",
            "answers",
            "error [m or rad]",
            "told to",
            "drive forces",
            "CPU s per s",
            "steps/s",
            "status",
        ]
        rows = [[x.fidelity, number(x.freedoms), number(x.coordinates), number(x.rows), ", ".join(n.replace("_", " ") for n in x.answers),
                 number(x.error), number(x.resolution), percent(x.force_error), number(x.cost.get("cpu_s_per_s")),
                 number(x.cost.get("steps_per_s")),
                 x.status] for x in self.levels]  # fmt: skip
        lines = [
            f"{self.name}, scene {self.scene}, {self.duration:.4g} s{cut}: the fidelities side by side",
            f"needed: {', '.join(n.replace('_', ' ') for n in self.needs)}, within {self.tolerance:g} m or rad",
            "",
            table(heads, rows),
            "errors against the richest fidelity: largest difference of any joint, shaft or frame that both name, samples",
            "closed again; told to: below that it cannot be told from the softness of the engine's rows; drive forces: mean square",
            *(f"{x.fidelity}: {x.exact}" for x in self.levels if x.exact and x.error is not None),
            "",
            self.sentence,
        ]
        return "\n".join(lines)

    def save(self, path: str | Path) -> dict[str, Path]:
        """Write the picture or the data, by the suffix; into a folder (a path without one) all of them."""
        path = Path(path)
        if path.suffix and path.suffix not in FORMATS:
            raise MechlabError(
                f"fidelities: cannot write {path.name}; formats: {', '.join(FORMATS)}, or a folder for all of them."
            )
        if path.suffix:
            self._write(path)
            return {path.suffix[1:]: path}
        with whole_folder(path) as stage:
            for s in FORMATS:
                self._write(stage / f"fidelities_{self.name}{s}")
        return {s[1:]: path / f"fidelities_{self.name}{s}" for s in FORMATS}

    def _write(self, path: Path) -> None:
        if path.suffix == ".json":
            write(path, json.dumps(self.to_dict(), indent=1))
        else:
            from mechlab.study.fidelity.picture import draw

            draw(self, path)


def percent(share: float | None) -> str:
    """A share as a percentage."""
    return "-" if share is None else f"{100 * share:.2g} %"
