"""Claims of the source on the three-gear four-bar. It prints formulas and curves, and hardly a number."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mechlab.analytic import gear_linkage as closed_form
from mechlab.catalog.gear_linkage.build import build
from mechlab.catalog.gear_linkage.parameters import PRESETS, SOURCE, Parameters
from mechlab.catalog.gear_linkage.questions import MOTION
from mechlab.experiment.entry import Claim, ClaimResult, Verdict

EXAMPLES = {"L1": (1.0, 1.0, 0.5), "L2": (1.0, 0.8, 0.4), "L3": (0.9, 0.9, 0.3), "L4": (0.8, 1.0, 0.4)}
"""Coupler, rocker, idler radius in units of the frame: examples of ours, the source prints none."""
PHI = np.linspace(0.0, 2.0 * math.pi, 181)
TIGHT = 1e-8


def _linkages(share: float = 0.7) -> dict[str, closed_form.GearLinkage]:
    return {
        f"{name} {mode:+d}": closed_form.GearLinkage(share * closed_form.longest_crank(b, c), b, c, r, 1.0, mode)
        for name, (b, c, r) in EXAMPLES.items()
        for mode in (1, -1)
    }


def speed_formula() -> ClaimResult:
    """The printed similarity invariant against rolling, in both readings of its first coefficient."""
    worst = {"i - (i + ic) w2 + (1 + ic) w3": 0.0, "1 - (1 + i) w2 + (1 + ic) w3": 0.0}
    engines = 0.0
    for g in _linkages().values():
        x, (_, truth) = closed_form.motion(g, PHI), closed_form.rolling_rates(g, PHI)
        i, j = g.ratio, g.idler_ratio
        for name, value in zip(worst, (
            i - (i + j) * x.coupler_rate + (1 + j) * x.rocker_rate,
            1 - (1 + i) * x.coupler_rate + (1 + j) * x.rocker_rate,
        ), strict=True):  # fmt: skip
            worst[name] = max(worst[name], float(np.max(np.abs(value - truth))))
        p = Parameters(g.crank, g.coupler, g.rocker, g.frame, g.idler_radius, g.mode)
        for engine in ("pinocchio", "mujoco"):
            said = MOTION.witnesses[engine](p, {"crank_angle": 2.2, "crank_rate": 1.0, "crank_accel": 0.0})
            engines = max(engines, abs(said.values["output_rate"] - float(closed_form.rolling_rates(g, 2.2)[1])))
    computed = {f"{k}: largest error": v for k, v in worst.items()} | {"Pinocchio, MuJoCo against rolling": engines}
    right, other = worst.values()
    if right < TIGHT and engines < TIGHT and other > 0.1:
        return ClaimResult(
            computed, Verdict.HOLDS_ONLY_IF, "the damaged coefficients are read as i and (i + ic), not 1 and (1 + i)"
        )
    return ClaimResult(computed, Verdict.FAILS, "neither reading of the damaged coefficients follows from rolling")


def acceleration_formula() -> ClaimResult:
    """The printed acceleration against central differences of rolling."""
    h, worst = 1e-5, 0.0
    for g in _linkages().values():
        x = closed_form.motion(g, PHI)
        value = -(g.ratio + g.idler_ratio) * x.coupler_accel + (1 + g.idler_ratio) * x.rocker_accel
        ahead, behind = (closed_form.rolling_rates(g, PHI + s * h)[1] for s in (1, -1))
        worst = max(worst, float(np.max(np.abs(value - (ahead - behind) / (2 * h))) / np.max(np.abs(value))))
    computed = {"largest error against differences, relative": worst}
    # Truncation of the differences: h^2 / 6 times the third derivative over the first, which is below 1e3 here.
    return (
        ClaimResult(computed, Verdict.HOLDS)
        if worst < 1e-6
        else ClaimResult(computed, Verdict.FAILS, "it differs from rolling")
    )


def position_formula() -> ClaimResult:
    """The printed increment of the output angle against the integral of the rolling rate."""
    from scipy.integrate import solve_ivp

    worst = {"with i before the crank turn": 0.0, "without it": 0.0}
    for g in _linkages().values():
        run = solve_ivp(lambda t, y, g=g: [float(closed_form.rolling_rates(g, t)[1])], (0.4, 2.7), [0.0],
                        method="DOP853", rtol=1e-12, atol=1e-12)  # fmt: skip
        (a, b), (c, d) = (closed_form.angles(g, [0.4, 2.7])[k] for k in (0, 1))
        bars = -(g.ratio + g.idler_ratio) * (b - a) + (1 + g.idler_ratio) * (d - c)
        for name, factor in zip(worst, (g.ratio, 1.0), strict=True):
            worst[name] = max(worst[name], abs(float(factor * 2.3 + bars - run.y[0, -1])))
    computed = {f"{k}: largest error [rad]": v for k, v in worst.items()}
    if worst["with i before the crank turn"] < TIGHT:
        return ClaimResult(computed, Verdict.HOLDS_ONLY_IF, "the damaged first term is read as + i (phi_k - phi_n)")
    return ClaimResult(computed, Verdict.FAILS, "no reading follows from rolling")


def zero_crank() -> ClaimResult:
    """A vanishing crank: an ordinary gear train with a uniform output."""
    spread = {}
    for name, (b, c, r) in EXAMPLES.items():
        g = closed_form.GearLinkage(1e-9, b, c, r)
        spread[f"{name}: largest |w - i|"] = float(np.max(np.abs(closed_form.rate(g, PHI) - g.ratio)))
    if max(spread.values()) < 1e-7:
        return ClaimResult(spread, Verdict.HOLDS)
    return ClaimResult(spread, Verdict.FAILS, "the output is not uniform")


def three_regimes() -> ClaimResult:
    """Curves I, III and II: with a longer crank the rate stays positive, touches zero once, becomes negative."""
    computed: dict[str, object] = {}
    right = True
    for name, (b, c, r) in EXAMPLES.items():
        crank = closed_form.momentary_crank(b, c, r)
        lengths = (0.8 * crank, crank, 0.5 * (crank + closed_form.longest_crank(b, c)))
        found = [closed_form.regime(closed_form.GearLinkage(x, b, c, r)).regime for x in lengths]
        computed[f"{name}: crank of curve III"] = crank
        right &= found == [
            closed_form.OutputRegime.MONOTONE,
            closed_form.OutputRegime.MOMENTARY_DWELL,
            closed_form.OutputRegime.REVERSING,
        ]
    if right:
        return ClaimResult(computed, Verdict.HOLDS, "in all four examples, in this order")
    return ClaimResult(computed, Verdict.FAILS, "the order of the regimes differs")


def grows_with_crank() -> ClaimResult:
    """The non-uniformity grows with the crank."""
    growing = {}
    for name, (b, c, r) in EXAMPLES.items():
        top = closed_form.longest_crank(b, c)
        spans = []
        for share in np.linspace(0.05, 0.98, 25):
            w = closed_form.rate(closed_form.GearLinkage(float(share * top), b, c, r), PHI)
            spans.append(float(np.ptp(w)))
        growing[f"{name}: least growth of max - min per step"] = float(np.min(np.diff(spans)))
    if min(growing.values()) > 0.0:
        return ClaimResult(growing, Verdict.HOLDS)
    return ClaimResult(growing, Verdict.FAILS, "somewhere a longer crank is more uniform")


def dwell_within_play() -> ClaimResult:
    """With play of the size of the reverse motion: how long does the output stand?"""
    computed: dict[str, object] = {}
    ratios = []
    for name, (b, c, r) in EXAMPLES.items():
        found = closed_form.crank_for("reverse_angle", math.radians(2.0), b, c, r)
        g = closed_form.GearLinkage(found.crank or math.nan, b, c, r)
        report = closed_form.regime(g)
        phi = report.stop_angle + np.linspace(-1.0, 2.5, 70001)
        x = closed_form.motion(g, phi).output_angle
        held = closed_form.with_play(x, math.radians(2.0) * (1 + 1e-9))
        still = phi[:-1][np.diff(held) == 0.0]
        simulated = float(still[-1] - still[0])
        computed[f"{name}: phi_w, pushed output, formula [deg]"] = [
            math.degrees(a) for a in (report.dwell_angle, simulated, report.dwell_angle_one_sided)
        ]
        ratios.append(simulated / report.dwell_angle)
    computed["pushed / phi_w"] = ratios
    if min(ratios) > 1.3:
        return ClaimResult(
            computed, Verdict.HOLDS_ONLY_IF,
            "the output follows at once when the gears turn forward again; pushed from one side and held by friction it "
            "stands until it is caught up, about 1.5 times as long",
        )  # fmt: skip
    return ClaimResult(computed, Verdict.HOLDS)


def sheet_delivery() -> ClaimResult:
    """A monotone linkage with equal speeds where the sheet is gripped and a slow release."""
    g = Parameters(**PRESETS["sheet-delivery"]).linkage  # type: ignore[arg-type]
    report = closed_form.regime(g)
    at = closed_form.motion(g, report.fastest_angle)
    computed = {
        "fastest rate, its acceleration": [report.fastest_rate, float(at.output_accel)],
        "slowest rate": report.slowest_rate, "slowest / fastest": report.slowest_rate / report.fastest_rate,
    }  # fmt: skip
    slow = 0.0 < report.slowest_rate < 0.25 * report.fastest_rate
    if slow and abs(float(at.output_accel)) < 1e-6:
        return ClaimResult(
            computed,
            Verdict.HOLDS,
            "dimensions exist: at the grip the speed is stationary, at release a fraction of it",
        )
    return ClaimResult(computed, Verdict.FAILS, "these dimensions do not match the speed and release slowly")


def cutter_torque() -> ClaimResult:
    """The torque of the cutter's main shaft cannot be had without its loads and masses."""
    g = Parameters(**PRESETS["knife-drive"])  # type: ignore[arg-type]
    fastest = closed_form.regime(replace(g.linkage)).fastest_rate
    computed = {
        "drive torque / output torque: largest (power balance)": fastest,
        "bodies of our model": len(build(g, "minimal").bodies),
    }
    return ClaimResult(
        computed, Verdict.CANNOT, "the source gives neither dimensions, masses nor cutting force of the machine"
    )


