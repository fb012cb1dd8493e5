"""Steady motions of the closed differential with friction, each with the law that it really follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.differential.train import FloatArray, Train
from mechlab.errors import MechlabError


@dataclass(frozen=True)
class SteadyState:
    """Speeds [rad/s] of the carriers, moment on the input [N m], share of the input power that reaches the load."""

    w_H1: FloatArray
    w_H2: FloatArray
    M_H1: FloatArray
    efficiency: FloatArray


def mobility(train: Train, drag_14: float, drag_36: float) -> FloatArray:
    """(2, 2) Y of (w_H1, w_H2) = Y (M_H1, -M_H2) for viscous drag of the blocks against the housing [N m s]."""
    if not (drag_14 > 0 and drag_36 > 0):
        raise MechlabError(f"drag_14, drag_36 = {drag_14!r}, {drag_36!r}: a steady state needs both positive.")
    u = train.carriers
    return np.asarray(u @ np.diag([1.0 / drag_14, 1.0 / drag_36]) @ u.T)


def housing_drag(train: Train, drag_14: float, drag_36: float, M_H1: ArrayLike, M_H2: ArrayLike) -> SteadyState:
    """Constant moments and drag to the housing: unique and asymptotically stable."""
    y = mobility(train, drag_14, drag_36)
    one, two = np.broadcast_arrays(np.asarray(M_H1, dtype=float), np.asarray(M_H2, dtype=float))
    h1, h2 = y[0, 0] * one - y[0, 1] * two, y[0, 1] * one - y[1, 1] * two
    return SteadyState(h1, h2, one, two * h2 / (one * h1))


def drag_ratio(train: Train, drag_ratio_36_to_14: float, load: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """(ratio w_H1/w_H2, efficiency) of `housing_drag` against load = M_H2/M_H1. Only c3/c1 matters, so that the
    efficiency does not tend to 1 as friction vanishes."""
    y = mobility(train, 1.0, drag_ratio_36_to_14)
    mu = np.asarray(load, dtype=float)
    ratio = (y[0, 0] - y[0, 1] * mu) / (y[0, 1] - y[1, 1] * mu)
    return ratio, mu / ratio


def drag_stall(train: Train, drag_ratio_36_to_14: float) -> float:
    """Load ratio M_H2/M_H1 at which the output of `housing_drag` stands still, Y12/Y22."""
    y = mobility(train, 1.0, drag_ratio_36_to_14)
    return float(y[0, 1] / y[1, 1])


def backstop(train: Train, internal_drag: float, w_H1: ArrayLike, M_H2: ArrayLike) -> SteadyState:
    """Held input, one-way stop w3 >= 0, viscous drag between the blocks; for a > b, w_H1 > 0, M_H2 >= 0.

    Below M_H2 = ci w_H1/(a (a-b)) a slipping clutch: M_H1 = M_H2, w_H2 = w_H1 - (a-b)^2 M_H2/ci. Above it block 36
    stands: w_H2 = (b/a) w_H1, M_H1 = (b M_H2 + ci w_H1/a)/a.
    """
    a, b = train.a, train.b
    if not (a > b and internal_drag > 0):
        raise MechlabError("backstop: it needs z1/z3 > z4/z6 and a drag between the blocks greater than zero.")
    h1, load = np.broadcast_arrays(np.asarray(w_H1, dtype=float), np.asarray(M_H2, dtype=float))
    slips = load <= internal_drag * h1 / (a * (a - b))
    h2 = np.where(slips, h1 - (a - b) ** 2 * load / internal_drag, b / a * h1)
    one = np.where(slips, load, (b * load + internal_drag * h1 / a) / a)
    with np.errstate(divide="ignore", invalid="ignore"):
        return SteadyState(h1, h2, one, np.where(load == 0, 0.0, load * h2 / (one * h1)))
