"""The planar four-bar: the tutorial entry. Copy this folder to add a mechanism of your own.

Ground pivots A = (0, 0) and D = (ground, 0); crank pin B, joint C of coupler and rocker. The plane stands upright: x to
the right, y of the closed form is z of the world. Angles are counted from the ground line, counter-clockwise as seen
from the front (from -Y).
"""

from __future__ import annotations

import math

from mechlab.analytic import fourbar as closed_form
from mechlab.catalog.fourbar.build import build
from mechlab.catalog.fourbar.checks import CHECKS
from mechlab.catalog.fourbar.parameters import Parameters
from mechlab.catalog.fourbar.questions import QUESTION
from mechlab.catalog.fourbar.scenes import SCENES, reference
from mechlab.experiment.entry import Entry

__all__ = ["ENTRY", "Parameters", "build"]


def _remarks(p: Parameters) -> tuple[str, ...]:
    limits = closed_form.crank_limits(*p.lengths)
    arcs = ", ".join(f"{math.degrees(a):.6g} to {math.degrees(b):.6g} deg" for a, b in limits.ranges)
    swing = "" if limits.full_turn else f"; it assembles at crank angles {arcs}" if arcs else "; it assembles nowhere"
    return (f"Grashof: {closed_form.grashof_class(*p.lengths).value}{swing}.",)


ENTRY = Entry(
    name="fourbar",
    title="Four-bar linkage",
    summary="Planar four-bar: crank, coupler, rocker; both assembly modes.",
    parameters=Parameters,
    build=build,
    fidelities={"kinematic": "closed form", "minimal": "three bars, one loop; exact dynamics"},
    default_fidelity="minimal",
    scenes=SCENES,
    default_scene="driven-crank",
    sliders=("crank", "coupler"),
    questions=(QUESTION,),
    checks=CHECKS,
    reference=reference,
    remarks=_remarks,
    chain="RRRR",
    formulas="Dyad RRR: C = D + rocker (cos, sin)(rocker_angle), on the side `mode` of B to D; rates from the loop equation.",
    sources=("Freudenstein 1955", "Eksergian 1930"),
)
