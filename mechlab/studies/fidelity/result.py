"""All fidelities on one scene as data, and as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

from mechlab.lab.fidelity.measure import FidelityError
from mechlab.lazy_dataclass import dataclass
from mechlab.results import Result


@dataclass(frozen=True)
class Level:
    """One fidelity: its size, the needs it answers, and why it does not answer the others.

    error [m or rad]: against the richest, largest at `worst`; force_error, load_error: of drive forces and tooth loads, as shares;
    slip [m or rad]: how far the rows of the engine gave way; resolution: below it the error cannot be told from that; exact: in
    words, where it is an exact reduction; reason: why its run failed.
    """

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

    def as_error(self) -> FidelityError:
        """Its error; infinite where it is not known."""
        poses = float("inf") if self.error is None else self.error
        return FidelityError(poses, self.worst, self.force_error, self.load_error, self.slip or 0.0)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "fidelity": self.fidelity, "freedoms": self.freedoms, "coordinates": self.coordinates, "rows": self.rows,
            "answers": list(self.answers), "cannot": dict(self.missing), "error": self.error, "worst": self.worst,
            "slip": self.slip, "resolution": self.resolution, "force_error": self.force_error, "load_error": self.load_error,
            "exact": self.exact, "cost": dict(self.cost),
            "status": self.status,
        }  # fmt: skip


@dataclass(frozen=True, repr=False)
class Fidelities(Result[dict[str, Path]]):
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
