"""Motion of the two freedoms in closed form, piece by piece: J w' = Q - D w + contacts, with exact events; reactions, and the
lag of MuJoCo's soft constraint rows.

A contact acts on the sum row . w. It opposes the departure of this sum from its target with its lower or upper bound [N m]
(dry friction: -f, f; a one-way stop: 0, infinity; a servo or a rigid pair: -infinity, infinity); between the bounds it holds
the target exactly. Between events the equations are linear and solved by matrix exponentials, without a step size.
"""

from __future__ import annotations

from dataclasses import field
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.differential.train import FloatArray
from mechlab.analytic.roots import brentq
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

TOLERANCE = 1e-10
MOST_EVENTS = 100


@dataclass(frozen=True)
class Contact:
    """Holds row . w (row (2,), speeds (w1, w3)) at `target` [rad/s] by a moment between `low` and `high` [N m]."""

    name: str
    row: tuple[float, float]
    target: float = 0.0
    low: float = -np.inf
    high: float = np.inf


@dataclass(frozen=True)
class DifferentialMotion:
    """Angles and rates (n, 2) of blocks 14 and 36 at times t (n,); moments of the contacts; events (time, sentence)."""

    t: FloatArray
    angles: FloatArray
    rates: FloatArray
    moments: dict[str, FloatArray]
    events: tuple[tuple[float, str], ...]


@dataclass
class _Phase:
    """Which contacts hold (the others push with a constant moment), and the linear motion that follows."""

    J: FloatArray
    D: FloatArray
    Q: FloatArray
    contacts: tuple[Contact, ...]
    state: tuple[str, ...]
    system: FloatArray = field(init=False)
    flows: dict[float, FloatArray] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        held = [i for i, s in enumerate(self.state) if s == "hold"]
        self.held, self.moved = held, self.Q.copy()
        for c, s in zip(self.contacts, self.state, strict=True):
            if s != "hold":
                self.moved = self.moved + (c.low if s == "low" else c.high) * np.array(c.row)
        rows = np.array([self.contacts[i].row for i in held]).reshape(len(held), 2)
        _, values, vt = np.linalg.svd(rows) if held else (None, np.zeros(0), np.eye(2))
        free = vt[int(np.sum(values > 1e-12)) :].T if held else np.eye(2)
        inverse = free @ np.linalg.inv(free.T @ self.J @ free) @ free.T if free.shape[1] else np.zeros((2, 2))
        self.rows, self.slope, self.share = rows, inverse, np.linalg.pinv(rows.T)
        self.system = np.zeros((5, 5))
        self.system[:2, 2:4] = np.eye(2)
        self.system[2:4, 2:4] = -inverse @ self.D
        self.system[2:4, 4] = inverse @ self.moved

    def at(self, start: FloatArray, dt: float) -> FloatArray:
        """(4,) angles and rates after dt. The exponential of each dt is kept: times at even distances have a few, to rounding."""
        flow = self.flows.get(dt)
        if flow is None:
            flow = self.flows[dt] = exponential(dt * self.system)
        return np.asarray((flow @ np.append(start, 1.0))[:4])

    def onto(self, w: FloatArray) -> FloatArray:
        """(2,) rates w without the rounding error by which holding contacts miss their targets."""
        if not self.held:
            return w
        gap = self.rows @ w - [self.contacts[i].target for i in self.held]
        compliance = np.linalg.solve(self.J, self.rows.T)
        return np.asarray(w - compliance @ np.linalg.lstsq(self.rows @ compliance, gap, rcond=None)[0])

    def accelerations(self, w: FloatArray) -> FloatArray:
        """(2,) w'."""
        return np.asarray(self.slope @ (self.moved - self.D @ w))

    def moments(self, w: FloatArray) -> FloatArray:
        """Moment of every contact."""
        out = np.array([c.low if s == "low" else c.high for c, s in zip(self.contacts, self.state, strict=True)])
        if self.held:
            needed = self.J @ self.accelerations(w) - self.moved + self.D @ w
            out[self.held] = self.share @ needed
        return out

    def margins(self, w: FloatArray, allowance: float) -> FloatArray:
        """Margins, all >= 0 while the phase lasts: moment to each bound where a contact holds, else its slip."""
        load = self.moments(w)
        out = []
        for i, (c, s) in enumerate(zip(self.contacts, self.state, strict=True)):
            if s == "hold":
                slack = 1e-9 * max([1.0] + [abs(x) for x in (c.low, c.high) if np.isfinite(x)])
                out += [load[i] - c.low + slack, c.high - load[i] + slack]
            else:
                slip = float(np.array(c.row) @ w) - c.target
                out.append((slip if s == "low" else -slip) + allowance)
        return np.array(out) if out else np.ones(1)


def exponential(a: FloatArray) -> FloatArray:
    """exp(a) of a small square matrix: the Taylor series of a / 2^k, a norm below 1/2, squared k times (Higham 2008, 10.2). SciPy's
    routine waits 10 ms for its threads with 5 x 5 numbers on a loaded machine; this takes 0.05 ms."""
    halvings = max(0, int(np.ceil(np.log2(max(float(np.abs(a).sum(axis=0).max()), 1e-300) / 0.5))))
    x, unit = a / 2.0**halvings, np.eye(len(a))
    out = unit.copy()
    for k in range(14, 0, -1):  # 0.5^15 / 15! is below the rounding
        out = unit + x @ out / k
    for _ in range(halvings):
        out = out @ out
    return out


