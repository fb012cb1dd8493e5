"""The torque converter of the paper's figure 1, which reacts on the housing: its claim, and its figure with a map of the efficiency."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic import differential as closed
from mechlab.catalog.bibliography import GEAR_CVT
from mechlab.catalog.closed_differential.checks import LAB, rounded, run, speeds
from mechlab.engines.protocol import WITNESSES as ENGINES
from mechlab.experiment.figure import Curve, Drawing, Panel, Reading, SourceFigure
from mechlab.kit.claims import Evidence, Ledger, above, below, evidence, fails, holds
from mechlab.mechanism.geometry import Array

LEDGER = Ledger(GEAR_CVT)
LOADS = (140.0, 170.0, 200.0, 220.0)
STARTS = ((100.0, 50.0), (60.0, 10.0))
SETTLED = 10.0
"""Time [s] after which less than 1e-3 rad/s is left of the start, at the slowest of these loads."""


@LEDGER.claim(
    "L8", "figure 1, p. 1", "With a torque converter, pump on wheel 1 and turbine on H2, the train is determinate and changes its ratio "
    "by itself with the load.", "determinate, adapts",
    holds("the reactor takes M_H2 - M_H1 from the housing, which the bare train lacks. (10) holds only for a converter without losses; "
          "with ours the ratio is {ratio:.4g} at twice the moment, the efficiency {efficiency:.3g}",
          when=below(1e-3, "spread", "drift") & above(0.0, "growth") & below(1e-3, "gap")),
    fails("the speeds depend on the start, or the ratio does not follow the load"),
)  # fmt: skip
def figure_1() -> Evidence:
    """The end of runs from two starts under four loads, with losses and without; engines started at the steady state."""
    computed: dict[str, Any] = {}
    spread, drift, gaps, ratios = [], [], [], []
    for name, lossless in (("torque-converter", False), ("lossless-converter", True)):
        for load in LOADS:
            ends = [speeds(run("analytic", replace(LAB, M_H2=load, w_H1_0=a, w_H2_0=b), name, SETTLED)) for a, b in STARTS]
            spread.append(max(abs(x - y) for x, y in zip(*ends, strict=True)))
            ratio = float(ends[0][0] / ends[0][1])
            computed[f"analytic: {name}, {load:g} N m: w_H1 / w_H2"] = rounded(ratio)
            if lossless:
                gaps.append(abs(ratio - load / LAB.M_H1))
            else:
                ratios.append(ratio)
    state = closed.converter_state(LAB.train, LAB.converter(), LAB.M_H1, LAB.M_H2)
    for who in ENGINES:
        h1, h2 = speeds(run(who, replace(LAB, w_H1_0=state.w_H1, w_H2_0=state.w_H2), "torque-converter", 0.2, "minimal"))
        computed[f"{who}: steady w_H1, w_H2 at 200 N m"] = rounded([h1, h2], 6)
        drift += [abs(h1 - state.w_H1), abs(h2 - state.w_H2)]
    return evidence(computed, spread=spread, drift=drift, growth=np.diff(ratios), gap=gaps, ratio=ratios[2],
                    efficiency=state.efficiency)  # fmt: skip


CLAIMS = LEDGER.claims
BLUE, RED, TEAL, BLACK, GOLD = 0, 1, 2, 4, 5


def adapting() -> Drawing:
    """Ratio and efficiency over the load ratio, and the map of the efficiency."""
    r, s = closed.shares(LAB.train)
    mu = np.linspace(s + r + 1e-6, s + r * LAB.converter_stall - 1e-6, 200)
    ratios, efficiencies = {}, {}
    for lossless in (True, False):
        states = [closed.converter_state(LAB.train, LAB.converter(lossless), LAB.M_H1, float(x) * LAB.M_H1) for x in mu]
        ratios[lossless] = np.array([x.w_H1 / x.w_H2 for x in states])
        efficiencies[lossless] = np.array([x.efficiency for x in states])
    at_two = closed.converter_state(LAB.train, LAB.converter(), LAB.M_H1, 2.0 * LAB.M_H1)
    return Drawing(
        (_ratio(mu, ratios), _efficiency(mu, efficiencies), _map()),
        (
            Reading("w_H1 / w_H2 at twice the moment: by (10), and with a converter without losses", 2.0,
                    float(np.interp(2.0, mu, ratios[True]))),
            Reading("the same with losses", 2.0, at_two.w_H1 / at_two.w_H2),
            Reading("moment of the reactor on the housing there", "not printed", at_two.reactor, "N m"),
            Reading("efficiency there", 1.0, at_two.efficiency),
        ),
        "The converter is ours (moment ratio 5 at stall, best efficiency 0.85); the paper draws one without data.", 3,
    )  # fmt: skip


def _ratio(mu: Array, ratios: dict[bool, Array]) -> Panel:
    points = []
    for lossless, name in ((True, "lossless-converter"), (False, "torque-converter")):
        for load in LOADS[::2]:
            state = closed.converter_state(LAB.train, LAB.converter(lossless), LAB.M_H1, load)
            near = replace(LAB, M_H2=load, w_H1_0=0.98 * state.w_H1, w_H2_0=1.02 * state.w_H2)
            h1, h2 = speeds(run("mujoco", near, name, 2.0))
            points.append((load / LAB.M_H1, h1 / h2))
    x, y = np.array(points).T
    return Panel(
        "Ratio over the load", "M_H2 / M_H1", "w_H1 / w_H2",
        (Curve(mu, ratios[True], "converter without losses", "thick", TEAL), Curve(mu, ratios[False], "with losses", "solid", BLUE),
         Curve(mu, mu, "printed law (10)", "dashed", BLACK), Curve(x, y, "MuJoCo, 2 s", "crosses", BLACK)),
        y_range=(0.0, 8.0),
    )  # fmt: skip


def _efficiency(mu: Array, efficiencies: dict[bool, Array]) -> Panel:
    return Panel(
        "Efficiency", "M_H2 / M_H1", "M_H2 w_H2 / (M_H1 w_H1)",
        (Curve(mu, efficiencies[True], "converter without losses", "thick", TEAL),
         Curve(mu, efficiencies[False], "with losses", "solid", BLUE)),
        y_range=(0.0, 1.1),
    )  # fmt: skip


def _map() -> Panel:
    """Lines of one efficiency (one load ratio): M_H2 grows with the square of w_H2; and lines of one input moment."""
    top, fast = 400.0, 120.0
    lines = []
    for mu, color in ((1.2, TEAL), (1.5, BLUE), (1.8, GOLD), (2.1, RED)):
        one = closed.converter_state(LAB.train, LAB.converter(), 100.0, 100.0 * mu)
        w = np.linspace(0.0, min(fast, one.w_H2 * np.sqrt(top / (100.0 * mu))), 60)
        lines.append(Curve(w, 100.0 * mu * (w / one.w_H2) ** 2, f"load ratio {mu:g}: efficiency {one.efficiency:.2f}", "solid", color))
    inputs = []
    for moment in (50.0, 100.0, 150.0):
        states = [closed.converter_state(LAB.train, LAB.converter(), moment, moment * float(x)) for x in np.linspace(1.05, 2.33, 60)]
        inputs.append(([x.w_H2 for x in states], [x.reactor + moment for x in states]))
    x, y = np.array(inputs).transpose(1, 0, 2)
    lines.append(Curve(np.where(x < fast, x, np.nan), y, "M_H1 = 50, 100, 150 N m", "thin", BLACK))
    return Panel(
        "Map with losses", "w_H2 [rad/s]", "M_H2 [N m]", tuple(lines), x_range=(0.0, fast), y_range=(0.0, top),
    )  # fmt: skip


FIGURES = (
    SourceFigure(
        "figure 1", "The train with a torque converter on wheel 1 and H2: what it makes of the law (10), and at which efficiency.",
        GEAR_CVT, adapting, ("L8", "L3"),
    ),
)  # fmt: skip
