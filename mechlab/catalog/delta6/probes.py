"""Where the delta is looked at: poses and motions that every parameter set can reach, and the source's own parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.parameters import Delta6Parameters
from mechlab.errors import NoSolution
from mechlab.mechanism.geometry import Array

SOURCE = Delta6Parameters()
"""The parameters of the source: its printed numbers are always compared with these, whatever the user has chosen."""
CENTRE = ("O_x", "O_y", "O_z")
ANGLES = ("alpha", "beta", "gamma")
SLIDERS = ("q1", "q2", "q3")
ROTARY = ("phi1", "phi2", "phi3")
HEAD_CENTRE_SWING = 0.05
"""Swing of the head centre on the probe motion, for parameters that reach as far as the source's [m]."""


def reach(p: Delta6Parameters) -> float:
    """Horizontal distance from the home pose to the nearest horizontal rod [m]."""
    return float(closed.reach_margin(p.geometry, np.zeros(3)))


def without_stops(p: Delta6Parameters) -> Delta6Parameters:
    """The same delta with slider stops that no probe reaches: what stops do to a motion is not what the checks ask."""
    home = p.geometry.home_height + p.platform_height + p.slider_height
    return replace(p, slider_min=min(p.slider_min, home - 1.0), slider_max=max(p.slider_max, home + 1.0))


def random_poses(p: Delta6Parameters, count: int, share: float = 0.5, seed: int = 3) -> tuple[Array, Array]:
    """Head centres O (count, 3) within `share` of the reach and angles (count, 3), |beta| < 1.5."""
    rng = np.random.default_rng(seed)
    radius, turn = share * reach(p) * np.sqrt(rng.random(count)), rng.uniform(-np.pi, np.pi, count)
    centre = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), rng.uniform(-0.1, 0.1, count)])
    return centre, rng.uniform([-3.0, -1.5, -3.0], [3.0, 1.5, 3.0], (count, 3))


@dataclass(frozen=True)
class Motion6:
    """Head centre and angles with their first and second derivatives, each (n, 3)."""

    centre: Array
    centre_rate: Array
    centre_accel: Array
    angles: Array
    angle_rate: Array
    angle_accel: Array

    @property
    def rate(self) -> Array:
        """(n, 6) rates of O_x, O_y, O_z, alpha, beta, gamma."""
        return np.hstack([self.centre_rate, self.angle_rate])

    @property
    def accel(self) -> Array:
        """(n, 6) their accelerations."""
        return np.hstack([self.centre_accel, self.angle_accel])


def probe_motion(p: Delta6Parameters, t: ArrayLike) -> Motion6:
    """All six freedoms at 1 Hz: O swings by about 0.05 m (less where the reach is short), the angles by 0.6, 0.5, 0.4."""
    time = np.asarray(t, dtype=float)[:, None]
    swing = min(HEAD_CENTRE_SWING, 0.35 * reach(p))
    w = 2.0 * np.pi
    parts = []
    for amplitude, phase in (([swing, swing, 0.6 * swing], [0.0, 1.3, 2.1]), ([0.6, 0.5, 0.4], [0.4, 1.7, 2.9])):
        size, x = np.array(amplitude), w * time + np.array(phase)
        parts += [size * np.sin(x), size * w * np.cos(x), -size * w**2 * np.sin(x)]
    return Motion6(*parts)


def refuses(ask: Callable[[], object]) -> bool:
    """True when the closed form says that there is no solution."""
    try:
        ask()
    except NoSolution:
        return True
    return False
