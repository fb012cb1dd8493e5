"""Prices: the counted work [s] of one evaluation of the equations of motion, by engine.

    price = first + rates nv + rows m + crossed nv m + springs s,      m constraint rows, s springs between points

Measured as CPU time on one core of an AMD EPYC (numpy 2.4, mujoco 4.0, pinocchio 4.1) over the scenes of the catalog
and four-bar chains of up to 81 joints; most prices are right within a factor of 1.5. That is enough for their use,
budgets and the choice of a method (`mechlab.integrate.work`).
"""

from __future__ import annotations

from collections.abc import Iterable

from mechlab.experiment.laws import Law
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.parts import LOOP_ROWS


@dataclass(frozen=True)
class Price:
    """The price of one evaluation [s]: `first` always; `rates`, `rows`, `crossed` and `springs` for each rate, row,
    product of rate and row, and spring; `rowed` once where there is any row."""

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
        """The price [s] for nv rates and these numbers of rows and springs."""
        own = self.first + self.rates * nv + self.springs * springs
        return own + (self.rowed + self.rows * rows + self.crossed * nv * rows if rows else 0.0)


MUJOCO = Price(2.3e-6, rates=2e-7, rows=3.5e-7, crossed=4e-9)
"""One stage of mj_step; RK4 has four."""
CONSTRAINED = Price(5e-6, rates=3e-7, crossed=3.5e-8, springs=1e-5)
"""Pinocchio's proximal dynamics, called from Python (`mechlab.engines.pinocchio.trace`)."""
EQUATIONS = Price(3.5e-5, rates=2e-6, rows=3e-6, crossed=3e-8, springs=1.5e-5, rowed=9e-5)
"""Pinocchio with factored constraint rows (`mechlab.engines.pinocchio.equations`)."""
BUILDING = {"mujoco": Price(1.2e-3, rates=1.4e-4), "pinocchio": Price(3e-4, rates=6e-5, crossed=6e-7)}
"""Making what an engine runs of a mechanism, for the choice of an engine that takes few steps."""
ONE_FREEDOM = Price(1.4e-5)
"""The equation of one freedom on its table."""
CLOSED_POSE = Price(3e-4, rates=2.5e-4)
"""A pose of the table, closed by Newton's method."""
OWN_EQUATIONS = 5e-5
"""An evaluation of an entry's own equations, for mechanisms of all sizes; used by charts only."""
OBSERVED_POSE = Price(2e-5, rates=3e-6)
"""The energy and the gaps of one pose, computed in Python."""
BATCH, BATCH_POSE, BATCH_SOLVED, SPARSE_SOLVED = 1.5e-4, 4e-7, 6e-10, 3e-8
"""Many poses together in numpy: price of a call, and for each pose per nv (kinematics), per nv^3 (linear equations) and per
product of a sparse elimination."""
CALLBACK = 3e-6
"""A call from MuJoCo to the compiled laws."""
LAWS = {
    "constant": 1e-7, "harmonic": 4e-7, "table": 6e-7, "viscous": 1e-7, "viscous_between": 1e-7, "servo": 3e-7, "dc_motor": 1e-6,
    "motor": 1e-7, "constant_power": 1e-6, "one_sided_stop": 1e-6, "held_rates": 6e-5, "floor": 9e-6, "computed_torque": 4e-5,
}  # fmt: skip
"""Kind of law -> price of one call [s]."""
OTHER_LAW = 3e-6


def row_count(mechanism: Mechanism) -> int:
    """Number of rows of all loops, relations, curves and dry friction, redundant ones included."""
    m = mechanism
    rough = sum(bool(x.friction) for x in m.joints) + sum(bool(x.friction) for x in m.shafts)
    return sum(LOOP_ROWS[x.kind] for x in m.loops) + len(m.relations) + len(m.curves) + rough


def price_of_poses(count: int, nv: int, solved: bool = False, sparse: int = 0) -> float:
    """The price of `count` poses at once [s]; solved: linear equations are solved for each pose too; sparse: by an elimination of
    so many products."""
    return BATCH + count * (BATCH_POSE * nv + (BATCH_SOLVED * nv**3 if solved else 0.0) + SPARSE_SOLVED * sparse)


def price_of_laws(laws: Iterable[Law]) -> float:
    """The price of one evaluation of the laws [s]."""
    return sum(LAWS.get(law.kind, OTHER_LAW) + price_of_laws(getattr(law, "laws", ())) for law in laws)
