"""Checks of the closed differential: closed forms, Pinocchio and MuJoCo, in every fidelity."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechlab.analytic import differential as closed
from mechlab.catalog.closed_differential.lag import predicted_lag
from mechlab.catalog.closed_differential.moving import MOVING
from mechlab.catalog.closed_differential.parameters import Parameters
from mechlab.catalog.closed_differential.probes import answers, machines, run
from mechlab.catalog.closed_differential.questions import ANSWERS
from mechlab.catalog.closed_differential.scenes import SCENES
from mechlab.catalog.closed_differential.witnesses import ENGINES
from mechlab.experiment.entry import Check, CheckResult
from mechlab.mechanism import TreeKinematics
from mechlab.mechanism.geometry import Array

FIDELITIES = ("minimal", "parts", "full")


def _speeds(p: Parameters) -> CheckResult:
    said = answers(p, w_H1=100.0, w_H2=37.0)
    keys = [k for k in ANSWERS if k != "w_H2" and all(k in v for v in said.values())]
    scale = np.maximum(1.0, [abs(float(said["analytic"][k])) for k in keys])
    values = {who: np.array([float(v[k]) for k in keys]) / scale for who, v in said.items()}
    return CheckResult(values, 1e-9, note=f"relative; {', '.join(keys)}")


def _mass(p: Parameters) -> CheckResult:
    expected = closed.mass_matrix(p.train, p.inertias)
    said = {}
    for fidelity in FIDELITIES:
        for who, made in machines(p, fidelity).items():
            basis = np.column_stack([made.rates({"w1": 1.0, "w3": 0.0}), made.rates({"w1": 0.0, "w3": 1.0})])
            said[f"{who} {fidelity}"] = basis.T @ made.mass @ basis / np.abs(expected).max()
    return CheckResult(
        said, 1e-12, expected / np.abs(expected).max(), "mass matrix in (w1, w3), relative to its largest entry"
    )


def _final(recording: Any) -> Array:
    return np.array([recording.channel(f"{n}_rate")[-1] for n in ("H1", "H2", "block_14", "block_36")])


def _end(recording: Any) -> Array:
    """Time, angles and rates at the end."""
    turned = [recording.channel(n)[-1] for n in ("H1", "H2", "block_14", "block_36")]
    return np.array([recording.t[-1], *turned, *_final(recording)])


def _constant(p: Parameters) -> CheckResult:
    expected = _end(run("analytic", p, "constant-moments"))
    said = {f"{who} {f}": _end(run(who, p, "constant-moments", fidelity=f)) for who in ENGINES for f in FIDELITIES}
    # RK4 is exact for constant accelerations; MuJoCo's soft rows start with a transient of 1e-9 of the speeds, 2e-6 rad.
    return CheckResult(
        said, 1e-5, expected, "time, angles and speeds of H1, H2 and both blocks after 0.5 s of constant moments"
    )


def _scenes(p: Parameters) -> CheckResult:
    from dataclasses import replace

    expected: list[Array] = []
    said: dict[str, list[Array]] = {"mujoco minimal": [], "mujoco parts": []}
    for name in ("held-input-dry-load", "one-way-stop", "locked-pair", "internal-drag"):
        lived = replace(p, **SCENES[name].overrides)
        if name == "locked-pair":  # the pair is closed before it is locked
            start = closed.speeds(p.train, w1=float(p.lock_ratio), w3=1.0)
            factor = p.w_H1_0 / float(start.w_H1)
            lived = replace(lived, w_H2_0=factor * float(start.w_H2))
        expected.append(_final(run("analytic", lived, name)))
        for who in said:
            said[who].append(_final(run("mujoco", lived, name, fidelity=who.split()[1])))
    # A rate is caught within some steps of 0.5 or 1 ms, which shifts later speeds by less than 1e-4 rad/s.
    return CheckResult({k: np.array(v) for k, v in said.items()}, 1e-3, np.array(expected), "final speeds [rad/s]")


def mesh_powers(p: Parameters, who: str) -> Array:
    """(n, meshes) power that goes into each mesh from both gears and the carrier [W], along constant moments; without the
    first 50 ms, in which soft rows take up their load."""
    found = run(who, p, "constant-moments", fidelity="parts")
    m, late = found.mechanism, found.t > 0.05
    return np.column_stack(
        [
            found.channel(f"{r.name}_load") * sum(float(c) * found.channel(f"{n}_rate") for n, c in r.coefficients)
            for r in m.relations
        ]
    )[late]


def _powers(p: Parameters) -> CheckResult:
    worst = {who: float(np.abs(mesh_powers(p, who)).max()) for who in ENGINES}
    turned = p.M_H1 * abs(p.w_H1_0) + abs(p.M_H2 * p.w_H2_0) + 1.0
    said = {who: x / turned for who, x in worst.items()}
    # What is left of the soft rows' transient after 25 of its time constants is rounding.
    return CheckResult(
        said, 1e-9, 0.0, "power in + out + carrier of every mesh, relative to the outer powers at the start"
    )


def angular_momentum(recording: Any) -> Array:
    """(n,) angular momentum about the axis [N m s] of a run in parts or full, part by part from the bodies' twists."""
    m = recording.mechanism
    tree = TreeKinematics(m)
    out = np.zeros(len(recording.t))
    for k, (q, v) in enumerate(zip(recording.q, recording.v, strict=True)):
        tree.set(q, v)
        for body in m.bodies:
            rotation, origin = tree.pose(body.name)
            centre = origin + rotation @ np.array(body.inertia.com)
            twist = tree.velocity(body.name, centre)
            spin = rotation @ body.inertia.matrix() @ rotation.T @ twist[3:]
            out[k] += spin[2] + body.inertia.mass * (centre[0] * twist[1] - centre[1] * twist[0])
    return out


