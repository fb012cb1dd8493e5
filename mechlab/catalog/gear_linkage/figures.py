"""Figure 2 of the paper on gear-lever mechanisms: the regimes I to IV, and what play makes of the reverse motion; the torque of the
knife drive that it proposes."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from mechlab.analytic import gear_linkage as closed_form
from mechlab.catalog.bibliography import GEAR_LEVERS
from mechlab.catalog.gear_linkage.claims_clutch import engage
from mechlab.catalog.gear_linkage.clutch import Parameters as ClutchParameters
from mechlab.catalog.gear_linkage.clutch import inertia
from mechlab.catalog.gear_linkage.knife import Parameters
from mechlab.experiment.figure import Curve, Drawing, Mark, Note, Panel, Reading, SourceFigure
from mechlab.mechanism.geometry import Array

SIZES = (1.0, 1.0, 0.5)
"""Coupler, rocker, idler radius in units of the frame: ours, the source prints none."""
REVERSE, PLAY = math.radians(30.0), math.radians(2.0)
"""Reverse angle alpha_w of the curves II and IV, large enough to be seen, and the play of the third part [rad]."""
PHI = np.linspace(0.0, 2.0 * math.pi, 721)
BLUE, RED, TEAL, BLACK = 0, 1, 2, 4


def crank_for(angle: float) -> float:
    """The crank at which the output runs back by that angle [rad]; raises where there is none."""
    found = closed_form.crank_for("reverse_angle", angle, *SIZES)
    return float(found.crank or math.nan)


def linkage(crank: float) -> closed_form.GearLinkage:
    """The linkage of the figure with that crank."""
    return closed_form.GearLinkage(crank, *SIZES)


def regimes() -> Drawing:
    """Transfer functions I, II, III, the position function IV, and the output with play."""
    third = closed_form.momentary_crank(*SIZES)
    cranks = {"I": 0.6 * third, "II": crank_for(REVERSE), "III": third}
    zeros = [len(_zeros(closed_form.rate(linkage(x), PHI))) for x in cranks.values()]
    one, two, three = _transfer(cranks), _position(cranks["II"]), _with_play()
    report = closed_form.regime(linkage(crank_for(PLAY)))
    return Drawing(
        (one, two, three),
        (
            Reading("zeros of the curves I, II, III in one turn (III touches)", [0, 2, 1], zeros),
            Reading("alpha_w of the curve IV", "drawn, without a number", math.degrees(REVERSE), "deg"),
            Reading("stop of the output over phi_w, play = alpha_w = 2 deg", 1.0,
                    report.dwell_angle_one_sided / report.dwell_angle),
        ),
        "The paper prints the marks without numbers: they stand where ours are. Coupler and rocker are 1, the idler 0.5 of the frame.", 3,
    )  # fmt: skip


def _zeros(values: Array) -> Array:
    """Places along PHI where the rate changes its sign; one where it touches zero without a change."""
    signs = np.flatnonzero(np.diff(np.sign(values)))
    return PHI[signs] if len(signs) else PHI[[np.argmin(values)]] if float(values.min()) < 1e-4 else PHI[:0]


def _transfer(cranks: dict[str, float]) -> Panel:
    report = closed_form.regime(linkage(cranks["II"]))
    curves = tuple(
        Curve(PHI, closed_form.rate(linkage(x), PHI), f"{name}: crank {x:.4g}", "thick" if name == "II" else "solid", color)
        for (name, x), color in zip(cranks.items(), (BLUE, RED, TEAL), strict=True)
    )
    middle = 0.5 * (report.stop_angle + report.turn_angle)
    return Panel(
        "Transfer functions I, II, III", "crank angle phi [rad]", "w_d / w_1", (*curves, Curve(PHI, 0.0 * PHI, "", "thin", BLACK)),
        (Mark("phi'", report.stop_angle), Mark("phi''", report.turn_angle)),
        (Note(f"phi_w = {report.dwell_angle:.3f}", 0.4, -1.3, (middle, 0.0)),), y_range=(-1.8, 4.0),
    )  # fmt: skip


def _position(crank: float) -> Panel:
    report = closed_form.regime(linkage(crank))
    phi = np.linspace(report.stop_angle - 1.6, report.turn_angle + 1.0, 400)
    x = closed_form.motion(linkage(crank), phi).output_angle
    stop, turn = (float(np.interp(a, phi, x)) for a in (report.stop_angle, report.turn_angle))
    return Panel(
        "Position function IV", "crank angle phi [rad]", "output angle phi_d [rad]",
        (Curve(phi, x, "IV: the output of II", "thick", RED),),
        (Mark("phi'", report.stop_angle), Mark("phi''", report.turn_angle), Mark("phi_d'", y=stop), Mark("phi_d''", y=turn)),
        (Note(f"alpha_w = {report.reverse_angle:.4f}", 4.3, turn - 0.55, (report.turn_angle, 0.5 * (stop + turn))),),
    )  # fmt: skip


def _with_play() -> Panel:
    g = linkage(crank_for(PLAY))
    report = closed_form.regime(g)
    phi = np.linspace(report.stop_angle - 0.6, report.stop_angle + 2.0, 1201)
    x = closed_form.motion(g, phi).output_angle
    pushed = closed_form.with_play(x, PLAY * (1.0 + 1e-9))
    stop = float(np.interp(report.stop_angle, phi, x))
    back = report.stop_angle + report.dwell_angle_one_sided
    return Panel(
        "Output with a play of 2 deg", "crank angle phi [rad]", "output from its stop [deg]",
        (Curve(phi, np.degrees(x - stop), "gears without play", "solid", BLUE),
         Curve(phi, np.degrees(pushed - pushed[0] + x[0] - stop), "pushed output, held by friction", "thick", TEAL)),
        (Mark("phi'", report.stop_angle), Mark("phi''", report.turn_angle)),
        (Note(f"the output stands for {report.dwell_angle_one_sided / report.dwell_angle:.2f} phi_w", report.stop_angle - 0.5, 2.2,
              (back, 0.0)),),
        y_range=(-4.0, 4.0),
    )  # fmt: skip


KNIVES, CLUTCH = Parameters(), ClutchParameters()


def knife_torque() -> Drawing:
    """Torque in the cut over the turn, and the factor by which it falls, over the mount and over the crank."""
    p = KNIVES
    best, factor = closed_form.best_mount(p.linkage, p.knife, 0.0)
    return Drawing(
        (_cut(best), _over_mount(), _over_crank(), _engagement()),
        (
            Reading("torque of the clutch over that of the linkage, crank 0.25, the clutch never rests", 1.8, factor),
            Reading("the same where the clutch rests for a quarter of the turn", 1.8, factor * 4.0 / 3.0),
            Reading("energy that an engagement of the clutch takes at 6 rad/s; in constant mesh none", "not printed", _lost(), "J"),
            Reading("cranks over frame that give 1.8 with that clutch", "not printed", _cranks_for(1.8, 0.5 * math.pi)),
        ),
        "Sizes of the entries knife_drive and knife_clutch, ours: the paper prints the factor alone. Stack 0.6 of the stroke, rod 3.5 "
        "throws.",
        2,
    )  # fmt: skip


def _shorter(share: float) -> closed_form.GearLinkage:
    return replace(KNIVES, crank=share * KNIVES.frame).linkage


def _cranks_for(factor: float, rest: float) -> list[float]:
    """Where the curve of the best factor over the crank passes `factor`, by interpolation."""
    x, y = SHARES, _best(rest) - factor
    cross = np.flatnonzero(np.diff(np.sign(y)))
    return [float(x[k] - y[k] * (x[k + 1] - x[k]) / (y[k + 1] - y[k])) for k in cross]


SHARES = np.linspace(0.04, 0.46, 22)


@lru_cache(maxsize=4)
def _best_at_once() -> Array:
    return np.array([closed_form.best_mount(_shorter(float(x)), KNIVES.knife, 0.0)[1] for x in SHARES])


def _best(rest: float) -> Array:
    """(n,) best factor for the cranks SHARES; a clutch that rests turns faster while it holds."""
    return _best_at_once() * closed_form.clutch_pace(rest)


def _cut(best: float) -> Panel:
    p, g = KNIVES, KNIVES.linkage
    up = 0.5 * math.pi - float(closed_form.pin_angle(g, closed_form.regime(g).slowest_angle))
    place, slope = p.knife.place(PHI)
    return Panel(
        "Torque in the cut for 1 N", "main shaft [rad]", "torque [N m]",
        (Curve(PHI, closed_form.cutting_torque(g, p.knife, best, PHI), "linkage, the cut in its slow part", "thick", TEAL),
         Curve(PHI, closed_form.cutting_torque(g, p.knife, up, PHI), "linkage, slow where the knife is up", "solid", RED),
         Curve(PHI, -slope * p.knife.cuts(place, slope), "clutch that never rests", "dashed", BLACK)),
    )  # fmt: skip


def _over_mount() -> Panel:
    mounts = np.linspace(0.0, 2.0 * math.pi, 121)
    curves = tuple(
        Curve(mounts, closed_form.torque_factor(_shorter(x), KNIVES.knife, mounts, 0.0), f"crank {x:g} of the frame", "solid", color)
        for x, color in ((0.1, BLUE), (0.25, TEAL), (0.44, RED))
    )
    return Panel("Factor over the mount of the pin", "mount [rad]", "clutch / linkage", curves, (Mark("1.8", y=1.8),), y_range=(0.0, 2.5))


def _over_crank() -> Panel:
    curves = tuple(
        Curve(SHARES, _best(rest), f"the clutch rests {math.degrees(rest):g} deg", "solid", color)
        for rest, color in ((0.0, BLUE), (0.25 * math.pi, TEAL), (0.5 * math.pi, RED))
    )
    return Panel("Best factor over the crank", "crank / frame", "clutch / linkage", curves, (Mark("1.8", y=1.8),), y_range=(0.0, 2.5))


def _lost() -> float:
    return closed_form.engagement(CLUTCH.flywheel, inertia(CLUTCH), CLUTCH.no_load, CLUTCH.clutch)[0]


def _engagement() -> Panel:
    """The clutch closes: speeds of both shafts under its friction torque, with the inertia of the resting crankshaft."""
    p, driven = CLUTCH, inertia(CLUTCH)
    slip = closed_form.engagement(p.flywheel, driven, p.no_load, p.clutch)[1]
    run = engage("mujoco", p)
    t = np.linspace(0.0, float(run.t[-1]), 121)
    slow, fast = (start + rate * np.minimum(t, slip) for start, rate in ((p.no_load, -p.clutch / p.flywheel), (0.0, p.clutch / driven)))
    found = np.array([run.channel("shaft_rate"), run.channel("crank_rate")])
    return Panel(
        f"A dry clutch closes: {_lost():.3g} J are lost", "time [ms]", "speed [rad/s]",
        (Curve(1e3 * t, slow, "main shaft with flywheel", "solid", BLUE), Curve(1e3 * t, fast, "crankshaft with the knives", "thick", TEAL),
         Curve([1e3 * run.t] * 2, found, "MuJoCo", "crosses", BLACK)),
        notes=(Note(f"slips for {1e3 * slip:.2g} ms\nwith {p.clutch:g} N m", 5.5, 2.2, (1e3 * slip, float(slow[-1]))),), y_range=(0.0, 7.0),
    )  # fmt: skip


FIGURES = (
    SourceFigure(
        "figure 2", "The output is monotone (I), touches rest (III), or runs back by alpha_w while the crank turns by phi_w (II, IV).",
        GEAR_LEVERS, regimes, ("G5", "G6", "G7"),
    ),
    SourceFigure(
        "knife drive, p. 3",
        "Torque of a three-knife cutter's main shaft: for which cranks and mounts it falls 1.8 times; what a clutch loses.",
        GEAR_LEVERS, knife_torque, ("G9", "G10"),
    ),
)  # fmt: skip
