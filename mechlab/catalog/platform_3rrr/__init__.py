"""The planar parallel platform 3-RRR: three driven cranks, three legs and a platform, an Assur group of class III.

For given drives the platform has up to six assembly modes, for a given pose up to eight working modes. x to the right, y
upwards; angles counter-clockwise from x.
"""

from __future__ import annotations

from mechlab.catalog.platform_3rrr.build import SCENES, PlatformParameters, build, reference
from mechlab.catalog.platform_3rrr.checks import CHECKS
from mechlab.catalog.platform_3rrr.questions import QUESTIONS
from mechlab.experiment.entry import Entry, PlotRecipe

ENTRY = Entry(
    name="platform_3rrr",
    title="Planar platform 3-RRR",
    family="parallel-robot",
    summary="Planar parallel robot (class III): all assembly modes, all working modes.",
    parameters=PlatformParameters,
    build=build,
    fidelities={"kinematic": "closed form", "minimal": "seven parts, two pins; exact dynamics"},
    default_fidelity="minimal",
    scenes=SCENES,
    default_scene="driven-cranks",
    sliders=("leg",),
    plots=(
        PlotRecipe("centre of the platform", ("centre_x", "centre_z")),
        PlotRecipe("angle of the platform", ("alpha",)),
    ),
    questions=QUESTIONS,
    checks=CHECKS,
    reference=reference,
    chain="3 R + class III",
    formulas="|B1 + leg t + (P_i - P_1) u - B_i| = leg, i = 2, 3: degree 6 in t.",
    sources=("Gosselin & Merlet 1994",),
)
