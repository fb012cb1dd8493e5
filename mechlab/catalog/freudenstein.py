"""A function generator: a four-bar whose output follows the logarithm, exact at three points (Freudenstein's equation)."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.short import Bars, Linkage, Outside, PlotRecipe, parameter, planar_entry, value_at
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Parameters(Bars):
    """Input angle linear in x from 1 to 2, output angle linear in log10 x; Chebyshev's three precision points."""

    ground: float = parameter(0.2, "m", "pivots O-D", low=0, strict=True)
    first: float = parameter(1.8, "rad", "input angle at x = 1")
    turn: float = parameter(1.4, "rad", "input range", low=0, strict=True)
    first_out: float = parameter(1.4, "rad", "output angle at x = 1")
    turn_out: float = parameter(1.047, "rad", "output range", low=0, strict=True)


POINTS = 1.5 - 0.5 * np.cos(np.radians([30.0, 90.0, 150.0]))
"""Chebyshev's spacing of three points in 1 <= x <= 2."""


def angles(p: Parameters) -> tuple[np.ndarray, np.ndarray]:
    """Input and output angles (3,) at the precision points."""
    return p.first + p.turn * (POINTS - 1.0), p.first_out + p.turn_out * np.log10(POINTS) / math.log10(2.0)


def linkage(p: Parameters) -> Linkage:
    """K1 cos(out) - K2 cos(in) + K3 = cos(in - out), K1 = d/a, K2 = d/c, K3 = (a^2 - b^2 + c^2 + d^2) / (2 a c), d the ground."""
    x, y = angles(p)
    k1, k2, k3 = np.linalg.solve(np.column_stack([np.cos(y), -np.cos(x), np.ones(3)]), np.cos(x - y))
    a, c, d = p.ground / k1, p.ground / k2, p.ground
    b = math.sqrt(a * a + c * c + d * d - 2.0 * a * c * k3)
    chain = Linkage("freudenstein").pivot("O", 0.0, 0.0).pivot("D", d, 0.0).crank("input", "O", "A", a)
    way, arm = d - a * np.exp(1j * x[0]), c * np.exp(1j * y[0])
    side = 1 if (np.conj(way) * (way + arm)).imag > 0 else -1  # B left or right of the line A -> D
    return chain.rrr("B", ("coupler", "output"), ("A", "D"), (b, abs(c)), side)


def precise(k: int) -> Outside:
    """The output angle at a precision point."""
    return value_at("output_angle", lambda p: float(angles(p)[1][k]), f"log10 x at precision point {k + 1}", 12 * k, unit="rad")


ENTRY = planar_entry(
    "freudenstein", "Logarithm generator", "function-generator",
    summary="Four-bar whose output angle follows log10 x for 1 < x < 2, exact at three points.",
    use="Mechanical computing, instruments, matching of two scales.", origin="Ferdinand Freudenstein, 1955", parameters=Parameters,
    linkage=linkage, path=lambda p: {"input_angle": (float(angles(p)[0][0]), float(angles(p)[0][-1]))}, width=lambda p: 0.08 * p.ground,
    links=("coupler", "output"), points=("B",), sliders=("turn", "turn_out"), plots=(PlotRecipe("output", ("output_angle",)),),
    outside=tuple(precise(k) for k in range(3)),
    chain="R + RRR", formulas="Freudenstein's equation at three points.",
    sources=("Freudenstein, Approximate synthesis of four-bar linkages, Trans. ASME 77, 1955",),
)  # fmt: skip
