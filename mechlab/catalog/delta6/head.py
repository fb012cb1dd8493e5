"""Questions to the orientation head: the error of its control, when it has settled, and its dynamics with O held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import brentq

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.checks_head import head_inertias
from mechlab.catalog.delta6.parameters import Delta6Parameters
from mechlab.catalog.delta6.poses import coordinates, response, without_stops
from mechlab.catalog.delta6.parameters import ANGLES, CENTRE, ROTARY
from mechlab.catalog.delta6.scenes import head_tracking
from mechlab.catalog.delta6.witnesses import MujocoWitness, PinocchioWitness, Witness
from mechlab.errors import EngineMissing, MechlabError
from mechlab.experiment.question import Answer, Question
from mechlab.experiment.scene import Settings
from mechlab.kit.witness import room
from mechlab.mechanism.geometry import Array

# -- the error of the control ------------------------------------------------------------------------------------------

_START = closed.source_targets(0.0)
INITIAL = {
    **{f"{n}_error_0": float(x) for n, x in zip(ANGLES, closed.SOURCE_START_ANGLES - _START.angles, strict=True)},
    **{f"{n}_error_rate_0": float(x) for n, x in zip(ANGLES, closed.SOURCE_START_RATES - _START.rates, strict=True)},
}
"""Errors at t = 0, actual - target, and their rates: those of the source."""
ERRORS = tuple(f"{n}_error" for n in ANGLES)
ERROR_RATES = tuple(f"{n}_error_rate" for n in ANGLES)
COMMANDS = tuple(f"{n}_command" for n in ANGLES)
SETTLING = tuple(f"{n}_settling_time" for n in ANGLES)
LONGEST_RUN = 10.0
"""The engines follow the whole mechanism no longer than this [s]: 1 s takes them two or three."""


def _initial(given: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
    return [given[f"{n}_error_0"] for n in ANGLES], [given[f"{n}_error_rate_0"] for n in ANGLES]


def _times(given: Mapping[str, Any]) -> Array:
    time = np.asarray(given["time"], dtype=float)
    if np.any(time < 0.0):
        raise MechlabError(f"delta6: time: expected 0 s or more, got {float(time.min()):g}.")
    return time


def _responses(p: Delta6Parameters, time: Any, errors: list[Any], rates: list[Any]) -> dict[str, Any]:
    """Errors with their rates, and the commanded accelerations a_T - kv e' - kp e."""
    kv, kp = p.velocity_gain, p.position_gain
    wanted = closed.source_targets(time).accelerations
    out: dict[str, Any] = {}
    for k, n in enumerate(ANGLES):
        e, de = errors[k], rates[k]
        out |= {f"{n}_error": e, f"{n}_error_rate": de, f"{n}_command": wanted[..., k] - kv * de - kp * e}
    return out


