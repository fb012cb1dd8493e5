"""The figures of the paper, ours against what can be read in them. As there: with the motor thick; at constant input speed dashed."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from mechlab.analytic.impulse import (
    Impulse,
    constant_speed_acceleration,
    harmonic_motion,
    motor_orbit,
    periodic_orbit,
    unidirectional,
)
from mechlab.analytic.impulse.regime import motion
from mechlab.catalog.bibliography import ALYUKOV
from mechlab.catalog.impulse_transmission.build import Parameters
from mechlab.catalog.impulse_transmission.ratio import AXES, CANDIDATES, fits
from mechlab.catalog.impulse_transmission.scenes import FIGURE_7, SPEED, at_constant_speed, of_scene, simulate
from mechlab.catalog.impulse_transmission.torque import best_load, over_load
from mechlab.experiment.figure import Curve, Drawing, Note, Panel, Reading, SourceFigure
from mechlab.kit.portrait import flow, section
from mechlab.mechanism.geometry import Array

SAMPLES = 801


def _ticks(low: float, high: float, step: float) -> tuple[float, ...]:
    """The numbers on a printed axis."""
    return tuple(round(low + k * step, 6) for k in range(round((high - low) / step) + 1))


BETA, RATE, TIME = "beta [rad]", "beta' [rad/s]", "t [s]"
TOLERANCE = 1e-7
"""Of the integrations: far below the width of a line."""


def _both(p: Parameters, duration: float, label: str, color: int) -> dict[str, tuple[Curve, Curve]]:
    """Curves with the motor and at constant speed: beta over t, beta' over t, beta' over beta."""
    t = np.linspace(0.0, duration, SAMPLES)
    y = simulate(p, t, TOLERANCE)[0]
    constant = at_constant_speed(p, duration)
    pairs = {"beta": ((t, y[:, 1]), (constant[0], constant[1])), "rate": ((t, y[:, 3]), (constant[0], constant[2])),
             "phase": ((y[:, 1], y[:, 3]), (constant[1], constant[2]))}  # fmt: skip
    return {
        name: (Curve(*motor, f"{label}, with the motor", "thick", color), Curve(*steady, f"{label}, constant input speed", "dashed", 4))
        for name, (motor, steady) in pairs.items()
    }


def _with_ratio(scene: str, q: str) -> Parameters:
    return replace(of_scene(scene), q=Fraction(q))


def figure_2() -> Drawing:
    """The first 0.08 s, for the default of q and for the candidate that fits the axis."""
    curves = [_both(_with_ratio("fig2", q), 0.08, f"q = {q}", k) for k, q in enumerate(("4/3", "3/5"))]
    ticks = _ticks(0.0, 0.08, 0.01)
    panels = (
        Panel("angle, as the caption says", TIME, BETA, tuple(c for x in curves for c in x["beta"]), printed_x=ticks),
        Panel("speed, as the unit on the axis says", TIME, RATE, tuple(c for x in curves for c in x["rate"]), printed_x=ticks,
              printed_y=(-4.0, 4.0)),
    )  # fmt: skip
    readings = tuple(
        Reading(f"numbers on the axis of beta' and range of the curve, q = {q}", (-4.0, 4.0), _extent(x["rate"][0].y), "rad/s")
        for q, x in zip(("4/3", "3/5"), curves, strict=True)
    )
    return Drawing(panels, readings)


def figure_3() -> Drawing:
    """The same over 0.45 s: the difference accumulates."""
    motor, constant = _both(of_scene("fig2"), 0.45, "q = 4/3", 0)["beta"]
    t = np.linspace(0.0, 0.45, SAMPLES)
    gap = np.asarray(motor.y) - np.interp(t, np.asarray(constant.x), np.asarray(constant.y))
    ticks = _ticks(0.0, 0.45, 0.05)
    panels = (
        Panel("output angle", TIME, BETA, (motor, constant), printed_x=ticks),
        Panel("with the motor less at constant speed", TIME, "difference of beta [rad]", (Curve(t, gap, color=0),), printed_x=ticks),
    )
    sizes = [_largest(gap[t <= end]) for end in (0.08, 0.45)]
    readings = (Reading("largest difference up to 0.08 s and to 0.45 s", "small, essential", sizes, "rad"),)
    return Drawing(panels, readings)


def figure_4() -> Drawing:
    """Phase paths near a periodic motion, for the default of q and the candidate that fits the axis best from the printed state."""
    panels, readings = [], []
    for k, q in enumerate(("4/3", "3/5")):
        found = _both(_with_ratio("fig4", q), 0.3, f"q = {q}", k)["phase"]
        panels.append(Panel(f"0.3 s from the printed state, q = {q}", BETA, RATE, found, printed_x=_ticks(-0.3, 0.3, 0.1)))
        readings.append(Reading(f"ends of the axis and of the curve, q = {q}", (-0.3, 0.3), _extent(found[0].x), "rad"))
    return Drawing(tuple(panels), tuple(readings))


def figure_5() -> Drawing:
    """One second of rotation: from rest as far as the figure is drawn, and the steady rotation of three candidates."""
    p = of_scene("fig5")
    t = np.concatenate([[0.0], np.linspace(4.0, 5.0, SAMPLES)])
    y = simulate(p, t, TOLERANCE)[0][1:, 1]
    curves = [Curve(t[1:], y - y[0] + 18.4, f"q = 4/3 from rest, with the motor, less {y[0] - 18.4:.3g} rad", "thick", 0)]
    readings = [Reading("turn between 4 s and 5 s, q = 4/3 from rest", 1.0, float(np.ptp(y)), "rad")]
    best = {f.q: f for f in reversed(fits()) if not f.order_exchanged}
    for k, q in enumerate(("4/3", "5/3", "4/2")):
        start = float(unidirectional(replace(p.impulse, q=CANDIDATES[q]), SPEED).psi_a) / CANDIDATES[q]
        time, beta, _ = at_constant_speed(replace(p, q=Fraction(q), alpha_0=start), 1.0)
        curves.append(Curve(time + 4.0, beta + 18.4, f"q = {q}, steady at 150 rad/s", "dashed", k))
        low, high = best[q].ranges["figure 5"]
        readings.append(Reading(f"turn within 1 s of the steady rotation, q = {q}", 1.0, high - low, "rad"))
    panel = Panel("18.4 rad at 4 s is given to each curve: a common shift of both angles is a motion too", TIME, BETA, tuple(curves),
                  printed_x=_ticks(4.0, 5.0, 0.2), printed_y=_ticks(18.4, 19.4, 0.2))  # fmt: skip
    return Drawing((panel,), tuple(readings))


def figure_7() -> Drawing:
    """The loops by the printed and the consistent formula, by shooting and with the motor; and the errors of the formulas."""
    i = FIGURE_7
    orbit = periodic_orbit(i, SPEED)
    t = np.linspace(0.0, orbit.period, 401)
    shot = motion(i, SPEED, orbit.start, orbit.period, t)
    formulas = {kind: harmonic_motion(i, SPEED, t, kind) for kind in ("printed", "consistent")}
    turns = simulate(of_scene("fig7"), np.linspace(0.0, 12 * orbit.period, 12 * 120 + 1), TOLERANCE)[0]
    loops = Panel(
        "loops", BETA, RATE,
        (
            Curve(turns[:, 1], turns[:, 3], "with the motor, 12 turns (thin in the paper too)", "thin", 4),
            Curve(shot[0], shot[1], "shooting, constant input speed", "thick", 0),
            Curve(*formulas["printed"], "formula (7) as printed", "dashed", 1),
            Curve(*formulas["consistent"], "all terms of the third order", "dotted", 2),
        ),
        printed_x=_ticks(-0.1, 0.08, 0.02), printed_y=(-10.0, 20.0),
    )  # fmt: skip
    phase = np.degrees(i.q * SPEED * t)
    errors = Panel(
        "errors of the formulas", "q w t [deg]", "beta less shooting [rad]",
        tuple(Curve(phase, formulas[kind][0] - shot[0], kind, style, color)
              for kind, style, color in (("printed", "dashed", 1), ("consistent", "solid", 2))),
    )  # fmt: skip
    readings = (
        Reading("ends of the axis and of the loop, beta", (-0.1, 0.08), _extent(shot[0]), "rad"),
        Reading("readable numbers on the axis and ends of the loop, beta'", (-10.0, 20.0), _extent(shot[1]), "rad/s"),
        Reading("largest error of the printed formula", "the curves coincide", _largest(formulas["printed"][0] - shot[0]), "rad"),
        Reading("share of its distance by which a neighbour comes nearer in a cycle, with the motor", "limit cycle",
                # a multiplier next to 1 holds two digits of it
                float(f"{motor_orbit(of_scene('fig7').impulse, np.array([0.0, SPEED, orbit.start[1], 0.0])).approach:.2g}")),
        Reading("largest error with all terms of the third order", "-", _largest(formulas["consistent"][0] - shot[0]), "rad"),
    )
    return Drawing((loops, errors), readings)


SETS_8 = (replace(FIGURE_7, c=57000.0), replace(FIGURE_7, c=34000.0, J2=0.4))
"""Sets of ours between the resonances of the first and second harmonic, of the size of the printed axes."""
PRINTED_8 = (_ticks(-0.1, 0.08, 0.02), _ticks(-0.25, 0.15, 0.05))


def figure_8() -> Drawing:
    """Loops of other shapes."""
    panels, readings = [], []
    for i, ticks, rates in zip(SETS_8, PRINTED_8, ((-20.0,), ()), strict=True):
        orbit = periodic_orbit(i, SPEED)
        t = np.linspace(0.0, orbit.period, 401)
        shot = motion(i, SPEED, orbit.start, orbit.period, t)
        kinds = (("printed", "formula (7) as printed", "dashed", 1), ("consistent", "all terms of the third order", "dotted", 2))
        formulas = tuple(Curve(*harmonic_motion(i, SPEED, t, kind), label, style, color) for kind, label, style, color in kinds)
        loops = (Curve(shot[0], shot[1], "shooting", "thick", 0), *formulas)
        title = f"J2 = {i.J2:g} kg m2, c = {i.c:g} N m/rad: ours"
        panels.append(Panel(title, BETA, RATE, loops, printed_x=ticks, printed_y=rates))
        readings.append(Reading(f"ends of the axis and of the loop, c = {i.c:g}", (ticks[0], ticks[-1]), _extent(shot[0]), "rad"))
    return Drawing(tuple(panels), tuple(readings), "The paper prints no parameters for this figure: only the axes are its own.")


SET_9 = replace(FIGURE_7, c=85000.0)
STARTS_9 = 24


def figure_9() -> Drawing:
    """Phase paths around a periodic motion, and where each crosses the section psi = 0."""
    i = SET_9
    orbit = periodic_orbit(i, SPEED)
    away = np.linspace(-0.02, 0.02, STARTS_9)
    start = np.column_stack([orbit.start[0] + away, np.full(STARTS_9, orbit.start[1])])

    def f(t: float, y: Array) -> Array:
        beta, rate = y[..., 0], y[..., 1]
        return np.stack([rate, constant_speed_acceleration(i, SPEED, i.q * (SPEED * t - beta), rate, 0.0, beta)], axis=-1)

    few = start[:: STARTS_9 // 4]
    _, y = flow(f, few, 4 * orbit.period, orbit.period / 200.0, 801)
    points = section(f, start, orbit.period, 80, 100)
    loop = motion(i, SPEED, orbit.start, orbit.period, np.linspace(0.0, orbit.period, 401))
    periodic = Curve(loop[0], loop[1], "periodic motion", "thick", 0)
    paths = (Curve(y[..., 0].T, y[..., 1].T, "4 turns from other states", "thin", 4), periodic)
    crossings = (
        Curve(points[..., 0].T, points[..., 1].T, f"{STARTS_9} motions, 80 turns", "dots", 4),
        Curve([orbit.start[0]], [orbit.start[1]], "periodic motion", "crosses", 0),
    )
    panels = (
        Panel("phase paths", BETA, RATE, paths, printed_x=(-0.04, -0.02, 0.0, 0.02)),
        Panel("the same, each time the input has turned by 2 pi / q", BETA, RATE, crossings),
    )
    readings = (Reading("ends of the axis and of the periodic motion", (-0.04, 0.02), _extent(loop[0]), "rad"),)
    text = f"The paper prints no parameters for this figure; c = {i.c:g} N m/rad is ours. No path comes nearer to the loop: nothing damps."
    return Drawing(panels, readings, text)


def figure_of_q() -> Drawing:
    """Misfit of each candidate of q in each figure."""
    rows = sorted(f for f in [(CANDIDATES[f.q], f) for f in fits() if not f.order_exchanged] if f)
    q = np.array([x for x, _ in rows])
    curves = [
        Curve(q, [max(f.misfits[name], 1e-3) for _, f in rows], axis.figure, style, k)
        for k, (style, (name, axis)) in enumerate(zip(("solid", "dashed", "dotted", "thick"), AXES.items(), strict=True))
    ]
    total = Curve(q, [f.total for _, f in rows], "root mean square", "crosses", 4)
    title = "how far the ends of the curves lie beyond a step of the printed grid"
    panel = Panel(title, "q", "misfit, over the span of the axis (0.001: none)", (*curves, total), log="y", x_range=(0.4, 2.05))
    readings = (
        Reading("q in the lists of figures 2, 4 and 5; the default, undecided", "4 over 5, g, 4 over 5",
                str(Fraction(Impulse().q).limit_denominator(9))),
        *_misfits(),
    )
    return Drawing((panel,), readings)


def _misfits() -> tuple[Reading, ...]:
    return tuple(
        Reading(f"misfit of q = {f.q}, torques {f.order}", "-", f.misfits | {"all": f.total, "all but figure 2": f.without("figure 2")})
        for f in fits()
    )


def torque() -> Drawing:
    """Mean torques over the load without a clutch, and over the output speed with one, at 150 rad/s."""
    base, M1 = Impulse(), 750.0
    load = np.linspace(0.0, 80.0, 81)
    found = unidirectional(base, SPEED, load, M1)
    forward, back = found.forward_time, found.return_time
    output = load + M1 * (forward - back) / (forward + back)
    turns_back = float(load[np.argmax(found.mean_speed < 0.0)])
    without = Panel(
        "without a clutch, M1 = 750 N m", "load M0 [N m]", "mean torque [N m]",
        (
            Curve(load, found.mean_motor_torque, "motor", "thick", 0), Curve(load, output, "output shaft", "dashed", 4),
            Curve(load, load, "useful: the load M0", "solid", 1),
        ),
        notes=(Note("from here on the load drives the shaft back", 1.0, 55.0, (turns_back, float(found.mean_motor_torque[0]))),),
    )  # fmt: skip
    over = over_load(base, SPEED)
    best, cycle = best_load(base, SPEED)
    with_clutch = Panel(
        "with a one-way clutch to the housing, without friction", "mean output speed [rad/s]", "mean torque [N m]",
        (
            Curve(over["speed"], over["motor"], "motor", "thick", 0),
            Curve(over["speed"], over["load"], "output shaft: the load M0", "solid", 1),
            Curve([cycle.mean_speed] * 2, [cycle.motor_torque, best], "largest useful power", "crosses", 4),
        ),
        log="y", y_range=(1.0, 4000.0), x_range=(0.0, 28.0),
    )  # fmt: skip
    fourth, fifth = (unidirectional(base, SPEED, *pair) for pair in ((18.0, M1), (0.0, 20.0)))
    useful = 18.0 * float(fourth.mean_speed)
    output_torque = float(np.interp(18.0, load, output))
    readings = (
        Reading("mean torque of the output shaft over that of the motor, figure 4, without a clutch", "transformed",
                output_torque / float(fourth.mean_motor_torque)),
        Reading("mean torque of the motor, figure 4, without a clutch: that of the output shaft is the same", "-",
                float(fourth.mean_motor_torque), "N m"),
        Reading("the same, figure 5", "-", float(fifth.mean_motor_torque), "N m"),
        Reading("share of the power that the load gets, figure 4, without a clutch", "-",
                useful / (float(fourth.mean_motor_torque) * SPEED)),
        Reading("with the clutch, largest useful power (optimize over M0)", "-", best * cycle.mean_speed, "W"),
        Reading("at the load, the motor torque", "-", [best, cycle.motor_torque], "N m"),
    )  # fmt: skip
    text = "The best load: mechlab optimize impulse_transmission M0=100:2700 M1=0 clutch_at_speed=150 --maximize useful_power"
    return Drawing((without, with_clutch), readings, text)


def _largest(x: Array) -> float:
    return float(np.abs(x).max())


def _extent(x: Any) -> tuple[float, float]:
    return float(np.min(x)), float(np.max(x))


FIGURES = (
    SourceFigure("figure 2", "Output over time, with the motor and at constant input speed.", ALYUKOV, figure_2, ("M11", "M16")),
    SourceFigure("figure 3", "The same over a longer time: the difference accumulates.", ALYUKOV, figure_3, ("M11",)),
    SourceFigure("figure 4", "Phase paths near a periodic motion, with the motor and at constant input speed.", ALYUKOV, figure_4,
                 ("M12", "M16")),
    SourceFigure("figure 5", "One-way rotation with high-frequency oscillation.", ALYUKOV, figure_5, ("M8", "M13", "M16")),
    SourceFigure("figure 7", "Periodic motions on a spring, by formula and by integration.", ALYUKOV, figure_7, ("M7", "M9", "M14")),
    SourceFigure("figure 8", "Periodic motions of other shapes.", ALYUKOV, figure_8, ("M15",)),
    SourceFigure("figure 9", "Examples of phase paths and periodic motions.", ALYUKOV, figure_9, ("M15",)),
    SourceFigure("transformation of torque", "Mean torques of motor and output shaft; what a one-way clutch to the housing changes.",
                 ALYUKOV, torque, ("M17",)),
    SourceFigure("ratio q", "Which q fits the readable axes: none fits all.", ALYUKOV, figure_of_q, ("M16",)),
)  # fmt: skip
