"""Printed claims of the paper on the inertial-impulse transmission: its figures, the ratio q that they are drawn with, torque."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic.impulse import Impulse, harmonic_amplitudes, periodic_orbit
from mechlab.catalog.impulse_transmission.claims import LEDGER
from mechlab.catalog.impulse_transmission.questions import closing
from mechlab.catalog.impulse_transmission.ratio import AXES, CANDIDATES, fits
from mechlab.catalog.impulse_transmission.scenes import FIGURE_7, SPEED, at_constant_speed, of_scene, simulate
from mechlab.catalog.impulse_transmission.torque import best_load
from mechlab.kit.claims import (
    Evidence,
    above,
    below,
    cannot,
    equals,
    evidence,
    fails,
    holds,
    none,
    only_if,
    true,
    unreadable,
)


@LEDGER.claim(
    "M11", "figures 2 and 3", "At constant input speed the output is nearly the same at first, and not later.", "figures 2, 3",
    holds("they part by little early and by a slip of phase later. The numbers -4 and 4 on the axis of figure 2 fit {fitting} only",
          when=above(1.0, "growth")),
    fails("the difference does not grow"),
)  # fmt: skip
def figures_2_and_3() -> Evidence:
    """Full model against constant input speed at 0.08 s and 0.45 s, both readings of the torques."""
    computed: dict[str, Any] = {}
    gaps = []
    for name in ("fig2", "fig2-swapped"):
        p = of_scene(name)
        y = simulate(p, np.array([0.0, 0.08, 0.45]), 1e-7)[0]
        times, beta, _ = at_constant_speed(p, 0.45)
        for k, t in ((1, 0.08), (2, 0.45)):
            constant = float(np.interp(t, times, beta))
            computed[f"{name}: beta at {t} s, with motor and at constant speed [rad]"] = [float(y[k, 1]), constant]
            gaps.append(abs(float(y[k, 1]) - constant))
    for fit in fits():
        if not fit.order_exchanged:
            computed[f"q = {fit.q}: range of beta' in 0.08 s, printed axis -4 to 4 [rad/s]"] = list(fit.ranges["figure 2"])
    fitting = " and ".join(f.q for f in fits() if f.misfits["figure 2"] == 0.0) or "no candidate of q"
    return evidence(computed, growth=[gaps[1] / gaps[0], gaps[3] / gaps[2]], fitting=f"q = {fitting}")


@LEDGER.claim(
    "M12", "figure 4", "The phase paths come to a limit cycle.", "beta from -0.3 to 0.3 rad",
    fails("the loop leaves the printed axes", when=none("early")),
    only_if("one looks at 0.3 s: nothing holds beta (c = 0), it drifts; the loop closes in beta' only", when=none("late")),
    holds(),
)  # fmt: skip
def figure_4() -> Evidence:
    """Range of the loop, and its drift within 1 s."""
    p = of_scene("fig4")
    y = simulate(p, np.linspace(0.0, 1.0, 2001), 1e-7)[0]
    early, late = y[:601, 1], y[1400:, 1]
    times, beta, _ = at_constant_speed(p, 0.3)
    constant = float(np.interp(0.3, times, beta))
    return evidence({
        "analytic: range of beta in 0.3 s [rad]": [float(early.min()), float(early.max())],
        "analytic: range of beta from 0.7 s to 1 s [rad]": [float(late.min()), float(late.max())],
        "analytic: beta at 0.3 s, with motor and at constant speed [rad]": [float(early[-1]), constant],
    }, **{name: AXES["figure 4"].inside(x.min(), x.max()) for name, x in (("early", early), ("late", late))})  # fmt: skip


@LEDGER.claim(
    "M13", "figure 5", "Between 4 s and 5 s the output turns from 18.4 to 19.4 rad with ripple.", [18.4, 19.4],
    holds(when=true("from_rest")),
    only_if("it starts from another state, which is not printed, and q is {fitting}: only there a second of the steady rotation is as long "
            "as the printed axis", when=above(0.0, "count")),
    fails("no candidate of q has a steady rotation as slow as the printed axis"),
)  # fmt: skip
def figure_5() -> Evidence:
    """One-way rotation and ripple between 4 s and 5 s, from rest with q = 4/3, and the steady rotation for every candidate."""
    y = simulate(of_scene("fig5"), np.concatenate([[0.0], np.linspace(4.0, 5.0, 201)]), 1e-6)[0][1:, 1]
    computed: dict[str, Any] = {"fig5: range of beta between 4 s and 5 s from rest [rad]": [float(y.min()), float(y.max())]}
    hit = bool(AXES["figure 5"].misfit(y.min(), y.max()) == 0.0)
    for fit in fits():
        low, high = fit.ranges["figure 5"]
        computed[f"q = {fit.q}, {fit.order}: turn within 1 s of the steady rotation, printed axis 1 [rad]"] = high - low
    fitting = sorted({f.q for f in fits() if f.misfits["figure 5"] == 0.0})
    return evidence(computed, from_rest=hit, fitting=" or ".join(fitting), count=len(fitting))


@LEDGER.claim(
    "M14", "figure 7", "Loop of beta within -0.1 to 0.08 rad.", [-0.1, 0.08],
    only_if("q = {fitting}: the loops of the other candidates end more than a step of the grid from the printed numbers",
            when=above(0.0, "count")),
    fails("no candidate of q fits the axis"),
)  # fmt: skip
def figure_7() -> Evidence:
    """Loop at constant speed against the printed axis, for every candidate of q."""
    found = {f.q: f for f in fits()}
    computed: dict[str, Any] = {f"q = {q}: range of beta, three harmonics [rad]": list(f.ranges["figure 7"]) for q, f in found.items()}
    orbit = periodic_orbit(FIGURE_7, SPEED)
    computed["q = 4/3, shooting: amplitude of beta [rad], beta' at psi = 0 [rad/s]"] = [abs(float(orbit.sines[0])), float(orbit.start[1])]
    fitting = [q for q, f in found.items() if f.misfits["figure 7"] == 0.0]
    return evidence(computed, fitting=" or ".join(fitting), count=len(fitting))


@LEDGER.claim(
    "M15", "figures 8 and 9", "Loops of other parameter sets.", "figures 8, 9",
    cannot("the text gives no parameter values, only axis labels"),
)  # fmt: skip
def figures_8_and_9() -> Evidence:
    """No parameter values in the text."""
    return evidence({"source: parameter values in the text": "none"})


@LEDGER.claim(
    "M16", "lists of parameters", "The ratio q: a fraction that the scan shows as 4 over 5 in two of three lists, as g in the third.",
    "4/5, g, 4/5",
    holds("q = {best}: it alone fits all readable axes", when=equals("fitting_all", 1)),
    unreadable("undecided: with 4/5, which is b/k, D1 and D3 vanish, though the paper gives (7) three harmonics. No candidate fits the "
               "axes of figures 2, 4, 5 and 7 together. q = {best} leaves least ({least:.2g} of an "
               "axis), but its loop of figure 7 is {loop:.2g} times too large; without figure 2, whose numbers may have lost digits, "
               "q = {other} leaves least ({least_without:.2g}). Of the fractions with a 4 only {with_4} fits figure 7: it is the default. "
               "M1 before Mn, as the lists are read, fits figure 2 better than exchanged for {better} of {count} candidates",
               when=below(1e-12, "third_with_4_5")),
    fails("with q = 4/5 formula (7) has three harmonics, and no candidate fits the axes of figures 2, 4, 5 and 7 together"),
)  # fmt: skip
def ratio() -> Evidence:
    """Misfit of each candidate and order of the torques: figures 2, 4, 5, 7, all, and all but figure 2."""
    computed: dict[str, Any] = {}
    for f in fits():
        computed[f"q = {f.q}, {f.order}: misfit of figures 2, 4, 5, 7"] = list(f.misfits.values())
        computed[f"q = {f.q}, {f.order}: root mean square, and without figure 2"] = [f.total, f.without("figure 2")]
    readable = harmonic_amplitudes(replace(FIGURE_7, q=4 / 5), SPEED, "printed")
    computed["q = 4/5: printed amplitudes of the three harmonics, figure 7 [rad]"] = list(readable)
    best, other = fits()[0], min(fits(), key=lambda f: f.without("figure 2"))
    second = {(f.q, f.order_exchanged): f.misfits["figure 2"] for f in fits()}
    with_4 = sorted({f.q for f in fits() if f.q.startswith("4/") and f.misfits["figure 7"] == 0.0})
    return evidence(
        computed, best=best.q, least=best.total, other=other.q, least_without=other.without("figure 2"),
        third_with_4_5=abs(readable[2]),
        with_4=" or ".join(with_4) or "none", better=sum(second[q, False] < second[q, True] for q in CANDIDATES), count=len(CANDIDATES),
        fitting_all=sum(f.total == 0.0 for f in fits()), loop=best.ranges["figure 7"][1] / (AXES["figure 7"].high + AXES["figure 7"].step),
    )  # fmt: skip


TORQUES = ((18.0, 750.0), (0.0, 20.0))
"""M0 and M1 of figures 4 and 5 [N m]."""


@LEDGER.claim(
    "M17", "statement of the problem", "Torque can be transformed when the resisting torque on the output shaft changes its sign within "
    "a cycle (cited from the paper's source [3]).", "transformation of torque",
    only_if("torque means that of an impulse: with c = 0 the mean torques of motor and output shaft are equal, {motor:.3g} N m in figure 4 "
            "and {weak:.3g} N m in figure 5, as nothing else acts from outside; the load M0 gets {share:.2g} % of the power. With a "
            "one-way clutch from the output shaft to the housing the mean load is {ratio:.3g} times the motor torque at the largest "
            "useful power",
            when=below(1e-6, "difference") & above(1.0, "ratio")),
    holds(when=above(1e-6, "difference")), fails("the clutch does not transform the torque either"),
)  # fmt: skip
def torque_transformation() -> Evidence:
    """Mean torques of simulated cycles without a clutch, and the best load with one, at 150 rad/s."""
    computed: dict[str, Any] = {}
    means, shares = [], []
    for M0, M1 in TORQUES:
        i = Impulse(M0=M0, M1=M1)
        run = closing(i, SPEED, plain=3)
        assert run is not None
        # The shaft does not stick here: its friction is M1 forward and -M1 back.
        output = M0 + M1 * (run.forward_time - run.return_time) / (run.forward_time + run.return_time)
        means.append((run.mean_motor_torque, output))
        shares.append(M0 * run.mean_speed / (run.mean_motor_torque * SPEED))
        computed[f"hybrid, M0 = {M0:g}, M1 = {M1:g} N m: mean torques of motor and output shaft [N m]"] = list(means[-1])
        computed[f"hybrid, M0 = {M0:g}, M1 = {M1:g} N m: share of the motor's power that the load M0 gets"] = shares[-1]
    load, best = best_load(Impulse(), SPEED)
    ratio = load / best.motor_torque
    computed["analytic, with the clutch, no friction: best load, motor torque [N m]"] = [load, best.motor_torque]
    computed["analytic, with the clutch, no friction: mean speed [rad/s], useful power [W]"] = [best.mean_speed, load * best.mean_speed]
    difference = max(abs(motor / output - 1.0) for motor, output in means)
    return evidence(
        computed, difference=difference, ratio=ratio, motor=means[0][0], weak=means[1][0], share=100.0 * max(shares)
    )


CLAIMS = LEDGER.claims
