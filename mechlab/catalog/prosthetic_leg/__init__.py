"""The above-knee prosthesis of the leg article: thigh and shin split by elastic slides, an elastic hitch at the hip."""

from mechlab.catalog.bibliography import PROSTHESIS
from mechlab.catalog.prosthetic_leg.build import SCENES, Parameters, build
from mechlab.catalog.prosthetic_leg.checks import CHECKS
from mechlab.catalog.prosthetic_leg.claims import CLAIMS
from mechlab.catalog.prosthetic_leg.figures import FIGURES
from mechlab.catalog.prosthetic_leg.questions import FREE_MOTION, SLIDES, expand, reference
from mechlab.catalog.prosthetic_leg.stance import STANCE
from mechlab.experiment.entry import Entry, PlotRecipe

ENTRY = Entry(
    name="prosthetic_leg",
    title="Above-knee prosthesis with elastic slides",
    family="walking",
    summary="Planar leg: hip hitch, split thigh and shin, knee, ankle; equations in transition matrices.",
    parameters=Parameters,
    build=build,
    fidelities={
        "minimal": "hitch, hip, knee, ankle; thigh and shin rigid, trunk fixed: enough for a swing",
        "parts": "thigh and shin split by elastic slides, trunk fixed",
        "full": "the trunk moves too: nine freedoms",
    },
    default_fidelity="parts",
    scenes=SCENES,
    default_scene="swing",
    plots=(
        PlotRecipe("hip, knee and ankle", ("hip", "knee", "ankle")),
        PlotRecipe("slides in the joints", ("hitch", "thigh", "shin")),
    ),
    questions=(FREE_MOTION, SLIDES, STANCE),
    checks=CHECKS,
    claims=CLAIMS,
    figures=FIGURES,
    reference=reference,
    expand=expand,
    chain="P(hitch) R(hip) P(thigh) R(knee) P(shin) R(ankle)",
    formulas="T = 1/2 sum tr(dG_i/dt H_i dG_i^T/dt), dG_i/dq_j = W_j G_i; "
    "Q_j = -C_j (q_j - q0_j) - b_j dq_j/dt + sum m_i g . U_ij r_i for a slide.",
    sources=(PROSTHESIS.citation, "Vukobratovic 1976", "Korenev 1977", "Winter 1990 (anthropometry)"),
)
