"""Laws that hold rates by bounded forces (dry friction with true sticking, one-way stops, rate servos, locked pairs),
and viscous drag between two parts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import product
from typing import Any, ClassVar

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.laws import Law, Plant, register
from mechlab.experiment.laws.formula import Affine, Formula
from mechlab.experiment.recording import Finding
from mechlab.experiment.scene import Settings
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

ROUNDING = 1e-14


@dataclass(frozen=True)
class RateHold:
    """A hold of a rate at `rate` [rad/s or m/s] by a force between `low` and `high` [N m or N]. `on`: a joint or shaft,
    or pairs (name, coefficient) of a sum of rates; the force on each member is its coefficient times the holding force.

    Dry friction: -f, f. A one-way stop that lets the rate grow: 0, inf. A rate servo or a locked pair: -inf, inf.
    """

    on: str | tuple[tuple[str, float], ...]
    rate: float = 0.0
    low: float = -math.inf
    high: float = math.inf

    @property
    def terms(self) -> tuple[tuple[str, float], ...]:
        """Pairs (joint or shaft, coefficient)."""
        return ((self.on, 1.0),) if isinstance(self.on, str) else self.on


@register("viscous_between")
@dataclass(frozen=True)
class ViscousBetween:
    """Viscous drag between two joints or shafts: -coefficient (rate of a - rate of b) on a, the opposite on b."""

    a: str
    b: str
    coefficient: float
    kind: ClassVar[str]

    def targets(self) -> tuple[str, ...]:
        """The two joints or shafts."""
        return self.a, self.b

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The drag at the present rates."""
        f = self.coefficient * (plant.rate(self.a) - plant.rate(self.b))
        return {self.a: -f, self.b: f}

    def formulas(self) -> tuple[Formula, ...]:
        """See `mechlab.experiment.laws.formula`."""
        c, pair = self.coefficient, (self.a, self.b)
        drag = [Affine(rates=tuple(zip(pair, gains, strict=True))) for gains in ((-c, c), (c, -c))]
        return tuple(Formula(on, (force,)) for on, force in zip(pair, drag, strict=True))


