"""What all portraits share: options, units, and friction smoothed just enough for a fixed step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mechlab.analytic.impulse import Impulse, shape
from mechlab.errors import unknown

UNITS = {
    "t": "s", "alpha": "rad", "beta": "rad", "alpha_rate": "rad/s", "beta_rate": "rad/s", "motor_torque": "N m",
    "psi": "rad", "slip": "rad/s", "mean_speed": "rad/s", "M0": "N m", "M1": "N m",
}  # fmt: skip
WIDTH = 0.1
"""Least rate [rad/s] below which a portrait with friction is smoothed; the error is of this size in beta'."""


def options(given: Mapping[str, Any], **known: Any) -> dict[str, Any]:
    """The known quantities with the values that were given; raises MechlabError for another, listing them."""
    for key in given:
        if key not in known:
            raise unknown("portrait: quantity", key, known)
    return known | dict(given)


def smoothing(i: Impulse, timestep: float) -> tuple[float, tuple[str, ...]]:
    """Rate below which friction is smoothed, wide enough for RK4 to be stable, and what to say of it."""
    if i.M1 == 0.0:
        return 0.0, ()
    width = max(WIDTH, timestep * i.M1 / (shape(i).B3 - abs(shape(i).b3)))
    return width, (
        f"dry friction is smoothed below {width:.3g} rad/s; `simulate --engine hybrid` follows single motions exactly",
    )
