"""The protocols of a law and of the state that it sees, and the table of all laws by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from mechlab.errors import unknown
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
        LAWS[kind] = cls
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
    """(nv,) generalised force of all laws, and the force on each joint or shaft by name."""
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
