"""Runs of the scenes by each engine, for checks and claims."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from mechlab.catalog.impulse_transmission.build import build
from mechlab.catalog.impulse_transmission.parameters import Parameters
from mechlab.catalog.impulse_transmission.scenes import SCENES
from mechlab.engines.protocol import engine
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Settings, preset
from mechlab.mechanism.geometry import Array


def of_scene(name: str, **changes: float) -> Parameters:
    """Parameters of a scene, with changes."""
    return Parameters(**{**SCENES[name].overrides, **changes})


@lru_cache(maxsize=16)
def hybrid_run(
    p: Parameters, scene: str, duration: float, fidelity: str = "minimal", tolerance: float = 1e-11
) -> Recording:
    """A scene by the engine hybrid; equations from Pinocchio."""
    made = replace(SCENES[scene].make(p, fidelity), duration=duration)
    return engine("hybrid").run(
        build(p, fidelity), made, Settings(engine="hybrid", integrator="DOP853", tolerance=tolerance)
    )


def mujoco_run(p: Parameters, scene: str, duration: float, timestep: float, fidelity: str = "minimal") -> Recording:
    """A scene by MuJoCo with RK4."""
    made = replace(SCENES[scene].make(p, fidelity), duration=duration)
    return engine("mujoco").run(build(p, fidelity), made, preset("accurate", timestep=timestep))


def end(recording: Recording) -> Array:
    """(4,) beta, beta', alpha', Md at the end of a run."""
    return np.array([recording.channel(n)[-1] for n in ("beta", "beta_rate", "alpha_rate", "alpha_force")])
