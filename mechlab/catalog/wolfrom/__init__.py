"""A Wolfrom train 116:1: high ratio, much rolling power, poor efficiency. The `minimal` model is the exact reduction."""

from __future__ import annotations

from mechlab.catalog.wolfrom.build import build, reduction
from mechlab.catalog.wolfrom.checks import CHECKS
from mechlab.catalog.wolfrom.parameters import Parameters
from mechlab.catalog.wolfrom.scenes import expand, reference, scene
from mechlab.experiment.entry import Entry, SceneRecipe

__all__ = ["CHECKS", "ENTRY", "Parameters", "build", "reduction"]

ENTRY = Entry(
    name="wolfrom",
    title="Wolfrom train",
    summary="A sun, stepped planets, a held and a turning ring: 116:1 in one stage, and what that costs in efficiency.",
    parameters=Parameters,
    build=build,
    fidelities={
        "kinematic": "Willis equation",
        "minimal": "exact reduction: one coordinate, all gears as shafts",
        "parts": "one planet that stands for all, each mesh a row",
        "full": "every planet, redundant rows named",
    },
    default_fidelity="minimal",
    scenes={"constant-torques": SceneRecipe(scene, "minimal", "constant torques on sun and output ring from rest")},
    default_scene="constant-torques",
    checks=CHECKS,
    reference=reference,
    expand=expand,
    chain="3K epicyclic (Wolfrom)",
    formulas="w_sun / w_ring = (1 + z_r1 / z_s) / (1 - z_r1 z_p2 / (z_p1 z_r2)).",
    sources=("Wolfrom 1912", "Mueller 1998, Die Umlaufgetriebe"),
)
