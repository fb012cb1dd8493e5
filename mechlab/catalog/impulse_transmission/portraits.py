"""Phase portraits, exact curves, Poincare map and bifurcation of the transmission."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic.impulse import (
    Impulse,
    constant_speed_acceleration,
    first_integral,
    shape,
    slip_speed,
    slope,
    unidirectional,
)
from mechlab.catalog.impulse_transmission.build import Parameters
from mechlab.catalog.impulse_transmission.scenes import simulate
from mechlab.errors import MechlabError
from mechlab.kit.portrait import Portrait, estimated_error, flow, grid, options, section
from mechlab.mechanism.geometry import Array

UNITS = {
    "t": "s", "alpha": "rad", "beta": "rad", "alpha_rate": "rad/s", "beta_rate": "rad/s", "motor_torque": "N m",
    "psi": "rad", "slip": "rad/s", "mean_speed": "rad/s", "M0": "N m", "M1": "N m",
}  # fmt: skip
WIDTH = 0.1
"""Least rate [rad/s] below which a portrait with friction is smoothed; the error is of this size in beta'."""
STATES = ("alpha", "beta", "alpha_rate", "beta_rate", "motor_torque")
DURATION, TIMESTEP, ROUGH_TIMESTEP = 0.1, 5e-4, 2.5e-4
SAMPLES_A_TURN = 60
"""Samples of a phase portrait in a turn of psi at the first input speed."""
MOST_POINTS = 1_000_000
"""Points of all curves of a phase portrait, beyond 101 of each: 40 MB."""
FOLLOWED = 3
"""Number of motions that are repeated with exact friction, to measure the error of the smoothed ones."""
TURNS, TURN_STEPS = 100, 100
"""Turns of psi of a Poincare map, and RK4 steps in each."""


def smoothing(i: Impulse, timestep: float) -> tuple[float, tuple[str, ...]]:
    """Rate below which friction is smoothed, wide enough for RK4 to be stable, and the note on it."""
    if i.M1 == 0.0:
        return 0.0, ()
    width = max(WIDTH, timestep * i.M1 / (shape(i).B3 - abs(shape(i).b3)))
    text = (
        f"dry friction is smoothed below {width:.3g} rad/s; `simulate --engine hybrid` follows single motions exactly"
    )
    return width, (text,)


def phase(p: Parameters, given: Mapping[str, Any]) -> Portrait:
    """Motions with the motor, from all combinations of the given initial states."""
    o = options(
        given, alpha_0=p.alpha_0, beta_0=np.linspace(-0.2, 0.2, 6), alpha_rate_0=p.alpha_rate_0,
        beta_rate_0=np.linspace(-30.0, 30.0, 6), motor_torque_0=p.motor_torque_0, duration=DURATION,
        timestep=ROUGH_TIMESTEP if p.M1 else TIMESTEP,
    )  # fmt: skip
    if p.static_motor:
        raise MechlabError(f"portrait: the motor torque is a state here and needs tau, got {p.tau:g} s.")
    duration, timestep = float(o["duration"]), float(o["timestep"])
    width, notes = smoothing(p.impulse, timestep)

    def f(t: float, y: Array) -> Array:
        return slope(p.impulse, y, width)

    start = np.column_stack(list(grid({s: o[f"{s}_0"] for s in STATES}).values()))
    t, y = flow(f, start, duration, timestep, _samples(p, duration, len(start)))
    arrays = {"t": t} | {name: y[:, :, k].T for k, name in enumerate(STATES)}
    if width:
        error = _against_events(p, start, y[-1], t[-1])
    else:
        error = f"estimated error {estimated_error(f, start, duration, timestep):.2g}"
    notes = (f"{len(start)} motions at once by RK4, step {timestep:g} s, {error}", *notes)
    return Portrait("phase", "phase portrait with the motor", "beta", "beta_rate", arrays, UNITS, notes=notes)