def _law(p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    """e'' + kv e' + kp e = 0 in closed form."""
    time = _times(given)
    found = [
        closed.error_response(time, e, de, p.velocity_gain, p.position_gain)
        for e, de in zip(*_initial(given), strict=True)
    ]
    return Answer(_responses(p, time, [x.error for x in found], [x.error_rate for x in found]))


def _flow(p: Delta6Parameters, time: float) -> Array:
    """(2, 2) from (e, e') at 0 to those at `time`, by the matrix exponential."""
    from scipy.linalg import expm

    return np.asarray(expm(np.array([[0.0, 1.0], [-p.position_gain, -p.velocity_gain]]) * time))


def _exponential(p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    time = float(_times(given))
    errors, rates = _flow(p, time) @ np.array(_initial(given), dtype=float)
    return Answer(_responses(p, time, list(errors), list(rates)))


def _tracked(engine: str, p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    """The whole mechanism under computed torque, O held: its angles minus the targets at the end of the run."""
    time = float(_times(given))
    if time > LONGEST_RUN:
        return Answer(cannot=f"it follows the mechanism for {LONGEST_RUN:g} s at most")
    errors, rates = (np.array(x, dtype=float) for x in _initial(given))
    if time == 0.0:
        return Answer(cannot="nothing to follow at t = 0")
    free, start = without_stops(p), closed.source_targets(0.0)
    scene = head_tracking(free, "minimal")
    scene = replace(
        scene,
        duration=time,
        initial={**scene.initial, **dict(zip(ANGLES, start.angles + errors, strict=True))},
        initial_rates={**scene.initial_rates, **dict(zip(ANGLES, start.rates + rates, strict=True))},
    )
    # the fast root of the error law is near -kv: RK4 follows it up to kv h = 2.78
    step = min(0.97e-3, 0.5 / max(p.velocity_gain, 1.0))
    settings = {
        "mujoco": Settings(timestep=step),
        "pinocchio": Settings(engine="pinocchio", timestep=2.0 * step),
    }[engine]
    try:
        recording = room(engine).run(build(free, "minimal"), scene, settings)
    except EngineMissing as missing:
        return Answer(cannot=str(missing))
    wanted = closed.source_targets(time)
    e = np.array([recording.channel(n)[-1] for n in ANGLES]) - wanted.angles
    de = np.array([recording.channel(f"{n}_rate")[-1] for n in ANGLES]) - wanted.rates
    return Answer(_responses(p, time, list(e), list(de)))


ERROR = Question(
    "error of the head",
    given=("time",),
    optional=INITIAL,
    answers=(*ERRORS, *ERROR_RATES, *COMMANDS),
    witnesses={
        "analytic": _law,
        "exponential": _exponential,
        "pinocchio": partial(_tracked, "pinocchio"),
        "mujoco": partial(_tracked, "mujoco"),
    },
    units={"time": "s"}
    | dict.fromkeys((*ERRORS, *(f"{e}_0" for e in ERRORS)), "rad")
    | dict.fromkeys((*ERROR_RATES, *(f"{e}_0" for e in ERROR_RATES)), "rad/s")
    | dict.fromkeys(COMMANDS, "rad/s2"),
    text="error of alpha, beta, gamma (actual - target), its rate and the commanded acceleration, a time after the given "
    "initial errors, under the control with position_gain and velocity_gain",
    # softness of MuJoCo's loops and RK4 of both runs: 1e-8 rad measured, times the gains in the commands
    tolerance=1e-4,
)


def _settled(p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    """The last time at which the closed form reaches the limit."""
    if np.any(np.asarray(given["settled_below"]) <= 0.0):
        raise MechlabError(f"delta6: settled_below: expected more than 0 rad, got {np.min(given['settled_below']):g}.")
    e, de = _initial(given)
    found = closed.settling_time(e, de, p.velocity_gain, p.position_gain, given["settled_below"])
    return Answer({name: found[..., k] for k, name in enumerate(SETTLING)})


def _settled_by_steps(p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    """Steps of the matrix exponential, until the energy of the errors allows no more of them."""
    limit, state = float(given["settled_below"]), np.array(_initial(given), dtype=float)
    step = 0.1 / (p.velocity_gain + np.sqrt(p.position_gain))
    flow = _flow(p, step)
    crossings: dict[int, tuple[float, Array]] = {}  # the last one of each angle: time and state at the step before it
    t = 0.0
    # e'^2 + kp e^2 never grows
    while np.any(state[1] ** 2 + p.position_gain * state[0] ** 2 > p.position_gain * limit**2):
        after = flow @ state
        for k in np.flatnonzero((np.abs(state[0]) > limit) & (np.abs(after[0]) <= limit)):
            crossings[int(k)] = t, state[:, k]
        state, t = after, t + step
        if t > 1e6 * step:
            return Answer(cannot="the errors last longer than a million of its steps")

    def excess(x: float, before: Array) -> float:
        return abs(float((_flow(p, x) @ before)[0])) - limit

    last = [0.0, 0.0, 0.0]
    for angle, (begin, before) in crossings.items():
        last[angle] = begin + float(brentq(excess, 0.0, step, args=(before,), xtol=1e-14))
    return Answer(dict(zip(SETTLING, last, strict=True)))


SETTLED = Question(
    "settling of the head",
    given=("settled_below",),
    optional=INITIAL,
    answers=SETTLING,
    witnesses={"analytic": _settled, "exponential": _settled_by_steps},
    units=dict(ERROR.units) | {"settled_below": "rad"} | dict.fromkeys(SETTLING, "s"),
    text="time after which the error of each angle stays below a limit",
)

# -- dynamics ----------------------------------------------------------------------------------------------------------

PAIRS = tuple((i, j) for i in range(3) for j in range(i, 3))
MASSES = tuple(f"mass_{ANGLES[i]}_{ANGLES[j]}" for i, j in PAIRS)
BIASES = tuple(f"bias_{n}" for n in ANGLES)
TORQUES = tuple(f"{n}_torque" for n in ROTARY)
RATES = tuple(f"head_{n}_rate" for n in ANGLES)
ACCELS = tuple(f"head_{n}_accel" for n in ANGLES)
INERTIAS = tuple(f.name for f in fields(closed.HeadInertias))


def _terms(mass: Array, bias: Array, torques: Array) -> Answer:
    values: dict[str, Any] = {name: mass[..., i, j] for name, (i, j) in zip(MASSES, PAIRS, strict=True)}
    values |= {name: bias[..., k] for k, name in enumerate(BIASES)}
    return Answer(values | {name: torques[..., k] for k, name in enumerate(TORQUES)})


def _stacked(given: Mapping[str, Any], names: tuple[str, ...]) -> Array:
    shape = np.shape(given["head_beta"])
    return np.stack(np.broadcast_arrays(*(np.asarray(given[n], dtype=float) for n in names), np.zeros(shape))[:-1], -1)


def _head_analytic(p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    changed = {k: float(given[k]) for k in INERTIAS if k in given}
    if "planet_sense" in changed:
        changed["planet_sense"] = round(changed["planet_sense"])
    parts = replace(head_inertias(p), **changed)  # type: ignore[arg-type]
    beta, v, a = given["head_beta"], _stacked(given, RATES), _stacked(given, ACCELS)
    torques = closed.drive_torques(p.geometry, parts, beta, v, a)
    return _terms(closed.mass_matrix(p.geometry, parts, beta), closed.bias(parts, beta, v), torques)


def _head_engine(engine: str, p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    """An engine's mass matrix and velocity terms of all parts, along the motions that its own rows allow with O held."""
    strange = [k for k in INERTIAS if k in given]
    if strange:
        return Answer(cannot=f"it knows the head as it is built, not with another {strange[0]}")
    try:
        room(engine)
    except EngineMissing as missing:
        return Answer(cannot=str(missing))
    m = build(p, "parts")
    w: Witness = PinocchioWitness(m) if engine == "pinocchio" else MujocoWitness(m)
    q = coordinates(p, "parts", np.zeros(3), [0.0, float(given["head_beta"]), 0.0])[0]
    v, a = _stacked(given, RATES), _stacked(given, ACCELS)
    moves = response(w.at(q), (*CENTRE, *ANGLES))[:, 3:]
    resting = w.bias()
    mass = moves.T @ w.mass_matrix() @ moves
    bias = moves.T @ (w.at(q, moves @ v).bias() - resting)
    drives = np.array([m.row(n) for n in ROTARY]) @ moves
    return _terms(mass, bias, np.asarray(np.linalg.solve(drives.T, mass @ a + bias)))


HEAD = Question(
    "dynamics of the head",
    given=("head_beta",),
    optional=dict.fromkeys((*RATES, *ACCELS), 0.0) | dict.fromkeys(INERTIAS),
    answers=(*MASSES, *BIASES, *TORQUES),
    witnesses={
        "analytic": _head_analytic,
        "pinocchio": partial(_head_engine, "pinocchio"),
        "mujoco": partial(_head_engine, "mujoco"),
    },
    units={"head_beta": "rad", "planet_sense": ""}
    | dict.fromkeys(RATES, "rad/s")
    | dict.fromkeys(ACCELS, "rad/s2")
    | {k: "kg" if k.endswith("_mass") else "m" if k.endswith("_offset") else "kg m2" for k in INERTIAS[:-1]}
    | dict.fromkeys(MASSES, "kg m2")
    | dict.fromkeys((*BIASES, *TORQUES), "N m"),
    text="mass matrix and velocity terms of the head in alpha, beta, gamma, and the torques of the rotary drives, O held, "
    "without gravity",
)

HEAD_QUESTIONS = (ERROR, SETTLED, HEAD)
