"""Claims of the source on the three-gear four-bar. It prints formulas and curves, and hardly a number."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic import gear_linkage as closed_form
from mechlab.catalog.bibliography import GEAR_LEVERS
from mechlab.catalog.gear_linkage.build import PRESETS, Parameters
from mechlab.catalog.gear_linkage.knife import Parameters as KnifeDrive
from mechlab.catalog.gear_linkage.knife import build as build_knives
from mechlab.catalog.gear_linkage.questions import MOTION
from mechlab.engines.protocol import WITNESSES as ENGINES
from mechlab.kit.claims import Evidence, Ledger, above, below, cannot, evidence, fails, holds, only_if, true, unreadable
from mechlab.kit.path_motion import EngineMotion

LEDGER = Ledger(GEAR_LEVERS)
EXAMPLES = {"L1": (1.0, 1.0, 0.5), "L2": (1.0, 0.8, 0.4), "L3": (0.9, 0.9, 0.3), "L4": (0.8, 1.0, 0.4)}
"""Coupler, rocker, idler radius in units of the frame: examples of ours, the source prints none."""
PHI = np.linspace(0.0, 2.0 * math.pi, 181)
TIGHT = 1e-8


def _linkages(share: float = 0.7) -> list[closed_form.GearLinkage]:
    return [
        closed_form.GearLinkage(share * closed_form.longest_crank(b, c), b, c, r, 1.0, mode)
        for b, c, r in EXAMPLES.values()
        for mode in (1, -1)
    ]


@LEDGER.claim(
    "G1", "p. 2, invariant of velocity", "w_d = i - (i + ic) w_2 + (1 + ic) w_3 (coefficients damaged in print)",
    "1~-(+ i)w2 + (1 + ic)w3",
    unreadable("i and (i + ic) must stand there, as in the accelerations below it; 1 and (1 + i) do not follow from rolling",
            when=below(TIGHT, "i - *", "Pinocchio, MuJoCo*") & above(0.1, "1 - *")),
    fails("neither reading of the damaged coefficients follows from rolling"),
)  # fmt: skip
def speed_formula() -> Evidence:
    """The printed similarity invariant against rolling, in both readings of its first coefficient."""
    worst = {"i - (i + ic) w2 + (1 + ic) w3": 0.0, "1 - (1 + i) w2 + (1 + ic) w3": 0.0}
    engines = 0.0
    for g in _linkages():
        x, (_, truth) = closed_form.motion(g, PHI), closed_form.rolling_rates(g, PHI)
        i, j = g.ratio, g.idler_ratio
        for name, value in zip(worst, (
            i - (i + j) * x.coupler_rate + (1 + j) * x.rocker_rate,
            1 - (1 + i) * x.coupler_rate + (1 + j) * x.rocker_rate,
        ), strict=True):  # fmt: skip
            worst[name] = max(worst[name], float(np.max(np.abs(value - truth))))
        p = Parameters(g.crank, g.coupler, g.rocker, g.frame, g.idler_radius, g.mode)
        for engine in ("pinocchio", "mujoco"):
            answer = MOTION.witnesses[engine](p, {"crank_angle": 2.2, "crank_rate": 1.0, "crank_accel": 0.0})
            engines = max(engines, abs(answer.values["output_rate"] - float(closed_form.rolling_rates(g, 2.2)[1])))
    return evidence(
        {f"{k}: largest error": v for k, v in worst.items()} | {"Pinocchio, MuJoCo against rolling": engines}
    )


@LEDGER.claim(
    "G2", "p. 2, invariant of acceleration", "e_d = -(i + ic) e_2 + (1 + ic) e_3", "-(i + ic)e2 + (1 + ic)e3",
    # Truncation of the differences: h^2 / 6 times the third derivative over the first, which is below 1e3 here.
    holds(when=below(1e-6, "largest error against differences, relative")),
    fails("it differs from rolling"),
)  # fmt: skip
def acceleration_formula() -> Evidence:
    """The printed acceleration against central differences of rolling."""
    h, worst = 1e-5, 0.0
    for g in _linkages():
        x = closed_form.motion(g, PHI)
        value = -(g.ratio + g.idler_ratio) * x.coupler_accel + (1 + g.idler_ratio) * x.rocker_accel
        ahead, behind = (closed_form.rolling_rates(g, PHI + s * h)[1] for s in (1, -1))
        worst = max(worst, float(np.max(np.abs(value - (ahead - behind) / (2 * h))) / np.max(np.abs(value))))
    return evidence({"largest error against differences, relative": worst})


@LEDGER.claim(
    "G3", "p. 2, increment of the output angle", "phi_dk = phi_dn + i(phi_k - phi_n) - (i + ic)(...) + (1 + ic)(...)",
    "damaged first term",
    unreadable("+ i (phi_k - phi_n) must stand there; without i it does not follow from rolling",
               when=below(TIGHT, "with i before the crank turn*") & above(0.1, "without it*")),
    fails("no reading follows from rolling"),
)  # fmt: skip
def position_formula() -> Evidence:
    """The printed increment of the output angle against the integral of the rolling rate."""
    worst = {"with i before the crank turn": 0.0, "without it": 0.0}
    # 100 Gauss points leave 1e-15 of the integral: the rate is smooth there.
    places, weights = np.polynomial.legendre.leggauss(100)
    for g in _linkages():
        turned = 1.15 * float(weights @ closed_form.rolling_rates(g, 1.55 + 1.15 * places)[1])
        (a, b), (c, d) = (closed_form.angles(g, [0.4, 2.7])[k] for k in (0, 1))
        bars = -(g.ratio + g.idler_ratio) * (b - a) + (1 + g.idler_ratio) * (d - c)
        for name, factor in zip(worst, (g.ratio, 1.0), strict=True):
            worst[name] = max(worst[name], abs(float(factor * 2.3 + bars - turned)))
    return evidence({f"{k}: largest error [rad]": v for k, v in worst.items()})


@LEDGER.claim(
    "G4", "p. 1", "with crank 0 the linkage becomes an ordinary gear train with a uniform output", "uniform",
    holds(when=below(1e-7, "*: largest |w - i|")),
    fails("the output is not uniform"),
)  # fmt: skip
def zero_crank() -> Evidence:
    """A vanishing crank: an ordinary gear train with a uniform output."""
    spread = {}
    for name, (b, c, r) in EXAMPLES.items():
        g = closed_form.GearLinkage(1e-9, b, c, r)
        spread[f"{name}: largest |w - i|"] = float(np.max(np.abs(closed_form.rate(g, PHI) - g.ratio)))
    return evidence(spread)


@LEDGER.claim(
    "G5", "p. 1", "the longer the crank, the stronger the non-uniformity", "grows",
    holds(when=above(0.0, "*: least growth of max - min per step")),
    fails("somewhere a longer crank is more uniform"),
)  # fmt: skip
def grows_with_crank() -> Evidence:
    """The difference of largest and smallest output rate for 25 crank lengths."""
    growing = {}
    for name, (b, c, r) in EXAMPLES.items():
        top = closed_form.longest_crank(b, c)
        cranks = (closed_form.GearLinkage(float(x * top), b, c, r) for x in np.linspace(0.05, 0.98, 25))
        spans = [float(np.ptp(closed_form.rate(g, PHI))) for g in cranks]
        growing[f"{name}: least growth of max - min per step"] = float(np.min(np.diff(spans)))
    return evidence(growing)


@LEDGER.claim(
    "G6", "p. 1, fig. 2", "curves I, III, II: monotone, touching zero in one point, with reverse motion", "I, III, II",
    holds("in all four examples, in this order", when=true("in_order")),
    fails("the order of the regimes differs"),
)  # fmt: skip
def three_regimes() -> Evidence:
    """Curves I, III and II: with a longer crank the rate stays positive, touches zero once, becomes negative."""
    kinds = closed_form.OutputRegime
    wanted = [kinds.MONOTONE, kinds.MOMENTARY_DWELL, kinds.REVERSING]
    cranks, in_order = {}, []
    for name, (b, c, r) in EXAMPLES.items():
        crank = cranks[f"{name}: crank of curve III"] = closed_form.momentary_crank(b, c, r)
        lengths = (0.8 * crank, crank, 0.5 * (crank + closed_form.longest_crank(b, c)))
        in_order.append([closed_form.regime(closed_form.GearLinkage(x, b, c, r)).regime for x in lengths] == wanted)
    return evidence(cranks, in_order=in_order)


@LEDGER.claim(
    "G7", "p. 1 and 3", "a reverse motion within the play of the gears makes the output stand while the crank turns by phi_w",
    "phi_w",
    only_if("the output follows at once when the gears turn forward again; pushed from one side and held by friction it "
            "stands until it is caught up, about 1.5 times as long", when=above(1.3, "pushed / phi_w")),
    holds(),
)  # fmt: skip
def dwell_within_play() -> Evidence:
    """With play of the size of the reverse motion: how long does the output stand?"""
    angles, ratios = dict[str, list[float]](), []
    for name, (b, c, r) in EXAMPLES.items():
        found = closed_form.crank_for("reverse_angle", math.radians(2.0), b, c, r)
        g = closed_form.GearLinkage(found.crank or math.nan, b, c, r)
        report = closed_form.regime(g)
        phi = report.stop_angle + np.linspace(-1.0, 2.5, 70001)
        x = closed_form.motion(g, phi).output_angle
        still = phi[:-1][np.diff(closed_form.with_play(x, math.radians(2.0) * (1 + 1e-9))) == 0.0]
        simulated = float(still[-1] - still[0])
        dwells = (report.dwell_angle, simulated, report.dwell_angle_one_sided)
        angles[f"{name}: phi_w, pushed output, formula [deg]"] = [math.degrees(a) for a in dwells]
        ratios.append(simulated / report.dwell_angle)
    return evidence(angles | {"pushed / phi_w": ratios})


def _preset(name: str) -> Parameters:
    sizes: Mapping[str, float] = PRESETS[name]
    return Parameters(**sizes)  # type: ignore[arg-type]


@LEDGER.claim(
    "G8", "p. 3", "a sheet-delivery transporter can match speeds at the grip and lay the sheet down slowly",
    "equal speeds, low speed",
    holds("dimensions exist: at the grip the speed is stationary, at release a fraction of it",
          when=above(0.0, "slowest rate") & below(0.25, "slowest / fastest") & below(1e-6, "acceleration_at_grip")),
    fails("these dimensions do not match the speed and release slowly"),
)  # fmt: skip
def sheet_delivery() -> Evidence:
    """A monotone linkage with equal speeds where the sheet is gripped and a slow release."""
    g = _preset("sheet-delivery").linkage
    report = closed_form.regime(g)
    accel = float(closed_form.motion(g, report.fastest_angle).output_accel)
    return evidence({
        "fastest rate, its acceleration": [report.fastest_rate, accel], "slowest rate": report.slowest_rate,
        "slowest / fastest": report.slowest_rate / report.fastest_rate,
    }, acceleration_at_grip=abs(accel))  # fmt: skip


@LEDGER.claim(
    "G9", "p. 3", "in the paper cutter BRP-125/450 the main-shaft torque in the cut falls about 1.8 times", 1.8,
    cannot("the source gives neither dimensions nor forces of the machine. With sizes of ours, the cut in the slow part of the "
           "turn and a clutch that never rests, the factor is {largest:.3g} at best, with a crank of {crank:.2g} of the frame; with the "
           "slow part where the knife is up the torque grows, to {worst:.2g} times that of the clutch",
           when=above(1.7, "largest") & below(1.0, "factor_up")),
    fails("no linkage of these sizes reaches it"),
)  # fmt: skip
def cutter_torque() -> Evidence:
    """Torque of the main shaft in the cut, clutch of periodic turning over linkage, for the sizes of the entry knife_drive."""
    p, computed = KnifeDrive(), dict[str, Any]()
    shares = np.linspace(0.05, 0.45, 5)
    best = [closed_form.best_mount(replace(p, crank=float(x) * p.frame).linkage, p.knife, 0.0)[1] for x in shares]
    for rest in (0.0, 45.0, 90.0):  # a clutch that rests turns faster while it holds
        computed[f"best factor for cranks 0.05 to 0.45 of the frame, the clutch rests {rest:g} deg"] = [
            x * closed_form.clutch_pace(math.radians(rest)) for x in (min(best), max(best))
        ]
    report = closed_form.regime(p.linkage)
    up = 0.5 * math.pi - float(closed_form.pin_angle(p.linkage, report.slowest_angle))
    factor_up = float(closed_form.torque_factor(p.linkage, p.knife, up, 0.0))
    computed["factor with the slow part where the knife is up, crank 0.25"] = factor_up
    computed |= _torque_of_engines(p)
    return evidence(computed, largest=max(best), crank=float(shares[int(np.argmax(best))]), factor_up=factor_up,
                    worst=1.0 / factor_up)  # fmt: skip


def _torque_of_engines(p: KnifeDrive) -> dict[str, float]:
    """Largest torque for a force of 1 N by the rates of the engines, beside the closed form, at 73 places of the shaft."""
    path = {"shaft": (0.0, 2.0 * math.pi)}
    phi = np.linspace(*path["shaft"], 73)
    found = {"analytic": float(np.max(closed_form.cutting_torque(p.linkage, p.knife, p.mount, phi)))}
    for who in ENGINES:
        x = EngineMotion(who, build_knives(p), path, 73)
        rate = x["knife_sides_rate"] / (2.0 * math.pi)
        found[who] = float(np.max(-rate * p.knife.cuts(x["knife_sides"], rate)))
    return {f"{who}: largest torque for 1 N in the cut [N m]": v for who, v in found.items()}


CLAIMS = LEDGER.claims