def _momentum(p: Parameters) -> CheckResult:
    from dataclasses import replace

    lived = replace(p, drag_internal=max(p.drag_internal, 0.5), drag_14=0.0, drag_36=0.0)
    said = {}
    for who in ENGINES:
        found = run(who, lived, "internal-drag", 0.5, "full")
        gained = angular_momentum(found) - angular_momentum(found)[0]
        said[f"{who} full"] = float(np.abs(gained - (lived.M_H1 - lived.M_H2) * found.t).max())
    return CheckResult(said, 1e-8, 0.0, "largest |dL - (M_H1 - M_H2) t| with drag between the blocks [N m s]")


def _lag(p: Parameters) -> CheckResult:
    predicted = predicted_lag(p, "parts")
    found = run("mujoco", p, "constant-moments", 0.1, "parts")
    m = found.mechanism
    measured = np.array([abs(m.coefficient_row(r.coefficients) @ found.q[-1]) for r in m.relations])
    told = np.array([predicted[r.name] for r in m.relations])
    if not np.all(told > 0.0):
        return CheckResult({"mujoco": measured}, 1e-12, told, "residual of each mesh [rad]; not all carry load")
    return CheckResult(
        {"mujoco": measured / told}, 0.01, np.ones(len(told)), "residual of each mesh over the predicted one"
    )


CHECKS = (
    Check("D1", "speeds, moments and accelerations from three witnesses", _speeds, "Willis; virtual work"),
    Check("D2", "mass matrix of each fidelity against the closed form", _mass, "Lagrange"),
    Check("D3", "constant moments in every fidelity and engine", _constant, "linear motion, exact"),
    Check(
        "D4",
        "dry load, stop, lock and inner drag against exact events",
        _scenes,
        "matrix exponentials between events",
        True,
    ),
    Check("D5", "power balance of every mesh on a moving carrier", _powers, "no mesh stores or loses energy"),
    Check("D6", "angular momentum under friction inside the train", _momentum, "only the housing can change it"),
    Check("D7", "lag of soft rows against the law r = (1-d) tc^2 A f", _lag, "MuJoCo's soft constraints at quasi-rest"),
    *MOVING,
)
