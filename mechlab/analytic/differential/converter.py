"""A hydrodynamic torque converter on the closed differential, as in the figure 1 of the source: pump on block 14, turbine on H2,
reactor on the housing. Moments of the converter, and the steady states of the train with it.

With r = (a - b)/(1 - b), s = (1 - a)/(1 - b) (r + s = 1), the speed ratio n of turbine to pump and the moment ratio k(n) of
turbine to pump, balance of both blocks and of H2 gives

    pump moment = r M_H1,   M_H2/M_H1 = s + r k,   w_H1/w_H2 = s + r/n:

the ratio of speeds is that of moments exactly where k n = 1, in a converter without losses.
"""

from __future__ import annotations

import math

from mechlab.analytic.differential.train import Train
from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Converter:
    """capacity K [N m s2]; stall: moment ratio with the turbine at rest; efficiency: the best one, 0 to 1.

    With losses: pump moment K (wp |wp| - wt |wt|), moment ratio stall - stall^2 n/(4 efficiency), whose product with n peaks at
    `efficiency`; from where it is 1 the reactor runs free. lossless: pump moment K wp |wp|, moment ratio 1/n, at most `stall`.
    Raises MechlabError for a capacity of zero, a stall ratio of at most 1, an efficiency outside (0, 1].
    """

    capacity: float
    stall: float
    efficiency: float
    lossless: bool = False

    def __post_init__(self) -> None:
        if not (self.capacity > 0.0 and self.stall > 1.0 and 0.0 < self.efficiency <= 1.0):
            raise MechlabError(
                f"converter: expected capacity > 0, stall > 1 and 0 < efficiency <= 1, got {self.capacity!r}, {self.stall!r}, "
                f"{self.efficiency!r}."
            )

    def ratio(self, n: float) -> float:
        """Moment of the turbine over that of the pump at the speed ratio n of turbine to pump."""
        if self.lossless:
            return 1.0 / n if n * self.stall > 1.0 else self.stall
        return min(max(self.stall - self.stall**2 * n / (4.0 * self.efficiency), 1.0), self.stall)

    def moments(self, pump: float, turbine: float) -> tuple[float, float]:
        """Moments [N m] that the pump takes and the turbine gives at their speeds [rad/s]. A pump that does not drive: equal ones."""
        load = self.capacity * pump * abs(pump)
        if not self.lossless:
            load -= self.capacity * turbine * abs(turbine)
        if not (load > 0.0 and pump > 0.0):
            return load, load
        return load, load * self.ratio(turbine / pump)

    def speed_ratio(self, ratio: float) -> float:
        """The speed ratio n at which the moment ratio is `ratio`; raises NoSolution where none is: from `stall` on, and, with losses,
        up to 1."""
        if not ((0.0 if self.lossless else 1.0) < ratio < self.stall):
            raise NoSolution(
                f"converter: no speed ratio has the moment ratio {ratio:.6g}; between {0 if self.lossless else 1} and {self.stall:g}"
            )
        return 1.0 / ratio if self.lossless else 4.0 * self.efficiency * (self.stall - ratio) / self.stall**2


@dataclass(frozen=True)
class ConverterState:
    """Steady state: speeds [rad/s] of H1, H2 and of the blocks, moment [N m] of the reactor on the housing, efficiency."""

    w_H1: float
    w_H2: float
    w1: float
    w3: float
    reactor: float
    efficiency: float


def shares(train: Train) -> tuple[float, float]:
    """(r, s): the pump takes r M_H1, the gears pass s M_H1 on to H2. Raises MechlabError unless z1/z3 > z4/z6."""
    a, b = train.a, train.b
    if not a > b:
        raise MechlabError("converter: the pump on block 14 is driven only where z1/z3 > z4/z6.")
    return (a - b) / (1.0 - b), (1.0 - a) / (1.0 - b)


def converter_state(train: Train, converter: Converter, M_H1: float, M_H2: float) -> ConverterState:
    """The steady state under constant moments M_H1 > 0 and M_H2. Raises NoSolution where the load asks for a moment ratio that the
    converter does not have."""
    r, s = shares(train)
    if not M_H1 > 0.0:
        raise MechlabError(f"converter: expected a driving moment M_H1 > 0, got {M_H1!r}.")
    load = r * M_H1
    n = converter.speed_ratio((M_H2 - s * M_H1) / load)
    w1 = math.sqrt(load / (converter.capacity * (1.0 if converter.lossless else 1.0 - n * n)))
    h2 = n * w1
    h1, w3 = r * w1 + s * h2, (h2 - train.b * w1) / (1.0 - train.b)
    return ConverterState(h1, h2, w1, w3, M_H2 - M_H1, M_H2 * h2 / (M_H1 * h1))
