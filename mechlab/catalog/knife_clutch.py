"""The knife drive with a clutch: what the source sets its gear linkages against, with the engagement as motion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from mechlab.catalog.bibliography import GEAR_LEVERS
from mechlab.catalog.gear_linkage.clutch import Parameters, brake_law, build, clutch_law, inertia
from mechlab.catalog.gear_linkage.knife import SIDES
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import Motor
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.cutting import Cutting
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, each

STEP = 5e-4
"""Timestep [s], and time constant of the capture: the clutch slips for a dozen of them."""


def places(p: Parameters, given: Mapping[str, float]) -> Mapping[str, float]:
    """Places of both knives [m] in closed form."""
    return {f"knife_{s}": float(p.knife.place(given["crank"] + p.pin(s))[0]) for s in SIDES}


def engagement(p: Parameters, fidelity: str) -> Scene:
    """The clutch closes onto the resting crankshaft; it turns once and cuts with both knives."""
    low = p.knife.lowest
    cuts = [Cutting(f"knife_{s}", p.cutting_force, low, low + p.stack) for s in SIDES]
    law = clutch_law(p, (Motor("shaft", p.stall, p.no_load), *cuts), STEP)
    return Scene("engagement", fidelity, 2.0 * math.pi / p.no_load, (law,), {"shaft": 0.0, "crank": 0.0},
                 {"shaft": p.no_load, "crank": 0.0}, channels=("shaft_rate", "crank_rate", "crank_force"), tolerance=1e-3,
                 settings=Settings(timestep=STEP), drives="free", text=ENGAGED)  # fmt: skip


def stopping(p: Parameters, fidelity: str) -> Scene:
    """The clutch has opened after a turn of the crankshaft, and its brake stops it where it rested; the main shaft runs on. A brake that
    needs more than a turn is followed for the time of one."""
    turn = 2.0 * math.pi
    way = min(inertia(p) * p.no_load**2 / (2.0 * p.brake), turn)
    time = min(2.5 * inertia(p) * p.no_load / p.brake + 20.0 * STEP, turn / p.no_load)
    law = brake_law(p, (Motor("shaft", p.stall, p.no_load),), STEP)
    return Scene("stopping", fidelity, time, (law,), {"shaft": 0.0, "crank": -way},
                 {"shaft": p.no_load, "crank": p.no_load}, channels=("shaft_rate", "crank_rate", "crank_force"), tolerance=1e-3,
                 settings=Settings(timestep=STEP), drives="free", text=STOPPED)  # fmt: skip


STOPPED = "after the turn the clutch opens, and the brake of the crankshaft takes its whole energy; the main shaft runs on"
ENGAGED = "the clutch closes onto the resting crankshaft, slips, sticks, and both knives cut"
BASE = builder_entry(
    "knife_clutch", "Knife drive with a clutch", "press",
    summary="A clutch takes the knives of a three-knife cutter round once: two freedoms, a jerk and a loss as it closes and as it opens.",
    use="Paper cutters at low speed; presses with a one-turn clutch.", origin="the usual drive that a paper of 1995 replaces",
    parameters=Parameters, build=build, path=lambda p: {"shaft": (0.0, 2 * math.pi), "crank": (0.0, 2 * math.pi)}, closed=each(places),
    sliders=("clutch", "flywheel"),
    plots=(PlotRecipe("speeds", ("shaft_rate", "crank_rate")), PlotRecipe("torque of clutch or brake", ("crank_force",)),
           PlotRecipe("knives", ("knife_sides", "knife_front"))),
    outside=(
        Outside("stroke of a knife", "m", lambda p: 2.0 * p.throw, lambda p, m: float(m["knife_sides"][0] - m["knife_sides"][12]), 1e-9,
                "twice the throw"),
    ),
    chain="R, R with (RRP) twice", formulas="lost when the clutch closes: J1 J2 / (J1 + J2) w^2 / 2, whatever its torque.",
    sources=(GEAR_LEVERS.citation,),
)  # fmt: skip
SCENES = {"engagement": SceneRecipe(engagement, "full", ENGAGED), "stopping": SceneRecipe(stopping, "full", STOPPED)}
ENTRY = replace(BASE, scenes={**BASE.scenes, **SCENES})