@register("held_rates")
@dataclass(frozen=True)
class HeldRates:
    """The forces of `laws` plus bounded holding forces that bring each rate to its target. With e the rate less its
    target, the holding forces solve the box-constrained problem

        acceleration = free + response @ force;    force inside its bounds: acceleration = -e / time;
        force at its lower (upper) bound: acceleration >= (<=) -e / time.

    Far from the target this is sliding friction at its bound; at the target it sticks exactly, without creep, as long
    as the bounds allow. `laws` must contain every other law of the scene; dry friction of the Mechanism itself is not
    included. `time` [s] is the time constant of the capture: of the order of the timestep, at least half of it.
    """

    holds: tuple[RateHold, ...]
    laws: tuple[Law, ...] = ()
    time: float = 1e-3
    kind: ClassVar[str]

    def __post_init__(self) -> None:
        if not self.time > 0.0:
            raise MechlabError(f"held_rates: time: expected a number > 0 s, got {self.time!r}.")
        for hold in self.holds:
            if not hold.low <= 0.0 <= hold.high:
                raise MechlabError(
                    f"held_rates: {hold.on!r}: the bounds must enclose 0, got {hold.low:g} to {hold.high:g}."
                )

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return self.targets()

    def targets(self) -> tuple[str, ...]:
        """Everything that is held or that one of the laws acts on."""
        names = [n for law in self.laws for n in law.targets()] + [n for h in self.holds for n, _ in h.terms]
        return tuple(dict.fromkeys(names))

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """Forces of the laws plus the holding forces at the present state."""
        out = dict.fromkeys(self._names, 0.0)
        for law in self.laws:
            for name, f in law.force(t, plant).items():
                out[name] += f
        rows = self._rows(plant.mechanism)
        free, response = self._response(plant, list(out.values()), rows)
        excess = []
        for a, hold in zip(free, self.holds, strict=True):
            off = -hold.rate
            for n, c in hold.terms:
                off += c * plant.rate(n)
            excess.append(a + off / self.time)
        for hold, f in zip(self.holds, self._holding(excess, response), strict=True):
            for name, c in hold.terms:
                out[name] += c * f
        return out

    @cached_property
    def _kept(self) -> dict[str, Any]:
        return {}

    def _rows(self, m: Mechanism) -> _HeldRows:
        """The rows of a mechanism; cached for the last one."""
        kept: _HeldRows | None = self._kept.get("rows")
        if kept is None or kept.mechanism is not m:
            table = np.array([m.row(n) for n in self._names]).reshape(-1, m.nv)
            held = np.array([sum(c * m.row(n) for n, c in h.terms) for h in self.holds]).reshape(-1, m.nv)
            kept = self._kept["rows"] = _HeldRows(m, table, held)
        return kept

    def _response(self, plant: Plant, forces: list[float], rows: _HeldRows) -> tuple[list[float], list[list[float]]]:
        """Accelerations (k,) of the held rates under the constraints and `forces` on the targets, without holding forces, and
        their change (k, k) per unit of each holding force.

        The operators are cached while mass matrix and constraint rows stay equal to rounding: in gear trains they are
        constant, and a law is evaluated at every stage of every step.
        """
        mass, jacobian = plant.mass_matrix(), plant.jacobian()
        kept: _Operators | None = self._kept.get("operators")
        if kept is None or kept.rows is not rows or not (kept.mass.same(mass) and kept.jacobian.same(jacobian)):
            by_force, by_bias, response = _operators(mass, jacobian, rows.held)
            kept = _Operators(rows, _Seen(mass), _Seen(jacobian), by_force, by_force @ rows.table.T, by_bias, response)
            self._kept["operators"] = kept
        free = kept.by_target.dot(forces) - kept.by_force.dot(plant.bias())
        if len(jacobian):
            free += kept.by_bias.dot(plant.constraint_bias())
        return free.tolist(), kept.response

    @cached_property
    def _active_sets(self) -> list[tuple[tuple[int, ...], list[float], list[int]]]:
        """Every active set: state of each hold (0: inside its bounds, -1, 1: at one of them), the forces of those at a bound, and
        the holds inside."""
        return [
            (state, [h.high if s > 0 else h.low if s < 0 else 0.0 for s, h in zip(state, self.holds, strict=True)],
             [i for i, s in enumerate(state) if s == 0])
            for state in product(*(_states(h) for h in self.holds))
        ]  # fmt: skip

    def _holding(self, excess: list[float], response: list[list[float]]) -> list[float]:
        """Forces f of the box-constrained problem: excess + response @ f is complementary to the bounds on f.

        All active sets are tried in turn, as there are few; for one hold they come to the clipped solution. Plain floats, because this
        runs at every stage of every step.
        """
        if len(excess) == 1 and response[0][0] > 0.0:
            hold = self.holds[0]
            return [min(max(-excess[0] / response[0][0], hold.low), hold.high)]
        scale = 1e-9 * max(1.0, *(abs(x) for x in excess)) if excess else 0.0
        best, least = [0.0] * len(excess), math.inf
        for state, bounds, inside in self._active_sets:
            f = bounds.copy()
            right = [-excess[i] - _dot(response[i], f) for i in inside]
            for i, x in zip(inside, _solve([[response[i][k] for k in inside] for i in inside], right), strict=True):
                f[i] = x
            gap = -math.inf  # violation: a force beyond its bounds, or at a bound with the wrong sign of acceleration
            for i, (s, h) in enumerate(zip(state, self.holds, strict=True)):
                gap = max(gap, s * (excess[i] + _dot(response[i], f)) if s else max(h.low - f[i], f[i] - h.high))
            if gap < least:
                best, least = f, gap
            if gap <= scale:
                break
        return [min(max(x, h.low), h.high) for x, h in zip(best, self.holds, strict=True)]


def without_holds(laws: tuple[Law, ...]) -> tuple[tuple[Law, ...], tuple[RateHold, ...]]:
    """The laws of a scene without those that hold rates, and the holds of these."""
    holding = [law for law in laws if isinstance(law, HeldRates)]
    others = tuple(x for law in laws for x in (law.laws if isinstance(law, HeldRates) else (law,)))
    return others, tuple(h for law in holding for h in law.holds)


def captured(laws: Sequence[Law], factor: float) -> tuple[Law, ...]:
    """The laws, with the capture times of held rates times `factor`: they have to be refined with the timestep."""
    return tuple(replace(law, time=factor * law.time) if isinstance(law, HeldRates) else law for law in laws)


