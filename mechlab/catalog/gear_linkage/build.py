"""The mechanism: crank with gear a, coupler, rocker, idler and output gear; one loop and two gear relations."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache

from mechlab.analytic import gear_linkage as closed_form
from mechlab.catalog.gear_linkage.looks import crank_looks, gear_looks, ground_looks, rod_looks, tooth_counts
from mechlab.catalog.gear_linkage.parameters import Parameters
from mechlab.errors import unknown
from mechlab.mechanism import Builder, Inertia, LinearRelation, Mechanism, Placement, as_fraction, revolute
from mechlab.mechanism.geometry import axis_rotation
from mechlab.shapes import external_phase

START = 1.0
"""Crank angle of the reference pose [rad]: away from 0 and pi, where a change point would be."""


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """Five bodies, 5 coordinates, 3 rows of the loop (one void) and 2 gear relations: one freedom.

    `output_angle` is 0 at crank angle 0. The relations are exact ratios of the lengths as written.
    """
    if fidelity != "minimal":
        raise unknown("gear_linkage: fidelity", fidelity, ("minimal",))
    g = p.linkage
    at = closed_form.motion(g, START)
    psi, chi, out = float(at.coupler_angle), float(at.rocker_angle), float(at.output_angle)
    ra, rc, rd = g.radii
    b = Builder("gear_linkage", gravity=(0.0, 0.0, 0.0), summary="four-bar with three gears at B, C and D")
    disc_a = _disc(p, ra, (p.crank, 0.0, 0.0))
    # Coordinates from the placements as written, where relations count from: the gears have turned that far.
    idler = ra / rc * (psi - START)
    turned = (1.0 + rc / rd) * chi - rc / rd * (psi + idler)
    teeth = tooth_counts(g)
    phases = _phases(teeth, (START, psi, chi), (psi + idler, out))
    rod = Inertia.rod
    b.body("crank", revolute("crank_angle"), inertia=rod(p.mass_per_length * p.crank, (0, 0, 0), (p.crank, 0, 0)) + disc_a,
           shapes=crank_looks(g, teeth[0], phases[0]))  # fmt: skip
    b.body("coupler", revolute("coupler_joint"), parent="crank", at=(p.crank, 0.0, 0.0),
           inertia=rod(p.mass_per_length * p.coupler, (0, 0, 0), (p.coupler, 0, 0)), shapes=rod_looks(g, "coupler"))  # fmt: skip
    b.body("idler", revolute("idler_joint"), parent="coupler", at=(p.coupler, 0.0, 0.0), inertia=_disc(p, rc),
           shapes=gear_looks(g, "idler", teeth[1], phases[1]))  # fmt: skip
    b.body("rocker", revolute("rocker_angle"), at=(p.frame, 0.0, 0.0),
           inertia=rod(p.mass_per_length * p.rocker, (0, 0, 0), (p.rocker, 0, 0)), shapes=rod_looks(g, "rocker"))  # fmt: skip
    b.body("output", revolute("output_angle", zero=out - turned), at=(p.frame, 0.0, 0.0), inertia=_disc(p, rd),
           turned=Placement.of(axis_rotation((0.0, 0.0, 1.0), out - turned), (0.0, 0.0, 0.0)),
           shapes=gear_looks(g, "output", teeth[2], phases[2]))  # fmt: skip
    b.loop("joint_C", "coupler", "rocker", (p.coupler, 0.0, 0.0), (p.rocker, 0.0, 0.0))
    for relation in relations(p):
        b.mesh(relation)
    b.shaft("coupler_angle", {"crank_angle": 1, "coupler_joint": 1})
    b.shaft("idler_angle", {"crank_angle": 1, "coupler_joint": 1, "idler_joint": 1},
            zero=float(at.idler_angle) - (psi + idler))  # fmt: skip
    b.frame("B", "crank", (p.crank, 0.0, 0.0)).frame("C", "rocker", (p.rocker, 0.0, 0.0))
    b.frame("rim", "output", (rd, 0.0, 0.0))
    b.drive("crank_angle", stiffness=200.0, damping=20.0)
    b.ground(*ground_looks(g))
    guess = {
        "crank_angle": START, "coupler_joint": psi - START, "idler_joint": idler, "rocker_angle": chi, "output_angle": turned,
    }  # fmt: skip
    return b.assemble(guess, hold=["crank_angle"])


def relations(p: Parameters) -> tuple[LinearRelation, LinearRelation]:
    """Both meshes, exact. Idler on the coupler: idler_joint = (ra / rc) coupler_joint (gear a stands in the crank, so
    seen from the coupler it turns back by coupler_joint). Output on the rocker, idler seen absolutely:
    output + (rc / rd) idler = (1 + rc / rd) rocker."""
    coupler, rocker, rc = (as_fraction(x, "gear_linkage") for x in (p.coupler, p.rocker, p.idler_radius))
    ra, rd = coupler - rc, rocker - rc
    one = Fraction(1)
    first = (("idler_joint", one), ("coupler_joint", -ra / rc))
    turn = rc / rd
    second = (
        ("output_angle", one), ("crank_angle", turn), ("coupler_joint", turn), ("idler_joint", turn),
        ("rocker_angle", -(1 + turn)),
    )  # fmt: skip
    return LinearRelation("mesh_a_idler", first, "external"), LinearRelation("mesh_idler_output", second, "external")


def _disc(p: Parameters, radius: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Inertia:
    mass, moment = p.masses.disc(radius)
    return Inertia.axial(mass, moment, 0.5 * moment, com=at)


def _phases(
    teeth: tuple[int, int, int], links: tuple[float, float, float], gears: tuple[float, float]
) -> tuple[float, float, float]:
    """Phase of each gear in its own frame, so that teeth stand in gaps in the reference pose, and so always.

    links: angles of crank, coupler and rocker; gears: angles at which the frames of idler and output stand.
    """
    a, c, d = teeth
    phi, psi, chi = links
    idler = external_phase(a, phi, c, psi)  # gear a has phase 0 in the crank, which stands at phi
    output = external_phase(c, idler, d, chi + math.pi)
    return 0.0, idler - gears[0], output - gears[1]
