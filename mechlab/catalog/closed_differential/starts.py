"""Starting: the claims that the output starts by itself and that a braked wheel starts it, and their figure, with the blocks that
run apart under the moments of the example."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic import differential as closed
from mechlab.catalog.bibliography import GEAR_CVT
from mechlab.catalog.closed_differential.checks import LAB, SOLVERS, rounded, run, speeds
from mechlab.experiment.figure import Curve, Drawing, Mark, Note, Panel, Reading, SourceFigure
from mechlab.kit.claims import Evidence, Ledger, above, below, evidence, fails, holds, only_if
from mechlab.mechanism.geometry import Array

LEDGER = Ledger(GEAR_CVT)
REST = replace(LAB, w_H1_0=0.0, w_H2_0=0.0)
SHORT = 0.05
"""Duration [s] of the runs for the claims: two engines take each step, and an output that starts has some rad/s by then."""
STANDS = 1e-3
"""Speed [rad/s] below which the output stands: above the rounding of the engines, far below the speeds of a start."""


@LEDGER.claim(
    "L9", "starting, before (1)", "Moved by the input moment alone, the whole chain comes into motion.", "M_H2,start",
    holds("against 200 N m, below the printed {printed:.4g} N m", when=above(STANDS, "*: w_H2 against 200 N m")),
    fails("from rest against a dry load of 200 N m the output never starts, though the printed formula allows {printed:.4g} N m: the "
          "input runs away, and the moment on the output stays at the inertial {true:.4g} N m. It starts against less",
          when=below(STANDS, "*: w_H2 against 200 N m") & above(STANDS, "*: w_H2 against 90 N m")),
    fails("the output starts against neither load"),
)  # fmt: skip
def dry_start() -> Evidence:
    """A twentieth of a second from rest against dry loads on both sides of the moment that a held output feels."""
    computed: dict[str, Any] = {}
    for load in (200.0, 90.0):
        for who in SOLVERS:
            h1, h2 = speeds(run(who, replace(REST, M_H2=load), "dry-start", SHORT, "minimal"))
            computed[f"{who}: w_H2 against {load:g} N m"] = rounded(h2, 6)
            computed[f"{who}: w_H1 then, {load:g} N m"] = rounded(h1, 6)
    true = float(closed.held_output_moment(LAB.train, closed.mass_matrix(LAB.train, LAB.inertias), LAB.M_H1))
    return evidence(computed, printed=float(closed.start_moment(LAB.train, LAB.M_H1)), true=true)


@LEDGER.claim(
    "L10", "p. 2, on the patents",
    "To start, when the train passes from one freedom to two, one of the wheels is braked.", "a braked wheel",
    holds("also when the brake is released", when=above(STANDS, "*: block 36 braked", "*: block 14 braked", "*: then released")),
    only_if("it is block 36, and as long as it is braked: the train is then an ordinary gear of ratio {ratio:g}; with block 14 braked, "
            "of ratio {other:.4g}, it does not start. Released, it has two freedoms again and the output stops",
            when=above(STANDS, "*: block 36 braked") & below(STANDS, "*: block 14 braked", "*: then released")),
    fails("no braked wheel starts the output"),
)  # fmt: skip
def braked_start() -> Evidence:
    """Output speed against 200 N m, a twentieth of a second after the start with either block braked, and after the release at 2 rad/s."""
    computed: dict[str, Any] = {}
    after = replace(LAB, w_H1_0=8.0, w_H2_0=2.0)
    for who in SOLVERS:
        computed[f"{who}: block 36 braked"] = rounded(speeds(run(who, REST, "braked-start", SHORT, "minimal"))[1], 6)
        computed[f"{who}: then released"] = rounded(speeds(run(who, after, "brake-released", SHORT, "minimal"))[1], 6)
    ratio, other = closed.braked_ratios(LAB.train)
    computed["analytic: block 14 braked"] = rounded(max(braked_acceleration(other, LAB.M_H2), 0.0))
    return evidence(computed, ratio=ratio, other=other)


def braked_acceleration(ratio: float, load: float) -> float:
    """w_H2' [rad/s2] from rest while w_H1 = ratio x w_H2: (ratio M_H1 - load) over the inertia reduced to H2; below 0: it stands."""
    u = np.array([ratio, 1.0])
    inertia = closed.carrier_mass_matrix(LAB.train, closed.mass_matrix(LAB.train, LAB.inertias))
    return (ratio * LAB.M_H1 - load) / float(u @ inertia @ u)


CLAIMS = LEDGER.claims
BLUE, RED, TEAL, BLACK, GOLD = 0, 1, 2, 4, 5


