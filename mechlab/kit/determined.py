"""What given quantities determine, at the levels of position, rate and acceleration.

Quantities are named as in `mechlab.kit.quantities`.

At a pose that has the given values, the constraints J_c and the rows G of what is given leave the null space of [J_c; G]
open. Each direction of it is tried: the mechanism is moved along it (poses are closed again by Newton), and a quantity that
changes hangs on that freedom. So a rate that is the same in every pose (a train of gears) is determined though the pose is
not, and a direction that leads nowhere (a dead centre) leaves no position open, only rates.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mechlab.experiment.question import Open
from mechlab.kit.quantities import key_of, level, split
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, integrate, newton
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.named_rows import LETTERS, NamedRows
from mechlab.mechanism.structure import idle_directions, null_space, rank, step_size

SINGULAR = 1e-6
"""Directions whose scaled singular value is below this are open: as in `mechlab.mechanism.singularity`."""
STEP = 0.1
"""Size of the trial motion along a freedom [rad, or relative to the mechanism's size]."""
CHANGED = 1e-7
"""A quantity that changes by more than this, relative to its size, depends on the freedom; Newton's method leaves
1e-12."""


@dataclass(frozen=True)
class Determined:
    """Result for the wanted quantities. open: those that are not determined; idle: those that depend on local freedoms
    alone (the spin of a rod), not listed in open; assumed: accelerations set to 0, as their coordinate is given and
    they are not."""

    open: tuple[Open, ...] = ()
    idle: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()

    @property
    def unfixed(self) -> frozenset[str]:
        """All quantities that have no value: open and idle ones."""
        return frozenset(self.idle).union(*(x.quantities for x in self.open))


@dataclass(frozen=True)
class _State:
    q: Array
    v: Array
    a: Array


class _Question:
    """Given quantities of a mechanism at one pose."""

    def __init__(self, m: Mechanism, q: Array, values: Mapping[str, Any]) -> None:
        self.m, self.q, self.named = m, q, NamedRows(m)
        self.position, self.rate, self.accel = split(m, values)
        self.named.set(q)
        idle = idle_directions(m, self.named.closure())
        given = [
            np.vstack([np.zeros((0, m.nv)), *map(self.named.rows, x)]) for x in (self.position, self.rate, self.accel)
        ]
        self._idle = [idle @ null_space(rows @ idle) for rows in given]  # one that is given is none

    def left(self, order: int, names: Sequence[str]) -> Array:
        """(nv, k) directions that the constraints and the rows of the names leave free, without the local freedoms."""
        self.named.set(self.q)
        return null_space(np.vstack([self.named.stack(names), self._idle[order].T]), SINGULAR)

    def idle(self, order: int) -> Array:
        """(nv, k) directions of local freedoms that are not given."""
        return self._idle[order]

    def rates(self, q: Array) -> Array:
        """(nv,) minimum-norm rates with the given rates."""
        matrix = self.named.set(q).stack(self.rate)
        return _smallest(matrix, np.concatenate([np.zeros(len(matrix) - len(self.rate)), list(self.rate.values())]))

    def accelerations(self, q: Array, v: Array) -> Array:
        """(nv,) minimum-norm accelerations with the given accelerations."""
        named = self.named.set(q, v)
        bias = np.concatenate([named.constraints.bias(named.tree), *(named.bias(n) for n in self.accel)])
        wanted = np.concatenate([np.zeros(len(bias) - len(self.accel)), list(self.accel.values())])
        return _smallest(named.stack(self.accel), wanted - bias)

    def assume(self, free: Array) -> tuple[str, ...]:
        """Sets to 0 the free accelerations of coordinates whose value or rate is given; returns their keys. free (nv, k): directions
        that the given rates leave open."""
        self.named.set(self.q)
        known = [n for n in self.position if not n.endswith("_rotation") and _still(self.named.rows(n), free)]
        out = []
        for name in dict.fromkeys([*self.rate, *known]):
            if name in self.accel:
                continue
            have = rank(self.named.stack(self.accel))
            if rank(self.named.stack([*self.accel, name])) > have:
                self.accel[name] = 0.0
                out.append(key_of(self.m, name, 2))
        return tuple(out)

    def moved(self, direction: Array) -> Array | None:
        """A pose with the given values, one step along a direction; None when no finite motion exists in it."""
        size = max(float(np.max(np.abs(direction))), 1e-12)
        for step in (STEP, -STEP, 0.1 * STEP):
            dv = direction * (step * step_size(self.m) / size)
            found = newton(self._misses, lambda x, d: integrate(self.m, x, d), integrate(self.m, self.q, dv))
            far = float(np.linalg.norm(found.q - self.q))
            if found.closed and 0.3 * np.linalg.norm(dv) < far < 3.0 * np.linalg.norm(dv):
                return found.q
        return None

    def _misses(self, q: Array) -> tuple[Array, Array]:
        named = self.named.set(q)
        missing = [named.missing(n, x) for n, x in self.position.items()]
        return np.concatenate([named.constraints.residual(named.tree), *missing]), named.stack(self.position)

    def values(self, state: _State, wanted: Sequence[tuple[str, int]]) -> Array:
        """(wanted,) values, rates or accelerations of names at a state."""
        named = self.named.set(state.q, state.v)
        out = []
        for name, order in wanted:
            if order == 0:
                out.append(float(named.missing(name, 0.0)[0]))
            else:
                row = named.rows(name)
                out.append(float((row @ state.v if order == 1 else row @ state.a + named.bias(name))[0]))
        return np.array(out)


def determined(m: Mechanism, q: Array, given: Mapping[str, Any], wanted: Sequence[str]) -> Determined:
    """Which of the wanted quantities the given ones determine, at a pose q (nq,) that has the given values.

    Only the assembly mode of q counts: other modes do not make a quantity open. Raises MechlabError for unknown names.
    """
    asked = _Question(m, np.asarray(q, dtype=float), given)
    moving = bool(asked.rate or asked.accel)
    items = {key: level(m, key) for key in wanted}
    assumed = asked.assume(asked.left(1, list(asked.rate))) if moving else ()
    names = (list(asked.position), list(asked.rate), list(asked.accel))
    orders = (0, 1, 2) if moving else (0,)
    left = [asked.left(k, names[k]) for k in orders]
    idle = _idle(asked, items, orders)
    if not any(x.shape[1] for x in left):
        return Determined((), idle, assumed)
    hangs: dict[str, list[tuple[int, str]]] = {key: [] for key in wanted if key not in idle}
    for order, basis in zip(orders, left, strict=True):
        for name, keys in _tried(asked, order, basis, {k: items[k] for k in hangs}, moving):
            for key in keys:
                hangs[key].append((order, name))
    return Determined(_grouped(m, hangs), idle, assumed)


def with_nothing_open(m: Mechanism, q: Array, given: Mapping[str, Any], wanted: Sequence[str]) -> Determined:
    """`determined` at a pose where the given values, and the given rates, are known to leave no motion open."""
    asked = _Question(m, q, given)
    moving = bool(asked.rate or asked.accel)
    assumed = asked.assume(np.zeros((m.nv, 0))) if moving else ()
    return Determined((), _idle(asked, {key: level(m, key) for key in wanted}, (0, 1, 2) if moving else (0,)), assumed)


def _tried(
    asked: _Question, order: int, basis: Array, items: Mapping[str, tuple[str, int]], moving: bool
) -> Iterator[tuple[str, list[str]]]:
    """Name of each open freedom at a level, with the keys that change along it."""
    keys, wanted = list(items), list(items.values())
    v = asked.rates(asked.q) if moving else np.zeros(asked.m.nv)
    a = asked.accelerations(asked.q, v) if moving else np.zeros(asked.m.nv)
    here = asked.values(_State(asked.q, v, a), wanted)
    speed = max(1.0, float(np.max(np.abs(v), initial=0.0)))
    for name, direction in _freedoms(asked, order, basis):
        there = _State(asked.q, v, a)
        if order == 0:
            q = asked.moved(direction)
            if q is None:
                continue
            w = asked.rates(q) if moving else v
            there = _State(q, w, asked.accelerations(q, w) if moving else a)
        elif order == 1:
            w = v + speed * direction
            there = _State(asked.q, w, asked.accelerations(asked.q, w))
        else:
            there = _State(asked.q, v, a + max(1.0, float(np.max(np.abs(a), initial=0.0))) * direction)
        now = asked.values(there, wanted)
        size = np.maximum(np.maximum(np.abs(now), np.abs(here)), _sizes(wanted, here, now))
        yield name, [k for k, apart, x in zip(keys, np.abs(now - here), size, strict=True) if not apart <= CHANGED * x]


def _sizes(wanted: Sequence[tuple[str, int]], here: Array, now: Array) -> Array:
    """(wanted,) scale of a change: the largest value of the same level, at least 1e-3."""
    orders = np.array([order for _, order in wanted], dtype=int)
    both = np.maximum(np.abs(here), np.abs(now))
    largest = [float(np.max(both[orders == k], initial=0.0)) for k in range(3)]
    return np.array([max(1e-3, largest[k]) for k in orders])


def _freedoms(asked: _Question, order: int, basis: Array) -> Iterator[tuple[str, Array]]:
    """A basis of the open directions with a name for each: along a direction its own name changes by 1, the other names
    by 0.

    Names are chosen in this order: given coordinates (a user would give their rate), drives, joints and shafts, frames.
    """
    m, named = asked.m, asked.named.set(asked.q)
    points = [f"{f.name}_{a}" for f in m.frames for a in (LETTERS if order else LETTERS[:3])]
    first = [n for n in (*asked.position, *(d.on for d in m.drives)) if not n.endswith("_rotation") or order == 0]
    names: list[str] = []
    rows = np.zeros((0, basis.shape[1]))
    for name in dict.fromkeys([*first, *m.scalar_names, *points]):
        if len(names) == basis.shape[1]:
            break
        row = named.rows(name) @ basis
        if len(row) == 1 and np.linalg.norm(row) > 1e-6 and rank(np.vstack([rows, row])) > len(names):
            names.append(name)
            rows = np.vstack([rows, row])
    for name, x in zip(names, np.linalg.pinv(rows).T if names else (), strict=True):
        yield name, basis @ x
    rest = null_space(rows) if names else np.eye(basis.shape[1])
    for k, x in enumerate(rest.T):
        yield f"a motion of {_mover(m, basis @ x)}{f' ({k + 1})' if rest.shape[1] > 1 else ''}", basis @ x


def _mover(m: Mechanism, direction: Array) -> str:
    """The joint that moves most along a direction."""
    return max(m.joints, key=lambda j: float(np.max(np.abs(direction[m.v_slice[j.name]]), initial=0.0))).name


def _idle(asked: _Question, items: Mapping[str, tuple[str, int]], orders: Sequence[int]) -> tuple[str, ...]:
    """Keys that change along a local freedom."""
    out = []
    asked.named.set(asked.q)
    for key, (name, order) in items.items():
        free = np.hstack([asked.idle(k) for k in orders if k <= order])
        if free.shape[1] and not _still(asked.named.rows(name), free):
            out.append(key)
    return tuple(out)


def _grouped(m: Mechanism, hangs: Mapping[str, Sequence[tuple[int, str]]]) -> tuple[Open, ...]:
    """Open keys, grouped by the freedoms that they depend on."""
    groups: dict[tuple[tuple[int, str], ...], list[str]] = {}
    for key, on in hangs.items():
        if on:
            groups.setdefault(tuple(on), []).append(key)
    known = {*m.scalar_names, *(f"{f.name}_{a}" for f in m.frames for a in LETTERS)}
    out = []
    for on, keys in groups.items():
        names = [key_of(m, n, k) if n in known else n for k, n in on]
        out.append(Open(tuple(keys), tuple(names), tuple(key_of(m, n, k) for k, n in on if n in known)))
    return tuple(out)


def _still(rows: Array, free: Array) -> bool:
    """True when the rows (k, nv) do not change along the directions (nv, n)."""
    return float(np.max(np.abs(rows @ free), initial=0.0)) <= CHANGED * max(
        1.0, float(np.max(np.abs(rows), initial=0.0))
    )


def _smallest(matrix: Array, right: Array) -> Array:
    norms = np.linalg.norm(matrix, axis=1)
    scale = np.where(norms > 1e-14, norms, 1.0)
    return np.asarray(np.linalg.lstsq(matrix / scale[:, None], right / scale, rcond=1e-11)[0])
