"""The motion that follows a path, and how well: errors of the targets, limits that stopped it, distance from singularity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import explained
from mechlab.experiment.recording import Recording
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.results import Result
from mechlab.tables import counted, number


@dataclass(frozen=True, eq=False)
class Tracked:
    """A target and its error (n,) along the path [m or rad]. required: it has the first priority and must be met."""

    name: str
    error: Array
    unit: str
    tolerance: float
    priority: int
    required: bool

    @property
    def largest(self) -> float:
        """Largest error."""
        return float(np.max(self.error))

    @property
    def missed(self) -> NDArray[np.bool_]:
        """(n,) True where the error is beyond the tolerance."""
        return ~(self.error <= self.tolerance)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "name": self.name, "unit": self.unit, "tolerance": self.tolerance, "priority": self.priority,
            "required": self.required, "largest_error": self.largest, "met": not np.any(self.missed),
            "error": self.error.tolist(),
        }  # fmt: skip


@dataclass(frozen=True)
class ActiveLimit:
    """A limit that stopped the motion at the samples `first` to `last`, which are counted from 0."""

    sentence: str
    kind: str
    of: str
    first: int
    last: int


@explained
@dataclass(frozen=True, repr=False)
class Track(Result[Path]):
    """A motion of a closed mechanism along its targets.

    recording: poses and rates at the times of the path, a Recording like that of a run: `view`, `save` and channels work.
    Rates are central differences of the poses (their error falls with the square of the spacing), put on the motions that
    the loops allow. targets: error of each. limits: what stopped the motion, where. distances: kind -> (n,) distance from
    singularity. gap: largest residual of loops and gears, in sizes of the mechanism and rad. `steps`: QP steps of all poses.
    """

    name: str
    recording: Recording
    targets: tuple[Tracked, ...]
    limits: tuple[ActiveLimit, ...]
    distances: Mapping[str, Array]
    gap: float
    steps: int
    cpu_s: float
    unsettled: NDArray[np.bool_]
    notes: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def t(self) -> Array:
        """(n,) times [s]."""
        return self.recording.t

    @property
    def q(self) -> Array:
        """(n, nq) coordinates."""
        return self.recording.q

    def __getitem__(self, channel: str) -> Array:
        return self.recording.channel(channel)

    @property
    def commands(self) -> dict[str, Array]:
        """Drive -> (n,) value of its joint or shaft [rad, m]: what to command to move like this."""
        m = self.recording.mechanism
        return {d.name: self.recording.channel(d.on) for d in m.drives}

    @property
    def met(self) -> bool:
        """True when every required target is met at every time, and the loops are closed."""
        return self.recording.health.trusted

    @property
    def exit_code(self) -> int:
        """0, or 3 when a required target is missed."""
        return 0 if self.met else 3

    @property
    def message(self) -> str:
        """One sentence: met, or what is missed, where and by how much."""
        if self.met:
            required = [x for x in self.targets if x.required]
            return f"{counted(len(required), 'target')} met at {counted(len(self.t), 'time')}"
        return self.recording.message

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        t = self.t
        return {
            "name": self.name, "times": t.tolist(), "targets": [x.to_dict() for x in self.targets],
            "commands": {n: x.tolist() for n, x in self.commands.items()},
            "joints": {n: self.recording.channel(n).tolist() for n in self.recording.mechanism.scalar_names},
            "limits": [
                {"sentence": x.sentence, "kind": x.kind, "of": x.of, "from": float(t[x.first]), "to": float(t[x.last])}
                for x in self.limits
            ],
            "singularity": {n: {"least": float(np.min(x)), "at": float(t[int(np.argmin(x))])} for n, x in self.distances.items()},
            "gap": self.gap, "steps": self.steps, "cpu_s": self.cpu_s, "status": "answered" if self.met else "finished, do not trust it",
            "message": self.message, "notes": list(self.notes), "parameters": dict(self.recording.parameters),
            "versions": dict(self.recording.versions), "files": dict(self.files),
        }  # fmt: skip


def miss_sentence(
    x: Tracked, t: Array, limits: tuple[ActiveLimit, ...], settled: NDArray[np.bool_], alone: bool
) -> str:
    """Where, by how much and why a target is missed. alone: it is the only one that must be met."""
    k = int(np.argmax(x.error))
    spans = runs(x.missed)
    text = f"{x.name} is missed by up to {number(x.largest)} {x.unit} (at {t[k]:g} s), "
    text += "; ".join(f"from {t[a]:g} to {t[b]:g} s" if b > a else f"at {t[a]:g} s" for a, b in spans[:3])
    text += f" and {counted(len(spans) - 3, 'more time')}" if len(spans) > 3 else ""
    held = [limit.sentence for limit in limits if any(limit.first <= b and a <= limit.last for a, b in spans)]
    if held:
        return f"{text}: held by {'; '.join(dict.fromkeys(held))}"
    return f"{text}: " + (
        "the search did not settle there" if not settled[k] else "out of reach, or the targets contradict each other"
    )


def runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of each run of True."""
    edges = np.diff(np.concatenate([[0], np.asarray(mask, dtype=int), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    return list(zip(starts.tolist(), ends.tolist(), strict=True))
