"""The claim on the drive that the linkages replace, a clutch or wheels that engage quickly: shocks when the structure changes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic import gear_linkage as closed_form
from mechlab.catalog.gear_linkage.claims import LEDGER
from mechlab.catalog.gear_linkage.clutch import Parameters, build, clutch_law, inertia
from mechlab.engines.protocol import WITNESSES as ENGINES
from mechlab.engines.protocol import engine
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.experiment.tree_plant import TreePlant
from mechlab.kit.claims import Evidence, below, evidence, fails, holds, near
from mechlab.kit.path_motion import EngineMotion

STEP, SHORT = 5e-4, 0.012
"""Timestep and duration [s] of an engagement: at 1000 N m the clutch slips for 4 ms at 6 rad/s."""


@LEDGER.claim(
    "G10", "p. 3, on the usual drive",
    "The usual drive of the knives, a mechanism of periodic turning with wheels that engage quickly, changes its structure; at a certain "
    "speed that shows in shock loads.", "shock loads",
    holds("with sizes of ours each engagement takes {loss:.3g} J at 6 rad/s, {share:.2g} % of the work of both cuts, whatever the torque "
          "that closes it, a quarter of that at half the speed; a dry clutch of 1000 N m slips for {slip:.2g} ms, with "
          "{over:.2g} times the torque of a cut; wheels with teeth have no such bound. Linkages in constant mesh lose nothing",
          when=below(0.01, "gap") & near("growth", 0.02, of=4.0)),
    fails("the loss is another, or does not grow with the square of the speed"),
)  # fmt: skip
def shock_loads() -> Evidence:
    """Energy lost in an engagement and its time, in closed form and by engines, at two speeds; the torque of a cut through the clutch."""
    p, computed = Parameters(), dict[str, Any]()
    lost: dict[str, list[float]] = {}
    for speed in (3.0, 6.0):
        loss, time = closed_form.engagement(p.flywheel, inertia(p), speed, p.clutch)
        lost.setdefault("analytic", []).append(loss)
        computed[f"analytic: lost at {speed:g} rad/s [J], slips for [ms]"] = [loss, 1e3 * time]
        for who in ENGINES:
            lost.setdefault(who, []).append(energy_lost(p, engage(who, replace(p, no_load=speed))))
            computed[f"{who}: lost at {speed:g} rad/s [J]"] = lost[who][-1]
    computed |= (cut := _cut(p))
    values = np.array(list(lost.values()))
    cut_torque = p.cutting_force * max(cut.values())
    return evidence(
        computed, gap=float(np.max(np.abs(values / values[0] - 1.0))), growth=values[:, 1] / values[:, 0], loss=values[0, 1],
        share=100.0 * values[0, 1] / (2.0 * p.cutting_force * p.stack), over=p.clutch / cut_torque,
        slip=1e3 * closed_form.engagement(p.flywheel, inertia(p), 6.0, p.clutch)[1],
    )  # fmt: skip


def engage(who: str, p: Parameters, duration: float = SHORT) -> Recording:
    """The clutch closes onto the resting crankshaft; nothing else acts."""
    scene = Scene("engagement", "full", duration, (clutch_law(p, (), STEP),), {"shaft": 0.0, "crank": 0.0},
                  {"shaft": p.no_load, "crank": 0.0}, drives="free")  # fmt: skip
    return engine(who).run(build(p), scene, Settings(engine=who, integrator="RK4", timestep=STEP))


def energy_lost(p: Parameters, run: Recording) -> float:
    """Kinetic energy at the start less that at the end [J]."""
    w = TreePlant(run.mechanism)
    first, last = (0.5 * float(v @ w.set(q, v).mass_matrix() @ v) for q, v in ((run.q[k], run.v[k]) for k in (0, -1)))
    return first - last


def _cut(p: Parameters) -> Mapping[str, float]:
    """Largest torque through the closed clutch for a cutting force of 1 N [N m], in closed form and by the rates of the engines."""
    found = {"analytic": closed_form.clutch_torque(p.knife, 0.0)}
    turn = (0.4 * math.pi, 0.8 * math.pi)
    for who in ENGINES:
        x = EngineMotion(who, build(p), {"shaft": turn, "crank": turn}, 17)
        rate = x["knife_sides_rate"] / (turn[1] - turn[0])
        found[who] = float(np.max(-rate * p.knife.cuts(x["knife_sides"], rate)))
    return {f"{who}: largest torque for 1 N in the cut [N m]": v for who, v in found.items()}


CLAIMS = LEDGER.claims
