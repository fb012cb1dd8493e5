"""Equations of a mechanism with set-valued dry friction: a stuck element is one more constraint row."""

from __future__ import annotations

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.laws import Law, applied_force
from mechlab.integrate import Modes, count_work
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.solve.equations import BlowUp, Equations, Instant
from mechlab.solve.kkt import dense, factor


class RoughEquations(Equations):
    """Equations of a mechanism with set-valued dry friction: a `mechlab.integrate.RoughProblem`.

    A sliding element carries -mode limit; a stuck one is one more constraint row, rate = 0, whose reaction is its
    friction force. Work and everything else as in `Equations`.
    """

    def __init__(self, mechanism: Mechanism, laws: tuple[Law, ...]) -> None:
        super().__init__(mechanism, laws, 0.0)
        self.rows = self.plant.passive.friction_rows
        self.limits = self.plant.passive.friction
        size = mechanism.nq + mechanism.nv + len(self.memory) + 1
        self.rates = np.zeros((len(self.limits), size))
        self.rates[:, mechanism.nq : mechanism.nq + mechanism.nv] = self.rows
        self.modes: Modes = tuple(0 for _ in self.limits)
        self._friction = np.zeros(len(self.limits))
        self.trouble = ""

    def instant(self, t: float, y: Array) -> Instant:
        """Accelerations, reactions and forces at a state in the present modes."""
        count_work(self.price)
        plant = self.move(t, y)
        try:
            force, by_name = applied_force(self.mechanism, self.laws, t, plant)
            a, reactions, friction = self._solve(force)
        except (MechlabError, np.linalg.LinAlgError, OverflowError, ZeroDivisionError) as problem:
            raise BlowUp(t, str(problem)) from problem
        if not np.all(np.isfinite(a)):
            raise BlowUp(t, "the accelerations are not finite (is a law's force not finite?)")
        self._friction = friction
        power = float((force + self.rows.T @ friction) @ plant.v) - plant.passive.loss(plant.kin, plant.v)
        return Instant(a, reactions, by_name, power)

    def _solve(self, force: Array) -> tuple[Array, Array, Array]:
        """Accelerations, reactions of the constraint rows, friction forces (k,)."""
        plant = self.plant
        modes = np.array(self.modes, dtype=float)
        friction = -modes * self.limits
        stuck = modes == 0.0
        if not stuck.any():
            a, r = plant.accelerations(force + self.rows.T @ friction)
            return a, r, friction
        plant.evaluations += 1
        held = self.rows[stuck]
        jacobian, count = plant.jacobian(), len(plant.constraints)
        rows = np.vstack([jacobian, held]) if count else held
        bias = np.concatenate([plant.constraint_bias() if count else np.zeros(0), np.zeros(len(held))])
        net = force + self.rows.T @ friction - plant.bias()
        factors = factor(plant.mass_matrix(), rows)
        a, r = factors.accelerations(net, bias) if factors else dense(plant.mass_matrix(), rows, net, bias)[:2]
        friction[stuck] = r[count:]
        return a, r[:count], friction

    def slope(self, t: float, y: Array, modes: Modes | None = None) -> Array:
        """dy/dt in these modes; not a number where the equations have no answer, `trouble` says why."""
        if modes is not None:
            self.modes = modes
        try:
            return super().slope(t, y)
        except BlowUp as trouble:
            self.trouble = trouble.reason
            return np.full(len(y), np.nan)

    def holding(self, t: float, y: Array, modes: Modes) -> Array:
        """(k,) friction forces in these modes."""
        self.modes = modes
        self.instant(t, y)
        return self._friction

    def settle(self, t: float, y: Array, modes: Modes) -> Array:
        """The state with the rates of stuck elements zero: the smallest change of rates, measured by the kinetic energy."""
        y = self.project(t, y)
        plant = self.move(t, y)
        held = self.rows[np.array(modes) == 0]
        rows = np.vstack([plant.jacobian(), held]) if len(plant.constraints) else held
        factors = factor(plant.mass_matrix(), rows)
        if factors is not None:
            self.split(y)[1][:] += factors.correction(rows @ plant.v)
        return y
