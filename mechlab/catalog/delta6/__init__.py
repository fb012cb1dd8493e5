"""The 6-DOF delta: three linear and three rotary drives, six rods of which three are cardan shafts, gear train, bevel head."""

from __future__ import annotations

import math

from mechlab.catalog.bibliography import B_SPLINES, REGIONS, THESIS
from mechlab.catalog.delta6 import (
    checks_motion,
    checks_pose,
    claims_articles,
    claims_head,
    claims_mesh,
    claims_mobility,
    claims_positions,
    elements,
    head,
    particles,
    questions,
    velocity_example,
    workspace,
)  # fmt: skip
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.figures import FIGURES
from mechlab.catalog.delta6.parameters import Delta6Parameters
from mechlab.catalog.delta6.poses import expand
from mechlab.catalog.delta6.scenes import CHANNELS, SCENES, reference
from mechlab.experiment.entry import Entry, PlotRecipe

CHECKS = (
    *velocity_example.CHECKS, *elements.CHECKS, *checks_pose.CHECKS, *checks_motion.CHECKS, workspace.A6, particles.A15,
)  # fmt: skip
LEDGERS = (
    claims_mobility.LEDGER, elements.LEDGER, claims_positions.LEDGER, velocity_example.LEDGER, claims_head.LEDGER,
    claims_mesh.LEDGER, claims_articles.LENGTHS, claims_articles.ALGEBRAS,
)  # fmt: skip
FORMULAS = """\
- Position: O = D - d e1; h_i = sqrt(L^2 - |O_xy + g_i|^2); q_i = O_z + platform_height + h_i + slider_height, with
  g_i = -radial_offset r_i + tangential_offset t_i. Forward: three spheres, the intersection below their centres.
- Orientation: R = Rz(gamma) Ry(beta) Rx(alpha).
- Rotary drives: phi_1,2 = k_spur gamma + k_transfer (k_bevel alpha -+ beta), phi_3 = gamma.
- Rates: q_i' = v_z - (G_i . v_xy) / h_i; phi' = K E^-1 omega, det E = cos(beta).
- Head dynamics and the error law of its control: `mechlab.analytic.delta6`."""


def _warnings(p: Delta6Parameters) -> tuple[str, ...]:
    home = math.degrees(p.home_bend)
    out = []
    if home > 45.0:
        out.append(f"the cardans bend {home:.4g} deg already at home; joints rarely allow more than 45 deg")
    if p.bend_limit is not None and home > math.degrees(p.bend_limit):
        out.append(f"the home pose bends the cardans {home:.4g} deg, beyond bend_limit; no pose near home is allowed")
    if not p.slider_min <= p.home_reading <= p.slider_max:
        out.append(f"the home reading of the sliders, {p.home_reading:.4g} m, lies outside slider_min..slider_max")
    return tuple(out)


ENTRY = Entry(
    name="delta6",
    title="6-DOF delta with cardan shafts and bevel head",
    family="parallel-robot",
    summary="Three linear and three rotary drives; six rods, three of them cardan shafts; gears on moving carriers; a bevel head.",
    parameters=Delta6Parameters,
    build=build,
    fidelities={
        "kinematic": "closed form",
        "minimal": "each leg one slender rod, gears and rotors as shafts; exact drive dynamics to 1e-5",
        "parts": "every gear a body, every mesh a row (tooth loads); rods as distance loops, half their mass at each end: "
        "linear drive forces within 3 %",
        "full": "every rod, cross, shaft, gear and planet",
    },
    default_fidelity="minimal",
    scenes=SCENES,
    default_scene="pose-sweep",
    plots=(
        PlotRecipe("position of the head", ("O_x", "O_y", "O_z")),
        PlotRecipe("angles of the head", ("alpha", "beta", "gamma")),
    ),
    questions=(*questions.QUESTIONS, *head.QUESTIONS, workspace.MARGIN),
    checks=tuple(sorted(CHECKS, key=lambda check: int(check.id[1:]))),
    claims=tuple(sorted((claim for ledger in LEDGERS for claim in ledger.claims), key=lambda claim: claim.id)),
    figures=FIGURES,
    reference=reference,
    expand=expand,
    channels=CHANNELS,
    warnings=_warnings,
    workspace=workspace.WORKSPACE,
    chain="3-PUU + 3-PSS legs (parallel rods) for translation; cardan shafts, spur train and bevel differential for rotation",
    formulas=FORMULAS,
    sources=(THESIS.citation, B_SPLINES.citation, REGIONS.citation, "Gosselin & Angeles 1990"),
)
