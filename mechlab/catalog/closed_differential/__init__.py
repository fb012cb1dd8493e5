"""The closed gear differential ("gear CVT"): two carriers, two blocks, two freedoms; the source's claim is tested."""

from __future__ import annotations

from mechlab.catalog.bibliography import GEAR_CVT
from mechlab.catalog.closed_differential.build import Parameters, build
from mechlab.catalog.closed_differential.checks import CHECKS, warnings
from mechlab.catalog.closed_differential.claims import CLAIMS, FIGURES
from mechlab.catalog.closed_differential.questions import CHANNELS, QUESTIONS, expand, reference
from mechlab.catalog.closed_differential.scenes import SCENES
from mechlab.experiment.entry import Entry, PlotRecipe

FORMULAS = """\
- Speeds: w_H1 = a w1 + (1-a) w3, w_H2 = b w1 + (1-b) w3, a = z1/(z1+z3), b = z4/(z4+z6): two degrees of freedom.
- Dynamics: J (w1', w3')^T = (a M_H1 - b M_H2, (1-a) M_H1 - (1-b) M_H2)^T, J constant.
- Under constant moments d/dt (M_H1 w_H1 - M_H2 w_H2) = Q^T J^-1 Q > 0: the source's (8) holds at one instant at most."""

ENTRY = Entry(
    name="closed_differential",
    title="Closed gear differential",
    family="gear-train",
    summary="Two carriers joined by two blocks of gears, two freedoms, one input: the gear CVT of the source, on trial.",
    parameters=Parameters,
    build=build,
    fidelities={
        "kinematic": "closed form",
        "minimal": "two coordinates, no rows; blocks and planets as shafts",
        "parts": "one planet that stands for all on each carrier; each mesh a row whose load can be read",
        "full": "every planet; redundant rows named",
    },
    default_fidelity="minimal",
    scenes=SCENES,
    default_scene="constant-moments",
    plots=(
        PlotRecipe("speeds of the outer shafts", ("H1_rate", "H2_rate")),
        PlotRecipe("transmission ratio", ("H1_rate",), over="H2_rate"),
        PlotRecipe("speeds of the blocks", ("block_14_rate", "block_36_rate")),
        PlotRecipe("angular momentum", ("angular_momentum",)),
    ),
    questions=QUESTIONS,
    checks=CHECKS,
    claims=CLAIMS,
    reference=reference,
    expand=expand,
    channels=CHANNELS,
    warnings=warnings,
    figures=FIGURES,
    chain="2K-H epicyclic twice, suns and rings joined: two freedoms",
    formulas=FORMULAS,
    sources=(GEAR_CVT.citation,),
)
