"""The figure of the claims: the one instant at which (8) holds, and ratio against load, printed and true."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.analytic import differential as closed
from mechlab.catalog.closed_differential.checks import LAB, run, speeds
from mechlab.mechanism.geometry import Array

SPAN = 0.3
"""The left part shows so many seconds before and after the source's point."""
DRAGS = (0.02, 2.0)
BLUE, RED, TEAL, GREY, GOLD = "#2a6bbf", "#c23b36", "#2f9490", "#6b7280", "#b8860b"


def draw(path: Path) -> None:
    """Write the figure; the kind of file follows the suffix."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 6.4), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    figure.suptitle(
        "Gear train of two freedoms with one input: does the output adapt its speed to the load?", fontsize=13
    )
    _crossing(left)
    _ratios(right)
    figure.savefig(path, dpi=150)


def _crossing(axes: Any) -> None:
    t, powers = crossing()
    axes.plot(t, powers[:, 0] / 1e3, color=BLUE, lw=2, label="power in:  M_H1 w_H1,  M_H1 = 100 N m")
    axes.plot(t, powers[:, 1] / 1e3, color=RED, lw=2, label="power taken by the load:  M_H2 w_H2,  M_H2 = 200 N m")
    axes.axvline(0.0, color=GREY, lw=0.8, ls=":")
    axes.plot([0.0], [10.0], "o", color="black", ms=8)
    axes.annotate(
        "the printed law (8), power in = power out,\nholds at this one instant (100 and 50 rad/s)\nand is crossed, never kept",
        (0.0, 10.0), (-0.285, 3.6), arrowprops={"arrowstyle": "->"}, fontsize=10,
    )  # fmt: skip
    dots = engine_dots(t)
    for who, (marker, size) in {"mujoco": ("x", 7), "pinocchio": ("+", 9)}.items():
        label = f"{who.replace('mujoco', 'MuJoCo').replace('pinocchio', 'Pinocchio')}, simulated"
        for k, values in enumerate(dots[who].T[1:]):
            axes.plot(
                dots[who][:, 0], values / 1e3, marker, color="black", ms=size, mew=1.2, label=label if k == 0 else None
            )
    axes.set(
        xlabel="time [s], 0 at the point of the example", ylabel="power [kW]", xlim=(-SPAN, SPAN), ylim=(3.0, 20.5)
    )
    axes.set_title("Constant moments: the powers cross once", fontsize=11)
    axes.legend(loc="upper left", fontsize=9, framealpha=0.95)
    axes.grid(alpha=0.25)


def crossing() -> tuple[Array, Array]:
    """Times (n,) and powers (n, 2) [W] of input and load under constant moments, exact (the motion is linear in time)."""
    p, t = LAB, np.linspace(-SPAN, SPAN, 121)
    a = closed.carrier_mass_matrix(p.train, closed.mass_matrix(p.train, p.inertias))
    rates = np.array([p.w_H1_0, p.w_H2_0]) + np.outer(t, np.linalg.solve(a, [p.M_H1, -p.M_H2]))
    return t, rates * [p.M_H1, p.M_H2]


def engine_dots(t: Array) -> dict[str, Array]:
    """Engine -> (n, 3) time and the two powers, from a run that starts at the left edge."""
    rates = crossing()[1][0] / [LAB.M_H1, LAB.M_H2]
    p = replace(LAB, w_H1_0=float(rates[0]), w_H2_0=float(rates[1]))
    out = {}
    for who in ("mujoco", "pinocchio"):
        found = run(who, p, "constant-moments", 2 * SPAN)
        pick = np.linspace(0, len(found.t) - 1, 9).round().astype(int)
        h1, h2 = (found.channel(f"{n}_rate")[pick] for n in ("H1", "H2"))
        out[who] = np.column_stack([found.t[pick] + t[0], p.M_H1 * h1, p.M_H2 * h2])
    return out


def _ratios(axes: Any) -> None:
    p, train = LAB, LAB.train
    mu = np.linspace(0.05, 3.0, 600)
    axes.plot(mu, mu, color="black", lw=2.2, ls="--", label="printed law (10): ratio = load ratio, no losses")
    stall = closed.drag_stall(train, DRAGS[1] / DRAGS[0])
    below = mu[mu < stall * 0.995]
    axes.plot(below, closed.drag_ratio(train, DRAGS[1] / DRAGS[0], below)[0], color=BLUE, lw=2,
              label="true, both blocks drag on the housing (drags 1:100)")  # fmt: skip
    axes.axvline(stall, color=BLUE, lw=0.8, ls=":")
    axes.text(stall + 0.03, 5.0, f"output stalls\nat {stall:.2f}", color=BLUE, fontsize=9)
    fixed = closed.braked_ratios(train)[0]
    axes.plot(
        mu,
        0 * mu + fixed,
        color=TEAL,
        lw=2,
        label=f"true, one-way stop of block 36: fixed ratio a/b = {fixed:g} (balanced at load {fixed:g} only)",
    )
    a, b = train.a, train.b
    locked = (a * float(p.lock_ratio) + 1 - a) / (b * float(p.lock_ratio) + 1 - b)
    axes.plot(mu, 0 * mu + locked, color=GREY, lw=2, label=f"true, blocks coupled 6:1: fixed ratio {locked:g}")
    axes.plot([locked], [locked], "o", color=GREY, ms=8)
    axes.annotate("balanced at this one load,\nelse it accelerates", (locked, locked), (2.1, 1.15), fontsize=9, color=GREY,
                  arrowprops={"arrowstyle": "->", "color": GREY})  # fmt: skip
    curve, dots = backstop_curve()
    axes.plot(*curve, color=GOLD, lw=2, label="true, input held, stop and drag between the blocks (slips)")
    axes.plot(*dots, "x", color="black", ms=7, mew=1.4, label="MuJoCo, simulated")
    axes.annotate("drag between the blocks alone: steady at load ratio 1 only,\nas all torques must cancel; its ratio is set by the past",
                  (1.0, 0.6), (1.06, 0.15), fontsize=8.5, arrowprops={"arrowstyle": "->"})  # fmt: skip
    axes.axvline(1.0, color="black", lw=0.6, ls=":")
    axes.set(xlabel="load ratio M_H2 / M_H1", ylabel="speed ratio w_H1 / w_H2", xlim=(0.0, 3.0), ylim=(0.0, 10.5))
    axes.set_title("Steady motion: ratio against load, printed and true", fontsize=11)
    axes.legend(loc="upper left", fontsize=9, framealpha=0.95)
    axes.grid(alpha=0.25)


def backstop_curve() -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """(load ratio, speed ratio) of the train with stop and inner drag: closed form, and points of MuJoCo."""
    p = replace(LAB, drag_internal=0.2)
    load = np.linspace(1.0, 3000.0, 3000)
    steady = closed.backstop(p.train, p.drag_internal, p.w_H1_0, load)
    curve = (load / steady.M_H1, steady.w_H1 / steady.w_H2)
    points = []
    for M_H2 in (100.0, 150.0, 250.0, 400.0):
        start = float(closed.backstop(p.train, p.drag_internal, p.w_H1_0, M_H2).w_H2)
        found = run("mujoco", replace(p, M_H2=M_H2, w_H2_0=start), "backstop-two-range", 0.5)
        h1, h2 = speeds(found)
        points.append((M_H2 / float(found.channel("H1_force")[-1]), h1 / h2))
    return curve, (np.array([x for x, _ in points]), np.array([y for _, y in points]))
