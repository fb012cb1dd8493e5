"""Many motions that differ in their initial state and constant loads, stepped inside the engine (mujoco.rollout).

For mechanisms without loops and scenes without laws other than constant loads: nothing calls Python between the steps. The
steps are those of `mechlab.engines.mujoco.run`, bit for bit, whatever the number of threads.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np
from mujoco import rollout

from mechlab.engines.mujoco.control import compiling, engine
from mechlab.engines.mujoco.model import MujocoMap, passive
from mechlab.engines.mujoco.stepping import Grid
from mechlab.engines.state import RATE_LIMIT
from mechlab.errors import MechlabError
from mechlab.experiment.energy import STANDSTILL
from mechlab.experiment.scene import Settings
from mechlab.formats import to_mjcf
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

NUMBERS = 4_000_000
"""Most numbers (32 MB) of one call of the engine, which keeps every step of all motions that it rolls out together."""
_FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS


@dataclass(frozen=True)
class Batch:
    """t (m,) of the kept samples; q (N, m, nq), v (N, m, nv); `reached` (N,) [s], less than the duration where a motion
    blew up; `slip` (N,) largest residual of the relations at the samples; `unaccounted` (N,) largest energy that neither
    the start nor the loads nor viscous damping explain, as a share of the energy that the motion exchanges."""

    t: Array
    q: Array
    v: Array
    reached: Array
    slip: Array
    unaccounted: Array


def roll(
    mechanism: Mechanism,
    settings: Settings,
    steps: Grid,
    q: Array,
    v: Array,
    loads: Mapping[str, Array],
    threads: int = 1,
) -> Batch:
    """N motions from coordinates q (N, nq) and rates v (N, nv) under constant loads: joint or shaft -> (N,).

    Raises MechlabError for loops and for a timestep that does not divide the duration.
    """
    if mechanism.loops:
        raise MechlabError(f"{mechanism.name}: mechanisms with loops are not rolled out; run them one by one.")
    if abs(steps.count * steps.timestep - steps.duration) > 1e-9 * steps.timestep:
        raise MechlabError(f"{mechanism.name}: a rollout needs a timestep that divides {steps.duration:g} s.")
    model = _model(mechanism, settings)
    map_ = MujocoMap(mechanism, model)
    size = mujoco.mj_stateSize(model, _FULL)
    data = mujoco.MjData(model)
    first = np.empty(size)
    mujoco.mj_getState(model, data, first, _FULL)
    start = np.tile(first, (len(q), 1))
    start[:, 1 + map_.qpos] = q
    start[:, 1 + model.nq + map_.dof] = v
    push = np.zeros((len(q), 1, model.nv))
    for name, values in loads.items():
        push[:, 0, map_.dof] += np.asarray(values)[:, None] * mechanism.row(name)
    many = max(1, NUMBERS // (steps.count * (size + model.nsensordata)))
    keep = np.array(steps.samples)
    out = Batch(
        np.array([steps.t(k) for k in steps.samples]), np.empty((len(q), len(keep), mechanism.nq)),
        np.empty((len(q), len(keep), mechanism.nv)), np.empty(len(q)), np.zeros(len(q)), np.zeros(len(q)),
    )  # fmt: skip
    with engine(), rollout.Rollout(nthread=threads) as pool:
        workers = [mujoco.MjData(model) for _ in range(max(1, threads))]
        for i in range(0, len(q), many):
            s = slice(i, min(i + many, len(q)))
            states, sensed = pool.rollout(
                [model] * (s.stop - i), workers, start[s], push[s], nstep=steps.count,
                control_spec=int(mujoco.mjtState.mjSTATE_QFRC_APPLIED), initial_warmstart=np.zeros((1, model.nv)),
            )  # fmt: skip
            states = np.concatenate([start[s, None], states], axis=1)
            _keep(mechanism, model, map_, states, sensed, keep, {n: np.asarray(x)[s] for n, x in loads.items()}, s, out)
    return out


@lru_cache(maxsize=8)
def _model(mechanism: Mechanism, settings: Settings) -> mujoco.MjModel:
    """The model without its sensors, which cost time, but for the two energies."""
    with compiling():
        spec = mujoco.MjSpec.from_string(to_mjcf(mechanism, settings))
        for sensor in list(spec.sensors):
            spec.delete(sensor)
        for kind in (mujoco.mjtSensor.mjSENS_E_POTENTIAL, mujoco.mjtSensor.mjSENS_E_KINETIC):
            spec.add_sensor(type=kind, name=kind.name)
        model = spec.compile()
    passive(model)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return model


def _keep(
    mechanism: Mechanism,
    model: mujoco.MjModel,
    map_: MujocoMap,
    states: Array,
    sensed: Array,
    keep: Array,
    loads: Mapping[str, Array],
    at: slice,
    out: Batch,
) -> None:
    """Fill rows `at` of `out` from states (n, steps + 1, size) and energies (n, steps, 2) sensed before each step."""
    qpos, qvel = states[:, :, 1 : 1 + model.nq], states[:, :, 1 + model.nq : 1 + model.nq + model.nv]
    out.q[at], out.v[at] = map_.coordinates(qpos[:, keep]), map_.rates(qvel[:, keep])
    fastest = np.max(np.abs(qvel), axis=2, initial=0.0)
    bad = ~((fastest < RATE_LIMIT) & np.all(np.isfinite(qpos), axis=2))
    first = np.where(np.any(bad, axis=1), np.argmax(bad, axis=1), -1)
    out.reached[at] = states[np.arange(len(states)), first, 0]  # where the engine gives up it repeats its last time
    if mechanism.relations:
        rows = np.array([mechanism.coefficient_row(x.coefficients) for x in mechanism.relations])
        out.slip[at] = np.max(np.abs(out.q[at][..., mechanism.q_columns] @ rows.T), axis=(1, 2), initial=0.0)
    q, v = map_.coordinates(qpos[:, :-1]), map_.rates(qvel[:, :-1])
    potential, kinetic = sensed[:, :, 0], sensed[:, :, 1]
    done = np.zeros(kinetic.shape)
    for name, force in loads.items():
        value = mechanism.value(name, q)
        done += force[:, None] * (value - value[:, :1])
    done -= _lost(mechanism, v, states[0, :-1, 0])
    balance = kinetic + potential - done
    weight = mechanism.total_mass * float(np.linalg.norm(mechanism.gravity)) * STANDSTILL
    turned = np.maximum(np.maximum(np.max(kinetic, axis=1), np.ptp(potential, axis=1)), max(weight, 1e-300))
    missing = np.max(np.abs(balance - balance[:, :1]), axis=1)
    noise = 1e-12 * np.max(np.abs(potential), axis=1, initial=0.0)
    out.unaccounted[at] = np.where(missing <= noise, 0.0, missing / turned)


def _lost(mechanism: Mechanism, v: Array, t: Array) -> Array:
    """(n, m) work [J] that viscous damping of joints and shafts has taken along v (n, m, nv), by the trapezoidal rule."""
    power = v**2 @ np.array([j.damping for j in mechanism.joints for _ in range(j.nv)])
    for shaft in mechanism.shafts:
        if shaft.damping:
            power = power + shaft.damping * (v @ mechanism.row(shaft.name)) ** 2
    if not np.any(power) or len(t) < 2:
        return np.zeros(power.shape)
    steps = 0.5 * (power[:, 1:] + power[:, :-1]) * np.diff(t)
    return np.concatenate([np.zeros((len(power), 1)), np.cumsum(steps, axis=1)], axis=1)