def motion(
    J: ArrayLike, D: ArrayLike, Q: ArrayLike, w0: ArrayLike, contacts: tuple[Contact, ...], t: ArrayLike
) -> DifferentialMotion:
    """Motion from rates w0 (2,) and zero angles at t[0]; J, D (2, 2), Q (2,), increasing times t (n,).

    Raises MechlabError when w0 violates a contact without finite bounds, or after more than MOST_EVENTS events.
    """
    j, d, q = (np.asarray(x, dtype=float) for x in (J, D, Q))
    times = np.asarray(t, dtype=float)
    state = np.concatenate([np.zeros(2), np.asarray(w0, dtype=float)])
    phase = _phase(j, d, q, contacts, state[2:])
    states, loads, events = [state], [phase.moments(state[2:])], []
    for start, end in zip(times[:-1], times[1:], strict=True):
        here = float(start)
        while True:
            allowance = _allowance(state[2:])
            after = phase.at(state, end - here)
            if np.all(phase.margins(after[2:], allowance) >= 0.0):
                break
            dt = _first(phase, state, end - here, allowance)
            here, state = here + dt, phase.at(state, dt)
            following = _phase(j, d, q, contacts, state[2:])
            state[2:] = following.onto(state[2:])
            events.append((here, _change(phase, following)))
            phase = following
            if len(events) > MOST_EVENTS:
                raise MechlabError(f"more than {MOST_EVENTS} events before t = {here:.6g} s; the contacts chatter.")
        state = after
        states.append(state)
        loads.append(phase.moments(state[2:]))
    table, load = np.array(states), np.array(loads).reshape(len(states), len(contacts))
    moments = {c.name: load[:, i] for i, c in enumerate(contacts)}
    return DifferentialMotion(times, table[:, :2], table[:, 2:], moments, tuple(events))


def _allowance(w: FloatArray) -> float:
    return TOLERANCE * max(1.0, float(np.max(np.abs(w))))


def _first(phase: _Phase, state: FloatArray, dt: float, allowance: float) -> float:
    def worst(x: float) -> float:
        return float(np.min(phase.margins(phase.at(state, x)[2:], allowance)))

    if worst(0.0) <= 0.0:
        return 0.0
    return float(brentq(worst, 0.0, dt, xtol=1e-15, rtol=1e-14))


def _phase(j: FloatArray, d: FloatArray, q: FloatArray, contacts: tuple[Contact, ...], w: FloatArray) -> _Phase:
    """The one consistent state of the contacts: each holds within its bounds, or slips in the direction that its bound opposes."""
    allowance = 4.0 * _allowance(w)
    options: list[tuple[str, ...]] = []
    for c in contacts:
        slip = float(np.array(c.row) @ w) - c.target
        bound = "low" if slip > allowance else "high" if slip < -allowance else ""
        if not bound:
            options.append(tuple(s for s, x in (("hold", 0.0), ("low", c.low), ("high", c.high)) if np.isfinite(x)))
        elif np.isfinite(getattr(c, bound)):
            options.append((bound,))
        else:
            raise MechlabError(
                f"contact {c.name!r} holds {c.target:g} rad/s, but the motion starts {slip:+.3g} off it."
            )
    for state in product(*options):
        phase = _Phase(j, d, q, contacts, state)
        load, a = phase.moments(w), phase.accelerations(w)
        fits = []
        for i, (c, s) in enumerate(zip(contacts, state, strict=True)):
            grows = float(np.array(c.row) @ a)
            still = len(options[i]) > 1
            scale = 1e-9 * max(1.0, float(np.max(np.abs(a))))
            fits.append(
                c.low - 1e-9 <= load[i] <= c.high + 1e-9
                if s == "hold"
                else not still or (grows >= -scale if s == "low" else grows <= scale)
            )
        if all(fits):
            return phase
    raise MechlabError("no consistent state of the contacts: are two of them the same?")


def _change(old: _Phase, new: _Phase) -> str:
    words = {"hold": "holds", "low": "lets go or slips", "high": "lets go or slips"}
    pairs = zip(old.contacts, old.state, new.state, strict=True)
    return ", ".join(f"{c.name} {words[b]}" for c, a, b in pairs if a != b) or "no change"


def reactions(mass: ArrayLike, rows: ArrayLike, force: ArrayLike) -> FloatArray:
    """(rows,) multipliers f of M a = force + J^T f, J a = 0; least norm where rows are redundant. mass (n, n), rows
    (m, n), force (n,)."""
    m, j, q = (np.asarray(x, dtype=float) for x in (mass, rows, force))
    free = np.linalg.solve(m, np.column_stack([q, j.T]))
    compliance = j @ free[:, 1:]
    size = 1.0 / np.sqrt(np.diag(compliance))
    scaled = compliance * size[:, None] * size
    return np.asarray(size * np.linalg.lstsq(scaled, -size * (j @ free[:, 0]), rcond=1e-10)[0])


def predicted_lag(
    mass: ArrayLike, rows: ArrayLike, force: ArrayLike, timeconst: float, impedance: float, damping_ratio: float = 1.0
) -> FloatArray:
    """(rows,) residual |r| = (1-d) tc^2 zeta^2 A |f| of soft rows in quasi-steady motion, A = J M^-1 J^T of the row, f its
    multiplier, tc the time constant [s] (at least two timesteps), d the impedance. Light parts under load lag most."""
    m, j = np.asarray(mass, dtype=float), np.asarray(rows, dtype=float)
    compliance = np.einsum("ij,ji->i", j, np.linalg.solve(m, j.T))
    return np.asarray(
        (1.0 - impedance) * (timeconst * damping_ratio) ** 2 * compliance * np.abs(reactions(m, j, force))
    )