CLAIMS = (
    Claim("G1", "p. 2, invariant of velocity", "w_d = i - (i + ic) w_2 + (1 + ic) w_3 (coefficients damaged in print)",
          "1~-(+ i)w2 + (1 + ic)w3", speed_formula, SOURCE),
    Claim("G2", "p. 2, invariant of acceleration", "e_d = -(i + ic) e_2 + (1 + ic) e_3", "-(i + ic)e2 + (1 + ic)e3",
          acceleration_formula, SOURCE),
    Claim("G3", "p. 2, increment of the output angle", "phi_dk = phi_dn + i(phi_k - phi_n) - (i + ic)(...) + (1 + ic)(...)",
          "damaged first term", position_formula, SOURCE),
    Claim("G4", "p. 1", "with crank 0 the linkage becomes an ordinary gear train with a uniform output", "uniform", zero_crank, SOURCE),
    Claim("G5", "p. 1", "the longer the crank, the stronger the non-uniformity", "grows", grows_with_crank, SOURCE),
    Claim("G6", "p. 1, fig. 2", "curves I, III, II: monotone, touching zero in one point, with reverse motion",
          "I, III, II", three_regimes, SOURCE),
    Claim("G7", "p. 1 and 3", "a reverse motion within the play of the gears makes the output stand while the crank turns by phi_w",
          "phi_w", dwell_within_play, SOURCE),
    Claim("G8", "p. 3", "a sheet-delivery transporter can match speeds at the grip and lay the sheet down slowly",
          "equal speeds, low speed", sheet_delivery, SOURCE),
    Claim("G9", "p. 3", "in the paper cutter BRP-125/450 the main-shaft torque falls about 1.8 times", 1.8, cutter_torque, SOURCE),
)  # fmt: skip
