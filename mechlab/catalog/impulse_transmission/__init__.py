"""The inertial-impulse transmission: unbalanced planets on a free carrier push an output shaft against dry friction."""

from __future__ import annotations

from mechlab.catalog.bibliography import ALYUKOV
from mechlab.catalog.impulse_transmission.build import Parameters, build, expand, warnings
from mechlab.catalog.impulse_transmission.checks import CHECKS
from mechlab.catalog.impulse_transmission.claims_figures import CLAIMS
from mechlab.catalog.impulse_transmission.figures import FIGURES
from mechlab.catalog.impulse_transmission.portraits import PORTRAITS
from mechlab.catalog.impulse_transmission.questions import QUESTIONS
from mechlab.catalog.impulse_transmission.scenes import SCENES, reference
from mechlab.experiment.entry import Entry, PlotRecipe

FORMULAS = """\
- theta = (a alpha + b beta) / (a + b), psi = q (alpha - beta).
- A1 alpha'' + A2 beta'' + A4 (alpha' - beta')^2 + A6 beta'^2 = Md;
  A2 alpha'' + A3 beta'' + A5 (alpha' - beta')^2 - A6 alpha'^2 + c beta = -Mc.
- Mc = M0 + M1 sign(beta'), set-valued at standstill; tau Md' = Mn - Md - (alpha' - wn) / (nu wxx).
- Constant speed w, c = 0: (q/2) A3(psi) s^2 = E + R psi + a6 w^2 cos psi with s = w - beta', R = M0 +- M1.
- One-way rotation: psi_b - psi_a = pi (1 - M0/M1), sin(psi_m) = (M0 + M1) Delta / (2 (a6 - a5) w^2 sin(Delta/2)) <= 1.
- c = 0: the mean torques of motor and output shaft are equal. With a one-way clutch to the housing, K = (a6 - a5) w^2, R = M0 + M1:
  forward from sin(psi_a) = R/K to psi_b, K (cos psi_a - cos psi_b) = R (psi_b - psi_a), then at rest; the mean motor torque is
  R beta'_mean / w."""

ENTRY = Entry(
    name="impulse_transmission",
    title="Inertial-impulse transmission",
    family="gear-train",
    summary="Unbalanced planets on a free carrier between two shafts: impulses turn the output against friction and load.",
    parameters=Parameters,
    build=build,
    fidelities={
        "minimal": "two freedoms, no rows: one planet stands for all, the shafts are Shafts; exact dynamics",
        "full": "both shafts, the carrier and every planet, each mesh a row (tooth loads)",
    },
    default_fidelity="minimal",
    scenes=SCENES,
    default_scene="fig4",
    plots=(
        PlotRecipe("input and output speed", ("alpha_rate", "beta_rate")),
        PlotRecipe("speed ratio, output to input", ("beta_rate",), over="alpha_rate"),
        PlotRecipe("input and output angle", ("alpha", "beta")),
    ),
    questions=QUESTIONS,
    checks=CHECKS,
    claims=CLAIMS,
    reference=reference,
    expand=expand,
    channels={"motor_torque": ("N m", lambda p, recording: recording.channel("alpha_force"))},
    warnings=warnings,
    figures=FIGURES,
    portraits=PORTRAITS,
    chain="differential with a free carrier and unbalanced planets",
    formulas=FORMULAS,
    sources=(ALYUKOV.citation,),
)
