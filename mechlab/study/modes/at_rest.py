"""What acts on a mechanism that is to rest: the laws of a scene, if they can stand still."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.laws import DcMotor, Law, applied_force
from mechlab.experiment.scene import Scene
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism

STEPPED = ("held_rates",)
"""Laws that hold by force bounds: they have no stiffness to linearise."""


def laws_at_rest(m: Mechanism, scene: Scene) -> tuple[tuple[Law, ...], tuple[str, ...]]:
    """The laws of a scene as they can be linearised, and sentences on what was changed.

    Raises NoSolution for a law that follows a motion or changes with time (a steady motion has no rest), MechlabError for one
    that cannot be linearised.
    """
    laws, notes = [], []
    for law in scene.laws:
        if law.kind in STEPPED:
            raise MechlabError(
                f"{m.name}, scene {scene.name}: the law {law.kind} on {', '.join(law.targets())} holds rates by bounded forces and has "
                "no stiffness. Modes need laws that are smooth: choose another scene, or none (the drives then hold their targets)."
            )
        if isinstance(law, DcMotor) and law.inductance:
            law = replace(law, inductance=0.0)
            notes.append(f"the current of the motor on {law.on} is taken to follow at once (no inductance)")
        elif tuple(getattr(law, "start", tuple)()):
            raise MechlabError(
                f"{m.name}, scene {scene.name}: the law {law.kind} has states of its own; modes take laws without."
            )
        laws.append(law)
    _refuse_steady(m, scene, tuple(laws))
    if any(scene.initial_rates.values()):
        notes.append("the rates of the start are left out: an equilibrium at rest is looked for")
    return tuple(laws), tuple(notes)


def _refuse_steady(m: Mechanism, scene: Scene, laws: tuple[Law, ...]) -> None:
    """Raise NoSolution for a law whose force changes with time in a mechanism that stands still."""
    plant = _Still(m)
    for law in laws:
        forces = []
        for t in (0.0, 0.137 * scene.duration, 0.618 * scene.duration, scene.duration):
            plant.t = t
            forces.append(applied_force(m, (law,), t, plant)[0])
        if np.max(np.abs(np.array(forces) - forces[0]), initial=0.0) > 1e-9 * max(1.0, float(np.max(np.abs(forces)))):
            raise NoSolution(
                f"{m.name}, scene {scene.name}: the law {law.kind} on {', '.join(law.targets())} follows a motion: the mechanism runs, it "
                "does not rest, and modes about a steady motion are not computed. Choose a scene whose drives stand still, or none "
                "(the drives then hold their targets)."
            )


class _Still:
    """The reference pose at rest, as a law sees it; implements `mechlab.experiment.laws.Plant`."""

    def __init__(self, m: Mechanism) -> None:
        from mechlab.mechanism.constraints import ConstraintSet

        self.mechanism, self.t = m, 0.0
        self._tree, self._rows = TreeKinematics(m), ConstraintSet(m)

    def value(self, name: str) -> float:
        return self.mechanism.zero(name)

    def rate(self, name: str) -> float:
        return 0.0

    def mass_matrix(self) -> Array:
        return self._tree.mass_matrix()

    def bias(self) -> Array:
        return self._tree.bias_force()

    def jacobian(self) -> Array:
        return self._rows.jacobian(self._tree)

    def constraint_bias(self) -> Array:
        return np.zeros(len(self._rows))
