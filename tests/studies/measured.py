"""Simulated measurements: series of a design with parameters off their defaults, with noise of known size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

import mechlab as ml
from mechlab.mechanism.geometry import Array


def clean_run(name: str, scene: str, true: Mapping[str, float], channels: Sequence[str], t: Array) -> dict[str, Array]:
    """A run with the true parameters, by the scene's own engine: heads of a table -> series without noise."""
    run = ml.simulate(name, dict(true), scene=scene, duration=float(t[-1]), at=t.tolist())
    return {"t [s]": t} | {f"{c} [{run.units[c]}]": np.array([run.at(c, x) for x in t]) for c in channels}


def noisy(clean: Mapping[str, Array], noise: Mapping[str, float], seed: int) -> dict[str, Any]:
    """The same with white noise on the channels named, of standard deviations in their units."""
    rng = np.random.default_rng(seed)
    out = {}
    for head, values in clean.items():
        sigma = noise.get(head.split(" [")[0], 0.0)
        out[head] = values + rng.normal(0.0, sigma, len(values)) if sigma else values
    return out


def clean_angles(true: Mapping[str, float], angles: Array) -> dict[str, Array]:
    """Rocker and coupler of a four-bar at given crank angles, by the closed form."""
    found = ml.solve("fourbar", dict(true), crank_angle=angles)["analytic"]
    return {"crank_angle [rad]": angles} | {f"{n} [rad]": np.asarray(found[n]) for n in ("rocker_angle", "coupler_angle")}
