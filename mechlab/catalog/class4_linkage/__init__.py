"""The class IV linkage of Zinchenko 2009: one crank, one group of class IV and order 2, all its assembly modes.

Links: 1 crank O-A; 2 ternary A-C-D; 3 C-B; 4 D-E; 5 ternary F-B-E. The inner contour D-C-B-E has four sides: class IV. The
chain is Stephenson's, driven in its five-bar side. x to the right, y upwards; angles counter-clockwise from x.
"""

from mechlab.catalog.bibliography import ZINCHENKO
from mechlab.catalog.class4_linkage.build import QUESTION, SCENES, build, reference
from mechlab.catalog.class4_linkage.checks import CHECKS
from mechlab.catalog.class4_linkage.claims import CLAIMS
from mechlab.catalog.class4_linkage.figures import FIGURES
from mechlab.catalog.class4_linkage.geometry import Class4Parameters
from mechlab.experiment.entry import Entry, PlotRecipe

ENTRY = Entry(
    name="class4_linkage",
    title="Class IV linkage",
    family="linkage",
    summary="Planar linkage with an Assur group of class IV: every assembly mode, limit positions, a driven turn.",
    parameters=Class4Parameters,
    build=build,
    fidelities={"kinematic": "closed form", "minimal": "five bars, two pins; exact dynamics"},
    default_fidelity="minimal",
    scenes=SCENES,
    default_scene="driven-crank",
    sliders=("AC",),
    plots=(
        PlotRecipe("output angle", ("theta5",)),
        PlotRecipe("output speed", ("theta5_rate",)),
        PlotRecipe("directions of the links between", ("theta2", "theta3", "theta4")),
    ),
    questions=(QUESTION,),
    checks=CHECKS,
    claims=CLAIMS,
    figures=FIGURES,
    reference=reference,
    chain="R + class IV (4R ternary, 2R binary, 4R ternary, 2R binary)",
    formulas="|w + p_i t + q_i u| = l_i, i = 0, 1, in the unit numbers t, u of links 2 and 5; the resultant has degree 6.",
    sources=(ZINCHENKO.citation, "Artobolevsky 1965"),
)
