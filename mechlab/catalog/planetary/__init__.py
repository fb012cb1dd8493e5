"""The planetary gear with series planets (2A-AA): sun 1 - planet 2 - planet 3 - fixed central gear 4, all meshes external.

Carrier output; the axes of sun, planet 2 and planet 3 stand on one ray, planet 3 outermost and wide: it meshes with
planet 2 in the plane of the sun and with gear 4 in a second plane. Its teeth come from `mechlab synthesize planetary`.
"""

from __future__ import annotations

from mechlab.catalog.planetary.build import build
from mechlab.catalog.planetary.checks import CHECKS
from mechlab.catalog.planetary.claims import CLAIMS, SOURCE
from mechlab.catalog.planetary.looks import phases
from mechlab.catalog.planetary.parameters import Parameters
from mechlab.catalog.planetary.questions import QUESTIONS
from mechlab.catalog.planetary.scenes import expand, reference, scene
from mechlab.experiment.entry import Entry, SceneRecipe

__all__ = ["CHECKS", "ENTRY", "Parameters", "build", "phases"]

ENTRY = Entry(
    name="planetary",
    title="Planetary gear with series planets",
    summary="Sun, two planets in series on each ray, fixed central gear, all meshes external; ratio 1 + z4 / z1.",
    parameters=Parameters,
    build=build,
    fidelities={
        "kinematic": "Willis equation",
        "minimal": "one coordinate, all gears as shafts",
        "parts": "one ray that stands for all, each mesh a row",
        "full": "every planet, redundant rows named",
    },
    default_fidelity="minimal",
    scenes={"constant-torques": SceneRecipe(scene, "minimal", "constant torques on sun and carrier from rest")},
    default_scene="constant-torques",
    questions=QUESTIONS,
    checks=CHECKS,
    claims=CLAIMS,
    reference=reference,
    expand=expand,
    chain="2A-AA epicyclic, series planets",
    formulas="w_sun = (1 + z4 / z1) w_carrier; planet 3 turns against the carrier by z4 / z3, planet 2 by -z4 / z2.",
    sources=(SOURCE, "Willis 1841"),
)
