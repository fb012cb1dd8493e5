"""All laws of a run together, made once into matrices over the arrays of an engine:

    z = (phi(t), q, v, states of the laws),    y = A z,    forces = y, shaped where a law is not affine,    generalized = C forces

Laws that are formulas (`mechlab.experiment.laws.formula`) are rows of A; computed torque takes its commands from A; every other
law is called as it is, with the time and the plant. Where all laws are affine, generalized = (C A) z is one product.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechlab.experiment.laws.formula import Affine, Formula
from mechlab.experiment.laws.protocol import Law, LawStates, Plant
from mechlab.experiment.motion_basis import TimeBasis
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

if TYPE_CHECKING:
    from mechlab.experiment.laws.inverse import InverseDynamics
    from mechlab.mechanism.batch_dynamics import ManyEquations

Indices = NDArray[Any]


@dataclass(frozen=True)
class StateOrder:
    """Where an engine keeps a state of the Mechanism: rate k in v[rates[k]], the coordinate that it changes in q[coordinates[k]];
    nq, nv numbers of its q and v."""

    coordinates: Indices
    rates: Indices
    nq: int
    nv: int


def own_order(mechanism: Mechanism) -> StateOrder:
    """The order of the Mechanism itself."""
    return StateOrder(mechanism.q_columns, np.arange(mechanism.nv), mechanism.nq, mechanism.nv)


class CompiledLaws:
    """The forces of laws at many states of one run; it belongs to one thread.

    targets: names of the joints and shafts that get a force, in the order of `forces`. constant: all laws are constant loads;
    affine: all are affine; all_formulas: none reads the plant.
    Raises MechlabError when a law acts on a name that does not exist.
    """

    def __init__(self, mechanism: Mechanism, laws: Sequence[Law], order: StateOrder | None = None) -> None:
        self.mechanism, self.laws = mechanism, tuple(laws)
        self._order = order or own_order(mechanism)
        self.states = LawStates(laws)
        self.targets: tuple[str, ...] = ()
        self._index: dict[str, int] = {}
        self._columns: list[Array] = []
        for law in laws:
            for name in law.targets():
                self._target(name)
        self.constant = all(law.kind == "constant" for law in laws)
        self._others: list[Law] = []
        formulas: list[tuple[Law, Formula]] = []
        controllers: list[Any] = []
        for law in laws:
            found = formulas_of(law)
            if found is not None:
                formulas += [(law, f) for f in found]
            elif callable(getattr(law, "commanded", None)):
                controllers.append(law)
            else:
                self._others.append(law)
        self._blind = not (formulas or controllers)  # nobody reads z
        rates = [(law, f) for law in self.states.laws if (f := _state_rate(law)) is not None]
        self._all_rates = len(rates) == len(self.states.laws)
        used = [a for _, f in formulas for a in f.arguments]
        used += [a for law in controllers for a in law.commanded()] + [a for _, a in rates]
        self._basis = TimeBasis([motion for a in used for motion, _ in a.motions])
        size, o = self._basis.size, self._order
        self._z = np.zeros(size + o.nq + o.nv + len(self.states))
        self._time, self._q = self._z[:size], self._z[size : size + o.nq]
        self._v, self._state = self._z[size + o.nq : size + o.nq + o.nv], self._z[size + o.nq + o.nv :]
        self._state[:] = self.states.initial
        self._make_rows(formulas, controllers)
        self._state_rows = np.array([self._row(a, law) for law, a in rates]).reshape(-1, len(self._z))

    def _make_rows(self, formulas: list[tuple[Law, Formula]], controllers: list[Any]) -> None:
        """A: a row for each target with the sum of its affine forces; then the arguments of shapes, and the commands."""
        sums = np.zeros((len(self.targets), len(self._z)))
        more: list[Array] = []
        self._shaped: list[tuple[int, Callable[..., float], slice]] = []
        for law, f in formulas:
            rows = [self._row(a, law) for a in f.arguments]
            if f.shape is None:
                sums[self._index[f.on]] += rows[0]
                continue
            start = len(sums) + len(more)
            more += rows
            self._shaped.append((self._index[f.on], f.shape, slice(start, start + len(rows))))
        self._controlled: list[tuple[slice | Array, InverseDynamics, slice]] = []
        for law in controllers:
            start, rows = len(sums) + len(more), [self._row(a, law) for a in law.commanded()]
            more += rows
            places = [self._index[n] for n in law.drives]
            following = places == list(range(places[0], places[0] + len(places)))
            where = slice(places[0], places[0] + len(places)) if following else np.array(places)
            self._controlled.append((where, law.inverse(self.mechanism), slice(start, start + len(rows))))
        self._rows = np.concatenate([sums, np.array(more).reshape(-1, len(self._z))])
        self._map = np.array(self._columns).reshape(len(self.targets), self._order.nv).T
        self.all_formulas = not (self._controlled or self._others)
        # a number that is not finite has to be refused by name, so that forces are looked at
        self.affine = not (self._shaped or self._controlled or self._others) and bool(np.isfinite(self._rows).all())
        self._count, self._nv = len(self.targets), self._order.nv
        self._both = np.concatenate([self._map.dot(sums), sums])
        self._direct = self._both[: self._nv]

    def _target(self, name: str) -> int:
        """The place of a joint or shaft among the targets; a new one is added at the end."""
        if name not in self._index:
            column = np.zeros(self._order.nv)
            column[self._order.rates] = self.mechanism.row(name)
            self._index[name] = len(self.targets)
            self.targets = (*self.targets, name)
            self._columns.append(column)
        return self._index[name]

    def _row(self, a: Affine, law: Law) -> Array:
        """(z,) row of an affine function."""
        out, o, m = np.zeros(len(self._z)), self._order, self.mechanism
        size = self._basis.size
        out[0] = a.constant
        for motion, gains in a.motions:
            out[:size] += self._basis.row(motion, gains)
        for name, gain in a.values:
            out[0] += gain * m.zero(name)
            out[size + o.coordinates] += gain * m.row(name)
        for name, gain in a.rates:
            out[size + o.nq + o.rates] += gain * m.row(name)
        if a.state:
            out[size + o.nq + o.nv + self.states.first(law)] += a.state
        return out

    def put(self, t: float, q: Array, v: Array) -> None:
        """Take the state at which `forces`, `generalised` and `state_rates` are asked for next."""
        if self._blind:
            return
        self._basis.values(t, self._time)
        self._q[:] = q
        self._v[:] = v

    def put_states(self, states: Array) -> None:
        """Take the states of the laws."""
        self._state[:] = states

    def forces(self, t: float, plant: Plant) -> tuple[Array, Array]:
        """(targets,) forces [N m or N] and (nv,) generalized force, in the order of the engine, at the state that was put; the plant
        is in the same state."""
        if self.affine:
            both = self._both.dot(self._z)
            return both[self._nv :], both[: self._nv]
        y = np.zeros(self._count) if self._blind else self._rows.dot(self._z)
        out: Array = y[: self._count]
        if self._shaped:
            numbers = y.tolist()
            for k, shape, arguments in self._shaped:
                out[k] += shape(*numbers[arguments])
        for places, inverse, commands in self._controlled:
            out[places] += inverse(plant, y[commands])
        for law in self._others:
            for name, force in law.force(t, plant).items():
                k = self._target(name)
                if k == len(out):  # a name that the law does not count among its targets
                    out = np.append(out, 0.0)
                    self._grow()
                out[k] += force
        return out, self._map.dot(out)

    @property
    def at_once(self) -> bool:
        """Whether the forces at many states follow from formulas and inverse dynamics: no law is called, none has states."""
        return not (self._others or len(self.states))

    def many(self, t: Array, q: Array, v: Array, equations: Callable[[], ManyEquations]) -> tuple[Array, Array]:
        """`forces` at P states at once, where they are known `at_once`: (P, targets) and (P, nv). NaN where computed torque has to solve a
        state by itself. equations: those of the Mechanism at these states."""
        z = np.empty((len(t), len(self._z)))
        size, o = self._basis.size, self._order
        z[:, :size] = self._basis.many(t)
        z[:, size : size + o.nq], z[:, size + o.nq : size + o.nq + o.nv] = q, v
        y = z @ self._rows.T
        out = y[:, : self._count].copy()
        for k, shape, arguments in self._shaped:
            out[:, k] += [shape(*x) for x in y[:, arguments].tolist()]
        for places, inverse, commands in self._controlled:
            out[:, places] += inverse.many(equations(), y[:, commands])
        return out, out @ self._map.T

    def _grow(self) -> None:
        """Room for a target that was not known."""
        count = len(self.targets) - 1
        self._rows = np.insert(self._rows, count, 0.0, axis=0)
        shift = [slice(s.start + 1, s.stop + 1) for _, _, s in (*self._shaped, *self._controlled)]
        shaped = len(self._shaped)
        self._shaped = [(k, f, s) for (k, f, _), s in zip(self._shaped, shift[:shaped], strict=True)]
        self._controlled = [(k, f, s) for (k, f, _), s in zip(self._controlled, shift[shaped:], strict=True)]
        self._map, self._count = np.array(self._columns).T, len(self.targets)

    def affine_force(self) -> Array:
        """(nv,) generalized force at the state that was put, where all laws are `affine`."""
        return self._direct.dot(self._z)

    @property
    def steady(self) -> bool:
        """Whether the laws are affine in the state of the mechanism alone, whatever the time."""
        return self.affine and self._basis.size == 2 and not self._rows[:, 1].any() and not len(self.states)

    def affine_rows(self) -> tuple[Array, Array, Array, Array]:
        """c (targets,), A_q (targets, nq), A_v and B (targets, nv) of `steady` laws: forces c + A_q q + A_v v, rates of the targets
        B v, in the order of the engine."""
        o = self._order
        on_q, on_v = self._rows[:, 2 : 2 + o.nq], self._rows[:, 2 + o.nq : 2 + o.nq + o.nv]
        return self._rows[:, 0], on_q, on_v, self._map.T

    def slopes(self, v: Array) -> Array:
        """(n, targets) rates A_q dq/dt of the forces of `steady` laws at rates v (n, nv)."""
        o = self._order
        return np.asarray(v[:, o.rates] @ self._rows[:, 2 + o.coordinates].T)

    def state_rates(self, t: float, plant: Plant) -> Array:
        """(states,) time derivative of the states of the laws."""
        if self._all_rates:
            return self._state_rows.dot(self._z)
        return self.states.rate(t, plant, self._state)


def formulas_of(law: Law) -> tuple[Formula, ...] | None:
    """The formulas of a law; None where it has none, or a force of its own."""
    found = getattr(law, "formulas", None)
    if not callable(found) or _owner(law, "force") != _owner(law, "formulas"):
        return None  # a class that was derived from a law may have another force
    made: tuple[Formula, ...] = found()
    return made


def _owner(law: Law, method: str) -> type:
    """The class whose method a law has."""
    return next(c for c in type(law).__mro__ if method in vars(c))


def _state_rate(law: Any) -> Affine | None:
    found = getattr(law, "state_formula", None)
    return found() if callable(found) else None
