"""What a path task, or a motion task, demands, and what its answers have in common: how they are followed, told apart and ordered."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from mechlab.analytic.path_synthesis.curves import Array, Complex, Curve, LinkCurve
from mechlab.analytic.path_synthesis.fit import Fitted, Limits
from mechlab.analytic.path_synthesis.guided_body import GuidedBody
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

EXACT = 1e-9
"""Largest distance from a point, relative to the extent of the points, of a linkage that passes through it."""
DENSE = 361
"""Crank angles at which a linkage is followed from the first point to the last."""
OVER = np.radians(15.0)
"""What the crank may turn beyond a full turn, at the end of a closed path."""


@dataclass(frozen=True)
class PathTask:
    """Points (n,) as x + i y [m] in their order; timing: crank angles (n,) [rad], or None where they are free; size: longest bar [m];
    least: smallest angle between coupler and link [rad]. turns: angles (n,) of a body [rad] whose origin is to be at the points, None where
    a point is all that is wanted; arm: length by which an error of these angles counts [m], 0: half the extent of the points.

    Raises MechlabError for points, or positions, that coincide or are not finite, and for crank angles that do not grow, or fall, within
    a turn."""

    targets: Complex
    timing: Array | None
    size: float
    least: float = 0.0
    turns: Array | None = None
    arm: float = 0.0

    def __post_init__(self) -> None:
        t, what = self.timing, "path synthesis: points" if self.turns is None else "motion synthesis: positions"
        if not np.all(np.isfinite(self.aims)) or (t is not None and not np.all(np.isfinite(t))):
            raise MechlabError(f"{what} and crank angles must be finite numbers.")
        for k in np.flatnonzero(self.ways <= 1e-9 * self.extent):
            raise MechlabError(f"{what} {k + 1} and {k + 2} are the same.")
        if t is not None and (np.ptp(np.sign(np.diff(t))) > 0.0 or t[0] == t[1] or np.ptp(t) > 2.0 * np.pi + 1e-9):
            raise MechlabError("path synthesis: the crank angles must grow, or fall, from point to point, within one turn.")

    @property
    def extent(self) -> float:
        """Twice the largest distance of a point from the middle of all [m]."""
        return 2.0 * float(np.max(np.abs(self.targets - self.targets.mean())))

    @property
    def unit(self) -> PathTask:
        """The task about the middle of its points, in their extent: the search is the same in every place and size."""
        one = self.extent
        return replace(self, targets=(self.targets - self.targets.mean()) / one, size=self.size / one, arm=self.arm / one)

    def to_unit(self, f: PathLinkage) -> PathLinkage:
        """A linkage of the task as one of `unit`."""
        return f.moved(1.0 / self.extent, -complex(self.targets.mean()) / self.extent)

    def from_unit(self, f: PathLinkage) -> PathLinkage:
        """A linkage of `unit` as one of the task."""
        return f.moved(self.extent, complex(self.targets.mean()))

    @property
    def arrows(self) -> Complex | None:
        """Directions (n,) of the body, of the length of the arm; None where there is no body."""
        return None if self.turns is None else (self.arm or 0.5 * self.extent) * np.exp(1j * self.turns)

    @property
    def aims(self) -> Complex:
        """What a curve is to meet: points (n,), or positions (n, 2) as `guided_body` has them."""
        arrows = self.arrows
        return self.targets if arrows is None else np.stack([self.targets, arrows], axis=-1)

    @property
    def ways(self) -> Array:
        """How far each is from the one before (n - 1,) [m]."""
        gap = np.diff(self.aims, axis=0)
        return np.asarray(np.linalg.norm(gap.reshape(len(gap), -1), axis=1))

    def curve(self, base: LinkCurve) -> Curve:
        """The kind of linkage as it is to meet them."""
        arrows = self.arrows
        return base if arrows is None else GuidedBody(base, abs(arrows[0]))

    def begun(self, base: LinkCurve, start: Fitted) -> Fitted:
        """Starts with the body fixed to its link as it suits best."""
        arrows = self.arrows
        if arrows is None:
            return start
        return replace(start, rows=GuidedBody(base, abs(arrows[0])).aligned(start.rows, start.modes, start.angles, arrows))

    @property
    def limits(self) -> Limits:
        """What every step of the fit keeps to."""
        return Limits(self.size, float(np.sin(self.least)))

    @property
    def timed(self) -> bool:
        """True where the crank angles are given."""
        return self.timing is not None


@dataclass(frozen=True)
class PathLinkage:
    """A linkage: its kind, its row and mode (`curves`, `sixbar`), crank angles (n,) of the points, counted from the crank's direction in
    the row, distances (n,) from the points [m], or (n, 2) from the places and arrows of a body (`guided_body`), least angle between
    coupler and link, of both dyads of a six-bar, on the way [rad], whether the crank turns fully. defect: "", "branch" (it does not get
    from the first point to the last without being taken apart) or "order"."""

    curve: Curve
    row: Array
    mode: int
    angles: Array
    distances: Array
    least_transmission_angle: float
    crank_turns: bool
    defect: str

    @property
    def ratio(self) -> int:
        """Ratio of the gears; 0: there are none."""
        return int(self.curve.ratio)

    def moved(self, scale: float, shift: complex) -> PathLinkage:
        """The linkage in another size, and then in another place [m]."""
        row = scale * self.row
        for k in self.curve.pivots:
            row[k] += shift.real
            row[k + 1] += shift.imag
        return replace(self, curve=self.curve.scaled(scale), row=row, distances=scale * self.distances)

    @property
    def squares(self) -> float:
        """Sum of squared distances [m^2]."""
        return float(np.sum(self.distances**2))


Found = tuple[Array, int, Array]
"""Row, mode, crank angles."""


def joined(parts: list[Fitted]) -> Fitted:
    """All of the parts."""
    return Fitted(*(np.concatenate([getattr(p, n) for p in parts]) for n in ("rows", "modes", "angles", "missed")))


def best(found: Fitted, task: PathTask, count: int) -> Fitted:
    """The best `count` that differ in mode, or by more than 1e-3 of the size of the points, or of the linkage."""
    kept = list[int]()
    for k in np.argsort(found.missed):
        if len(kept) == count or not np.isfinite(found.missed[k]):
            break
        row = found.rows[k]
        apart = 1e-3 * max(task.extent, float(np.max(np.abs(row))))
        same = np.max(np.abs(found.rows[kept] - row), axis=1) <= apart
        if not np.any(same & (found.modes[kept] == found.modes[k])):
            kept.append(int(k))
    return Fitted(*(getattr(found, n)[kept] for n in ("rows", "modes", "angles", "missed")))


def one_by_one(found: Fitted) -> Iterable[Found]:
    """One by one."""
    return ((row, int(mode), angles) for row, mode, angles in zip(found.rows, found.modes, found.angles, strict=True))


def judged(found: Found, curve: Curve, task: PathTask, near: float = 1.0) -> PathLinkage:
    """Follows the linkage from the first point to the last; it must come as near to all as `near` times their extent."""
    row, mode, t = found
    way, turn = np.linspace(t[0], t[-1], DENSE), np.linspace(0.0, 2.0 * np.pi, DENSE)
    at, path, round_ = (curve.points(row[None], np.array([mode]), x[None]) for x in (t, way, turn))
    distances = np.abs(at.point[0] - task.aims)
    assembles = bool(np.all(np.isfinite(path.margin)))
    # a four-bar that meets one of five points in its other mode closes there, but elsewhere
    reached = assembles and bool(np.max(distances) <= near * task.extent)
    in_order = bool(np.ptp(np.sign(np.diff(t))) == 0.0 and np.ptp(t) <= 2.0 * np.pi + OVER)
    least = float(np.arcsin(np.clip(np.min(np.abs(path.margin)), 0.0, 1.0))) if assembles else 0.0
    defect = ("" if in_order else "order") if reached else "branch"
    return PathLinkage(curve, row, mode, t, distances, least, bool(np.all(np.isfinite(round_.margin))), defect)


def ordered(found: Iterable[PathLinkage], task: PathTask) -> tuple[PathLinkage, ...]:
    """Exact ones in the order of their transmission angle, then the others in that of their squares."""

    def key(f: PathLinkage) -> tuple[bool, float]:
        exact = bool(np.max(f.distances) < EXACT * task.extent)
        return (not exact, -f.least_transmission_angle if exact else f.squares)

    return tuple(sorted(found, key=key))
