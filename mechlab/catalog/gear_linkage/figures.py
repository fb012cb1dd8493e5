"""Figure 2 of the paper on gear-lever mechanisms: the regimes I to IV, and what play makes of the reverse motion."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import gear_linkage as closed_form
from mechlab.catalog.bibliography import GEAR_LEVERS
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


FIGURES = (
    SourceFigure(
        "figure 2", "The output is monotone (I), touches rest (III), or runs back by alpha_w while the crank turns by phi_w (II, IV).",
        GEAR_LEVERS, regimes, ("G5", "G6", "G7"),
    ),
)  # fmt: skip
