"""A simple planetary stage: sun, planets on a carrier, ring. Gears on a moving carrier, in three fidelities."""

from __future__ import annotations

from mechlab.catalog.planetary_stage.build import build
from mechlab.catalog.planetary_stage.checks import CHECKS
from mechlab.catalog.planetary_stage.parameters import Parameters
from mechlab.catalog.planetary_stage.questions import QUESTIONS
from mechlab.catalog.planetary_stage.scenes import expand, reference, scene
from mechlab.experiment.entry import Entry, SceneRecipe

__all__ = ["CHECKS", "ENTRY", "QUESTIONS", "Parameters", "build"]

ENTRY = Entry(
    name="planetary_stage",
    title="Planetary stage",
    summary="Sun, planets on a moving carrier and ring: gears as exact linear relations.",
    parameters=Parameters,
    build=build,
    fidelities={
        "kinematic": "Willis equation",
        "minimal": "as many coordinates as freedoms, all other gears as shafts",
        "parts": "one planet that stands for all, each mesh a row",
        "full": "every planet, redundant rows named",
    },
    default_fidelity="minimal",
    scenes={"constant-torques": SceneRecipe(scene, "minimal", "constant torques on sun and carrier from rest")},
    default_scene="constant-torques",
    questions=QUESTIONS,
    checks=CHECKS,
    reference=reference,
    expand=expand,
    chain="2K-H epicyclic",
    formulas="Willis: z_sun (w_sun - w_carrier) = -z_ring (w_ring - w_carrier);\n"
    "z_planet (w_planet - w_carrier) = -z_sun (w_sun - w_carrier).",
    sources=("Willis 1841",),
)
