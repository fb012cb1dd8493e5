"""The forces of the laws of a scene at every evaluation of the equations of motion: what can be is prepared once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechlab.experiment.laws.loads import Constant
from mechlab.experiment.laws.protocol import Law, Plant
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism


class AppliedForce:
    """`applied_force` for many states: `self(t, plant)` is the (nv,) generalised force of all laws, and the force on
    each joint or shaft by name.

    `constant`: all laws are constant loads; then the two are the same objects at every call, not to be written to.
    Raises MechlabError when a law acts on a name that does not exist.
    """

    def __init__(self, mechanism: Mechanism, laws: Sequence[Law]) -> None:
        self.mechanism = mechanism
        self._forces = [law.force for law in laws]
        self._terms: dict[str, tuple[tuple[int, float], ...]] = {}
        for law in laws:
            for name in law.targets():
                self._learn(name)
        self.constant = all(type(law) is Constant for law in laws)
        self._kept: tuple[Array, dict[str, float]] | None = None

    def _learn(self, name: str) -> tuple[tuple[int, float], ...]:
        row = self.mechanism.row(name)
        self._terms[name] = tuple((int(k), float(row[k])) for k in np.flatnonzero(row))
        return self._terms[name]

    def __call__(self, t: float, plant: Plant) -> tuple[Array, dict[str, float]]:
        """(nv,) generalised force at time t [s] in the state of the plant, and the forces by name."""
        if self._kept is not None:
            return self._kept
        by_name: dict[str, float] = {}
        for force in self._forces:
            for name, f in force(t, plant).items():
                by_name[name] = by_name.get(name, 0.0) + f
        total = np.zeros(self.mechanism.nv)
        for name, f in by_name.items():
            for k, c in self._terms.get(name) or self._learn(name):
                total[k] += c * f
        if self.constant:
            total.flags.writeable = False
            self._kept = total, by_name
        return total, by_name


__all__ = ["AppliedForce"]
