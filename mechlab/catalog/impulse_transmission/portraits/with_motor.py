"""Motions with the motor, from thousands of initial states at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic.impulse import slope
from mechlab.catalog.impulse_transmission.parameters import Parameters
from mechlab.catalog.impulse_transmission.portraits.common import UNITS, options, smoothing
from mechlab.catalog.impulse_transmission.scenes import simulate
from mechlab.errors import MechlabError
from mechlab.kit.portrait import Portrait, estimated_error, flow, grid
from mechlab.mechanism.geometry import Array

STATES = ("alpha", "beta", "alpha_rate", "beta_rate", "motor_torque")
DURATION, TIMESTEP, ROUGH_TIMESTEP = 0.5, 5e-4, 2.5e-4
FOLLOWED = 3
"""Motions with friction that are followed exactly, to say how far the smoothed ones are off."""


def _states(p: Parameters, o: Mapping[str, Any]) -> Array:
    """(points, 5) initial states: all combinations of what was given."""
    points = grid({f"{s}_0": o[f"{s}_0"] for s in STATES})
    return np.column_stack(list(points.values()))


def phase(p: Parameters, given: Mapping[str, Any]) -> Portrait:
    """Motions with the motor, from a grid of initial states."""
    o = options(
        given, alpha_0=p.alpha_0, beta_0=np.linspace(-0.2, 0.2, 32), alpha_rate_0=p.alpha_rate_0,
        beta_rate_0=np.linspace(-30.0, 30.0, 32), motor_torque_0=p.motor_torque_0, duration=DURATION,
        timestep=ROUGH_TIMESTEP if p.M1 else TIMESTEP,
    )  # fmt: skip
    if p.static_motor:
        raise MechlabError(f"portrait: the motor torque is a state here and needs tau, got {p.tau:g} s.")
    i = p.impulse
    width, notes = smoothing(i, float(o["timestep"]))

    def f(t: float, y: Array) -> Array:
        return slope(i, y, width)

    start = _states(p, o)
    t, y = flow(f, start, float(o["duration"]), float(o["timestep"]))
    arrays = {"t": t} | {name: y[:, :, k].T for k, name in enumerate(STATES)}
    told = f"{len(start)} motions at once by RK4, step {float(o['timestep']):g} s, "
    if width:
        told += _against_events(p, start, y[-1], t[-1])
    else:
        told += f"estimated error {estimated_error(f, start, float(o['duration']), float(o['timestep'])):.2g}"
    return Portrait("phase", "phase portrait with the motor", "beta", "beta_rate", arrays, UNITS, notes=(told, *notes))


def _against_events(p: Parameters, start: Array, end: Array, duration: float) -> str:
    """How far a few of the motions end from those with exact friction, located events."""
    chosen = np.unique(np.linspace(0, len(start) - 1, FOLLOWED).round().astype(int))
    exact = []
    for state in start[chosen]:
        initial: dict[str, Any] = {f"{name}_0": float(x) for name, x in zip(STATES, state, strict=True)}
        q = replace(p, **initial)
        exact.append(simulate(q, np.array([0.0, duration]), 1e-9)[0][-1])
    off = np.abs(end[chosen] - exact).max(axis=0)
    return (
        f"off from exact friction at the end by {off[1]:.2g} rad in beta and {off[3]:.2g} rad/s in beta' "
        f"(largest of {len(chosen)} motions)"
    )
