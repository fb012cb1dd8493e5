"""The three-gear four-bar: a four-bar whose joints B, C, D carry gears. One loop, two gear relations, one freedom.

A = (0, 0), D = (frame, 0), B crank pin, C joint of coupler and rocker. Gear a is fixed on the crank at B, the idler is
free at C, the output gear free at D. The plane is horizontal: angles about z, counted from A -> D.
"""

from __future__ import annotations

from mechlab.catalog.bibliography import GEAR_LEVERS
from mechlab.catalog.gear_linkage.build import (
    NEAR_CHANGE_POINT,
    PRESETS,
    SCENES,
    Parameters,
    build,
    output_held,
    reference,
    warnings,
)
from mechlab.catalog.gear_linkage.checks import CHECKS
from mechlab.catalog.gear_linkage.claims_clutch import CLAIMS
from mechlab.catalog.gear_linkage.figures import FIGURES
from mechlab.catalog.gear_linkage.questions import QUESTIONS
from mechlab.experiment.entry import Entry, PlotRecipe

__all__ = ["ENTRY", "NEAR_CHANGE_POINT", "PRESETS", "Parameters", "build"]

ENTRY = Entry(
    name="gear_linkage",
    title="Three-gear four-bar",
    family="dwell",
    summary="Gears on the joints of a four-bar: an output that speeds up, dwells or runs back once a turn.",
    parameters=Parameters,
    build=build,
    fidelities={"kinematic": "closed form", "minimal": "five bodies, one loop, two gear relations; exact dynamics"},
    default_fidelity="minimal",
    scenes=SCENES,
    default_scene="constant-crank",
    sliders=("crank",),
    plots=(
        PlotRecipe("output angle", ("output_angle",)),
        PlotRecipe("output speed", ("output_angle_rate",)),
    ),
    questions=QUESTIONS,
    checks=CHECKS,
    claims=CLAIMS,
    figures=FIGURES,
    reference=reference,
    channels={"output_held": ("rad", output_held)},
    warnings=warnings,
    chain="RRRR with gears at B, C, D",
    formulas="i = ra / rd, j = rc / rd:  w_out = i - (i + j) w_coupler + (1 + j) w_rocker for a crank rate of 1;\n"
    "output angle = i phi - (i + j) (coupler turn) + (1 + j) (rocker turn), counted from crank angle 0.",
    sources=(GEAR_LEVERS.citation, "Eksergian 1930"),
)