def capture_finding(laws: Sequence[Law], settings: Settings) -> Finding | None:
    """Finding "capture": timestep / capture time of held rates; None without such a law or with step control.

    Above the stability limit of the method on e' = -e / time (RK4: 2.785, others: 2) the rates chatter about their
    targets: an error. From 0.9 times the limit on, a warning.
    """
    held = [law for law in laws if isinstance(law, HeldRates) and law.holds]
    if not held or settings.integrator == "DOP853":
        return None
    ratio, limit = max(settings.timestep / law.time for law in held), 2.785 if settings.integrator == "RK4" else 2.0
    text = f"held rates are captured in {settings.timestep / ratio:g} s, the timestep is {ratio:.3g} times that"
    if ratio <= 0.9 * limit:
        return Finding("capture", ratio, limit, "", "ok", f"{text} (limit {limit:g})")
    severity = "error" if ratio > limit else "warning"
    text += (
        f"; beyond {limit:g} times the rates chatter about their targets instead of standing. Take a smaller timestep"
    )
    return Finding("capture", ratio, limit, "", severity, text + (": do not trust this run" if ratio > limit else ""))


def _dot(a: list[float], b: list[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _solve(a: list[list[float]], b: list[float]) -> list[float]:
    """Solution x of a x = b; the minimum-norm solution where a is singular."""
    if not b:
        return []
    if len(b) == 1 and a[0][0] > 0.0:
        return [b[0] / a[0][0]]
    if len(b) == 2:
        det = a[0][0] * a[1][1] - a[0][1] * a[1][0]
        if det > 1e-12 * a[0][0] * a[1][1]:
            return [(b[0] * a[1][1] - b[1] * a[0][1]) / det, (b[1] * a[0][0] - b[0] * a[1][0]) / det]
    return [float(x) for x in np.linalg.lstsq(np.array(a), np.array(b), rcond=1e-12)[0]]


def _states(hold: RateHold) -> tuple[int, ...]:
    return tuple(s for s, x in ((0, 0.0), (-1, hold.low), (1, hold.high)) if math.isfinite(x))


@dataclass(frozen=True, eq=False)
class _HeldRows:
    """Rows of the targets, table (targets, nv), and of the held rates, held (holds, nv), for the rates of a mechanism."""

    mechanism: Mechanism
    table: Array
    held: Array


class _Seen:
    """A matrix that was seen, to tell whether another is equal to it to rounding."""

    def __init__(self, matrix: Array) -> None:
        self.matrix, self.exact = matrix.copy(), matrix.tobytes()
        self.rounding = ROUNDING * float(np.abs(matrix).max(initial=0.0))

    def same(self, matrix: Array) -> bool:
        """Whether it is the same matrix; bit for bit is tried first, which costs a tenth."""
        if matrix.shape != self.matrix.shape:
            return False
        return matrix.tobytes() == self.exact or bool(np.abs(matrix - self.matrix).max(initial=0.0) <= self.rounding)


@dataclass(frozen=True, eq=False)
class _Operators:
    """What `_operators` gives for the rows, a mass matrix and constraint rows; by_target (k, targets) = by_force @ table^T."""

    rows: _HeldRows
    mass: _Seen
    jacobian: _Seen
    by_force: Array
    by_target: Array
    by_bias: Array
    response: list[list[float]]


def _operators(m: Array, j: Array, r: Array) -> tuple[Array, Array, list[list[float]]]:
    """Operators A (k, nv), B (k, rows), C (k, k) for mass matrix m (nv, nv) and constraint rows j (rows, nv):

        r @ acceleration = A @ force + B @ (dJ/dt v) + C @ (forces on the rows r)

    Computed by the null space of j, so that they are exact for redundant constraints too.
    """
    nv = len(m)
    u, values, vt = np.linalg.svd(j) if len(j) else (np.zeros((0, 0)), np.zeros(0), np.eye(nv))
    rank = int(np.sum(values > 1e-11 * np.max(values, initial=0.0)))
    free = vt[rank:].T
    project = free @ np.linalg.solve(free.T @ m @ free, free.T)
    particular = -(vt[:rank].T / values[:rank]) @ u[:, :rank].T
    return r @ project, r @ (particular - project @ m @ particular), (r @ project @ r.T).tolist()