def starting() -> Drawing:
    """The blocks of the example run apart; the start over time; and over the load."""
    t = np.linspace(0.0, 0.5, 101)
    J = closed.mass_matrix(LAB.train, LAB.inertias)
    now = closed.speeds(LAB.train, w_H1=LAB.w_H1_0, w_H2=LAB.w_H2_0)
    start = np.array([now.w1, now.w3], dtype=float)
    slope = np.linalg.solve(J, closed.block_torques(LAB.train, LAB.M_H1, LAB.M_H2))
    held = float(closed.held_output_moment(LAB.train, J, LAB.M_H1))
    return Drawing(
        (_apart(t, start + np.outer(t, slope)), _over_time(), _over_load(held)),
        (
            Reading("speeds of blocks 14 and 36 in the example; ours 0.1 s later", [200.0, 33.33], [float(x) for x in start + 0.1 * slope],
                    "rad/s"),
            Reading("load that the input moment of 100 N m starts: formula as printed; ours",
                    float(closed.start_moment(LAB.train, LAB.M_H1)),
                    held, "N m"),
            Reading("the same with block 36 braked", "not printed", closed.braked_ratios(LAB.train)[0] * LAB.M_H1, "N m"),
        ),
        "The train of the lab has the ratios of the example; its inertias are ours, the paper prints none.", 3,
    )  # fmt: skip


def _apart(t: Array, w: Array) -> Panel:
    found = run("mujoco", LAB, "constant-moments", 0.5)
    pick = np.linspace(0, len(found.t) - 1, 6).round().astype(int)
    dots = np.array([found.channel(f"block_{n}_rate")[pick] for n in (14, 36)])
    return Panel(
        "Constant moments: the blocks run apart", "time [s]", "speed [rad/s]",
        (Curve(t, w[:, 0], "block 14, w1", "solid", BLUE), Curve(t, w[:, 1], "block 36, w3", "solid", RED),
         Curve([found.t[pick]] * 2, dots, "MuJoCo", "crosses", BLACK)),
        (Mark("200", 0.0, 200.0), Mark("33.33", 0.0, 33.33)),
    )  # fmt: skip


def _over_time() -> Panel:
    curves = []
    for text, p, scene, shift, color in (
        ("alone: w_H2", REST, "dry-start", 0.0, RED),
        ("block 36 braked: w_H2", REST, "braked-start", 0.0, TEAL),
    ):
        found = run("analytic", p, scene, 0.6)
        curves.append(Curve(found.t + shift, found.channel("H2_rate"), text, "thick", color))
        if scene == "dry-start":
            curves.append(Curve(found.t, found.channel("H1_rate"), "alone: w_H1", "solid", BLUE))
    braked = run("analytic", REST, "braked-start", 0.6)
    h1, h2 = (float(x) for x in speeds(braked))
    after = run("analytic", replace(LAB, w_H1_0=h1, w_H2_0=h2), "brake-released", 0.6)
    curves.append(Curve(after.t + 0.6, after.channel("H2_rate"), "brake released: w_H2", "thick", GOLD))
    return Panel("From rest against 200 N m, dry", "time [s]", "speed [rad/s]", tuple(curves), y_range=(-5.0, 130.0))


def _over_load(held: float) -> Panel:
    load = np.linspace(0.0, 450.0, 451)
    free = np.linalg.inv(closed.carrier_mass_matrix(LAB.train, closed.mass_matrix(LAB.train, LAB.inertias)))
    alone = 0.5 * np.maximum(free[1, 0] * LAB.M_H1 - free[1, 1] * load, 0.0)
    ratio, other = closed.braked_ratios(LAB.train)
    braked, wrong = (0.5 * np.maximum([braked_acceleration(r, float(x)) for x in load], 0.0) for r in (ratio, other))
    return Panel(
        "Output speed after 0.5 s", "dry load M_H2 [N m]", "w_H2 [rad/s]",
        (Curve(load, alone, f"alone: starts below {held:.4g} N m", "solid", RED),
         Curve(load, braked, f"block 36 braked: below {ratio * LAB.M_H1:.4g} N m", "solid", TEAL),
         Curve(load, wrong, f"block 14 braked: below {other * LAB.M_H1:.4g} N m", "solid", BLUE)),
        (Mark("M_H2,start", float(closed.start_moment(LAB.train, LAB.M_H1))),),
        (Note("the load of\nthe example", 250.0, 28.0, (200.0, 0.0)),), y_range=(0.0, 50.0),
    )  # fmt: skip


FIGURES = (
    SourceFigure(
        "starting and the example", "The blocks run apart where the paper has equilibrium; what starts the output, and what does not.",
        GEAR_CVT, starting, ("E1", "K4", "K6", "L9", "L10"),
    ),
)  # fmt: skip
