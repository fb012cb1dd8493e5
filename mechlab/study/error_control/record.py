"""A Recording of a motion whose error is known: the states that were estimated, at even times and at those asked for."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from mechlab.experiment.energy import dissipation, energy_finding
from mechlab.experiment.health import Finding, Health, measured
from mechlab.experiment.laws import applied_force
from mechlab.experiment.observe import kinematic_findings
from mechlab.experiment.recording import Cost, Recording, basic_channels
from mechlab.experiment.scene import Scene
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import passive_force
from mechlab.study.error_control.batch import BatchTree
from mechlab.study.error_control.result import Result
from mechlab.study.one_freedom import OneFreedomPlant


def findings(result: Result) -> tuple[Finding, ...]:
    """Findings "max_error" and, where there is one, "check_method"."""
    severity = "ok" if result.reached else "error"
    out = [Finding("max_error", result.estimate, result.max_error, result.unit, severity, result.sentence)]
    if result.checked is not None:
        c = result.checked
        out.append(Finding("check_method", c.difference, c.own, result.unit, "ok", c.sentence))
    return tuple(out)


def motion_of(mechanism: Mechanism, scene: Scene, result: Result, at: Sequence[float], every: int = 1) -> Recording:
    """States and channels: the basic ones, NAME_accel of joints and shafts, NAME_force of what constant loads and laws act on.
    every: only every so many of the output times are used, where states between them are interpolated."""
    t = np.union1d(result.t, np.asarray(at, dtype=float))
    if result.motion is not None:
        states = result.motion.states(t, accelerations=True)
        assert states.a is not None
        q, v, a = states.q, states.v, states.a
    else:
        q, v, a = _between(mechanism, scene, result, t, every)
    simple = mechanism.joints and all(j.nv == 1 for j in mechanism.joints)
    channels, units = basic_channels(mechanism, q, v, BatchTree(mechanism).frame_positions(q) if simple else None)
    for name in mechanism.scalar_names:
        channels[f"{name}_accel"] = a @ mechanism.row(name)
        units[f"{name}_accel"] = f"{units[name]}/s2"
    plant = OneFreedomPlant(mechanism)
    forces = []
    for k in range(len(t)):
        plant.set(float(t[k]), q[k], v[k], 1.0)
        forces.append(applied_force(mechanism, scene.laws, float(t[k]), plant)[1] if scene.laws else {})
    for name in dict.fromkeys(n for x in forces for n in x):
        channels[f"{name}_force"] = np.array([x.get(name, 0.0) for x in forces])
        units[f"{name}_force"] = "N" if units[name] == "m" else "N m"
    return Recording(
        mechanism, t, q, v, channels, units, settings=result.settings, scene=scene.name, name=mechanism.name,
        fidelity=scene.fidelity,
    )  # fmt: skip


def recording_of(mechanism: Mechanism, scene: Scene, result: Result, at: Sequence[float]) -> Recording:
    """`motion_of`, with its health, cost and versions."""
    made = motion_of(mechanism, scene, result, at)
    t, q, v, channels = made.t, made.q, made.v, made.channels
    power, done = np.zeros(len(t)), np.zeros(len(t))
    for name in mechanism.scalar_names:
        force = channels.get(f"{name}_force", np.zeros(len(t)))
        power += force * channels[f"{name}_rate"]
        done += force * (channels[name] - channels[name][0])
    constant = result.motion is not None
    balance = (
        energy_finding(mechanism, t, q, v, power, done)
        if constant
        else energy_finding(mechanism, t, q, v, power - dissipation(mechanism, q, v), laws=scene.laws)
    )
    found = [*findings(result), *kinematic_findings(mechanism, q, v, keep_mode=scene.keep_mode), balance]
    versions = {"numpy": np.__version__, "scipy": scipy.__version__, "python": platform.python_version()}
    cost = Cost(result.cpu_s, len(result.t) - 1, result.evaluations)
    return replace(made, health=Health(tuple(found)), cost=cost, versions=versions)


def _between(mechanism: Mechanism, scene: Scene, result: Result, t: Array, every: int) -> tuple[Array, Array, Array]:
    """States at times t: those of the result, and between (every `every`-th of) them the quintic through positions, rates and
    accelerations."""
    m = mechanism
    known = np.array([_acceleration(m, scene, x, q, v) for x, q, v in zip(result.t, result.q, result.v, strict=True)])
    if len(t) == len(result.t) and every == 1:
        return result.q, result.v, known
    from scipy.interpolate import BPoly

    nodes = np.stack([result.q, result.v, known], axis=1)
    spline = BPoly.from_derivatives(result.t[::every], nodes[::every])
    return spline(t), spline.derivative()(t), spline.derivative(2)(t)


def _acceleration(m: Mechanism, scene: Scene, t: float, q: Array, v: Array) -> Array:
    """(nv,) rigid dynamics at a state, without dry friction: M a + J^T r = forces, J a = -dJ/dt v."""
    tree, constraints = TreeKinematics(m, q, v), ConstraintSet(m)
    plant = OneFreedomPlant(m)
    plant.set(t, q, v, 1.0)
    applied = applied_force(m, scene.laws, t, plant)[0] if scene.laws else np.zeros(m.nv)
    force = applied + passive_force(tree) - tree.bias_force()
    rows = constraints.jacobian(tree)
    size = m.nv + len(rows)
    matrix, side = np.zeros((size, size)), np.zeros(size)
    matrix[: m.nv, : m.nv], matrix[: m.nv, m.nv :], matrix[m.nv :, : m.nv] = tree.mass_matrix(), rows.T, rows
    side[: m.nv], side[m.nv :] = force, -constraints.bias(tree)
    return np.asarray(np.linalg.lstsq(matrix, side, rcond=1e-12)[0][: m.nv])


def with_estimate(recording: Recording, result: Result, difference: float) -> Recording:
    """A Recording that an engine made with the accepted settings; what it differs from the estimated run counts too."""
    total = result.estimate + difference
    own = findings(result)
    text = f"{result.sentence}; the recorded run differs from the estimated one by {difference:.2g} {result.unit}"
    if result.reached:
        first = measured("max_error", total, result.max_error, result.unit, f"{text}; together")
    else:
        first = Finding("max_error", total, result.max_error, result.unit, "error", text)
    return replace(recording, health=Health((first, *own[1:])) + recording.health)
