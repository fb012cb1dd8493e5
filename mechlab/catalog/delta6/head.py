"""The orientation head with O held: the error of its control, when that has settled, and its dynamics. Three questions, and
what the checks need of the same quantities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic import delta6 as closed
from mechlab.analytic.roots import brentq
from mechlab.catalog.delta6 import masses
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.parameters import ANGLES, ROTARY, Delta6Parameters
from mechlab.catalog.delta6.poses import coordinates, response, rows_of, without_stops
from mechlab.catalog.delta6.scenes import head_tracking
from mechlab.engines.protocol import StatePlant, engine
from mechlab.errors import EngineMissing, MechlabError
from mechlab.experiment.question import Answer, Question
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.questions import by_name, for_engines, stacked
from mechlab.mechanism.geometry import Array

Given = Mapping[str, Any]

ERRORS = tuple(f"{n}_error" for n in ANGLES)
ERROR_RATES = tuple(f"{n}_error_rate" for n in ANGLES)
ERRORS_0, ERROR_RATES_0 = (tuple(f"{n}_0" for n in names) for names in (ERRORS, ERROR_RATES))
INITIAL = dict(zip(ERRORS_0, closed.SOURCE_START_ERRORS.tolist(), strict=True))
INITIAL |= dict(zip(ERROR_RATES_0, closed.SOURCE_START_ERROR_RATES.tolist(), strict=True))
"""Errors at t = 0, actual - target, and their rates: those of the source."""
COMMANDS = tuple(f"{n}_command" for n in ANGLES)
SETTLING = tuple(f"{n}_settling_time" for n in ANGLES)
LONGEST_RUN = 10.0
"""The engines follow the whole mechanism no longer than this [s]: 1 s takes them two or three."""


def error_flow(velocity_gain: float, position_gain: float, time: float) -> Array:
    """(2, 2) map of (e, e') at 0 to those at `time` [s] under e'' + kv e' + kp e = 0, by the matrix exponential."""
    from scipy.linalg import expm

    return np.asarray(expm(np.array([[0.0, 1.0], [-position_gain, -velocity_gain]]) * time))


def tracked_errors(name: str, p: Delta6Parameters, scene: Scene) -> tuple[Array, Array]:
    """(3,) errors of alpha, beta, gamma (actual - target) and their rates at the end of a run of head tracking by an engine.

    The whole mechanism runs under computed torque, O held. Raises EngineMissing.
    """
    # the fast root of the error law is near -kv: RK4 follows it up to kv h = 2.78
    step = min(0.97e-3, 0.5 / max(p.velocity_gain, 1.0))
    settings = Settings(timestep=step) if name == "mujoco" else Settings(engine=name, timestep=2.0 * step)
    recording = engine(name).run(build(p, "minimal"), scene, settings)
    wanted = closed.source_targets(scene.duration)
    angles, rates = (np.array([recording.channel(n + end)[-1] for n in ANGLES]) for end in ("", "_rate"))
    return angles - wanted.angles, rates - wanted.rates


def _initial(given: Given) -> tuple[Array, Array]:
    """(..., 3) errors of alpha, beta, gamma at t = 0, and their rates."""
    return stacked(given, ERRORS_0), stacked(given, ERROR_RATES_0)


def _times(given: Given) -> Array:
    time = np.asarray(given["time"], dtype=float)
    if np.any(time < 0.0):
        raise MechlabError(f"delta6: time: expected 0 s or more, got {float(time.min()):g}.")
    return time


def _responses(p: Delta6Parameters, time: ArrayLike, errors: Array, rates: Array) -> Answer:
    """Errors (..., 3) with their rates, and the commanded accelerations a_T - kv e' - kp e."""
    wanted = closed.source_targets(time).accelerations
    commands = wanted - p.velocity_gain * rates - p.position_gain * errors
    parts = {"error": errors, "error_rate": rates, "command": commands}
    return Answer({f"{n}_{part}": x[..., k] for k, n in enumerate(ANGLES) for part, x in parts.items()})


def _error_analytic(p: Delta6Parameters, given: Given) -> Answer:
    """e'' + kv e' + kp e = 0 in closed form."""
    time = _times(given)
    found = closed.error_response(time[..., None], *_initial(given), p.velocity_gain, p.position_gain)
    return _responses(p, time, found.error, found.error_rate)


def _error_exponential(p: Delta6Parameters, given: Given) -> Answer:
    time = float(_times(given))
    errors, rates = error_flow(p.velocity_gain, p.position_gain, time) @ np.array(_initial(given))
    return _responses(p, time, errors, rates)


def _error_engine(name: str, p: Delta6Parameters, given: Given) -> Answer:
    """The angles of the whole mechanism minus their targets at the end of a run."""
    time = float(_times(given))
    if time > LONGEST_RUN:
        return Answer(cannot=f"it follows the mechanism for {LONGEST_RUN:g} s at most")
    if time == 0.0:
        return Answer(cannot="nothing to follow at t = 0")
    errors, rates = _initial(given)
    free, start = without_stops(p), closed.source_targets(0.0)
    scene = head_tracking(free, "minimal")
    initial = {**scene.initial, **dict(zip(ANGLES, start.angles + errors, strict=True))}
    initial_rates = {**scene.initial_rates, **dict(zip(ANGLES, start.rates + rates, strict=True))}
    scene = replace(scene, duration=time, initial=initial, initial_rates=initial_rates)
    try:
        return _responses(p, time, *tracked_errors(name, free, scene))
    except EngineMissing as missing:
        return Answer(cannot=str(missing))


ERROR = Question(
    "error of the head",
    given=("time",),
    optional=INITIAL,
    answers=(*ERRORS, *ERROR_RATES, *COMMANDS),
    witnesses={"analytic": _error_analytic, "exponential": _error_exponential} | for_engines(_error_engine),
    units={"time": "s"}
    | dict.fromkeys((*ERRORS, *ERRORS_0), "rad")
    | dict.fromkeys((*ERROR_RATES, *ERROR_RATES_0), "rad/s")
    | dict.fromkeys(COMMANDS, "rad/s2"),
    text="error of alpha, beta, gamma (actual - target), its rate and the commanded acceleration, a time after the given "
    "initial errors, under the control with position_gain and velocity_gain",
    # softness of MuJoCo's loops and RK4 of both runs: 1e-8 rad measured, times the gains in the commands
    tolerance=1e-4,
)


def _settling_analytic(p: Delta6Parameters, given: Given) -> Answer:
    """The last time at which the closed form reaches the limit."""
    if np.any(np.asarray(given["settled_below"]) <= 0.0):
        raise MechlabError(f"delta6: settled_below: expected more than 0 rad, got {np.min(given['settled_below']):g}.")
    found = closed.settling_time(*_initial(given), p.velocity_gain, p.position_gain, given["settled_below"])
    return Answer(by_name(SETTLING, found))


def _settling_by_steps(p: Delta6Parameters, given: Given) -> Answer:
    """Steps of the matrix exponential, until the energy of the errors excludes that any exceeds the limit again."""
    limit, state = float(given["settled_below"]), np.array(_initial(given))
    kv, kp = p.velocity_gain, p.position_gain
    step = 0.1 / (kv + np.sqrt(kp))
    flow = error_flow(kv, kp, step)
    crossings: dict[int, tuple[float, Array]] = {}  # the last one of each angle: time and state at the step before it
    t = 0.0
    # e'^2 + kp e^2 never grows
    while np.any(state[1] ** 2 + kp * state[0] ** 2 > kp * limit**2):
        after = flow @ state
        for k in np.flatnonzero((np.abs(state[0]) > limit) & (np.abs(after[0]) <= limit)):
            crossings[int(k)] = t, state[:, k]
        state, t = after, t + step
        if t > 1e6 * step:
            return Answer(cannot="the errors last longer than a million of its steps")

    def excess(x: float, before: Array) -> float:
        return abs(float((error_flow(kv, kp, x) @ before)[0])) - limit

    last = [0.0, 0.0, 0.0]
    for angle, (begin, before) in crossings.items():
        last[angle] = begin + float(brentq(excess, 0.0, step, args=(before,), xtol=1e-14))
    return Answer(dict(zip(SETTLING, last, strict=True)))


SETTLED = Question(
    "settling of the head",
    given=("settled_below",),
    optional=INITIAL,
    answers=SETTLING,
    witnesses={"analytic": _settling_analytic, "exponential": _settling_by_steps},
    units=dict(ERROR.units) | {"settled_below": "rad"} | dict.fromkeys(SETTLING, "s"),
    text="time after which the error of each angle stays below a limit",
)

PAIRS = tuple((i, j) for i in range(3) for j in range(i, 3))
MASSES = tuple(f"mass_{ANGLES[i]}_{ANGLES[j]}" for i, j in PAIRS)
BIASES = tuple(f"bias_{n}" for n in ANGLES)
TORQUES = tuple(f"{n}_torque" for n in ROTARY)
RATES = tuple(f"head_{n}_rate" for n in ANGLES)
ACCELS = tuple(f"head_{n}_accel" for n in ANGLES)
INERTIAS = tuple(f.name for f in fields(closed.HeadInertias))


def head_inertias(p: Delta6Parameters) -> closed.HeadInertias:
    """The head as built: the default inertias of the closed form, and what follows from the parameters. The meshes are
    real external ones, so that the planets turn against the carrier. Numbers of gears and output link are written out
    here, not taken from `masses`, so that a slip there is seen."""
    spur, output_across = 4e-5, 4e-5
    shaft = p.rotor_inertia + masses.shaft_spin(p) + spur
    across = output_across + p.output_mass * p.head_offset**2
    return closed.HeadInertias(output_transverse=across, input_gear=shaft, third_shaft=shaft, planet_sense=-1)


def head_terms(w: StatePlant, q: Array, rates: Array) -> tuple[Array, Array, Array]:
    """(3, 3) mass matrix and (3,) velocity terms in alpha, beta, gamma at coordinates q with O held, without gravity; and
    (nv, 3) the motions of all coordinates per rate of the three angles that the witness's constraint rows allow."""
    moves = response(w.set(q))[:, 3:]
    resting = w.bias()
    mass = moves.T @ w.mass_matrix() @ moves
    return mass, moves.T @ (w.set(q, moves @ rates).bias() - resting), moves


def _terms(mass: Array, bias: Array, torques: Array) -> Answer:
    values: dict[str, Any] = {name: mass[..., i, j] for name, (i, j) in zip(MASSES, PAIRS, strict=True)}
    return Answer(values | by_name(BIASES, bias) | by_name(TORQUES, torques))


def _motion(given: Given) -> tuple[Array, Array]:
    """(..., 3) rates and accelerations of alpha, beta, gamma, as many as there are values of beta."""
    rates, accels = (stacked(given, ("head_beta", *names))[..., 1:] for names in (RATES, ACCELS))
    return rates, accels


def _dynamics_analytic(p: Delta6Parameters, given: Given) -> Answer:
    changed = {k: float(given[k]) for k in INERTIAS if k in given}
    if "planet_sense" in changed:
        changed["planet_sense"] = round(changed["planet_sense"])
    parts = replace(head_inertias(p), **changed)  # type: ignore[arg-type]
    beta, (rates, accels) = given["head_beta"], _motion(given)
    torques = closed.drive_torques(p.geometry, parts, beta, rates, accels)
    return _terms(closed.mass_matrix(p.geometry, parts, beta), closed.bias(parts, beta, rates), torques)


def _dynamics_engine(name: str, p: Delta6Parameters, given: Given) -> Answer:
    """The engine's mass matrix and velocity terms of all parts."""
    changed = [k for k in INERTIAS if k in given]
    if changed:
        return Answer(cannot=f"it knows the head as it is built, not with another {changed[0]}")
    try:
        w = engine(name).plant(build(p, "parts"))
    except EngineMissing as missing:
        return Answer(cannot=str(missing))
    q = coordinates(p, "parts", np.zeros(3), [0.0, float(given["head_beta"]), 0.0])[0]
    rates, accels = _motion(given)
    mass, bias, moves = head_terms(w, q, rates)
    drives = rows_of(w, ROTARY) @ moves
    return _terms(mass, bias, np.asarray(np.linalg.solve(drives.T, mass @ accels + bias)))


DYNAMICS = Question(
    "dynamics of the head",
    given=("head_beta",),
    optional=dict.fromkeys((*RATES, *ACCELS), 0.0) | dict.fromkeys(INERTIAS),
    answers=(*MASSES, *BIASES, *TORQUES),
    witnesses={"analytic": _dynamics_analytic} | for_engines(_dynamics_engine),
    units={"head_beta": "rad", "planet_sense": ""}
    | dict.fromkeys(RATES, "rad/s")
    | dict.fromkeys(ACCELS, "rad/s2")
    | {k: "kg" if k.endswith("_mass") else "m" if k.endswith("_offset") else "kg m2" for k in INERTIAS[:-1]}
    | dict.fromkeys(MASSES, "kg m2")
    | dict.fromkeys((*BIASES, *TORQUES), "N m"),
    text="mass matrix and velocity terms of the head in alpha, beta, gamma, and the torques of the rotary drives, O held, "
    "without gravity",
)

QUESTIONS = (ERROR, SETTLED, DYNAMICS)
