"""The knife drive of a three-knife paper cutter: two three-gear four-bars on one main shaft, each with a slider-crank and a knife."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from mechlab.analytic.gear_linkage import pin_angle
from mechlab.catalog.bibliography import GEAR_LEVERS
from mechlab.catalog.gear_linkage.knife import SIDES, Parameters, build
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import Motor
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.cutting import Cutting
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, each, speeds


def places(p: Parameters, given: Mapping[str, float]) -> Mapping[str, float]:
    """Places of both knives [m] in closed form."""
    pins = {s: float(pin_angle(p.linkage, given["shaft"] + p.behind(s), p.mount)) for s in SIDES}
    return {f"knife_{s}": float(p.knife.place(pin)[0]) for s, pin in pins.items()}


def cutting(p: Parameters, fidelity: str) -> Scene:
    """A motor turns the main shaft three times; each knife meets its force in the stack. It starts at 0.95 of the no-load speed."""
    low = p.knife.lowest
    cuts = [Cutting(f"knife_{s}", p.cutting_force, low, low + p.stack) for s in SIDES]
    start, settings = {"shaft": 0.95 * p.no_load}, Settings(timestep=1e-3)
    return Scene("cutting", fidelity, 6.0 * math.pi / p.no_load, (Motor("shaft", p.stall, p.no_load), *cuts), {"shaft": 0.0}, start,
                 tolerance=1e-4, settings=settings, drives="free")  # fmt: skip


ALIGNED = "symmetry: equal bars, the crank on the frame line"
BASE = builder_entry(
    "knife_drive", "Knife drive of a three-knife cutter", "press",
    summary="Two gear linkages on one shaft drive two slider-cranks with knives: in constant mesh, slow in the cut.",
    use="Three-knife trimmers for books, without a clutch.", origin="proposed in a paper of 1995 for the cutter BRP-125/450",
    parameters=Parameters, build=build, path=lambda p: {"shaft": (0.0, 2 * math.pi)}, closed=each(places),
    sliders=("crank", "mount", "lag"),
    plots=(PlotRecipe("knives", ("knife_sides", "knife_front")), PlotRecipe("speed of the main shaft", ("shaft_rate",))),
    outside=(
        speeds("output_sides", "shaft", lambda p: 1.0, ALIGNED, 0), speeds("output_sides", "shaft", lambda p: 1.0, ALIGNED, 12),
        Outside("turn of the output gear in one of the main shaft", "rad", lambda p: 2 * math.pi,
                lambda p, m: float(m["output_front"][-1] - m["output_front"][0]), 1e-8, "equal gears: i = 1"),
    ),
    chain="(RRR with gears + RRP) twice", formulas="torque of the main shaft in the cut = force x |dy/d(shaft)|.",
    sources=(GEAR_LEVERS.citation,),
)  # fmt: skip
ENTRY = replace(
    BASE, scenes={**BASE.scenes, "cutting": SceneRecipe(cutting, "full", "a motor and a flywheel, a cutting force on each knife")}
)
