"""The protocols of a law and of the state that it sees, the table of all laws by name, and the states of laws, such as the current
of a motor, which the engine integrates together with the motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from mechlab.errors import explained, unknown
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism


class Plant(Protocol):
    """The state that a law sees; each engine implements it. Values are physical: zero + coordinate."""

    mechanism: Mechanism
    t: float

    def value(self, name: str) -> float:
        """Value of a joint or shaft [rad or m]."""
        ...

    def rate(self, name: str) -> float:
        """Rate of a joint or shaft [rad/s or m/s]."""
        ...

    def mass_matrix(self) -> Array:
        """(nv, nv) mass matrix, shafts and armatures included."""
        ...

    def bias(self) -> Array:
        """(nv,) h of M a + h = applied + J^T reactions: velocity, gravity and passive terms."""
        ...

    def jacobian(self) -> Array:
        """(rows, nv) constraint Jacobian."""
        ...

    def constraint_bias(self) -> Array:
        """(rows,) dJ/dt v."""
        ...


class Law(Protocol):
    """A force law: forces on joints and shafts [N m or N] by name."""

    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """Forces at time t [s] in the state of the plant."""
        ...

    def targets(self) -> tuple[str, ...]:
        """Names of the joints and shafts that the law may act on."""
        ...


LAWS: dict[str, type[Any]] = {}
"""Registered laws by name."""

T = TypeVar("T", bound=type)


def register(kind: str) -> Callable[[T], T]:
    """Class decorator that registers a law under the name `kind`."""

    def add(cls: T) -> T:
        cls.kind = kind  # type: ignore[attr-defined]
        LAWS[kind] = explained(cls)
        return cls

    return add


class OnOne:
    """A law on one joint or shaft."""

    on: str

    def targets(self) -> tuple[str, ...]:
        """The one joint or shaft that the law acts on."""
        return (self.on,)


def applied_force(
    mechanism: Mechanism, laws: tuple[Law, ...], t: float, plant: Plant
) -> tuple[Array, dict[str, float]]:
    """(nv,) generalized force of all laws, and the force on each joint or shaft by name."""
    total = np.zeros(mechanism.nv)
    by_name: dict[str, float] = {}
    for law in laws:
        for name, f in law.force(t, plant).items():
            by_name[name] = by_name.get(name, 0.0) + f
    for name, f in by_name.items():
        total += f * mechanism.row(name)
    return total, by_name


def law(kind: str, **data: object) -> Any:
    """A registered law by its name; raises MechlabError that lists the laws."""
    if kind not in LAWS:
        raise unknown("law", kind, LAWS)
    return LAWS[kind](**data)


class LawStates:
    """The states of all laws that have any, as one vector (size,).

    Such a law has `start()`, its states at t = 0; `state_rate(t, plant, state)`, their time derivative; and
    `after(t, plant, state, h)`, the states after h seconds in the present state of the mechanism. The plants of the
    engines hold the states in `memory`, keyed by the law; on a plant without them a law uses its start states.
    """

    def __init__(self, laws: Sequence[Law]) -> None:
        self.laws: list[Any] = []
        self.slices: list[slice] = []
        start: list[float] = []
        for law in laws:
            states = tuple(getattr(law, "start", tuple)())
            if states:
                self.laws.append(law)
                self.slices.append(slice(len(start), len(start) + len(states)))
                start += states
        self.initial = np.array(start)

    def __len__(self) -> int:
        return len(self.initial)

    def first(self, law: Law) -> int:
        """Where the states of a law begin."""
        return self.slices[next(k for k, x in enumerate(self.laws) if x is law)].start

    def put(self, plant: Any, state: Array) -> None:
        """Store the states (size,) in the memory of the plant, where the laws read them."""
        plant.memory = {law: state[s] for law, s in zip(self.laws, self.slices, strict=True)}

    def rate(self, t: float, plant: Plant, state: Array) -> Array:
        """(size,) time derivative of the states."""
        parts = [law.state_rate(t, plant, state[s]) for law, s in zip(self.laws, self.slices, strict=True)]
        return np.concatenate(parts) if parts else np.zeros(0)

    def after(self, t: float, plant: Plant, state: Array, h: float) -> Array:
        """(size,) states after h seconds in the present state of the mechanism."""
        parts = [law.after(t, plant, state[s], h) for law, s in zip(self.laws, self.slices, strict=True)]
        return np.concatenate(parts) if parts else np.zeros(0)
