"""Dry friction that an engine smooths about standstill: does it hide a stick?

Below a small rate smoothed friction is less than its bound. What is there and would not be accelerated by more than its friction
can hold stands in truth; here it creeps, by the integral of its rate.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mechlab.experiment.health import Finding
from mechlab.mechanism.geometry import Array

Flags = NDArray[np.bool_]

BAND = 3.0
"""Widths of a tanh beyond which smoothed friction has all but its bound (.5 % less)."""


def stands(rates: Array, accelerations: Array, width: Array, able: Array) -> Flags:
    """(n, k) whether friction smoothed as able tanh(rate / width) hides a stick: the rate is in the band, and the acceleration
    without friction is less than what friction is able to (width, able: (k,))."""
    free = accelerations + able * np.tanh(rates / width)
    return np.asarray((np.abs(rates) < BAND * width) & (np.abs(free) < able))


def crept(t: Array, rates: Array, standing: Flags) -> Array:
    """(k,) ways [rad or m] made between samples at which something stands: t (n,), rates (n, k), standing (n, k)."""
    both = standing[1:] & standing[:-1]
    mean = 0.5 * (np.abs(rates[1:]) + np.abs(rates[:-1]))
    return np.asarray(np.sum(np.where(both, mean, 0.0) * np.diff(t)[:, None], axis=0))


def friction_finding(
    names: Sequence[str], t: Array, rates: Array, standing: Flags, tolerance: float, how: str
) -> Finding | None:
    """Finding "friction": the largest way crept, an error beyond the tolerance [rad or m] of the scene; None without dry
    friction. names (k,); `how` says what the engine does to it."""
    if not names:
        return None
    ways = crept(t, rates, standing)
    k = int(np.argmax(ways))
    value, text = float(ways[k]), f"dry friction of {', '.join(dict.fromkeys(names))} {how}"
    if not value > 0.0:
        return Finding("friction", 0.0, tolerance, "rad or m", "ok", f"{text}; nothing stood still for long")
    text += f": {names[k]} stands where the load cannot break it away, and creeps by {value:.2g} rad or m"
    if value <= tolerance:
        return Finding("friction", value, tolerance, "rad or m", "warning", f"{text} (tolerance {tolerance:g})")
    text += f", beyond the tolerance {tolerance:g} of the scene; --engine hybrid follows it exactly, a smaller timestep more closely"
    return Finding("friction", value, tolerance, "rad or m", "error", text)
