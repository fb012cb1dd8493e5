"""The lag of MuJoCo's soft gear rows under the loads of a scene, predicted before the run.

    r = (1 - d) tc^2 zeta^2 A f,    A = J M^-1 J^T of the row, f its reaction, d the impedance, tc the time constant

(static, zeta = 1). A is large when a part of the row is light, so light loaded parts lag most. With the integrator
"discrete" the lag is larger by (1 + h / tc)^2. Verified against MuJoCo 4.0.0 to 12 digits for one row.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.experiment.laws import ComputedTorque, Law, LawStates
from mechlab.experiment.recording import Finding
from mechlab.experiment.scene import Scene, Settings, initial_state
from mechlab.experiment.tree_plant import TreePlant
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.model import Mechanism

LAG_LIMIT = 1e-3
"""Lag [rad or m] above which a run warns."""
SAMPLES = 25
ENGINE_TIMECONST, ENGINE_IMPEDANCE = 0.02, 0.95
"""MuJoCo's default time constant [s], and its default impedance for lags beyond the width of 1 mm or 1 mrad."""


@dataclass(frozen=True)
class Lag:
    """Prediction for one relation: `compliance` A [1/(kg m2) or 1/kg], largest `load` f [N m or N], `lag`
    [rad or m]."""

    relation: str
    compliance: float
    load: float
    lag: float


def softness(settings: Settings) -> float:
    """Factor s [s^2] of the static lag r = s A f of a row: (1 - d) tc^2, times (1 + h / tc)^2 with "discrete"."""
    if settings.timeconst is None or settings.impedance is None:
        tc, d = max(ENGINE_TIMECONST, 2.0 * settings.timestep), ENGINE_IMPEDANCE
    else:
        tc, d = settings.timeconst * settings.timestep, settings.impedance
        if settings.integrator != "discrete":
            tc = max(tc, 2.0 * settings.timestep)
    factor = (1.0 + settings.timestep / tc) ** 2 if settings.integrator == "discrete" else 1.0
    return factor * (1.0 - d) * tc**2


def predicted_lags(mechanism: Mechanism, scene: Scene, settings: Settings) -> tuple[Lag, ...]:
    """The lag of every relation in the initial state of a scene, under the largest load of its laws at SAMPLES times.

    Laws that depend on the state are evaluated in the initial state; inverse dynamics, which follows its motion, after the beginning
    without its feedback, as the initial state is no error then. Empty without relations or with another engine.
    """
    if settings.engine != "mujoco" or not mechanism.relations:
        return ()
    q, v = initial_state(mechanism, scene)
    plant = TreePlant(mechanism, q, v)
    memory = LawStates(scene.laws)
    memory.put(plant, memory.initial)
    mass, jacobian, free = plant.mass_matrix(), plant.jacobian(), plant.constraint_bias()
    inverse = np.linalg.solve(mass, jacobian.T)
    compliance = jacobian @ inverse
    forces = []
    for t in np.linspace(0.0, scene.duration, SAMPLES):
        force = -plant.bias()
        plant.t = float(t)
        for law in scene.laws if t == 0.0 else map(_planned, scene.laws):
            for name, x in law.force(plant.t, plant).items():
                force = force + x * mechanism.row(name)
        forces.append(force)
    needed = -(jacobian @ np.linalg.solve(mass, np.array(forces).T) + free[:, None])
    # Minimum-norm reactions of redundant rows, as the engine's regularization gives.
    largest = np.abs(np.linalg.lstsq(compliance, needed, rcond=1e-11)[0]).max(axis=1)
    soft, names = softness(settings), ConstraintSet(mechanism).rows
    at = {name: k for k, name in enumerate(names)}
    out = []
    for relation in mechanism.relations:
        k = at[relation.name]
        a, f = float(compliance[k, k]), float(largest[k])
        out.append(Lag(relation.name, a, f, soft * a * f))
    return tuple(out)


def _planned(law: Law) -> Law:
    """The law as it acts where its motion is followed."""
    return replace(law, gains=((0.0, 0.0),) * len(law.gains)) if isinstance(law, ComputedTorque) else law


def lag_findings(mechanism: Mechanism, scene: Scene, settings: Settings) -> tuple[Finding, ...]:
    """Finding "predicted_lag": the relation with the largest lag; above LAG_LIMIT a warning. Empty without
    relations."""
    lags = predicted_lags(mechanism, scene, settings)
    if not lags:
        return ()
    worst = max(lags, key=lambda x: x.lag)
    text = f"before the run: relation {worst.relation!r} will lag by {worst.lag:.3g} rad or m under {worst.load:.3g} N m or N"
    if not worst.lag <= LAG_LIMIT:
        text += (
            f", more than {LAG_LIMIT:g}: its lightest part is light for that load (A = {worst.compliance:.3g} 1/(kg m2)). "
            "Take the fidelity 'minimal', which has no soft rows, or a smaller timestep"
        )
        return (Finding("predicted_lag", worst.lag, LAG_LIMIT, "rad or m", "warning", text),)
    return (Finding("predicted_lag", worst.lag, LAG_LIMIT, "rad or m", "ok", text),)