def _samples(p: Parameters, duration: float, motions: int) -> int:
    """Samples of a curve: enough for a smooth line, as a turn of psi is a loop of it; fewer where there are very many motions."""
    turns = abs(p.impulse.q) * p.alpha_rate_0 * duration / (2.0 * math.pi)
    return int(np.clip(SAMPLES_A_TURN * turns, 101, max(101, MOST_POINTS // motions)))


def _against_events(p: Parameters, start: Array, end: Array, duration: float) -> str:
    """How far a few of the motions end from those with exact friction, located events."""
    chosen = np.unique(np.linspace(0, len(start) - 1, FOLLOWED).round().astype(int))
    exact = []
    for state in start[chosen]:
        initial: dict[str, Any] = {f"{name}_0": float(x) for name, x in zip(STATES, state, strict=True)}
        exact.append(simulate(replace(p, **initial), np.array([0.0, duration]), 1e-9)[0][-1])
    off = np.abs(end[chosen] - exact).max(axis=0)
    return (
        f"off from exact friction at the end by {off[1]:.2g} rad in beta and {off[3]:.2g} rad/s in beta' "
        f"(largest of {len(chosen)} motions)"
    )


def _over_psi(i: Impulse, w: float, width: float) -> Callable[[float, Array], Array]:
    """d(beta, s^2, ended)/dpsi at constant input speed, s = w - beta'; vectorized over leading axes.

    s^2 is smooth where s vanishes and psi turns back, where beta' over psi has a pole; `ended` grows from there on.
    """

    def f(psi: float, y: Array) -> Array:
        moving = y[..., 1] > 0.0
        slip = np.sqrt(np.where(moving, y[..., 1], 1.0))
        v = w - slip
        resisting = i.M0 + (i.M1 * np.tanh(v / width) if width else 0.0)
        accel = constant_speed_acceleration(i, w, psi, v, resisting, y[..., 0])
        out = np.zeros_like(y)
        out[..., 0] = np.where(moving, v / (i.q * slip), 0.0)
        out[..., 1] = np.where(moving, -2.0 * accel / i.q, 0.0)
        out[..., 2] = ~moving
        return out

    return f


def poincare(p: Parameters, given: Mapping[str, Any]) -> Portrait:
    """Points (beta, beta') each time psi has grown by 2 pi, at constant input speed."""
    o = options(
        given, input_speed=p.nominal_speed, beta_0=np.linspace(-0.05, 0.05, 5), beta_rate_0=np.linspace(-30.0, 10.0, 9),
        turns=TURNS,
    )  # fmt: skip
    i, w, turns = p.impulse, float(o["input_speed"]), int(o["turns"])
    turn, step = 2.0 * math.pi, 2.0 * math.pi / TURN_STEPS
    width, notes = smoothing(i, 2.0 * math.pi / (TURN_STEPS * i.q * w))
    points = grid({"beta_0": o["beta_0"], "beta_rate_0": o["beta_rate_0"]})
    slip = w - points["beta_rate_0"]
    if not np.all(slip > 0.0):
        raise MechlabError(f"portrait poincare: beta_rate_0 must stay below input_speed = {w:g} rad/s.")
    start = np.column_stack([points["beta_0"], slip**2, np.zeros(len(slip))])
    f = _over_psi(i, w, width)
    y = section(f, start, turn, turns, TURN_STEPS)
    passed = y[:, :, 2] == 0.0
    values = {"beta": y[:, :, 0], "beta_rate": w - np.sqrt(np.maximum(y[:, :, 1], 0.0))}
    arrays = {name: np.where(passed, x, np.nan).T for name, x in values.items()}
    note = f"{len(start)} motions over {turns} turns of psi, {TURN_STEPS} steps of RK4 each"
    ended = int(np.count_nonzero(~passed[-1]))
    if ended:
        notes = (*notes, f"{ended} motions end: the output shaft reaches the input speed, psi turns back")
    few = start[passed[-1]]
    if len(few):
        error = estimated_error(f, few, turn * min(turns, 10), step)
        # What is integrated is (w - beta')^2, whose error is 2 w times that of beta'.
        note += f", estimated error of the steps after {min(turns, 10)} turns {error / (2.0 * w):.2g} rad/s in beta'"
    title = f"Poincare map at psi = 0 (mod 2 pi), {w:g} rad/s"
    return Portrait("poincare", title, "beta", "beta_rate", arrays, UNITS, True, (note, *notes))


def exact(p: Parameters, given: Mapping[str, Any]) -> Portrait:
    """Curves of the first integral at constant input speed (c = 0), for a constant resisting torque M0 and M1 = 0."""
    o = options(given, input_speed=p.nominal_speed, psi_0=0.0, beta_rate_0=np.linspace(-60.0, 60.0, 41), turns=1)
    i, w = p.impulse, float(o["input_speed"])
    if i.M1:
        raise MechlabError("portrait exact: friction changes its sign along a curve; set M1=0 (M0 may stay).")
    points = grid({"psi_0": o["psi_0"], "beta_rate_0": o["beta_rate_0"]})
    energy = first_integral(i, w, points["psi_0"], w - points["beta_rate_0"], i.M0)
    psi = points["psi_0"][:, None] + np.linspace(0.0, 2.0 * math.pi * float(o["turns"]), 361)
    slip = slip_speed(i, w, psi, energy[:, None], i.M0)
    arrays = {"psi": psi, "slip": slip, "beta_rate": w - slip, "energy": energy}
    note = "closed form: no integration; a curve ends where the output shaft reaches the input speed"
    return Portrait("exact", f"first integral at {w:g} rad/s", "psi", "beta_rate", arrays, UNITS, notes=(note,))


def bifurcation(p: Parameters, given: Mapping[str, Any]) -> Portrait:
    """Mean speed of one-way rotation over M0/M1, exact; NaN where there is no such regime."""
    o = options(
        given, input_speed=p.nominal_speed, ratio=np.linspace(0.0, 0.5, 201), friction=np.geomspace(1.0, 2000.0, 9)
    )
    friction, ratio = (np.atleast_1d(np.asarray(o[k], dtype=float)) for k in ("friction", "ratio"))
    w = float(o["input_speed"])
    M1, M0 = friction[:, None] * np.ones(len(ratio)), friction[:, None] * ratio
    found = unidirectional(p.impulse, w, M0, M1)
    ratios = np.broadcast_to(ratio, M0.shape)
    arrays = {"M0/M1": ratios, "mean_speed": found.mean_speed, "M0": M0, "M1": M1, "sine": found.sine}
    note = f"exact half-phases; the regime exists at {100 * float(np.mean(found.exists)):.3g} % of the points"
    title = f"mean output speed over M0/M1 at {w:g} rad/s, M1 = {friction.min():g} to {friction.max():g} N m"
    return Portrait("bifurcation", title, "M0/M1", "mean_speed", arrays, UNITS, notes=(note,))


PORTRAITS = {"phase": phase, "poincare": poincare, "exact": exact, "bifurcation": bifurcation}
