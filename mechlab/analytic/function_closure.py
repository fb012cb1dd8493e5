"""Closure of signed four-bars (a, b, c, first, first_out) in batches, ground bar 1: |1 + c e^(i g) - a e^(i f)| = b."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def output(x: Array, input_angle: Array, side: Array) -> Array:
    """Output angles (k, m) of signed bars (k, 5) at input angles (k, m) on the side (k,) of the way from A to D; NaN: not assembled."""
    a, b, c = (x[:, n, None] for n in range(3))
    way = 1.0 - a * np.exp(1j * input_angle)
    square = way.real**2 + way.imag**2
    along = (square + c * c - b * b) / 2.0
    with np.errstate(invalid="ignore"):
        across = side[:, None] * np.sqrt(square * c * c - along * along)
    # C - D = c e^(i g), seen from D against the way from A
    return np.angle(way * (-along + 1j * across) / square / c)


def side_of(x: Array, input_angle: Array, output: Array) -> Array:
    """Side (k,) on which C lies, of the way from A to D, at these angles (k,)."""
    way = 1.0 - x[:, 0] * np.exp(1j * input_angle)
    return np.where(np.imag(np.conj(way) * x[:, 2] * np.exp(1j * output)) >= 0.0, 1.0, -1.0)


def output_slopes(x: Array, input_angle: Array, output_angle: Array) -> Array:
    """Derivatives (n, 5) of the output angle by a, b, c, f and the beginning of its scale, on which it does not depend, at closed
    angles (n,) of one linkage (5,)."""
    a, b, c = x[:3]
    crank, rocker = np.exp(1j * input_angle), np.exp(1j * output_angle)
    rod, none = np.conj(1.0 + c * rocker - a * crank), np.zeros(len(crank))
    by = [np.real(rod * crank), b + none, -np.real(rod * rocker), np.real(1j * rod * a * crank), none]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.column_stack(by) / np.real(1j * rod * c * rocker)[:, None])
