"""A chart of speed against accuracy as data: points, front, recommendation, published times, the comparison with other engines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mechlab.lazy_dataclass import dataclass
from mechlab.results import Result, Shown


@dataclass(frozen=True)
class Published:
    """A published CPU time [s] with its program and machine; the sources print no trajectory error with it."""

    program: str
    machine: str
    cpu_s: float

    def to_dict(self) -> dict[str, object]:
        """JSON-able form."""
        return dict(vars(self))


_OPENSIM = ("OpenSim 3.2 / Simbody (2015)", "i5-4570, 3.2 GHz")

PUBLISHED: dict[str, tuple[Published, ...]] = {
    "pendulum": (Published(*_OPENSIM, 0.637),),
    "n_fourbar": (Published(*_OPENSIM, 0.455),),
    "andrews": (Published(*_OPENSIM, 0.384),),
    "bricard": (Published(*_OPENSIM, 0.258),),
    "flyball": (Published(*_OPENSIM, 0.233),),
}
"""MBSbenchmarksInOpenSim (RehabEngGroup), with the parameters of the IFToMM library."""

FEWEST = 4
"""Least number of step sizes of a method."""
OK, DIVERGED, NOT_RUN = "ok", "diverged", "not run"


@dataclass(frozen=True)
class ChartPoint:
    """One method at one step [s], or at one tolerance where `control` is "tolerance".

    error: largest deviation of a tracked quantity [m or rad]; e_g, energy [J], gap [m]: see `score.Score`; default: an
    engine's default settings; evaluations: of the equations of motion, 0 where they are not counted. cpu_s: of stepping;
    total_s: of a peer's run, its model building and output included.
    """

    method: str
    step: float
    control: str
    cpu_s: float
    error: float
    e_g: float
    energy: float
    gap: float
    status: str
    reason: str = ""
    default: bool = False
    evaluations: int = 0
    total_s: float = math.nan

    @classmethod
    def without_numbers(
        cls, method: str, step: float, control: str, status: str, reason: str, default: bool = False
    ) -> ChartPoint:
        """A point of a run that diverged or was not made."""
        nan = math.nan
        return cls(method, step, control, nan, nan, nan, nan, nan, status, reason, default)

    @property
    def ok(self) -> bool:
        """True when there is an error to show."""
        return self.status == OK

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form; a number that is missing is null."""
        numbers = {"cpu_s": self.cpu_s, "error": self.error, "e_G": self.e_g, "energy": self.energy, "gap": self.gap}
        numbers |= {} if math.isnan(self.total_s) else {"total_s": self.total_s}
        shown = {k: x if math.isfinite(x) else None for k, x in numbers.items()}
        head = {"method": self.method, "step": self.step, "control": self.control, **shown}
        end = {"status": self.status, "reason": self.reason, "default": self.default}
        return head | end | {"evaluations": self.evaluations or None}


@dataclass(frozen=True)
class Recommendation:
    """The cheapest point that meets the target, in words and as settings to paste."""

    point: ChartPoint
    target: float
    met: bool
    sentence: str
    paste: str

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        p = self.point.to_dict()
        named = {k: p[k] for k in ("method", "step", "control", "cpu_s", "error")}
        return named | {"target": self.target, "met": self.met, "sentence": self.sentence, "paste": self.paste}


@dataclass(frozen=True, repr=False)
class Chart(Result[dict[str, Path]]):
    """All points of a scene, the reference that their errors are measured against, and what follows from them.

    unit: of the errors; tracked: the quantities whose largest error counts; reference_error: estimated error of the
    reference; skipped: method -> why it could not run. `save` writes .svg, .png, .csv or .json, or all of them into a
    folder.
    """

    name: str
    title: str
    scene: str
    duration: float
    unit: str
    tracked: tuple[str, ...]
    reference: str
    reference_error: float
    points: tuple[ChartPoint, ...]
    skipped: dict[str, str]
    recommendation: Recommendation
    notes: tuple[str, ...]
    published: tuple[Published, ...]
    versions: dict[str, str]
    peers: PeerTable | None = None
    acts: str = ""

    @property
    def front(self) -> tuple[ChartPoint, ...]:
        """Points that no other beats in both cost and error, cheapest first."""
        return pareto(self.points)

    @property
    def exit_code(self) -> int:
        """0, or 3 when no method met the target."""
        return 0 if self.recommendation.met else 3

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "name": self.name, "scene": self.scene, "acts": self.acts, "duration": self.duration, "error_unit": self.unit,
            "tracked": list(self.tracked), "reference": {"text": self.reference, "error": self.reference_error},
            "points": [p.to_dict() for p in self.points], "front": [p.to_dict() for p in self.front],
            "recommendation": self.recommendation.to_dict(), "notes": list(self.notes), "skipped": dict(self.skipped),
            "published": [p.to_dict() for p in self.published], "versions": self.versions,
            "status": "answered" if self.recommendation.met else "no method meets the target",
            "message": self.recommendation.sentence,
            **({} if self.peers is None else self.peers.to_dict()),
        }  # fmt: skip


def pareto(points: Sequence[ChartPoint]) -> tuple[ChartPoint, ...]:
    """The points that no other point beats in both cost and error, cheapest first."""
    out: list[ChartPoint] = []
    for p in sorted((p for p in points if p.ok), key=lambda p: (p.cpu_s, p.error)):
        if not out or p.error < out[-1].error:
            out.append(p)
    return tuple(out)


@dataclass(frozen=True)
class PeerRow:
    """One target [m or rad]: our run and the fastest peer that meets the target.

    ours_cpu_s: all CPU time from the call to the returned recording, no model kept from before; peer_cpu_s: that of building the
    peer's model, stepping and output. Neither has imports in it. When no peer meets the target, `peer` is empty and `peer_error` is
    the least error of all peers. Missing numbers are nan.
    """

    target: float
    ours_cpu_s: float
    ours_error: float
    ours_method: str
    ours_reached: bool
    peer: str
    peer_step: float
    peer_cpu_s: float
    peer_error: float

    @property
    def ratio(self) -> float:
        """Our CPU time over the peer's; nan where one of them does not meet the target."""
        met = self.ours_reached and self.ours_error <= self.target
        return self.ours_cpu_s / self.peer_cpu_s if met and self.peer else math.nan

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form; a missing number is null."""
        names = ("target", "ours_cpu_s", "ours_error", "peer_cpu_s", "peer_error", "peer_step", "ratio")
        numbers = {n: getattr(self, n) for n in names}
        shown = {n: x if math.isfinite(x) else None for n, x in numbers.items()}
        return shown | {"ours_method": self.ours_method, "ours_reached": self.ours_reached, "peer": self.peer or None}


@dataclass(frozen=True, repr=False)
class PeerTable(Shown):
    """Comparison with other engines on a scene: a row for each target, all points of the peers, and peer -> why it was
    not run.

    costly: CPU time [s] of one run at which the search for a peer's best setting ends. notes: what a reader must know of a peer.
    """

    rows: tuple[PeerRow, ...]
    points: tuple[ChartPoint, ...]
    skipped: dict[str, str]
    versions: dict[str, str]
    unit: str
    costly: float
    notes: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        rows = [r.to_dict() for r in self.rows]
        return {
            "peers": rows, "peers_refined_to_cpu_s": self.costly, "peer_versions": dict(self.versions),
            "peer_notes": list(self.notes),
        }  # fmt: skip
