"""Explicit Runge-Kutta methods as data, and one loop that runs them all at a fixed step, for one state or many at once.

A Butcher tableau is checked against its order conditions when it is made.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError
from mechlab.integrate.work import FIXED_STAGE, count_work
from mechlab.lazy_dataclass import dataclass

Exact = tuple[Fraction, ...]


@dataclass(frozen=True)
class Tableau:
    """An explicit Runge-Kutta method: stages k_i = f(t + c_i h, y + h sum_j a_ij k_j), then y + h sum_i b_i k_i.

    a: the strictly lower rows, a[i] has i entries; b: weights; c_i = sum_j a_ij follows. All exact fractions. Raises
    MechlabError when the shapes do not fit or the order conditions (Hairer, Norsett & Wanner 1993, II.2) up to the
    stated `order` (at most 4) do not hold exactly; the message names the first condition that fails.
    """

    name: str
    order: int
    a: tuple[Exact, ...]
    b: Exact

    def __post_init__(self) -> None:
        stages = len(self.b)
        if [len(row) for row in self.a] != list(range(stages)):
            raise MechlabError(
                f"tableau {self.name!r}: {stages} weights need rows of {', '.join(map(str, range(stages)))} "
                f"coefficients, got {', '.join(str(len(row)) for row in self.a)}."
            )
        if not 1 <= self.order <= 4:
            raise MechlabError(f"tableau {self.name!r}: the order must be 1 to 4 to be checked, got {self.order}.")
        for order, text, left, right in self._conditions():
            if order <= self.order and left != right:
                raise MechlabError(
                    f"tableau {self.name!r}: it is not of order {self.order}: {text} = {left}, must be {right}."
                )

    @property
    def c(self) -> Exact:
        """Times of the stages as fractions of the step."""
        return tuple(sum(row, Fraction(0)) for row in self.a)

    def _conditions(self) -> Iterator[tuple[int, str, Fraction, Fraction]]:
        """(order, text, left side, right side) of the eight conditions up to order 4."""
        b, c = self.b, self.c
        n = range(len(b))
        full = [list(row) + [Fraction(0)] * (len(b) - len(row)) for row in self.a]
        ac = [sum((full[i][j] * c[j] for j in n), Fraction(0)) for i in n]
        ac2 = [sum((full[i][j] * c[j] ** 2 for j in n), Fraction(0)) for i in n]
        aac = [sum((full[i][j] * ac[j] for j in n), Fraction(0)) for i in n]
        table: list[tuple[int, str, list[Fraction], int]] = [
            (1, "sum b", [Fraction(1) for _ in n], 1),
            (2, "sum b c", list(c), 2),
            (3, "sum b c^2", [x**2 for x in c], 3),
            (3, "sum b a c", ac, 6),
            (4, "sum b c^3", [x**3 for x in c], 4),
            (4, "sum b c a c", [c[i] * ac[i] for i in n], 8),
            (4, "sum b a c^2", ac2, 12),
            (4, "sum b a a c", aac, 24),
        ]
        for order, text, values, denominator in table:
            yield (
                order,
                text,
                sum((w * x for w, x in zip(b, values, strict=True)), Fraction(0)),
                Fraction(1, denominator),
            )

    @cached_property
    def floats(self) -> tuple[tuple[NDArray[np.float64], ...], NDArray[np.float64], tuple[float, ...]]:
        """(rows of a, b, c) as floats."""
        rows = tuple(np.array([float(x) for x in row]) for row in self.a)
        return rows, np.array([float(x) for x in self.b]), tuple(float(x) for x in self.c)


def _exact(*values: str) -> Exact:
    return tuple(Fraction(x) for x in values)


EULER = Tableau("Euler", 1, ((),), _exact("1"))
HEUN = Tableau("Heun", 2, ((), _exact("1")), _exact("1/2", "1/2"))
RK4 = Tableau(
    "RK4", 4, ((), _exact("1/2"), _exact("0", "1/2"), _exact("0", "0", "1")), _exact("1/6", "1/3", "1/3", "1/6")
)
RK38 = Tableau(
    "RK38",
    4,
    ((), _exact("1/3"), _exact("-1/3", "1"), _exact("1", "-1", "1")),
    _exact("1/8", "3/8", "3/8", "1/8"),
)

TABLEAUX: dict[str, Tableau] = {x.name: x for x in (EULER, HEUN, RK4, RK38)}
"""The methods by name: Euler, Heun, the classical RK4 and the 3/8 rule (Kutta 1901)."""

Array = NDArray[np.float64]
RightSide = Callable[[float, Array], Array]


@dataclass(frozen=True)
class FixedStepEnd:
    """Where an integration ended: time, state, steps done, and in `reason` why it stopped early (empty: it did not)."""

    t: float
    y: Array
    steps: int
    reason: str = ""

    @property
    def complete(self) -> bool:
        """True when all steps were done."""
        return not self.reason


def step(tableau: Tableau, f: RightSide, t: float, y: Array, h: float) -> Array:
    """The state after one step of size h from (t, y); y has any shape (..., n), f keeps it."""
    rows, weights, times = tableau.floats
    slopes: list[Array] = []
    for row, c in zip(rows, times, strict=True):
        stage = y
        for a, k in zip(row, slopes, strict=True):
            if a:
                stage = stage + (h * a) * k
        slopes.append(f(t + c * h, stage))
    out = y
    for b, k in zip(weights, slopes, strict=True):
        out = out + (h * b) * k
    return out


def integrate_fixed(
    tableau: Tableau,
    f: RightSide,
    t0: float,
    y0: ArrayLike,
    h: float,
    steps: int,
    observe: Callable[[int, float, Array], None] | None = None,
    project: Callable[[float, Array], Array] | None = None,
) -> FixedStepEnd:
    """`steps` steps of size h from y0 (..., n) at t0; f(t, y) -> dy/dt of the same shape, vectorized over leading axes.

    After each step `project(t, y) -> y` brings the state back onto constraints, then `observe(k, t, y)` sees it; k =
    0 is the start. Times are t0 + k h, not sums. Stops at the first state that is not finite and says when; that
    state is not returned. Raises MechlabError for a step that is not a positive finite number.
    """
    if not np.isfinite(h) or h <= 0:
        raise MechlabError(f"step size: expected a number > 0, got {h!r}.")
    y = np.array(y0, dtype=float)
    price = FIXED_STAGE * len(tableau.floats[1])
    if observe is not None:
        observe(0, t0, y)
    for k in range(steps):
        t = t0 + k * h
        count_work(price)
        with np.errstate(over="ignore", invalid="ignore"):
            new = step(tableau, f, t, y, h)
        after = t0 + (k + 1) * h
        if project is not None and np.isfinite(new).all():
            new = project(after, new)
        if not np.isfinite(new).all():
            return FixedStepEnd(t, y, k, f"the state is not finite after t = {t:.6g} (step {k + 1}, size {h:g})")
        y = new
        if observe is not None:
            observe(k + 1, after, y)
    return FixedStepEnd(t0 + steps * h, y, steps)
