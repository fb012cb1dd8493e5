"""Prices: counted work [s] of one evaluation of the equations of motion, by engine, as data.

    price = first + rates nv + rows m + crossed nv m + springs s,      m constraint rows, s springs between points

Measured as CPU time on one core of an AMD EPYC (numpy 2.4, mujoco 4.0, pinocchio 4.1) over the scenes of the catalog and
four-bar chains of up to 81 joints; most lie within a factor of 1.5, which is what prices have to tell: budgets and the choice
of a method, not seconds of a stopwatch (`mechlab.integrate.work`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from mechlab.experiment.laws import Law
from mechlab.mechanism import Mechanism
from mechlab.mechanism.parts import LOOP_ROWS


@dataclass(frozen=True)
class Price:
    """Of one evaluation [s]: `first` in all, more for each rate, row, rate times row, spring; `rowed` once where there is a
    row at all."""

    first: float
    rates: float = 0.0
    rows: float = 0.0
    crossed: float = 0.0
    springs: float = 0.0
    rowed: float = 0.0

    def of(self, mechanism: Mechanism) -> float:
        """The price for a mechanism."""
        return self.at(mechanism.nv, row_count(mechanism), len(mechanism.springs))

    def at(self, nv: int, rows: int, springs: int = 0) -> float:
        """The price for so many rates, rows and springs."""
        own = self.first + self.rates * nv + self.springs * springs
        return own + (self.rowed + self.rows * rows + self.crossed * nv * rows if rows else 0.0)


MUJOCO = Price(2.3e-6, rates=2e-7, rows=3.5e-7, crossed=4e-9)
"""One stage of mj_step; RK4 has four."""
CONSTRAINED = Price(5e-6, rates=3e-7, crossed=3.5e-8, springs=1e-5)
"""Pinocchio's proximal dynamics, called from Python (`mechlab.engines.pinocchio.trace`)."""
EQUATIONS = Price(3.5e-5, rates=2e-6, rows=3e-6, crossed=3e-8, springs=1.5e-5, rowed=9e-5)
"""Pinocchio with factored constraint rows (`mechlab.engines.pinocchio.equations`)."""
ONE_FREEDOM = Price(1.4e-5)
"""The equation of one freedom on its table."""
CLOSED_POSE = Price(3e-4, rates=2.5e-4)
"""A pose of the table, closed by Newton's method."""
OWN_EQUATIONS = 5e-5
"""An evaluation of an entry's own equations: of all sizes, and by charts alone."""
OBSERVED_POSE = Price(2e-5, rates=3e-6)
"""A pose looked at in Python: its energy, its gaps."""
BATCH, BATCH_POSE, BATCH_SOLVED = 1.5e-4, 4e-7, 6e-10
"""Many poses together in numpy: of a call, and of each pose times nv (kinematics) and nv^3 (linear equations)."""
CALLBACK = 8e-6
"""From MuJoCo to laws in Python and back."""
LAWS = {
    "constant": 1e-7, "harmonic": 1e-6, "viscous": 1e-6, "viscous_between": 1e-6, "servo": 1.5e-6, "dc_motor": 1e-6, "motor": 1e-6,
    "held_rates": 5e-5, "floor": 8.5e-5, "computed_torque": 1.2e-4,
}  # fmt: skip
"""Of one call of a law, by its kind."""
OTHER_LAW = 3e-6


def row_count(mechanism: Mechanism) -> int:
    """Rows of all loops, relations and dry friction, as if none repeated another."""
    m = mechanism
    rough = sum(bool(x.friction) for x in m.joints) + sum(bool(x.friction) for x in m.shafts)
    return sum(LOOP_ROWS[x.kind] for x in m.loops) + len(m.relations) + rough


def price_of_poses(count: int, nv: int, solved: bool) -> float:
    """Of `count` poses at once [s]; solved: with linear equations for each."""
    return BATCH + count * (BATCH_POSE * nv + (BATCH_SOLVED * nv**3 if solved else 0.0))


def price_of_laws(laws: Iterable[Law]) -> float:
    """Of one evaluation of the laws [s]."""
    return sum(LAWS.get(law.kind, OTHER_LAW) + price_of_laws(getattr(law, "laws", ())) for law in laws)
